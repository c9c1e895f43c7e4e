"""Tables in a terminal and as CSV: lines marked by weight, columns that fit, spacing.csv, tables of results."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np

from geoprint.errors import how_many
from geoprint.geometry.files import write_whole
from geoprint.metrics import Uniformity
from geoprint.model import Table
from geoprint.postprocessor.tables import table_bytes

# What a person should mind, by weight: warnings to act on, notes, details, then what was not checked.


def marked_lines(
    *,
    warnings: Iterable[str] = (),
    notes: Iterable[str] = (),
    details: Iterable[str] = (),
    not_checked: Iterable[str] = (),
    verbose: bool = False,
) -> list[str]:
    """Return a line for each thing to mind, the weightiest first; none is said twice.

    Args:
        warnings: what to act on.
        notes: what to know.
        details: what is as it should be; none unless all is asked for.
        not_checked: what nobody looked at; as one line with their count, unless all is asked for.
        verbose: whether it is.
    """
    unchecked = list(dict.fromkeys(not_checked))
    if unchecked and not verbose:
        unchecked = [f"{how_many(len(unchecked), 'thing')}; `--verbose` lists them"]
    return [
        *(f"warning: {text}" for text in dict.fromkeys(warnings)),
        *(f"note: {text}" for text in dict.fromkeys(notes)),
        *(f"detail: {text}" for text in dict.fromkeys(details) if verbose),
        *(f"not checked: {text}" for text in unchecked),
    ]


# Tables in a terminal: columns that fit, each as wide as it must be.


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


# spacing.csv: the measured spacing sample by sample, for statistics of one's own.
#
# One row a sample, four a spacing along each run, one stretch after the other.
#
# | column | meaning | |---|---| | run | as in poses.csv | | x, y, z | place on the surface, in the coordinates of
# the part [mm] | | left, right | exact distance over the surface to the neighbour on that side, over the wanted
# spacing; nan for none | | width | of the strip of surface nearest to the sample, over the wanted spacing |


# Lengths to a nanometre, ratios to a millionth: finer than they are measured.
DECIMALS = 6


def spacing_table(measured: Uniformity) -> bytes:
    """Return the content of spacing.csv.

    Args:
        measured: the evenness of the stream.
    """
    return csv_bytes(measured.table())


def csv_bytes(table: Table) -> bytes:
    """Return a table as CSV: its columns in the first row, then a row each; numbers with six decimals."""
    names = table.dtype.names or ()
    decimals = tuple(DECIMALS if table.dtype[name].kind == "f" else 0 for name in names)
    return table_bytes(np.column_stack([table[name] for name in names]), columns=names, decimals=decimals)


def csv_text(table: Table) -> str:
    """Return a table of runs, levels or samples as CSV: its columns in the first row, then a row each."""
    return csv_bytes(table).decode("ascii")


def save_table(table: Table, path: Path | str) -> None:
    """Write a table of runs, levels or samples as a CSV file, whole or not at all; one of that name is replaced.

    Raises:
        ExportError: the file cannot be written.
    """
    write_whole(path, csv_bytes(table))
