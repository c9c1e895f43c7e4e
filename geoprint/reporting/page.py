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
from itertools import groupby
from pathlib import Path
from string import Template

from geoprint.errors import InputError
from geoprint.reporting.histogram import histograms
from geoprint.reporting.html import (
    Document,
    Json,
    Markup,
    choice,
    distance_matrix,
    element,
    figure,
    joined,
    scene_block,
    script_data,
    scrollable,
    view,
)
from geoprint.reporting.scene import part_scales, scene_data
from geoprint.reporting.values import BackendView, PartReport, PathDistances, Row, Section

# The parts of the page as HTML: verdict, views with their controls, what decides, and everything else below.


BEADS_COLOUR = ("beads", "Beads at their true width")
SPEEDS = (1, 5, 20, 50)
SLIDER_STEPS = 1000
BEST = "shown where there is room for only one"


def part_document(part: PartReport, *, key: str, head: str) -> Document:
    """Return what the page says of one part.

    Args:
        part: what to show.
        key: of its scene.
        head: heading of what stands below it, as HTML names it.
    """
    deciding = [row for row in part.table if row.decides]
    decides = [element(head, "What decides"), _table(part, deciding, class_="comparison deciding")] if deciding else []
    spread = element(
        "p", "Share of the path by its distance to the neighbouring path; shaded: within 5 % of the wanted one. "
        "Each row has its own height.", class_="note",
    )  # fmt: skip
    ratios = histograms(
        [(view.name, view.ratios) for view in part.backends], of="path", axis="local spacing / wanted spacing [1]"
    )
    return Document(
        name=part.name,
        verdict=part.verdict,
        cautions=part.cautions,
        shown=joined(_scene(part, key), *decides),
        blocks=(
            ("", _refused(part.refused)),
            ("Everything measured", _table(part, part.table, class_="comparison")),
            ("How the spacing is distributed", joined(spread, ratios)),
            *_path_distances(part.path_distances),
            *([("Pictures", joined(*map(figure, part.pictures)))] if part.pictures else []),
            *(_of_feature(section) for section in part.sections),
        ),
        settings=part.settings,
        inputs=part.inputs,
    )


def _of_feature(section: Section) -> tuple[str, Markup]:
    """Return heading and content of what a feature writes."""
    sentences = (element("p", sentence) for sentence in section.sentences)
    return section.heading, joined(*sentences, *map(figure, section.pictures))


def overview(parts: Sequence[PartReport], failed: Sequence[tuple[str, str]]) -> Markup:
    """Return the table over all parts, one row each, with links to their sections; failed ones have a reason."""
    headings = list(dict.fromkeys(heading for part in parts for heading, _ in part.overview))
    rows: list[Markup] = []
    for number, part in enumerate(parts):
        cells = dict(part.overview)
        rows.append(
            element(
                "tr",
                element("th", element("a", part.name, href=f"#part{number}"), scope="row"),
                *(element("td", cells.get(heading, "-")) for heading in headings),
                element("td", part.verdict[0], class_="words"),
            )
        )
    for name, reason in failed:
        blank = [element("td", "-") for _ in headings]
        rows.append(element("tr", element("th", name, scope="row"), *blank, element("td", reason, class_="words")))
    head = [element("th", heading, scope="col") for heading in ("part", *headings)]
    head.append(element("th", "verdict", scope="col", class_="words"))
    return scrollable(
        element("table", element("thead", element("tr", *head)), element("tbody", *rows), class_="overview"),
        label="All parts",
    )


def _table(part: PartReport, shown: Sequence[Row], *, class_: str) -> Markup:
    columns = [element("th", "quantity", scope="col")] + [
        element("th", backend.name, element("small", backend.title), scope="col") for backend in part.backends
    ]
    bodies: list[Markup] = []
    for group, rows in groupby(shown, key=lambda row: row.group):
        heading = element("tr", element("th", group, colspan=len(columns), scope="rowgroup", class_="group"))
        bodies.append(element("tbody", heading, *map(_table_row, rows)))
    table = element("table", element("thead", element("tr", *columns)), *bodies, class_=class_)
    return scrollable(table, label=f"Comparison of the backends on {part.name}")


def _table_row(row: Row) -> Markup:
    meaning = element("small", row.meaning) if row.meaning else Markup("")
    cells = [
        element("td", element("strong", value, title="best")) if column in row.best else element("td", value)
        for column, value in enumerate(row.values)
    ]
    return element("tr", element("th", row.quantity, meaning, scope="row"), *cells)


def _refused(refused: Sequence[tuple[str, str]]) -> Markup:
    return joined(
        *(
            element("p", element("strong", name), f" made no plan: {reason}", class_="refused")
            for name, reason in refused
        )
    )


def _scene(part: PartReport, key: str) -> Markup:
    """Return the views of the backends, side by side, with what moves and what colours them."""
    names = [(str(place), view.name) for place, view in enumerate(part.backends)]
    replayed = any(backend.replay is not None for backend in part.backends)
    shown = [element("label", element("input", type="checkbox", name=f"{key}-paths", checked=True), " Paths")]
    if replayed:
        shown.append(element("label", element("input", type="checkbox", name=f"{key}-robot"), " Robot"))
    shown.append(element("button", "Reset view", type="button", class_="reset"))
    colours = [(name, scale.heading) for name, scale in part_scales(part).items()]
    if all(backend.widths is not None for backend in part.backends):
        colours.append(BEADS_COLOUR)
    controls = [
        choice(key, "backend", "Backend", [("all", "Side by side"), *names] if len(names) > 1 else names),
        choice(key, "colour", "Colour", colours),
        *([choice(key, "frame", "Frame", (("part", "Part"), ("robot", "Part and robot")))] if replayed else []),
        element("fieldset", element("legend", "Show"), *shown),
    ]
    note = (part.machine.note if part.machine else None) or ""
    views = [_view(part, place, key) for place in range(len(names))]
    return scene_block(key, views, controls, player=_player(part.backends, key), note=note)


def _view(part: PartReport, place: int, key: str) -> Markup:
    """Return the place of one backend's 3D view."""
    backend, best = part.backends[place], place == part.winner and len(part.backends) > 1
    return view(
        backend.still,
        key=key,
        place=place,
        name=backend.name,
        title=backend.title,
        figures=[(row.quantity, row.values[place]) for row in part.table if row.decides],
        label=f"3D view of {part.name} by {backend.name}",
        mark=("best", BEST) if best else None,
    )


def _player(backends: Sequence[BackendView], key: str) -> Markup:
    if all(backend.replay is None for backend in backends):
        return element("p", "No robot motion to replay.", class_="note")
    speeds = [element("option", f"{speed} times", value=speed, selected=speed == 5) for speed in SPEEDS]
    return element(
        "div",
        element("button", "Play", type="button", class_="play"),
        element(
            "label", "Time ",
            element("input", type="range", id=f"{key}-time", min=0, max=SLIDER_STEPS, value=SLIDER_STEPS, step=1),
            class_="time",
        ),
        element("output", "", for_=f"{key}-time"),
        element("label", "Speed ", element("select", *speeds)),
        class_="player", role="group", aria_label="Replay of the robot",
    )  # fmt: skip


def _path_distances(distances: PathDistances | None) -> list[tuple[str, Markup]]:
    if distances is None:
        return []
    note = element(
        "p", "Above the diagonal: Hausdorff distance, the largest from a point of one path to the other path [mm]. "
        "Below, shaded: the mean of these distances [mm].", class_="note",
    )  # fmt: skip
    matrix = distance_matrix(distances, unit="mm", form="{:.3f}", label="Distances between the paths of the backends")
    return [("Distances between the backends' paths", joined(note, matrix))]


# plotly.js with its 3D traces alone: the npm package plotly.js-gl3d-dist-min 4.1.1, unchanged, a third of the whole.
LIBRARY = "plotly-gl3d.min.js"
# Key of a page's only scene.
ONLY = "part0"
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
    several = len(parts) + len(failed) > 1
    sections: list[Markup] = []
    for number, part in enumerate(parts):
        key, heading = f"part{number}", part.name if several else ""
        sections.append(part_document(part, key=key, head="h3" if several else "h2").section(key=key, heading=heading))
    body = [element("h1", title), overview(parts, failed) if several else Markup(""), *sections]
    return page(title, body, {f"part{number}": scene_data(part) for number, part in enumerate(parts)})


def document_page(title: str, document: Document, *, scene: Json = None) -> bytes:
    """Return a page on one thing: its title, what is said of it, and the data of its scene where it has one."""
    body = [element("h1", title), document.section(key=ONLY)]
    return page(title, body, {} if scene is None else {ONLY: scene})


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
    return Markup((resources.files("geoprint.reporting") / name).read_text(encoding="utf-8"))


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
