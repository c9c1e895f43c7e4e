"""What a terminal of some width shows when a command has ended."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import struct
import subprocess
import termios
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
_SIGN = re.compile(r"\x1b\[\?25[lh]|\x1b\[(\d*)([AK])|(\r)|(\n)|((?:\x1b\[[\d;]*m|[^\x1b\r\n])+)")


def screen(command: Sequence[str], *, columns: int, rows: int = 200) -> str:
    """Return what a terminal of some width shows when a command has ended, colours included."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    kept = {name: value for name, value in os.environ.items() if name not in {"COLUMNS", "NO_COLOR"}}
    process = subprocess.Popen(
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
