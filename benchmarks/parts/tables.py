"""Markdown tables and the least of several times, for every benchmark."""

from __future__ import annotations

import time
from collections.abc import Callable


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
