"""What every benchmark shares: arguments, Markdown tables, and the least of several times."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable


def script_parser(description: str | None, *, smoke: str) -> argparse.ArgumentParser:
    """Return a script's parser, which takes `--smoke`: the least that shows that it runs."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smoke", action="store_true", help=smoke)
    return parser


def row(*cells: str) -> str:
    """Return a line of a table."""
    return "| " + " | ".join(cells) + " |"


def rule(columns: int) -> str:
    """Return the line below the headings."""
    return "|" + "---|" * columns


def least_seconds(work: Callable[[], object], *, repeats: int = 3) -> float:
    """Return the least of several times that some work takes [s]: the machine is rarely alone."""
    times: list[float] = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def table(*cells: str) -> list[str]:
    """Return an empty line and the head of a table."""
    return ["", row(*cells), row(*("---" for _ in cells))]
