"""spacing.csv: the measured spacing sample by sample, for statistics of one's own.

One row a sample, four a spacing along each run, run after run; the outermost level has no neighbour and no rows.

| column | meaning |
|---|---|
| run | as in poses.csv |
| level | of the run; 0 is the outermost |
| x, y, z | place on the surface, in the coordinates of the part [mm] |
| ratio | exact distance over the surface to the level outside, over the wanted spacing; 1 is ideal |
| lower_bound | of the ratio; equal to it where it is exact |
| straight | the same ratio through the air |
| width | of the strip of surface nearest to the sample, over the wanted spacing |
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geoprint.export.tables import table_bytes
from geoprint.quality import Uniformity

# Columns by name, as `table["x"]`; whatever makes tables of arrays takes it.
Table: TypeAlias = "np.recarray[tuple[int], np.dtype[np.record]]"

SPACING_COLUMNS = ("run", "level", "x", "y", "z", "ratio", "lower_bound", "straight", "width")
# Lengths to a nanometre, ratios to a millionth: finer than they are measured.
DECIMALS = 6


def samples_table(measured: Uniformity) -> Table:
    """Return every measured spacing as a table of arrays, with the columns and rows of spacing.csv.

    Args:
        measured: the evenness of a plan.
    """
    ratios = [measured.ratios, measured.bounds, measured.straight, measured.widths]
    columns = [measured.runs, measured.levels, *measured.places.T, *ratios]
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
