"""spacing.csv: the measured spacing sample by sample, for statistics of one's own.

One row a sample, four a spacing along each run, one stretch after the other.

| column | meaning |
|---|---|
| run | as in poses.csv |
| x, y, z | place on the surface, in the coordinates of the part [mm] |
| left, right | exact distance over the surface to the neighbour on that side, over the wanted spacing; nan for none |
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
