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

import io

import numpy as np

from geoprint.quality import Uniformity

SPACING_COLUMNS = ("run", "level", "x", "y", "z", "ratio", "lower_bound", "straight", "width")
# Lengths to a nanometre, ratios to a millionth: finer than they are measured.
FORMATS = ("%d", "%d", *(["%.6f"] * 7))


def spacing_table(measured: Uniformity) -> bytes:
    """Return the content of spacing.csv.

    Args:
        measured: the evenness of the stream.
    """
    ratios = (measured.ratios, measured.bounds, measured.straight, measured.widths)
    rows = np.column_stack([measured.runs, measured.levels, measured.places, *ratios])
    text = io.StringIO()
    # Rounded first, then plus zero: -0.0000000001 is written as 0, not as -0.
    np.savetxt(text, np.round(rows, 6) + 0.0, fmt=FORMATS, delimiter=",", header=",".join(SPACING_COLUMNS), comments="")
    return text.getvalue().encode("ascii")
