"""targets.csv: which poses the program names, when and how it passes them; with poses.csv it gives its orders."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geoprint.errors import VerificationError
from geoprint.export.orders import Orders
from geoprint.export.tables import PosesTable, read_columns, table_bytes, whole_column
from geoprint.model import BoolArray, FloatArray, IntArray

# The configuration of each target, behind `flow` that of the dry run, which is driven higher, and where the target
# stands: at the tip of its pose, or outside of a bend, so that the rounded corner passes the pose.
TARGETS_COLUMNS = (
    "pose", "run", "laid", "t", "zone", "speed", "cf1", "cf4", "cf6", "cfx", "flow",
    "dry_cf1", "dry_cf4", "dry_cf6", "dry_cfx", "x", "y", "z",
)  # fmt: skip
_DECIMALS = (0, 0, 0, 6, 6, 6, 0, 0, 0, 0, 9, 0, 0, 0, 0, 9, 9, 9)
_WHOLE = (0, 1, 2, 6, 7, 8, 9, 11, 12, 13, 14)


def targets_table(orders: Orders) -> bytes:
    """Return the text of targets.csv: one row a target, in the order of the program."""
    columns = [
        orders.poses, orders.runs, orders.laid, orders.times, orders.zones, orders.speeds, orders.configuration,
        orders.flow, orders.aloft_configuration, orders.tips,
    ]  # fmt: skip
    return table_bytes(np.column_stack(columns).astype(np.float64), columns=TARGETS_COLUMNS, decimals=_DECIMALS)


def read_orders(
    path: Path | str,
    poses: PosesTable,
    *,
    start: FloatArray,
    aloft: FloatArray,
    extent: FloatArray,
    duration: float,
    frame: float = np.inf,
) -> Orders:
    """Read a targets.csv, and what it says of the poses that it names.

    Args:
        path: the file.
        poses: the plan's poses.csv.
        start: (6,) joints at the first target [rad].
        aloft: (6,) joints at the first target of the dry run [rad].
        extent: (2, 3) lowest and highest coordinates of the part [mm].
        duration: from home to home [s].
        frame: as `Orders` [mm].

    Raises:
        VerificationError: columns or numbers are not those of such a table, it names poses that do not exist, or lays
            no material or ends while it does.
    """
    data = read_columns(path, columns=TARGETS_COLUMNS)
    whole = [whole_column(data, column, path=path, columns=TARGETS_COLUMNS) for column in _WHOLE]
    chosen, laid = whole[0], whole[2] == 1
    _check_rows(chosen, laid, path=path, last=len(poses.runs) - 1)
    return Orders(
        poses=chosen,
        tips=data[:, 15:18],
        quaternions=poses.quaternions[chosen],
        configuration=np.column_stack(whole[3:7]),
        zones=data[:, 4],
        speeds=data[:, 5],
        runs=whole[1],
        laid=laid,
        flow=data[:, 10],
        times=data[:, 3],
        start=start,
        aloft=aloft,
        aloft_configuration=np.column_stack(whole[7:11]),
        extent=extent,
        duration=duration,
        frame=frame,
    )


def _check_rows(chosen: IntArray, laid: BoolArray, *, path: Path | str, last: int) -> None:
    """Refuse poses that do not rise or go beyond the last, and rows that lay nothing or to the end."""
    if not chosen.size or chosen.min() < 0 or chosen.max() > last or (np.diff(chosen) <= 0).any():
        raise VerificationError(
            f"{path}: the poses do not rise from 0 to {last}, the last row of poses.csv; write the plan again."
        )
    if not laid.any() or laid[-1]:
        what = "material is laid after the last target" if laid.any() else "no material is laid"
        raise VerificationError(f"{path}: {what}; write the plan again.")
