"""Draws the pictures of the guide and writes it as one HTML page.

    python -m benchmarks.guide [--draw [NAME ...]] [--html FILE] [--smoke]

With --draw all pictures in `geoprint/guide/pictures` are drawn anew, or those that are named; `report.png` needs
Chromium with its driver, and `through.png` a heart's labels, which are no part of this tree. With --html the guide is
written, as `geoprint guide --html` does. --smoke draws one picture and throws it away.
"""

from __future__ import annotations

from pathlib import Path

import geoprint
from benchmarks import ROOT
from benchmarks.guide.pictures import PICTURES
from benchmarks.parts.tables import script_parser
from geoprint.guide import html_guide, pages

FOLDER = Path(geoprint.__file__).parent / "guide" / "pictures"


def main() -> None:
    """Draw and write what is asked for."""
    parser = script_parser(__doc__, smoke="draw one picture, write nothing")
    parser.add_argument("--draw", nargs="*", metavar="NAME", help="draw all pictures, or these")
    parser.add_argument("--html", type=Path, metavar="FILE", help="write the guide as one page")
    arguments = parser.parse_args()
    if arguments.smoke:
        print(f"fine-lines.png: {len(PICTURES['fine-lines.png'](ROOT / 'data'))} bytes")
        print(f"the guide: {len(html_guide(pages()))} bytes")
    if arguments.draw is not None:
        for name in arguments.draw or PICTURES:
            data = PICTURES[name](ROOT / "data")
            (FOLDER / name).write_bytes(data)
            print(f"{name}: {len(data)} bytes")
    if arguments.html is not None:
        arguments.html.write_bytes(html_guide(pages()))
        print(f"written: {arguments.html}")


if __name__ == "__main__":
    main()
