"""The report of a comparison: one HTML file that opens offline, in any browser, years later.

Nothing is fetched: plotly.js, styles, script, data and pictures stand in the file. A content security policy with the
hash of every script forbids the rest, so that no name in the input can run or fetch anything either.
"""

from __future__ import annotations

import base64
import hashlib
import os
import re
import shlex
import sys
import time
from collections.abc import Mapping, Sequence
from importlib import resources
from importlib.metadata import version
from pathlib import Path
from string import Template

from geoprint.errors import InputError
from geoprint.report.markup import Json, Markup, element, joined, script_data
from geoprint.report.scene import scene_data
from geoprint.report.sections import overview, part_section
from geoprint.report.values import PartReport

# plotly.js with its 3D traces alone: the npm package plotly.js-gl3d-dist-min 4.1.1, unchanged, a third of the whole.
LIBRARY = "plotly-gl3d.min.js"
# The page's script, in the order in which its files build on each other.
SCRIPTS = ("data.js", "colours.js", "machine.js", "camera.js", "beads.js", "drawing.js", "view.js", "page.js")


def html_report(parts: Sequence[PartReport], *, title: str, failed: Sequence[tuple[str, str]] = ()) -> bytes:
    """Return report.html: verdict, figures and one 3D scene for each part.

    Args:
        parts: what was compared; with several, a table over all of them stands first.
        title: of the page.
        failed: name and reason of the parts that could not be compared.

    Returns:
        UTF-8 HTML; the same for the same input, but for its foot, which says when and by which command it was made.

    Raises:
        InputError: there is no part to report on.
    """
    if not parts:
        raise InputError("a report needs at least one part; none was compared.")
    numbered = list(enumerate(parts))
    body = [
        element("h1", title),
        overview(parts, failed) if len(parts) + len(failed) > 1 else Markup(""),
        *(
            part_section(part, number=number, heading=part.name if len(parts) + len(failed) > 1 else "")
            for number, part in numbered
        ),
    ]
    return page(title, body, {f"part{number}": scene_data(part) for number, part in numbered})


def page(title: str, body: Sequence[Markup], scenes: Mapping[str, Json]) -> bytes:
    """Return a whole page: its body, and the data of its scenes by their keys; without any it runs no script."""
    scripts = (_inline(_packaged(LIBRARY)), _script()) if scenes else ()
    text = Template(_packaged("page.html")).substitute(
        title=joined(title),
        policy=joined(_policy(*scripts)),
        style=_packaged("page.css"),
        body=joined(*body, _foot()),
        data=joined(
            *(
                element("script", script_data(data), type="application/json", id=f"{key}-data")
                for key, data in scenes.items()
            )
        ),
        scripts=Markup("\n".join(f"<script>{script}</script>" for script in scripts)),
    )
    return text.encode("utf-8")


def _foot() -> Markup:
    """Return what made the page: the version, the day, and the command where one was typed.

    The day is that of SOURCE_DATE_EPOCH where a build states one (reproducible-builds.org).
    """
    day = time.strftime("%Y-%m-%d", time.gmtime(float(os.environ.get("SOURCE_DATE_EPOCH", time.time()))))
    program = Path(sys.argv[0])
    typed = program.stem == "geoprint" or program.parent.name == "geoprint"
    # Where the result goes and what is printed beside it change nothing in it.
    kept = [word for word in sys.argv[1:] if word not in ("--overwrite", "--json", "--verbose")]
    if "--out" in kept:
        del kept[(at := kept.index("--out")) : at + 2]
    command = [": ", element("code", shlex.join(["geoprint", *kept]))] if typed else []
    return element("footer", f"geoprint {version('geoprint')}, {day}", *command)


def _script() -> str:
    """Return the page's own script, closed off from everything else."""
    return "\n".join(['(() => {\n"use strict";', *map(_packaged, SCRIPTS), "})();"])


def _inline(script: str) -> str:
    """Return JavaScript that can stand in a page: nothing in it ends the script element or opens a comment."""
    return re.sub(r"<(?=/script|!--)", r"\\x3c", script, flags=re.IGNORECASE)


def _packaged(name: str) -> Markup:
    return Markup((resources.files("geoprint.report") / name).read_text(encoding="utf-8"))


def _policy(*scripts: str) -> str:
    """Return the content security policy: these scripts run, styles and pictures of the page show, nothing loads.

    plotly.js sets styles on its elements, hence 'unsafe-inline' for styles alone.
    """
    hashes = " ".join(f"'sha256-{_hash(script)}'" for script in scripts) or "'none'"
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:; "
        "base-uri 'none'; form-action 'none'"
    )


def _hash(script: str) -> str:
    return base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
