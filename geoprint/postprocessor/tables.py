"""poses.csv, trajectory.csv, targets.csv and feedback.csv: the plan as tables that anything can read."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import final

import numpy as np

from geoprint.errors import InputError, VerificationError, how_many
from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream, Trajectory, frozen
from geoprint.postprocessor.orders import Orders

# poses.csv and trajectory.csv: the plan as tables that anything can read, and readers that check them.
#
# Rows are formatted in blocks by one `%`, which is as fast as Python formats; the same values give the same bytes.
# The readers go through NumPy's parser and share with the writer nothing but the names of the columns.


POSES_COLUMNS = (
    "run", "layer", "level", "deposit", "x", "y", "z", "qw", "qx", "qy", "qz", "nx", "ny", "nz", "s", "flow",
)  # fmt: skip
TRAJECTORY_COLUMNS = ("t", "q1", "q2", "q3", "q4", "q5", "q6", "deposit", "run")

# Decimals of each column. Joint angles need nine: fewer spoil the accelerations that are computed from them.
_POSES_DECIMALS = (0, 0, 0, 0, 6, 6, 6, 9, 9, 9, 9, 9, 9, 9, 6, 9)
_TRAJECTORY_DECIMALS = (3, 9, 9, 9, 9, 9, 9, 0, 0)
# Rows that are formatted at once: large enough for speed, small enough for memory.
_BLOCK_ROWS = 8192
# Times are written in whole milliseconds; what is farther from one [s] would be changed by that.
_MILLISECOND_TOLERANCE = 1e-6
# Reading a decimal back is exact to a few ulp; the rest is half of the last decimal.
_READING_SHARE = 1e-12


@final
@frozen
class PosesTable:
    """poses.csv as arrays.

    Attributes:
        runs: (p,).
        layers: (p,).
        levels: (p,) -1 on travel.
        deposit: (p,); consecutive rows of a run are the deposited polyline, its last point included.
        points: (p, 3) point of the surface on deposit, tip of the nozzle on travel [mm].
        quaternions: (p, 4) attitude of the tool, w x y z.
        normals: (p, 3) outward normal.
        arcs: (p,) arc length within the run [mm].
        flow: (p,) [mm3/mm].
    """

    runs: IntArray
    layers: IntArray
    levels: IntArray
    deposit: BoolArray
    points: FloatArray
    quaternions: FloatArray
    normals: FloatArray
    arcs: FloatArray
    flow: FloatArray


@final
@frozen
class TrajectoryTable:
    """trajectory.csv as arrays.

    Attributes:
        times: (k,) [s].
        joints: (k, 6) [rad].
        deposit: (k,).
        runs: (k,) -1 from and to home.
    """

    times: FloatArray
    joints: FloatArray
    deposit: BoolArray
    runs: IntArray


def poses_table(poses: PoseStream) -> bytes:
    """Return the text of poses.csv: one row a pose, in part coordinates."""
    return table_bytes(_pose_rows(poses), columns=POSES_COLUMNS, decimals=_POSES_DECIMALS)


def trajectory_table(trajectory: Trajectory) -> bytes:
    """Return the text of trajectory.csv: one row a millisecond of the motion, without what it waits for flow or lamp.

    Raises:
        InputError: a time is no whole number of milliseconds.
    """
    off = np.abs(trajectory.times - np.round(trajectory.times, 3))
    if off.max(initial=0.0) > _MILLISECOND_TOLERANCE:
        row = int(np.argmax(off))
        raise InputError(
            f"trajectory row {row} is at {trajectory.times[row]!r} s; the table holds whole milliseconds: "
            "sample the trajectory each millisecond."
        )
    return table_bytes(_trajectory_rows(trajectory), columns=TRAJECTORY_COLUMNS, decimals=_TRAJECTORY_DECIMALS)


def read_poses_table(path: Path | str) -> PosesTable:
    """Read a poses.csv.

    Args:
        path: the file.

    Raises:
        VerificationError: columns or numbers are not those of such a table.
    """
    data = read_columns(path, columns=POSES_COLUMNS)
    return PosesTable(
        runs=whole_column(data, 0, path=path, columns=POSES_COLUMNS),
        layers=whole_column(data, 1, path=path, columns=POSES_COLUMNS),
        levels=whole_column(data, 2, path=path, columns=POSES_COLUMNS),
        deposit=_flag(data, 3, path=path, columns=POSES_COLUMNS),
        points=data[:, 4:7],
        quaternions=data[:, 7:11],
        normals=data[:, 11:14],
        arcs=data[:, 14],
        flow=data[:, 15],
    )


def read_trajectory_table(path: Path | str) -> TrajectoryTable:
    """Read a trajectory.csv.

    Args:
        path: the file.

    Raises:
        VerificationError: columns or numbers are not those of such a table.
    """
    data = read_columns(path, columns=TRAJECTORY_COLUMNS)
    return TrajectoryTable(
        times=data[:, 0],
        joints=data[:, 1:7],
        deposit=_flag(data, 7, path=path, columns=TRAJECTORY_COLUMNS),
        runs=whole_column(data, 8, path=path, columns=TRAJECTORY_COLUMNS),
    )


def verify_poses_table(path: Path | str, poses: PoseStream) -> None:
    """Check that a poses.csv holds a pose stream, to the last decimal.

    Raises:
        VerificationError: it does not; file, row and column are named.
    """
    _verify(path, _pose_rows(poses), columns=POSES_COLUMNS, decimals=_POSES_DECIMALS)


def verify_trajectory_table(path: Path | str, trajectory: Trajectory) -> None:
    """Check that a trajectory.csv holds a trajectory, to the last decimal.

    Raises:
        VerificationError: it does not; file, row and column are named.
    """
    _verify(path, _trajectory_rows(trajectory), columns=TRAJECTORY_COLUMNS, decimals=_TRAJECTORY_DECIMALS)


def _pose_rows(poses: PoseStream) -> FloatArray:
    return np.column_stack(
        [
            poses.runs, poses.layers, poses.levels, poses.deposit, poses.surface_points, poses.quaternions,
            poses.normals, poses.arcs, poses.flow,
        ]
    ).astype(np.float64, copy=False)  # fmt: skip


def _trajectory_rows(trajectory: Trajectory) -> FloatArray:
    columns = [trajectory.times, trajectory.joints, trajectory.deposit, trajectory.runs]
    return np.column_stack(columns).astype(np.float64, copy=False)


def table_bytes(rows: FloatArray, *, columns: tuple[str, ...], decimals: tuple[int, ...]) -> bytes:
    """Return a table as text.

    Args:
        rows: (rows, columns).
        columns: their names.
        decimals: of each column.
    """
    line = ",".join(f"%.{places}f" for places in decimals) + "\n"
    blocks = [(",".join(columns) + "\n").encode("ascii")]
    for start in range(0, len(rows), _BLOCK_ROWS):
        block = rows[start : start + _BLOCK_ROWS].copy()
        for column, places in enumerate(decimals):
            # Rounded first, then plus zero: -0.0000000001 is written as 0, not as -0.
            block[:, column] = np.round(block[:, column], places) + 0.0
        blocks.append(((line * len(block)) % tuple(block.ravel().tolist())).encode("ascii"))
    return b"".join(blocks)


def read_columns(path: Path | str, *, columns: tuple[str, ...]) -> FloatArray:
    """Return the (rows, columns) numbers below a header.

    Args:
        path: the file.
        columns: names that the header must have.

    Raises:
        VerificationError: header, form or a number is wrong.
    """
    rows = 0

    def counted(lines: Iterable[str]) -> Iterator[str]:
        nonlocal rows
        for line in lines:
            rows += line.endswith("\n")
            yield line

    try:
        with Path(path).open(encoding="ascii", errors="replace", newline="") as file:
            header = file.readline().removesuffix("\n")
            if header != ",".join(columns):
                raise VerificationError(
                    f"{path}: the columns are {header[:200]!r}, they must be {','.join(columns)!r}."
                )
            _refuse_cut_off(Path(path), header)
            data = np.loadtxt(counted(file), delimiter=",", ndmin=2, comments=None)
    except OSError as error:
        raise VerificationError(f"{path} cannot be read: {error.strerror}; write the table again.") from error
    except ValueError as error:
        raise VerificationError(f"{path}: {error} (rows counted without the header); write the table again.") from error
    if data.shape != (rows, len(columns)):
        raise VerificationError(f"{path}: {data.shape} numbers in {rows} rows of {len(columns)}; write it again.")
    if not np.isfinite(data).all():
        row, column = np.argwhere(~np.isfinite(data))[0]
        raise VerificationError(f"{path}, row {row + 1}: {columns[column]} is not finite; write the table again.")
    return data


def _refuse_cut_off(path: Path, header: str) -> None:
    """Refuse a file without rows below its header, or whose last row has no end."""
    with path.open("rb") as file:
        length = file.seek(0, 2)
        file.seek(max(length - 1, 0))
        if length <= len(header) + 1 or file.read() != b"\n":
            raise VerificationError(f"{path}: the last row is cut off or missing; write the table again.")


def whole_column(data: FloatArray, column: int, *, path: Path | str, columns: tuple[str, ...]) -> IntArray:
    """Return a column that must hold whole numbers.

    Raises:
        VerificationError: it does not.
    """
    values = data[:, column]
    _require(values == np.round(values), values, name=columns[column], path=path, allowed="whole numbers")
    return values.astype(np.int64)


def _flag(data: FloatArray, column: int, *, path: Path | str, columns: tuple[str, ...]) -> BoolArray:
    values = data[:, column]
    _require((values == 0.0) | (values == 1.0), values, name=columns[column], path=path, allowed="0 and 1")
    return values == 1.0


def _require(fit: BoolArray, values: FloatArray, *, name: str, path: Path | str, allowed: str) -> None:
    if not fit.all():
        row = int(np.argmin(fit))
        raise VerificationError(f"{path}, row {row + 1}: {name} is {values[row]}, allowed are {allowed}.")


def _verify(path: Path | str, rows: FloatArray, *, columns: tuple[str, ...], decimals: tuple[int, ...]) -> None:
    found = read_columns(path, columns=columns)
    if len(found) != len(rows):
        raise VerificationError(
            f"{path} has {how_many(len(found), 'row')}, the plan has {len(rows)}; write the table again."
        )
    halves = 0.5 * 10.0 ** -np.array(decimals, dtype=np.float64) * np.array([places > 0 for places in decimals])
    for start in range(0, len(rows), _BLOCK_ROWS):
        read, planned = found[start : start + _BLOCK_ROWS], rows[start : start + _BLOCK_ROWS]
        wrong = np.abs(read - planned) > halves * (1.0 + 1e-6) + _READING_SHARE * np.maximum(np.abs(planned), 1.0)
        if wrong.any():
            row, column = np.argwhere(wrong)[0]
            raise VerificationError(
                f"{path}, row {start + row + 1}: {columns[column]} is {read[row, column]}, the plan has "
                f"{planned[row, column]}; write the table again.",
                row=start + int(row) + 1,
            )


# targets.csv: which poses the program names, when and how it passes them; with poses.csv it gives its orders.


# The joints at each target, behind `flow` those of the dry run, which is driven higher, and where the target stands:
# at the tip of its pose, or outside of a bend, so that the rounded corner passes the pose.
TARGETS_COLUMNS = (
    "pose", "run", "laid", "t", "zone", "speed", "q1", "q2", "q3", "q4", "q5", "q6", "flow",
    "dry_q1", "dry_q2", "dry_q3", "dry_q4", "dry_q5", "dry_q6", "x", "y", "z",
)  # fmt: skip
_TARGET_DECIMALS = (0, 0, 0, *[6] * 3, *[9] * 16)
_WHOLE = (0, 1, 2)


def targets_table(orders: Orders) -> bytes:
    """Return the text of targets.csv: one row a target, in the order of the program."""
    columns = [
        orders.poses, orders.runs, orders.deposited, orders.times, orders.zones, orders.speeds, orders.joints,
        orders.flow, orders.lifted_joints, orders.tips,
    ]  # fmt: skip
    return table_bytes(np.column_stack(columns).astype(np.float64), columns=TARGETS_COLUMNS, decimals=_TARGET_DECIMALS)


def read_orders(
    path: Path | str,
    poses: PosesTable,
    *,
    extent: FloatArray,
    duration: float,
    frame: float = np.inf,
) -> Orders:
    """Read a targets.csv, and what it says of the poses that it names.

    Args:
        path: the file.
        poses: the plan's poses.csv.
        extent: (2, 3) lowest and highest coordinates of the part [mm].
        duration: from home to home [s].
        frame: as `Orders` [mm].

    Raises:
        VerificationError: columns or numbers are not those of such a table, it names poses that do not exist, or lays
            no material or ends while it does.
    """
    data = read_columns(path, columns=TARGETS_COLUMNS)
    whole = [whole_column(data, column, path=path, columns=TARGETS_COLUMNS) for column in _WHOLE]
    chosen, deposited = whole[0], whole[2] == 1
    _check_rows(chosen, deposited, path=path, last=len(poses.runs) - 1)
    return Orders(
        poses=chosen,
        tips=data[:, 19:22],
        quaternions=poses.quaternions[chosen],
        joints=data[:, 6:12],
        zones=data[:, 4],
        speeds=data[:, 5],
        runs=whole[1],
        deposited=deposited,
        flow=data[:, 12],
        times=data[:, 3],
        lifted_joints=data[:, 13:19],
        extent=extent,
        duration=duration,
        frame=frame,
    )


def _check_rows(chosen: IntArray, deposited: BoolArray, *, path: Path | str, last: int) -> None:
    """Refuse poses that do not rise or go beyond the last, and rows that deposit nothing or to the end."""
    if not chosen.size or chosen.min() < 0 or chosen.max() > last or (np.diff(chosen) <= 0).any():
        raise VerificationError(
            f"{path}: the poses do not rise from 0 to {last}, the last row of poses.csv; write the plan again."
        )
    if not deposited.any() or deposited[-1]:
        what = "material is deposited after the last target" if deposited.any() else "no material is deposited"
        raise VerificationError(f"{path}: {what}; write the plan again.")


# feedback.csv: what flow was wanted, and what is commanded because of what the last print left.


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
            f"{path}: its {how_many(len(data), 'row')} are not the {np.count_nonzero(there)} poses that deposit by "
            "poses.csv, with their flow; write the plan again."
        )
    flow = np.zeros(poses.count)
    flow[there] = data[:, 2]
    return flow
