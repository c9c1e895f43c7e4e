"""How does the command line look in a terminal? Draws commands at several widths, as SVG and PNG.

    python -m benchmarks.terminals FOLDER [--columns 60 80 120 200] [--only NAME ...] [--command 'plan --help']

Without a command it draws the help, the tables and three refusals. Commands run in a terminal of their own, so that
widths, colours and the running stage are those that a person has; a browser (Chromium) makes the PNG.
"""

from __future__ import annotations

import argparse
import fcntl
import io
import os
import pty
import re
import shlex
import shutil
import struct
import subprocess
import sys
import tempfile
import termios
from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

ROOT = Path(__file__).parents[1]
WIDTHS = (60, 80, 120, 200)
# What is drawn, by the names of the pictures; OUT is a folder that later commands find again.
CASES = {
    "help": "--help",
    "help-compare": "compare -h",
    "compare": "compare data/plate.ply --unit mm --spacing 3 --place demo --out OUT/one --backends all",
    "compare-parts": "compare data/plate.ply data/heart_apex_patch.ply --unit mm --spacing 4 --no-robot --out OUT/two",
    "plan": "plan data/plate.ply --unit mm --spacing 3 --place demo --out OUT/plan",
    "check": "check OUT/plan",
    "inspect": "inspect data/heart_apex_patch.ply",
    "place": "place data/plate.ply --unit mm --spacing 6",
    "recommend": "recommend --pressure 20 --rounds 12 --good 10 20",
    "patch": "patch data/heart.ply --unit mm --at -19.3 14 0.5 --radius 15 --out OUT/patch.ply",
    "calibrate": "calibrate OUT/touched.csv --model OUT/corners.csv",
    "doctor": "doctor",
    "no-file": "plan hart.ply --spacing 1 --out OUT/none",
    "no-unit": "plan data/plate.ply --spacing 1 --out OUT/none",
    "radius": "plan data/heart.ply --unit mm --spacing 1 --at 0 0 0 --radius -1 --out OUT/none",
}
TOUCHES = {
    "corners.csv": "name,x,y,z\nleft,-50,50,0\nright,50,50,0\nfront,50,-50,0\nback,-50,-50,0\n",
    "touched.csv": "name,x,y,z\nleft,250.1,50,0\nright,350,50.1,0\nfront,350,-50,0.1\nback,250,-50,0\n",
}
# Pixels that a letter of the picture is wide and a line is high, and the frame around both.
LETTER, LINE, FRAME = 12.2, 24.4, 120
_SIGN = re.compile(r"\x1b\[\?25[lh]|\x1b\[(\d*)([AK])|(\r)|(\n)|((?:\x1b\[[\d;]*m|[^\x1b\r\n])+)")


def main() -> None:
    """Draw the pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", help="for the pictures")
    parser.add_argument("--columns", type=int, nargs="+", default=WIDTHS, help="widths of the terminal")
    parser.add_argument("--only", nargs="+", choices=CASES, default=[*CASES], help="some of them")
    parser.add_argument("--command", help="draw this command of geoprint instead")
    parser.add_argument("--smoke", action="store_true", help="one narrow picture, to see that this script runs")
    given = parser.parse_args()
    cases = {"command": given.command} if given.command else {name: CASES[name] for name in given.only}
    if given.smoke:
        cases, given.columns = {"no-unit": CASES["no-unit"]}, WIDTHS[:1]
    if given.folder is None and not given.smoke:
        parser.error("say in which folder the pictures shall stand")
    with tempfile.TemporaryDirectory() as aside:
        folder = given.folder or Path(aside)
        folder.mkdir(parents=True, exist_ok=True)
        draw_all(cases, folder, widths=given.columns)


def draw_all(cases: Mapping[str, str], folder: Path, *, widths: Sequence[int]) -> None:
    """Run commands at some widths and draw what a terminal shows then."""
    with tempfile.TemporaryDirectory() as out:
        for name, text in TOUCHES.items():
            Path(out, name).write_text(text, encoding="utf-8")
        for name, command in cases.items():
            for width in widths:
                again = [] if " --out " not in command else ["--overwrite"]
                words = [*shlex.split(command.replace("OUT", out)), *again]
                shown = screen([sys.executable, "-m", "geoprint", *words], columns=width).replace(out, "OUT")
                draw(f"$ geoprint {command}\n{shown}", folder / f"{name}-{width}.png", columns=width)
                print(f"{name}-{width}.png", flush=True)


def screen(command: Sequence[str], *, columns: int, rows: int = 200) -> str:
    """Return what a terminal of some width shows when a command has ended, colours included."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    kept = {name: value for name, value in os.environ.items() if name not in {"COLUMNS", "NO_COLOR"}}
    process = subprocess.Popen(  # noqa: S603  (commands of this file)
        command, cwd=ROOT, env=kept | {"TERM": "xterm-256color"}, stdin=slave, stdout=slave, stderr=slave
    )
    os.close(slave)
    heard = b""
    while True:
        try:
            piece = os.read(master, 65536)
        except OSError:  # how a terminal says that nobody writes to it any more
            break
        if not piece:
            break
        heard += piece
    os.close(master)
    process.wait()
    return settled(heard.decode("utf-8", "replace"))


def settled(written: str) -> str:
    r"""Return the lines that stand in the end where a program went back to some and wrote them again.

    Examples:
        >>> settled("working\r\x1b[2Kdone\r\nnext\n")
        'done\nnext'
    """
    lines, row = [""], 0
    for found in _SIGN.finditer(written):
        count, code, back, down, text = found.groups()
        if code == "A":
            row = max(row - int(count or 1), 0)
        elif code == "K":
            lines[row] = ""
        elif down:
            row += 1
            lines += [""] * (row + 1 - len(lines))
        elif text and not back:
            lines[row] += text
    return "\n".join(line.rstrip() for line in lines).rstrip()


def draw(text: str, path: Path, *, columns: int) -> None:
    """Write a picture of a terminal as SVG, and as PNG where there is a browser."""
    console = Console(record=True, width=columns, file=io.StringIO(), force_terminal=True)
    console.print(Text.from_ansi(text), soft_wrap=False, no_wrap=False)
    lines = sum(-(-max(len(Text.from_ansi(line).plain), 1) // columns) for line in text.splitlines())
    # The fonts of the page stand on the internet; any of the machine does.
    drawn = re.sub(r"@font-face \{.*?\}", "", console.export_svg(title=""), flags=re.DOTALL)
    path.with_suffix(".svg").write_text(drawn, encoding="utf-8")
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        return
    size = f"{round(columns * LETTER + FRAME)},{round(lines * LINE + FRAME)}"
    subprocess.run(  # noqa: S603  (a picture that was just drawn)
        [
            chromium, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", f"--window-size={size}",
            f"--screenshot={path}", path.with_suffix(".svg").resolve().as_uri(),
        ],
        check=True, capture_output=True, timeout=60,
    )  # fmt: skip


if __name__ == "__main__":
    main()
