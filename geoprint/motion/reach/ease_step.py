"""One convex step of easing: small turns of the tool along a stretch of path that keep its joints within their limits.

The tool turns by d(s), a vector in its own frame: lean about x and y, turn about the nozzle. Its joints are then
q(s) + A(s) d(s), with A the columns of the inverse Jacobian that turn the tool about its tip. d is a cubic spline that
begins and ends as if nothing were turned. Sought is the least lean, squared along the length, at which no joint is
faster or more accelerated than allowed while the tip runs at its speed; where that cannot be had, what exceeds the
accelerations counts far more than the lean. That is a quadratic program with bands, cones for the lean, and one
solution [Boyd2004], which an interior point solver finds [Goulart2024].
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, TypeAlias, final

import numpy as np
from scipy import sparse

from geoprint.model import BoolArray, FloatArray, IntArray, frozen

if TYPE_CHECKING:
    from scipy.sparse import csc_array

# Knots of the turn along the path [mm]: bends shorter than this are none that an arm could ease.
KNOT = 3.0
DEGREE = 3
# Coefficients at either end that are zero: place, slope and curvature begin from nothing.
CLAMPED = 3
# What a millimetre of path costs: lean squared counts 1, turn about the nozzle next to nothing, turning it little,
# and by how many times accelerations exceed their limits much.
TURN_COST = 1e-4
TURNING_COST = 0.5
EXCESS_COST = 10.0
SQUARED_EXCESS_COST = 1e-3
# Speeds of joints are looked at where they exceed this share of their limits.
FAST_SHARE = 0.4
# Values of a sparse matrix, and the rows and columns that they stand in.
_Block: TypeAlias = tuple[FloatArray, IntArray, IntArray]
# Tolerances of the solver: far below what a joint resolves.
GAP = 1e-5
FEASIBILITY = 1e-7


@final
@frozen
class Stretch:
    """A stretch of path to be eased, k poses in one run.

    Attributes:
        arcs: (k,) rising from 0 [mm].
        joints: (k, 6) continuous [rad].
        moved: (k, 6, 3) how joints change with small turns of the tool about its own axes.
        leans: (k, 2) from the normal to the nozzle about the tool's x and y axes [rad].
        largest: (k,) lean that is allowed [rad].
        counted: (k,) whether the pose is to keep its limits.
        rates: (6,) largest change of each joint by path [rad/mm].
        bends: (6,) largest second derivative by path [rad/mm2].
    """

    arcs: FloatArray
    joints: FloatArray
    moved: FloatArray
    leans: FloatArray
    largest: FloatArray
    counted: BoolArray
    rates: FloatArray
    bends: FloatArray

    @property
    def cone_bounds(self) -> FloatArray:
        """(k, 3) the largest lean, and the lean about both axes [rad]."""
        return np.column_stack([self.largest, self.leans])


def eased_turns(stretch: Stretch) -> FloatArray | None:
    """Return (k, 3) small turns of the tool in its own frame [rad], or None where the solver finds none.

    The first and the last are zero.
    """
    basis = _basis(stretch.arcs)
    if basis is None:
        return None
    solution = _solved(stretch, basis)
    if solution is None:
        return None
    value, count = basis.sparse(0), basis.count
    return np.column_stack([value @ solution[axis * count : (axis + 1) * count] for axis in range(3)])


@final
@frozen
class _Basis:
    """The cubic B-splines whose coefficients are free, at k places.

    Attributes:
        count: of the free coefficients.
        columns: (k, 4) which of them are not zero at a place; beyond the free ones where there are fewer.
        values: (3, k, 4) those, their slopes [1/mm] and curvatures [1/mm2]; zero where the column is beyond.
    """

    count: int
    columns: IntArray
    values: FloatArray

    def sparse(self, order: int) -> csc_array:
        """Return the (k, m) values, slopes or curvatures."""
        rows = np.repeat(np.arange(len(self.columns)), DEGREE + 1)
        return _filled([(self.values[order].ravel(), rows, self.columns.ravel())], (len(self.columns), self.count))


def _basis(arcs: FloatArray) -> _Basis | None:
    """Return the splines at each arc; None where the stretch is too short for any."""
    from scipy.interpolate import BSpline

    length = float(arcs[-1])
    pieces = max(int(np.ceil(length / KNOT)), 1)
    free = pieces + DEGREE - 2 * CLAMPED
    if free < 1:
        return None
    inner = np.linspace(0.0, length, pieces + 1)
    knots = np.concatenate([np.zeros(DEGREE), inner, np.full(DEGREE, length)])
    spline = BSpline(knots, np.eye(pieces + DEGREE), DEGREE)
    piece = np.clip(np.searchsorted(inner, arcs, side="right") - 1, 0, pieces - 1)
    every: IntArray = piece[:, None] + np.arange(DEGREE + 1)
    values = np.stack([np.take_along_axis(spline(arcs, order), every, axis=1) for order in range(3)])
    columns = every - CLAMPED
    beyond = (columns < 0) | (columns >= free)
    return _Basis(free, np.where(beyond, 0, columns), np.where(beyond, 0.0, values))


@final
@frozen
class _JointRows:
    """What turns do to the joints, over their limits: r rows for each of some joints in turn, k = poses.

    Attributes:
        entries: (j, k, 3, 4) by joint, pose, axis of the turn and spline.
        without: (j, k) what there is without any turn.
    """

    entries: FloatArray
    without: FloatArray


def _joint_rows(stretch: Stretch, basis: _Basis) -> tuple[_JointRows, _JointRows]:
    """Return what turns do to bends of all joints, and to rates of those that are fast."""
    from scipy.interpolate import CubicSpline

    path = CubicSpline(stretch.arcs, stretch.joints)
    moved = CubicSpline(stretch.arcs, stretch.moved)
    M, dM, ddM = (np.moveaxis(np.asarray(moved(stretch.arcs, order)), 1, 0)[..., None] for order in range(3))
    value, slope, curvature = basis.values[:, None, :, None, :]
    bends, rates = path(stretch.arcs, 2).T, path(stretch.arcs, 1).T
    fast = np.abs(rates).max(axis=1) > FAST_SHARE * stretch.rates
    bent = (M * curvature + 2.0 * dM * slope + ddM * value) * (1.0 / stretch.bends)[:, None, None, None]
    turning = (M[fast] * slope + dM[fast] * value) * (1.0 / stretch.rates[fast])[:, None, None, None]
    return (
        _JointRows(bent, bends / stretch.bends[:, None]),
        _JointRows(turning, rates[fast] / stretch.rates[fast, None]),
    )


def _solved(stretch: Stretch, basis: _Basis) -> FloatArray | None:
    """Return the coefficients of the turns, of each axis in turn."""
    # Late, as it is needed by few parts; by name, as it has no types.
    clarabel = import_module("clarabel")
    bent, fast = _joint_rows(stretch, basis)
    poses, rates = len(stretch.arcs), fast.without.ravel()
    bounds = np.concatenate([
        1.0 - bent.without.ravel(), 1.0 + bent.without.ravel(), 1.0 - np.minimum(rates, 1.0),
        1.0 + np.maximum(rates, -1.0), np.zeros(poses), stretch.cone_bounds.ravel(),
    ])  # fmt: skip
    quadratic, slope = _costs(stretch, basis)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = GAP
    settings.tol_feas = FEASIBILITY
    # Steps that are a little off end as near to the solution, as those tolerances say, at two thirds of the time.
    settings.iterative_refinement_enable = False
    cones = [clarabel.NonnegativeConeT(len(bounds) - 3 * poses), *[clarabel.SecondOrderConeT(3)] * poses]
    found = clarabel.DefaultSolver(
        sparse.csc_matrix(sparse.triu(quadratic)), slope, sparse.csc_matrix(_rows(basis, bent, fast)), bounds, cones,
        settings,
    ).solve()  # fmt: skip
    if str(found.status) not in ("Solved", "AlmostSolved"):
        return None
    return np.asarray(found.x)[: 3 * basis.count]


def _rows(basis: _Basis, bent: _JointRows, fast: _JointRows) -> csc_array:
    """Return all that is bounded, by the coefficients of each axis in turn and what exceeds the limits at each pose.

    Bends from above and below, rates likewise, what exceeds, which is not negative; then three rows a pose that keep
    the lean within its cone, its radius first.
    """
    poses, count = len(basis.columns), basis.count
    pose = np.arange(poses)
    each = basis.columns[:, None, :] + count * np.arange(3)[:, None]
    blocks: list[_Block] = []
    first = 0
    for part in (bent, fast):
        joints = len(part.without)
        row = np.arange(joints * poses)
        by_turn = part.entries.ravel(), np.repeat(row, each[0].size), np.tile(each.ravel(), joints)
        for sign in (1.0, -1.0):
            blocks.append((sign * by_turn[0], first + by_turn[1], by_turn[2]))
            if part is bent:
                blocks.append((np.full(row.size, -1.0), first + row, 3 * count + np.tile(pose, joints)))
            first += row.size
    blocks.append((np.full(poses, -1.0), first + pose, 3 * count + pose))
    first += poses
    for axis in range(2):
        row = np.repeat(first + 3 * pose + 1 + axis, DEGREE + 1)
        blocks.append((-basis.values[0].ravel(), row, (basis.columns + count * axis).ravel()))
    return _filled(blocks, (first + 3 * poses, 3 * count + poses))


def _filled(blocks: Sequence[_Block], shape: tuple[int, int]) -> csc_array:
    """Return the matrix of some entries; those that are zero are none."""
    values, rows, columns = (np.concatenate(part) for part in zip(*blocks, strict=True))
    filled = values != 0.0
    return sparse.csc_array((values[filled], (rows[filled], columns[filled])), shape=shape)


def _costs(stretch: Stretch, basis: _Basis) -> tuple[csc_array, FloatArray]:
    """Return the quadratic and the linear cost of the coefficients and of what exceeds the limits."""
    value, slope = basis.sparse(0), basis.sparse(1)
    lengths = np.gradient(stretch.arcs)
    weight = sparse.diags_array(lengths)
    lean = 2.0 * value.T @ weight @ value
    turn = TURN_COST * lean + 2.0 * TURNING_COST * slope.T @ weight @ slope
    excess = sparse.diags_array(SQUARED_EXCESS_COST * lengths * stretch.counted)
    linear = np.concatenate([
        *(2.0 * value.T @ (lengths * stretch.leans[:, axis]) for axis in range(2)),
        np.zeros(basis.count), EXCESS_COST * lengths * stretch.counted,
    ])  # fmt: skip
    return sparse.block_diag([lean, lean, turn, excess], format="csc"), linear
