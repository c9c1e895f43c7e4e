"""Attitudes eased: the nozzle leans and turns a little where its joints could not hold the speed of the tip else.

The smoothed normal is what the nozzle aims at. Where following it takes more speed or acceleration of a joint than
there is, the tool is turned ahead of the bend and in it (`ease_step`), by no more than it may lean, and so that the
nozzle keeps its room and the arm its distance. Everything else stays as it is, the ends of the runs too; the branch
stays, and what is checked after this is checked as ever.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, TypeAlias, final

import numpy as np
from scipy import sparse
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.geometry import arc_lengths, whole_steps
from geoprint.model import BoolArray, Eased, FloatArray, IntArray, JointPath, PoseStream, frozen
from geoprint.robot.arm import Arm, tilts, wrist_angles
from geoprint.robot.reach.costs import LARGEST_JUMP
from geoprint.robot.reach.keyframes import tool_poses
from geoprint.robot.reach.lean_room import CONE_MARGIN, NozzleRoom
from geoprint.threads import each_of

if TYPE_CHECKING:
    from scipy.sparse import csc_array


# One convex step of easing: small turns of the tool along a stretch of path that keep its joints within their
# limits.
#
# The tool turns by d(s), a vector in its own frame: lean about x and y, turn about the nozzle. Its joints are then
# q(s) + A(s) d(s), with A the columns of the inverse Jacobian that turn the tool about its tip. d is a cubic spline
# that begins and ends as if nothing were turned. Sought is the least lean, squared along the length, at which no
# joint is faster or more accelerated than allowed while the tip runs at its speed; where that cannot be had, what
# exceeds the accelerations counts far more than the lean. That is a quadratic program with bands, cones for the
# lean, and one solution [Boyd2004], which an interior point solver finds [Goulart2024].


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
# Asked about (p,) which poses of a stream are final; raises where these cannot be printed.
Refuse: TypeAlias = Callable[[PoseStream, BoolArray], None]
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
    pieces = int(whole_steps(length, step=KNOT))
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


# Joints that use up more than this share of a limit are eased ...
BUSY_SHARE = 0.98
# ... to this one: what is solved is linear, and the motion between the poses is not.
WANTED_SHARE = 0.94
# Where the bend of the tip alone takes this share of an acceleration, and so far about it [mm], no turn of the tool
# fixes what is missing.
BENT_SHARE = 0.6
BENT_REACH = 1.0
# So far before and behind such a place the tool may turn [mm].
AHEAD = 12.0
# Stretches shorter than this [mm] leave no room to turn and to turn back.
SHORTEST = 8.0
# A stretch is turned where that takes away this share of what its joints demand beyond their limits, at least.
LEAST_GAIN = 0.3
# A step is linear in the turn: so many are taken, each from where the one before led.
STEPS = 3
# What is eased stays so far inside the limits of the joints [rad] where it was: the dry run, high above the part, needs
# a little more.
LIMIT_MARGIN = float(np.radians(5.0))
# Rows closer than this [mm] are one place.
COINCIDENT = 1e-6


@final
@frozen
class Easing:
    """How attitudes may be eased.

    Attributes:
        speed: set speed of the tip [mm/s].
        largest_lean: between nozzle and surface normal [rad].
        room: what the nozzle must not touch.
        arm_touches: tells of (k, 6) joints [rad] (k,) whether a link comes too close to something; no proof.
        left_out: runs whose attitudes stay as they are.
    """

    speed: float
    largest_lean: float
    room: NozzleRoom
    arm_touches: Callable[[FloatArray], BoolArray]
    left_out: tuple[int, ...] = ()


@final
@frozen
class _Window:
    """Poses of one run that are turned together: k places.

    Attributes:
        rows: of the path.
        places: (k,) rising, the first of the rows at each place, counted from the first row.
        arcs: (k,) rising from 0 [mm].
        counted: (k,) whether a place is to keep the limits of the joints.
    """

    rows: slice
    places: IntArray
    arcs: FloatArray
    counted: BoolArray


def eased(
    path: JointPath,
    arm: Arm,
    *,
    easing: Easing,
    minimum_wrist_angle: float,
    refuse: Refuse | None = None,
) -> JointPath:
    """Return a joint path whose joints hold the speed of the tip along more of its deposits.

    Args:
        path: p poses with their joints.
        arm: with its tool; its inverse has a closed form.
        easing: what is wanted and what is allowed.
        minimum_wrist_angle: smallest |q5| where it is eased [rad].
        refuse: asked before anything is eased, about the poses that stay as they are.

    Returns:
        The same poses, turned where that helps; stretches in which it does not, or in which the nozzle would lack room
        that it had, are as they were.
    """
    windows = _windows(path, arm, easing=easing)
    stays = np.ones(path.poses.count, dtype=np.bool_)
    for window in windows:
        stays[window.rows] = False
    if refuse is not None:
        refuse(path.poses, stays)
    found = each_of(
        lambda window: _eased_part(path, arm, window, easing=easing, minimum_wrist_angle=minimum_wrist_angle), windows
    )
    parts = [(window, part) for window, part in zip(windows, found, strict=True) if part is not None]
    parts = _clear(parts, path, easing=easing)
    return _joined(path, parts, arm, speed=easing.speed) if parts else path


def _clear(
    parts: list[tuple[_Window, JointPath]], path: JointPath, *, easing: Easing
) -> list[tuple[_Window, JointPath]]:
    """Return the parts in which no link of the arm comes too close to something from which it kept clear before."""
    if not parts:
        return parts
    touching = np.split(
        easing.arm_touches(np.concatenate([part.joints for _, part in parts])),
        np.cumsum([part.poses.count for _, part in parts])[:-1],
    )
    return [
        (window, part)
        for (window, part), now in zip(parts, touching, strict=True)
        if not now.any() or easing.arm_touches(path.joints[window.rows]).any()
    ]


def demands(arcs: FloatArray, joints: FloatArray, *, speed: float, arm: Arm) -> FloatArray:
    """Return the (k,) largest share of a joint's limits that poses at (k,) arcs [mm] use up at a speed of the tip.

    As the strain of a motion it is a share of time: of the speed, or the root of the share of the acceleration.
    """
    from scipy.interpolate import CubicSpline

    path = CubicSpline(arcs, joints)
    rates = np.abs(path(arcs, 1)) * speed / arm.robot.speeds
    bends = np.sqrt(np.abs(path(arcs, 2)) * speed**2 / arm.robot.accelerations)
    return np.asarray(np.maximum(rates, bends).max(axis=1))


def _windows(path: JointPath, arm: Arm, *, easing: Easing) -> list[_Window]:
    """Return the stretches that are eased: places in which joints are busy, and the path about them."""
    found: list[_Window] = []
    for run in np.unique(path.poses.runs).tolist():
        rows, arcs = _places(path.poses, run)
        if run in easing.left_out or rows.size < 4 or arcs[-1] < SHORTEST:
            continue
        bent = _bent(path, arm, rows, arcs, speed=easing.speed)
        busy = demands(arcs, path.joints[rows], speed=easing.speed, arm=arm) > BUSY_SHARE
        for first, last in _around(arcs, busy & ~bent):
            span = slice(first, last + 1)
            begin = int(rows[first])
            found.append(
                _Window(
                    slice(begin, int(rows[last]) + 1), rows[span] - begin, arcs[span] - arcs[first], counted=~bent[span]
                )
            )
    return found


def _bent(path: JointPath, arm: Arm, rows: IntArray, arcs: FloatArray, *, speed: float) -> BoolArray:
    """Return at which poses, and next to which, the bend of the tip alone takes most of what the joints have."""
    from scipy.interpolate import CubicSpline

    pulls = CubicSpline(arcs, path.poses.tips[rows])(arcs, 2) @ path.T_base_work[:3, :3].T * speed**2
    pulls = np.concatenate([pulls, np.zeros_like(pulls)], axis=1)[:, :, None]
    found = np.abs(np.linalg.solve(arm.jacobians(path.joints[rows]), pulls)[:, :, 0])
    bent: FloatArray = arcs[(found > BENT_SHARE * arm.robot.accelerations).any(axis=1)]
    at = np.searchsorted(bent, arcs)
    around: FloatArray = np.pad(bent, 1, constant_values=np.inf)
    return np.asarray(np.minimum(np.abs(around[at] - arcs), np.abs(around[at + 1] - arcs)) < BENT_REACH)


def _places(poses: PoseStream, run: int) -> tuple[IntArray, FloatArray]:
    """Return the rows of a run that deposit material, each place once, and their arc lengths [mm]."""
    rows = np.flatnonzero((poses.runs == run) & poses.deposit)
    if rows.size == 0:
        return rows, np.empty(0)
    arcs = arc_lengths(poses.tips[rows])
    apart = np.concatenate([[True], np.diff(arcs) > COINCIDENT])
    return rows[apart], arcs[apart]


def _around(arcs: FloatArray, busy: BoolArray) -> list[tuple[int, int]]:
    """Return first and last place of the stretches about busy places; those that touch are one."""
    found: list[tuple[int, int]] = []
    firsts = np.searchsorted(arcs, arcs[busy] - AHEAD).tolist()
    lasts = np.minimum(np.searchsorted(arcs, arcs[busy] + AHEAD), arcs.size - 1).tolist()
    for first, last in zip(firsts, lasts, strict=True):
        if found and first <= found[-1][1]:
            found[-1] = (found[-1][0], last)
        else:
            found.append((first, last))
    return found


def _eased_part(
    path: JointPath, arm: Arm, window: _Window, *, easing: Easing, minimum_wrist_angle: float
) -> JointPath | None:
    """Return the poses of a window eased; None where it gains too little.

    Of the steps that gain enough, and whose nozzle keeps its room, the one that leaves least; of equal ones the first.
    """
    before = now = path.between(window.rows.start, window.rows.stop)
    enough = (1.0 - LEAST_GAIN) * _excess(before, arm, window, speed=easing.speed)
    steps: list[tuple[float, JointPath]] = []
    for _ in range(STEPS):
        turns = eased_turns(_stretch(now, arm, window, easing=easing))
        turned = None if turns is None else _turned(now, arm, window, turns, minimum_wrist_angle=minimum_wrist_angle)
        if turned is None:
            break
        now = turned
        left = _excess(now, arm, window, speed=easing.speed)
        # Where nothing is left, no later step leaves less.
        if left == 0.0 < enough and _permitted(now, before, window, easing=easing):
            return now
        if 0.0 < left < enough:
            steps.append((left, now))
    # The room is looked at last, because it costs the most.
    ordered = (step for _, step in sorted(steps, key=lambda each: each[0]))
    return next((step for step in ordered if _permitted(step, before, window, easing=easing)), None)


def _joined(path: JointPath, parts: list[tuple[_Window, JointPath]], arm: Arm, *, speed: float) -> JointPath:
    """Return a path with the poses of some windows replaced."""
    quaternions, joints, leans, rotations = (
        array.copy() for array in (path.poses.quaternions, path.joints, path.leans, path.rotations)
    )
    for window, part in parts:
        quaternions[window.rows] = part.poses.quaternions
        joints[window.rows], leans[window.rows], rotations[window.rows] = part.joints, part.leans, part.rotations
    return replace(
        path,
        poses=replace(path.poses, quaternions=transforms.same_sign(quaternions)),
        joints=joints,
        leans=leans,
        rotations=rotations,
        eased=tuple(_stated(path, window, part, arm, speed=speed) for window, part in parts),
    )


def _stated(path: JointPath, window: _Window, part: JointPath, arm: Arm, *, speed: float) -> Eased:
    """Return what easing the poses of a window bought."""
    first = window.rows.start
    before, after = (_lacking(joints, arm, window, speed=speed) for joints in (path.joints[window.rows], part.joints))
    length = float(window.arcs[-1])
    return Eased(int(path.poses.runs[first]), float(path.poses.arcs[first]), length, lacking=before, left=after)


def _lacking(joints: FloatArray, arm: Arm, window: _Window, *, speed: float) -> float:
    """Return the length of a window on which joints (n, 6) do not hold the speed of the tip [mm]."""
    demand = demands(window.arcs, joints[window.places], speed=speed, arm=arm)
    return float(np.gradient(window.arcs)[demand > 1.0].sum())


def _excess(path: JointPath, arm: Arm, window: _Window, *, speed: float) -> float:
    """Return the length of a window by what its joints demand above their limits, at the places that count [mm]."""
    demand = demands(window.arcs, path.joints[window.places], speed=speed, arm=arm)
    return float(np.gradient(window.arcs)[window.counted] @ np.maximum(demand[window.counted] - 1.0, 0.0))


def _stretch(path: JointPath, arm: Arm, window: _Window, *, easing: Easing) -> Stretch:
    rows = window.places
    joints, attitudes = path.joints[rows], transforms.rotation_of(path.poses.quaternions[rows])
    in_base = path.T_base_work[:3, :3] @ attitudes
    twists = np.concatenate([np.zeros_like(in_base), in_base], axis=1)
    moved = np.linalg.solve(arm.jacobians(joints), twists).astype(np.float64)
    axes, normals = -attitudes[:, :, 2], path.poses.normals[rows]
    across = np.cross(normals, axes)
    sine = np.linalg.norm(across, axis=1, keepdims=True)
    angle = np.arctan2(sine[:, 0], np.einsum("ij,ij->i", axes, normals))
    leans = across * (angle[:, None] / np.maximum(sine, np.finfo(np.float64).tiny))
    return Stretch(
        arcs=window.arcs,
        joints=joints,
        moved=moved,
        leans=np.einsum("kji,kj->ki", attitudes, leans)[:, :2],
        largest=np.maximum(easing.largest_lean - CONE_MARGIN, angle),
        counted=window.counted,
        rates=WANTED_SHARE * arm.robot.speeds / easing.speed,
        bends=WANTED_SHARE**2 * arm.robot.accelerations / easing.speed**2,
    )


def _turned(
    path: JointPath, arm: Arm, window: _Window, turns: FloatArray, *, minimum_wrist_angle: float
) -> JointPath | None:
    """Return the poses of a window turned in the tool's frame; None where the arm does not follow on its branch."""
    # Poses in one place turn together.
    every = turns[np.searchsorted(window.places, np.arange(path.poses.count), side="right") - 1]
    attitudes = Rotation.from_quat(path.poses.quaternions, scalar_first=True)
    poses = replace(path.poses, quaternions=(attitudes * Rotation.from_rotvec(every)).as_quat(scalar_first=True))
    found = arm.solutions(tool_poses(poses, T_base_work=path.T_base_work))[:, path.branch]
    joints = path.joints + transforms.wrapped(found - path.joints)
    inside, before = (
        np.minimum(each - arm.robot.limits[:, 0], arm.robot.limits[:, 1] - each) for each in (joints, path.joints)
    )
    follows = (
        np.isfinite(found).all()
        and (inside >= np.minimum(before, LIMIT_MARGIN)).all()
        and np.abs(np.diff(joints, axis=0)).max() <= LARGEST_JUMP
        and wrist_angles(joints, arm=arm).min() >= minimum_wrist_angle
    )
    if not follows:
        return None
    leans, rotations = _as_added(path, every)
    return replace(path, poses=poses, joints=joints, leans=leans, rotations=rotations)


def _as_added(path: JointPath, turns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return leans and turns about the nozzle of poses that are turned in the tool's frame."""
    lean = np.column_stack([path.leans, np.zeros(path.poses.count)])
    about = np.column_stack([np.zeros((path.poses.count, 2)), path.rotations])
    whole = Rotation.from_rotvec(lean) * Rotation.from_rotvec(about) * Rotation.from_rotvec(turns)
    leaned = Rotation.from_matrix(transforms.smallest_rotation(np.array([0.0, 0.0, 1.0]), whole.as_matrix()[:, :, 2]))
    left = (leaned.inv() * whole).as_rotvec()[:, 2]
    return leaned.as_rotvec()[:, :2], path.rotations + transforms.wrapped(left - path.rotations)


def _permitted(path: JointPath, before: JointPath, window: _Window, *, easing: Easing) -> bool:
    """Say whether the nozzle leans no more than it may or did, and lacks no room that it had."""
    leaning = tilts(path.poses) > np.maximum(easing.largest_lean, tilts(before.poses))
    if leaning[window.places].any():
        return False
    lacking = np.flatnonzero(_lacking_room(path, window.places, easing=easing))
    return not lacking.size or bool(_lacking_room(before, window.places[lacking], easing=easing).all())


def _lacking_room(path: JointPath, places: IntArray, *, easing: Easing) -> BoolArray:
    """Return where the nozzle lacks room, of places that deposit material."""
    poses = tool_poses(path.poses, T_base_work=path.T_base_work)[places]
    return easing.room.lacking(poses, deposit=np.ones(places.size, dtype=np.bool_))
