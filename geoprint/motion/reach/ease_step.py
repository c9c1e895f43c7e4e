"""One convex step of easing: small turns of the tool along a stretch of path that keep its joints within their limits.

The tool turns by d(s), a vector in its own frame: lean about x and y, turn about the nozzle. Its joints are then
q(s) + A(s) d(s), with A the columns of the inverse Jacobian that turn the tool about its tip. d is a cubic spline that
begins and ends as if nothing were turned. Sought is the least lean, squared along the length, at which no joint is
faster or more accelerated than allowed while the tip runs at its speed; where that cannot be had, what exceeds the
accelerations counts far more than the lean. That is a quadratic program with bands, cones for the lean, and one
solution [Boyd2004], which an interior point solver finds [Goulart2024].
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, final

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline, CubicSpline

from geoprint.model import BoolArray, FloatArray, frozen

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


def eased_turns(stretch: Stretch) -> FloatArray | None:
    """Return (k, 3) small turns of the tool in its own frame [rad], or None where the solver finds none.

    The first and the last are zero.
    """
    splines = _splines(stretch.arcs)
    if splines is None:
        return None
    count = splines[0].shape[1]
    moves, limits = _joint_rows(stretch, splines)
    solution = _solved(stretch, splines, moves=moves, limits=limits)
    if solution is None:
        return None
    return np.column_stack([splines[0] @ solution[axis * count : (axis + 1) * count] for axis in range(3)])


def _splines(arcs: FloatArray) -> tuple[csc_array, csc_array, csc_array] | None:
    """Return value, slope and curvature of the spline's free coefficients at each arc, (k, m) each."""
    length = float(arcs[-1])
    pieces = max(int(np.ceil(length / KNOT)), 1)
    free = pieces + DEGREE - 2 * CLAMPED
    if free < 1:
        return None
    knots = np.concatenate([np.zeros(DEGREE), np.linspace(0.0, length, pieces + 1), np.full(DEGREE, length)])
    basis = BSpline(knots, np.eye(pieces + DEGREE), DEGREE)
    kept = slice(CLAMPED, CLAMPED + free)
    value, slope, curvature = (sparse.csc_array(basis(arcs, order)[:, kept]) for order in range(3))
    return value, slope, curvature


def _joint_rows(
    stretch: Stretch, splines: tuple[csc_array, csc_array, csc_array]
) -> tuple[tuple[csc_array, csc_array], tuple[FloatArray, FloatArray]]:
    """Return what turns do to bends and rates of the joints, by their limits, and what these are without."""
    value, slope, curvature = splines
    path = CubicSpline(stretch.arcs, stretch.joints)
    moved = CubicSpline(stretch.arcs, stretch.moved)
    M, dM, ddM = (np.asarray(moved(stretch.arcs, order)) for order in range(3))
    bent: list[csc_array] = []
    fast: list[csc_array] = []
    bends: list[FloatArray] = []
    rates: list[FloatArray] = []
    for joint in range(stretch.joints.shape[1]):
        bend, rate = path(stretch.arcs, 2)[:, joint], path(stretch.arcs, 1)[:, joint]
        by_axis = [
            sparse.diags_array(M[:, joint, axis]) @ curvature
            + sparse.diags_array(2.0 * dM[:, joint, axis]) @ slope
            + sparse.diags_array(ddM[:, joint, axis]) @ value
            for axis in range(3)
        ]
        bent.append(sparse.csc_array(sparse.hstack(by_axis)) / stretch.bends[joint])
        bends.append(bend / stretch.bends[joint])
        if np.abs(rate).max() > FAST_SHARE * stretch.rates[joint]:
            by_axis = [
                sparse.diags_array(M[:, joint, axis]) @ slope + sparse.diags_array(dM[:, joint, axis]) @ value
                for axis in range(3)
            ]
            fast.append(sparse.csc_array(sparse.hstack(by_axis)) / stretch.rates[joint])
            rates.append(rate / stretch.rates[joint])
    nothing = sparse.csc_array((0, 3 * value.shape[1]))
    return (
        (sparse.vstack(bent, format="csc"), sparse.vstack([nothing, *fast], format="csc")),
        (np.concatenate(bends), np.concatenate([np.empty(0), *rates])),
    )


def _solved(
    stretch: Stretch,
    splines: tuple[csc_array, csc_array, csc_array],
    *,
    moves: tuple[csc_array, csc_array],
    limits: tuple[FloatArray, FloatArray],
) -> FloatArray | None:
    """Return the coefficients of the turns, of each axis in turn."""
    # Late, as it is needed by few parts; by name, as it has no types.
    clarabel = import_module("clarabel")
    (bent, fast), (bends, rates) = moves, limits
    count, poses = bent.shape[1], len(stretch.arcs)
    excess = sparse.vstack([sparse.eye_array(poses)] * (bent.shape[0] // poses), format="csc")
    without = sparse.csc_array((fast.shape[0], poses))
    linear = sparse.vstack([
        sparse.hstack([bent, -excess]), sparse.hstack([-bent, -excess]),
        sparse.hstack([fast, without]), sparse.hstack([-fast, without]),
        sparse.hstack([sparse.csc_array((poses, count)), -sparse.eye_array(poses)]),
    ])  # fmt: skip
    bounds = np.concatenate(
        [1.0 - bends, 1.0 + bends, 1.0 - np.minimum(rates, 1.0), 1.0 + np.maximum(rates, -1.0), np.zeros(poses)]
    )
    cone, cone_bounds = _lean_cones(stretch, splines[0])
    every = sparse.vstack([linear, cone], format="csc")
    quadratic, slope = _costs(stretch, splines)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = GAP
    settings.tol_feas = FEASIBILITY
    cones = [clarabel.NonnegativeConeT(linear.shape[0]), *[clarabel.SecondOrderConeT(3)] * poses]
    found = clarabel.DefaultSolver(
        sparse.csc_matrix(sparse.triu(quadratic)), slope, sparse.csc_matrix(every),
        np.concatenate([bounds, cone_bounds]), cones, settings,
    ).solve()  # fmt: skip
    if str(found.status) not in ("Solved", "AlmostSolved"):
        return None
    return np.asarray(found.x)[:count]


def _lean_cones(stretch: Stretch, value: csc_array) -> tuple[csc_array, FloatArray]:
    """Return the rows that keep each lean within its cone: three a pose, its radius first."""
    poses, count = value.shape
    order = np.arange(3 * poses).reshape(3, poses).T.ravel()
    nothing = sparse.csc_array((poses, count))
    beside = sparse.csc_array((3 * poses, count + poses))
    rows = sparse.block_array([[nothing, nothing], [-value, None], [None, -value]])
    bounds = np.concatenate([stretch.largest, stretch.leans[:, 0], stretch.leans[:, 1]])
    return sparse.csc_array(sparse.hstack([rows, beside]).tocsr()[order]), bounds[order]


def _costs(stretch: Stretch, splines: tuple[csc_array, csc_array, csc_array]) -> tuple[csc_array, FloatArray]:
    """Return the quadratic and the linear cost of the coefficients and of what exceeds the limits."""
    value, slope, _ = splines
    lengths = np.gradient(stretch.arcs)
    weight = sparse.diags_array(lengths)
    lean = 2.0 * value.T @ weight @ value
    turn = TURN_COST * lean + 2.0 * TURNING_COST * slope.T @ weight @ slope
    excess = sparse.diags_array(SQUARED_EXCESS_COST * lengths * stretch.counted)
    linear = np.concatenate([
        *(2.0 * value.T @ (lengths * stretch.leans[:, axis]) for axis in range(2)),
        np.zeros(value.shape[1]), EXCESS_COST * lengths * stretch.counted,
    ])  # fmt: skip
    return sparse.block_diag([lean, lean, turn, excess], format="csc"), linear
