"""feedback.csv: what flow was wanted, and what is commanded because of what the last print left."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geoprint.errors import VerificationError
from geoprint.export.tables import read_columns, table_bytes
from geoprint.model import FloatArray, PoseStream

# Its name in a bundle.
FEEDBACK_TABLE = "feedback.csv"
FEEDBACK_COLUMNS = ("run", "s", "wanted", "commanded", "factor")
_DECIMALS = (0, 6, 9, 9, 6)


def feedback_table(poses: PoseStream, wanted: FloatArray) -> bytes:
    """Return the text of feedback.csv: one row a pose that deposits, in their order.

    Args:
        poses: of the plan, with the flow that is commanded.
        wanted: (q,) flow that the paths ask for at these poses [mm3/mm].
    """
    there = poses.deposit
    commanded = poses.flow[there]
    factors = np.divide(commanded, wanted, out=np.ones_like(wanted), where=wanted > 0.0)
    columns = np.column_stack([poses.runs[there], poses.arcs[there], wanted, commanded, factors])
    return table_bytes(columns.astype(np.float64), columns=FEEDBACK_COLUMNS, decimals=_DECIMALS)


def read_wanted_flow(path: Path | str, poses: PoseStream) -> FloatArray:
    """Return the (p,) flow that the paths of a bundle ask for, without what was fed back; 0 on travel.

    Args:
        path: of feedback.csv.
        poses: of the bundle.

    Raises:
        VerificationError: it cannot be read, or is not of these poses.
    """
    data = read_columns(path, columns=FEEDBACK_COLUMNS)
    there = poses.deposit
    same = len(data) == np.count_nonzero(there) and np.array_equal(data[:, 0], poses.runs[there])
    if not same or not np.allclose(data[:, 3], poses.flow[there], rtol=0.0, atol=1e-8) or (data[:, 2] < 0.0).any():
        raise VerificationError(
            f"{path}: its {len(data)} rows are not the {np.count_nonzero(there)} poses that deposit by poses.csv, with "
            "their flow; write the plan again."
        )
    flow = np.zeros(poses.count)
    flow[there] = data[:, 2]
    return flow
