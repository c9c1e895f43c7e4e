"""Tables in a terminal and as CSV: lines marked by weight, columns that fit, runs, levels and spacing samples."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geoprint.geometry.files import write_whole
from geoprint.metrics import LevelSpacings, Uniformity
from geoprint.postprocessor.tables import table_bytes
from geoprint.reporting.records.rounding import how_many
from geoprint.results import Plan

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


# Columns by name, as `table["x"]`; whatever makes tables of arrays takes it.
Table: TypeAlias = "np.recarray[tuple[int], np.dtype[np.record]]"

SPACING_COLUMNS = ("run", "x", "y", "z", "left", "right", "width")
# Lengths to a nanometre, ratios to a millionth: finer than they are measured.
DECIMALS = 6


def samples_table(measured: Uniformity) -> Table:
    """Return every measured spacing as a table of arrays, with the columns and rows of spacing.csv.

    Args:
        measured: the evenness of a plan.
    """
    columns = [measured.runs, *measured.sides.places.T, *measured.sides.sides().T, measured.widths]
    return table_of(dict(zip(SPACING_COLUMNS, columns, strict=True)))


def table_of(columns: Mapping[str, NDArray[np.generic]]) -> Table:
    """Return arrays of one length as a table."""
    kinds = np.dtype([(name, column.dtype) for name, column in columns.items()])
    return np.rec.fromarrays([*columns.values()], dtype=kinds)


def spacing_table(measured: Uniformity) -> bytes:
    """Return the content of spacing.csv.

    Args:
        measured: the evenness of the stream.
    """
    return csv_bytes(samples_table(measured))


def csv_bytes(table: Table) -> bytes:
    """Return a table as CSV: its columns in the first row, then a row each; numbers with six decimals."""
    names = table.dtype.names or ()
    decimals = tuple(DECIMALS if table.dtype[name].kind == "f" else 0 for name in names)
    return table_bytes(np.column_stack([table[name] for name in names]), columns=names, decimals=decimals)


# Runs and levels of a plan as tables of arrays, for statistics of one's own, and such tables as CSV.
#
# | table | column | meaning | |---|---|---| | runs | run, layer, level | as in poses.csv, in printing order | | |
# closed | whether the run ends where it starts | | | x, y, z | where it starts on the surface, in the coordinates of
# the part [mm] | | | length | of what is laid [mm] | | | volume | of what is laid [mm3] | | levels | level | 0, the
# outermost, has no neighbour and no row | | | samples | measured on it | | | mean, cv, worst | of the spacing to the
# level outside, over the wanted one: 1, 0 and 1 are ideal |


def runs_table(plan: Plan) -> Table:
    """Return a row for each run of a plan, in printing order: run, layer, level, closed, x, y, z, length, volume.

    Lengths are those of the tip, as `deposit_mm` in plan.json is.
    """
    poses, path = plan.poses, plan.toolpath
    lengths = np.where(poses.deposited, np.linalg.norm(np.diff(poses.tips, axis=0), axis=1), 0.0)
    count = path.curves.count
    length, volume = (
        np.bincount(poses.runs[:-1], weights=each, minlength=count) for each in (lengths, lengths * poses.flow[:-1])
    )
    starts = path.curves.points.xyz(plan.workpiece.surface)[path.curves.offsets[:-1]]
    return table_of(
        {
            "run": np.arange(count), "layer": path.layers, "level": path.levels, "closed": path.curves.closed,
            "x": starts[:, 0], "y": starts[:, 1], "z": starts[:, 2], "length": length, "volume": volume,
        }
    )  # fmt: skip


def levels_table(measured: LevelSpacings) -> Table:
    """Return a row for each level but the outermost: level, samples, and mean, cv and worst of their spacing.

    Args:
        measured: the spacing from level to level of a plan (`uniformity(...).levels`).
    """
    levels, samples = np.unique(measured.levels, return_counts=True)
    mean, cv, worst = np.array([level[1:] for level in measured.by_level()]).reshape(-1, 3).T
    return table_of({"level": levels, "samples": samples, "mean": mean, "cv": cv, "worst": worst})


def csv_text(table: Table) -> str:
    """Return a table of runs, levels or samples as CSV: its columns in the first row, then a row each."""
    return csv_bytes(table).decode("ascii")


def save_table(table: Table, path: Path | str) -> None:
    """Write a table of runs, levels or samples as a CSV file, whole or not at all; one of that name is replaced.

    Raises:
        ExportError: the file cannot be written.
    """
    write_whole(path, csv_bytes(table))
