"""The site of the guide: its pages arranged as mkdocs reads them, with what is made from the code, and built."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import geoprint
from geoprint.guide import Page, pages
from geoprint.guide.pages import PARTS

GUIDE = Path(geoprint.__file__).parent / "guide"
# A fence with a second word, and what it says above the block where it is no name of a file.
_FENCE = re.compile(r"^```(\w+) (\S+)$", re.MULTILINE)
_TITLES = {"refused": "Each of these is refused"}
_CODE = re.compile(r"(^```.*?^```$|`[^`\n]+`)", re.MULTILINE | re.DOTALL)
_PACKAGE = re.compile(r"^## (.+): `(\S+)`\n", re.MULTILINE)
_PART = {
    "tutorials": "Start here: each leads from nothing to a result.",
    "how-to": "Steps for one task.",
    "reference": "What there is, in full, with units; made from the code.",
    "explanation": "Why it is as it is, and how well it works.",
}


def lay_out(folder: Path) -> Path:
    """Write the pages, their pictures and mkdocs.yml with their order into a folder; return that file."""
    docs = folder / "docs"
    for pictures in ("pictures", "examples"):
        shutil.copytree(GUIDE / pictures, docs / pictures, ignore=shutil.ignore_patterns("*.py*"))
    for name in ("site.css", "iframe-worker.js"):
        shutil.copy(GUIDE / name, docs)
    _write(docs / "index.md", (GUIDE / "pages" / "index.md").read_text(encoding="utf-8").replace("(../", "("))
    nav: list[object] = [{"Home": "index.md"}]
    for part, heading in PARTS.items():
        of_part = [page for page in pages() if page.part == part]
        rows = "".join(f"| [{page.title}]({page.name}.md) | {page.summary} |\n" for page in of_part)
        _write(docs / part / "index.md", f"# {heading}\n\n{_PART[part]}\n\n| page | what it shows |\n|---|---|\n{rows}")
        nav.append({heading: [f"{part}/index.md", *_listed(of_part, docs)]})
    settings = folder / "mkdocs.yml"
    _write(settings, f"{(GUIDE / 'mkdocs.yml').read_text(encoding='utf-8')}nav: {json.dumps(nav, indent=2)}\n")
    return settings


def build(settings: Path) -> Path:
    """Build the site; return its front page.

    Raises:
        RuntimeError: mkdocs refuses or warns; says what.
    """
    # Not quietly, because then no warning counts.
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", settings]
    # The theme tells of its successor on every build.
    env = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, check=False, env=env, capture_output=True, text=True)  # noqa: S603
    if done.returncode:
        raise RuntimeError(done.stderr)
    return settings.parent / "site" / "index.html"


def _listed(of_part: Sequence[Page], docs: Path) -> list[object]:
    """Write pages, and return their places in the order of the site, those of a group below its name."""
    nav: list[object] = []
    groups: dict[str, list[object]] = {}
    for page in of_part:
        if page.group and page.group not in groups:
            nav.append({page.group: groups.setdefault(page.group, [])})
        entries = groups[page.group] if page.group else nav
        if page.name == "api":
            entries.append({"API": _api(page, docs)})
        else:
            _write(docs / page.part / f"{page.name}.md", _laid_out(page.title, page.summary, page.text))
            entries.append(f"{page.part}/{page.name}.md")
    return nav


def _api(page: Page, docs: Path) -> list[object]:
    """Write a page for each package, and one that lists them; return their places."""
    before, *parts = _PACKAGE.split(page.text)
    packages = list(zip(parts[::3], parts[1::3], parts[2::3], strict=True))
    rows = "".join(f"| [`{name}`](api/{name}.md) | {heading} |\n" for heading, name, _ in packages)
    text = f"{before}\n| package | what one looks for there |\n|---|---|\n{rows}"
    _write(docs / page.part / "api.md", _laid_out(page.title, page.summary, text))
    for heading, name, text in packages:
        entries = text.replace("\n### ", "\n## ")
        _write(docs / page.part / "api" / f"{name}.md", _laid_out(name, f"{heading}.", entries))
    return [f"{page.part}/api.md", *(f"{page.part}/api/{name}.md" for _, name, _ in packages)]


def _laid_out(title: str, summary: str, text: str) -> str:
    """Return a page as mkdocs reads it: what a block is stands above it, and only code is taken as it stands."""
    text = _FENCE.sub(lambda fence: f'```{fence[1]} title="{_TITLES.get(fence[2], fence[2])}"', text)
    text = text.replace("\n```output\n", '\n```text title="It prints"\n')
    parts = [part if at % 2 else part.replace("<", "&lt;") for at, part in enumerate(_CODE.split(text))]
    parts[1::2] = [part.replace(r"\|", "|") for part in parts[1::2]]
    text = re.sub(r"\]\(\.\./\.\./(?=pictures/|examples/)", "](../", "".join(parts))
    return f"---\ndescription: {json.dumps(summary)}\n---\n# {title}\n\n{summary}\n{{ .summary }}\n\n{text}"


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
