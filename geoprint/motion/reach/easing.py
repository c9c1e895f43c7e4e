"""Attitudes eased: the nozzle leans and turns a little where its joints could not hold the speed of the tip else.

The smoothed normal is what the nozzle aims at. Where following it takes more speed or acceleration of a joint than
there is, the tool is turned ahead of the bend and in it (`ease_step`), by no more than it may lean, and so that the
nozzle keeps its room and the arm its distance. Everything else stays as it is, the ends of the runs too; the branch
stays, and what is checked after this is checked as ever.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import final

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import BoolArray, Eased, FloatArray, IntArray, JointPath, PoseStream, frozen
from geoprint.motion.arm import Arm, configuration_data, tilts, wrist_angles
from geoprint.motion.reach.ease_step import Stretch, eased_turns
from geoprint.motion.reach.following import LARGEST_JUMP
from geoprint.motion.reach.lean_room import CONE_MARGIN, NozzleRoom
from geoprint.motion.reach.pose_samples import tool_poses
from geoprint.surfaces import arc_lengths
from geoprint.threads import each_of

# Joints that use up more than this share of a limit are eased ...
BUSY_SHARE = 0.98
# ... to this one: what is solved is linear, and the motion between the poses is not.
WANTED_SHARE = 0.94
# Where the bend of the tip alone takes this share of an acceleration, and so far about it [mm], no turn of the tool
# mends what is missing.
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


def eased(path: JointPath, arm: Arm, *, easing: Easing, minimum_wrist_angle: float) -> JointPath:
    """Return a joint path whose joints hold the speed of the tip along more of its deposits.

    Args:
        path: p poses with their joints.
        arm: with its tool; its inverse has a closed form.
        easing: what is wanted and what is allowed.
        minimum_wrist_angle: smallest |q5| where it is eased [rad].

    Returns:
        The same poses, turned where that helps; stretches in which it does not, or in which the nozzle would lack room
        that it had, are as they were.
    """
    windows = _windows(path, arm, easing=easing)
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
    """Return the rows of a run that lay material, each place once, and their arc lengths [mm]."""
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
    """Return the poses of a window eased, all but their configuration data; None where it gains too little.

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
        configuration=configuration_data(joints, arm=arm),
        leans=leans,
        rotations=rotations,
        eased=tuple(_told(path, window, part, arm, speed=speed) for window, part in parts),
    )


def _told(path: JointPath, window: _Window, part: JointPath, arm: Arm, *, speed: float) -> Eased:
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
    """Return where the nozzle lacks room, of places that lay material."""
    poses = tool_poses(path.poses, T_base_work=path.T_base_work)[places]
    return easing.room.lacking(poses, deposit=np.ones(places.size, dtype=np.bool_))
