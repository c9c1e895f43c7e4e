"""Tables in a terminal: columns that fit, each as wide as it must be."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import TypeAlias

# Between two columns.
GAP = "  "

# The cells of a row by the names of their columns.
Cells: TypeAlias = Mapping[str, str]


def fitting(names: Sequence[str], rows: Sequence[Cells], *, width: int | None, weights: Mapping[str, int]) -> list[str]:
    """Return the columns that fit into a line, in their order; the first to go is the one with the largest weight.

    Args:
        names: of the columns.
        rows: what stands in them.
        width: letters in a line, or None where they are not counted.
        weights: of the columns; one of them stays.
    """
    kept = list(names)
    while width is not None and len(kept) > 1 and line_width(kept, rows) > width:
        kept.remove(max(kept, key=weights.__getitem__))
    return kept


def left_out(every: Sequence[str], kept: Sequence[str], weights: Mapping[str, int]) -> str:
    """Return the names of the columns that did not fit, in the order in which they went."""
    gone = sorted(set(every) - set(kept), key=weights.__getitem__, reverse=True)
    return ", ".join(gone)


def line_width(names: Sequence[str], rows: Sequence[Cells]) -> int:
    """Return how many letters a line of the table has."""
    return sum(_column(name, rows) for name in names) + len(GAP) * (len(names) - 1)


def grid(
    names: Sequence[str],
    parts: Sequence[Sequence[Cells]],
    *,
    titles: Sequence[str | None] = (None,),
    left: Collection[str],
) -> Iterator[str]:
    """Yield a heading and the rows, each part's below its title where it has one.

    Args:
        names: of the columns.
        parts: their rows.
        titles: one a part.
        left: columns that are aligned on the left; the others hold numbers.
    """
    every = [row for rows in parts for row in rows]
    widths = {name: _column(name, every) for name in names}
    inset = GAP if any(titles) else ""

    def line(cells: Cells) -> str:
        padded = [
            cells[name].ljust(widths[name]) if name in left else cells[name].rjust(widths[name]) for name in names
        ]
        return f"{inset}{GAP.join(padded)}".rstrip()

    yield line({name: name for name in names})
    yield f"{inset}{'-' * line_width(names, every)}"
    for title, rows in zip(titles, parts, strict=True):
        if title is not None:
            yield title
        yield from map(line, rows)


def _column(name: str, rows: Sequence[Cells]) -> int:
    return max(len(name), *(len(row[name]) for row in rows))
