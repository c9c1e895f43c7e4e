"""Draws the pictures of the guide and writes it as one HTML page.

    python -m benchmarks.guide [--draw [NAME ...]] [--outputs [PAGE ...]] [--gallery [NAME ...]]
                               [--film REPORT] [--index] [--html FILE] [--site FOLDER] [--smoke]

With --draw all pictures in `geoprint/guide/pictures` are drawn anew, or those that are named, and the figures of their
captions; `report.png` needs Chromium with its driver, and `through.png` a heart's labels, which are no part of this
tree. With --outputs all pages are run, or those that are named, and get what their commands print now: the lines that
they quote anew, and all lines behind a block that has none yet, to be shortened by hand. With --gallery the
scripts of `geoprint/guide/examples`, or those that are named, are run for their pictures. With --film the moving
picture of README is taken, likewise, of the report.html that README's first command wrote. With --index
the list of its pages is written, with --html the guide, as `geoprint guide --html` does, with --site its site, for
which the extra `docs` is needed. --smoke draws one picture and throws it away.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from itertools import chain
from pathlib import Path

import geoprint
from benchmarks import DATA, ROOT
from benchmarks.guide.filming import film
from benchmarks.guide.gallery import EXAMPLES, draw_gallery
from benchmarks.guide.pictures import PICTURES
from benchmarks.guide.site import build, lay_out
from benchmarks.guide.stamps import FIGURE, MADE_FROM, figures_in, figures_of, made_from, stamped
from benchmarks.parts.tables import script_parser
from geoprint.guide import Page, html_guide, pages
from geoprint.guide.pages import PARTS
from tests.guide.outputs import ran, sequences, with_outputs

FOLDER = Path(geoprint.__file__).parent / "guide" / "pictures"
PAGES = FOLDER.with_name("pages")
INDEX = FOLDER.parent / "README.md"
FILM = ROOT / ".github" / "images" / "printing.webp"


def main() -> None:
    """Draw and write what is asked for."""
    parser = script_parser(__doc__, smoke="draw one picture, write nothing")
    parser.add_argument("--draw", nargs="*", metavar="NAME", help="draw all pictures, or these")
    parser.add_argument("--outputs", nargs="*", metavar="PAGE", help="renew what all pages quote, or these")
    parser.add_argument("--gallery", nargs="*", metavar="NAME", help="run all scripts of the gallery, or these")
    parser.add_argument("--film", type=Path, metavar="REPORT", help="take README's moving picture of this report")
    parser.add_argument("--index", action="store_true", help="write the list of pages anew")
    parser.add_argument("--html", type=Path, metavar="FILE", help="write the guide as one page")
    parser.add_argument("--site", type=Path, metavar="FOLDER", help="build the site of the guide in a new folder")
    arguments = parser.parse_args()
    if arguments.smoke:
        print(f"fine-lines.png: {len(PICTURES['fine-lines.png'](DATA))} bytes")
        print(f"the guide: {len(html_guide(pages()))} bytes")
    if arguments.draw is not None:
        for name in arguments.draw or PICTURES:
            draw(name)
    if arguments.outputs is not None:
        renew_outputs(arguments.outputs)
    if arguments.gallery is not None:
        draw_gallery(arguments.gallery or [script.stem for script in EXAMPLES.glob("*.py")], DATA)
    if arguments.film is not None:
        FILM.write_bytes(film(arguments.film))
        print(f"{FILM.name}: {FILM.stat().st_size} bytes")
    if arguments.index:
        INDEX.write_text(index(), encoding="utf-8")
    if arguments.html is not None:
        arguments.html.write_bytes(html_guide(pages()))
        print(f"written: {arguments.html}")
    if arguments.site is not None:
        print(f"built: {build(lay_out(arguments.site))}")


def draw(name: str) -> None:
    """Draw a picture, and give its caption the figures that it shows."""
    data = stamped(PICTURES[name](DATA), MADE_FROM, made_from(PICTURES[name]))
    (FOLDER / name).write_bytes(data)
    print(f"{name}: {len(data)} bytes")
    for file in PAGES.rglob("*.md"):
        text = file.read_text(encoding="utf-8")
        renewed = captioned(text, name, figures_of(data))
        if renewed != text:
            file.write_text(renewed, encoding="utf-8")
            print(f"its caption in {file.name}")


def captioned(text: str, picture: str, figures: Sequence[str]) -> str:
    """Return a page whose caption of a picture says its figures, where it says as many."""
    caption = re.compile(rf"!\[[^\]]*\](?=\([^)\s]*/{re.escape(picture)}\))")

    def renewed(found: re.Match[str]) -> str:
        if len(figures_in(found[0])) not in {0, len(figures)}:
            print(f"say in the caption of {picture}, in this order: {' '.join(figures) or 'no figures'}")
            return found[0]
        left = iter(figures)
        return FIGURE.sub(lambda _: next(left), found[0])

    return caption.sub(renewed, text)


def renew_outputs(names: Sequence[str]) -> None:
    """Run all pages, or those that are named behind those that they go on with, and renew what they quote."""
    files = {file.stem: file for file in PAGES.rglob("*.md")}
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "data").symlink_to(DATA)
        for sequence in sequences():
            if names and not {page.name for page in sequence} & {*names}:
                continue
            for page in sequence:
                blocks = ran(page, Path(folder))
                if names and page.name not in names:
                    continue
                file = files[page.name]
                file.write_text(with_outputs(file.read_text(encoding="utf-8"), blocks), encoding="utf-8")
                print(f"{page.name}: {sum(each.quoted is not None or each.needs for each in blocks)} outputs")


def index() -> str:
    """Return the list of the guide's pages for whoever looks into its folder."""
    tables = [
        ["", f"## {heading}", "", "| page | what it shows |", "|---|---|"]
        + [f"| {_linked(page)} | {page.summary} |" for page in pages() if page.part == part]
        for part, heading in PARTS.items()
    ]
    words = (
        "`geoprint guide` lists these pages in a terminal, `geoprint guide NAME` shows one, and `geoprint guide --html "
        "FILE` writes all of them as one page that opens offline."
    )
    return "\n".join(["# The guide", "", words, *chain(*tables), ""])


def _linked(page: Page) -> str:
    return page.title if page.is_generated else f"[{page.title}](pages/{page.part}/{page.name}.md)"


if __name__ == "__main__":
    main()
