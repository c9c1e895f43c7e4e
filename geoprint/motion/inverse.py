"""From poses to joint angles: one branch of the inverse and one turn about the nozzle for the whole stream.

A nozzle is round, so every pose may be turned about it; one constant turn (spin) is chosen for the stream, together
with one of the eight branches. All of them are judged on keyframes, the best are then followed along every pose.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError, ReachError, VerificationError
from geoprint.model import BoolArray, FloatArray, IntArray, JointPath, PoseStream, Robot
from geoprint.motion.configuration import configuration_data, singularity_distances
from geoprint.motion.kinematics import BRANCHES, JOINTS, Arm

# Below the minimum, a turn of the tool needs more than 11 times that turn of joints 4 and 6 (1 / sin): it is refused
# on deposit. The preferred angle [rad] bounds the factor by 4.
MINIMUM_WRIST_ANGLE = float(np.radians(5.0))
PREFERRED_WRIST_ANGLE = float(np.radians(15.0))

# Turns about the nozzle that are tried, and poses on which they are judged: 5 degrees is finer than any margin below.
SPINS = 72
KEYFRAMES = 300

# How many of the ways that hold at the keyframes are followed along the whole stream before giving up.
ATTEMPTS = 12

# Margins that are worth as much as the preferred wrist angle; more than ENOUGH times that is no gain.
COMFORTABLE_LIMIT = float(np.radians(10.0))
COMFORTABLE_ELBOW = float(np.radians(15.0))
COMFORTABLE_SHOULDER = 50.0
ENOUGH = 2.0

# Between poses farther apart than this [mm, rad] the straight move is sampled in between; a joint that turns by more
# than LARGEST_JUMP [rad] within such a step has flipped (at 5 degrees from the singularity it turns by 12 degrees).
STEP = 2.0
TURN_STEP = float(np.radians(1.0))
LARGEST_JUMP = float(np.radians(20.0))

# Largest difference between the commanded pose and forward kinematics of the solution [mm, rad].
POSITION_TOLERANCE = 1e-3
ROTATION_TOLERANCE = 1e-5


def reach(
    poses: PoseStream,
    arm: Arm,
    *,
    T_base_work: FloatArray,
    minimum_wrist_angle: float = MINIMUM_WRIST_ANGLE,
    preferred_wrist_angle: float = PREFERRED_WRIST_ANGLE,
) -> JointPath:
    """Find joint angles for every pose, continuous and within the limits of `arm.robot`.

    Each of `SPINS` turns and eight branches is worth its smallest margin over the keyframes: the wrist angle, the
    distance from joint limits and from the singularities of elbow and shoulder, each relative to what is comfortable.
    Among equals the one nearest to home wins. The straight moves between the poses are followed too, so that no flip
    hides between rows that are far apart. A joint that can turn more than once is unwound along the stream; of the
    whole turns that keep all of it inside the limits the nearest to home is taken.

    Args:
        poses: p poses in the work frame.
        arm: with its tool.
        T_base_work: (4, 4) where the part stands [mm].
        minimum_wrist_angle: smallest |q5| on deposit [rad].
        preferred_wrist_angle: |q5| [rad] that counts as comfortable when ways are compared.

    Returns:
        The joint path; its poses are turned by its spin.

    Raises:
        InputError: the stream is empty.
        ReachError: no way holds for the whole stream; it tells where the best one fails first.
        VerificationError: Pinocchio does not lead from a solution back to its pose.
    """
    if poses.count == 0:
        raise InputError("the pose stream is empty; there is nothing to reach: plan at least one run.")
    samples = _sample(poses, T_base_work)
    ways = _rank_ways(
        samples, arm, minimum_wrist_angle=minimum_wrist_angle, preferred_wrist_angle=preferred_wrist_angle
    )
    spin, branch, joints = _follow_first(ways, samples, arm, minimum_wrist_angle=minimum_wrist_angle)
    path = JointPath(
        poses=replace(poses, quaternions=_turned(poses.quaternions, spin)),
        joints=joints,
        configuration=configuration_data(joints, arm=arm),
        branch=branch,
        spin=spin,
        T_base_work=T_base_work,
    )
    _confirm(path, arm)
    return path


def tool_poses(poses: PoseStream, *, T_base_work: FloatArray) -> FloatArray:
    """Return (p, 4, 4) T_base_tool [mm] that a pose stream commands."""
    return T_base_work @ transforms.rigid(transforms.rotation_of(poses.quaternions), poses.tips)


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Samples:
    """Poses and places on the straight moves between them: s samples of p poses.

    Attributes:
        Ts_base_tool: (s, 4, 4) [mm], not turned.
        T_base_work: (4, 4).
        runs: (s,) run.
        deposit: (s,) whether material is laid on one side of the sample at least.
        starts: (p,) sample of each pose.
    """

    Ts_base_tool: FloatArray
    T_base_work: FloatArray
    runs: IntArray
    deposit: BoolArray
    starts: IntArray


def _sample(poses: PoseStream, T_base_work: FloatArray) -> _Samples:
    commanded = tool_poses(poses, T_base_work=T_base_work)
    start, end = commanded[:-1], commanded[1:]
    moves = np.linalg.norm(end[:, :3, 3] - start[:, :3, 3], axis=1)
    turns = transforms.rotation_angle(np.swapaxes(start[:, :3, :3], 1, 2) @ end[:, :3, :3])
    steps = np.maximum(np.ceil(np.maximum(moves / STEP, turns / TURN_STEP)), 1.0).astype(np.int64)
    starts = np.concatenate([[0], np.cumsum(steps)])
    rows = np.repeat(np.arange(poses.count - 1), steps)
    shares = (np.arange(rows.size) - starts[rows]) / steps[rows]
    between = transforms.interpolate_poses(start[rows], end[rows], shares)
    laid = poses.deposit.copy()
    laid[1:] |= poses.deposit[:-1] & (poses.runs[1:] == poses.runs[:-1])
    inside = np.where(shares > 0.0, poses.deposit[rows] & laid[rows + 1], laid[rows])
    return _Samples(
        Ts_base_tool=np.concatenate([between, commanded[-1:]]),
        T_base_work=T_base_work,
        runs=np.concatenate([poses.runs[rows], poses.runs[-1:]]),
        deposit=np.concatenate([inside, laid[-1:]]),
        starts=starts,
    )


def _rank_ways(
    samples: _Samples, arm: Arm, *, minimum_wrist_angle: float, preferred_wrist_angle: float
) -> list[tuple[float, int]]:
    """Return spins and branches to follow: those that hold at all keyframes, best first, or else the best one."""
    keys = _keyframes(samples)
    spins = 2.0 * np.pi * np.arange(SPINS) / SPINS
    Ts_base_tool = samples.Ts_base_tool[keys] @ _about_nozzle(spins)[:, None]
    joints = arm.solutions(Ts_base_tool.reshape(-1, 4, 4)).reshape(SPINS, keys.size, BRANCHES, JOINTS)
    joints = np.swapaxes(joints, 1, 2).reshape(SPINS * BRANCHES, keys.size, JOINTS)
    usable = _usable(joints, arm.robot, deposit=samples.deposit[keys], minimum_wrist_angle=minimum_wrist_angle)
    comfort = np.where(usable, _comfort(joints, arm, preferred_wrist_angle=preferred_wrist_angle), 0.0).min(axis=1)
    from_home = np.linalg.norm(transforms.wrapped(joints - arm.robot.home), axis=2).mean(axis=1)
    share = usable.mean(axis=1)
    # Turns missed between keyframes cost an attempt only: the winding is checked again along the whole stream.
    least, most = _whole_turns(np.unwrap(joints, axis=1), arm.robot)
    order = np.lexsort([from_home, -comfort, (least > most).any(axis=1), -share])
    hold = max(int((share == 1.0).sum()), 1)
    return [(float(spins[way // BRANCHES]), int(way % BRANCHES)) for way in order[: min(hold, ATTEMPTS)]]


def _keyframes(samples: _Samples) -> IntArray:
    """Return samples taken evenly, and those that reach farthest and lean most along each base axis."""
    count = len(samples.Ts_base_tool)
    evenly = np.linspace(0, count - 1, min(count, KEYFRAMES)).round().astype(np.int64)
    columns = np.hstack([samples.Ts_base_tool[:, :3, 3], samples.Ts_base_tool[:, :3, 2]])
    return np.unique(np.concatenate([evenly, columns.argmin(axis=0), columns.argmax(axis=0)]))


def _limit_margins(joints: FloatArray, robot: Robot) -> FloatArray:
    """Return how far each joint [rad] of (..., 6) is inside its limits, at the whole turn that suits it best."""
    centre, half = robot.limits.mean(axis=1), np.ptp(robot.limits, axis=1) / 2.0
    return half - np.abs(transforms.wrapped(joints - centre))


def _usable(joints: FloatArray, robot: Robot, *, deposit: BoolArray, minimum_wrist_angle: float) -> BoolArray:
    """Return which of (..., s, 6) solutions exist, keep the limits, and on deposit the wrist angle."""
    # Comparisons with NaN are false: a branch that does not exist is not usable.
    within = (_limit_margins(joints, robot) >= 0.0).all(axis=-1)
    return within & (~deposit | (np.abs(joints[..., 4]) >= minimum_wrist_angle))


def _comfort(joints: FloatArray, arm: Arm, *, preferred_wrist_angle: float) -> FloatArray:
    """Return the smallest margin of (..., 6) solutions: 1 is comfortable, more than `ENOUGH` is not counted."""
    shoulder, elbow, _ = np.abs(singularity_distances(joints.reshape(-1, JOINTS), arm=arm)).T
    margins = [
        _limit_margins(joints, arm.robot).min(axis=-1) / COMFORTABLE_LIMIT,
        np.abs(joints[..., 4]) / preferred_wrist_angle,
        (np.minimum(elbow, np.pi - elbow) / COMFORTABLE_ELBOW).reshape(joints.shape[:-1]),
        (shoulder / COMFORTABLE_SHOULDER).reshape(joints.shape[:-1]),
    ]
    return np.minimum(np.min(margins, axis=0), ENOUGH)


def _follow_first(
    ways: list[tuple[float, int]], samples: _Samples, arm: Arm, *, minimum_wrist_angle: float
) -> tuple[float, int, FloatArray]:
    """Return the first way that holds along all samples, and its joints (p, 6) at the poses; else its refusal."""
    refusals: list[ReachError] = []
    for spin, branch in ways:
        joints = arm.solutions(samples.Ts_base_tool @ _about_nozzle(np.array([spin]))[0])[:, branch]
        try:
            _refuse_unusable(joints, samples, arm, minimum_wrist_angle=minimum_wrist_angle)
            joints = np.unwrap(joints, axis=0)
            _refuse_jumps(joints, samples)
            joints = _wind(joints, samples, arm.robot)
        except ReachError as refusal:
            refusals.append(refusal)
            continue
        return spin, branch, joints[samples.starts]
    raise refusals[0]


def _refuse_unusable(joints: FloatArray, samples: _Samples, arm: Arm, *, minimum_wrist_angle: float) -> None:
    usable = _usable(joints, arm.robot, deposit=samples.deposit, minimum_wrist_angle=minimum_wrist_angle)
    if usable.all():
        return
    reached = int(usable[samples.starts].sum())
    first = int(np.argmin(usable))
    margins = _limit_margins(joints[first], arm.robot)
    if np.isnan(margins).any():
        found, allowed = _wrist_distance(samples.Ts_base_tool[first], arm)
        what = f"is out of reach: the wrist would be {found:.0f} mm from axis 2, allowed is {allowed[0]:.0f} to "
        what += f"{allowed[1]:.0f} mm"
    elif margins.min() < 0.0:
        joint = int(margins.argmin())
        found, low, high = np.degrees([joints[first, joint], *arm.robot.limits[joint]])
        what = f"needs joint {joint + 1} at {found:.2f} degrees, allowed is {low:.0f} to {high:.0f}"
    else:
        found, least = np.degrees([abs(joints[first, 4]), minimum_wrist_angle])
        what = (
            f"is near the wrist singularity: joint 5 at {found:.1f} degrees, at least {least:.1f} is needed on deposit"
        )
    raise _refusal(what, samples, at=first, reached=reached)


def _refuse_jumps(joints: FloatArray, samples: _Samples) -> None:
    jumps = np.abs(np.diff(joints, axis=0))
    if jumps.size == 0 or jumps.max() <= LARGEST_JUMP:
        return
    at, joint = np.unravel_index(int(jumps.argmax()), jumps.shape)
    found, allowed, wrist = np.degrees([jumps[at, joint], LARGEST_JUMP, abs(joints[at, 4])])
    what = f"flips the wrist: joint {joint + 1} turns by {found:.0f} degrees at once (joint 5 at {wrist:.1f}), "
    raise _refusal(f"{what}allowed are {allowed:.0f}", samples, at=int(at), reached=samples.starts.size)


def _wind(joints: FloatArray, samples: _Samples, robot: Robot) -> FloatArray:
    """Shift each joint of a continuous path by whole turns: inside its limits, as near to home as possible."""
    turn = 2.0 * np.pi
    low, high = joints.min(axis=0), joints.max(axis=0)
    least, most = _whole_turns(joints, robot)
    if (least > most).any():
        joint = int(np.argmax(least > most))
        first, last, *limits = np.degrees([low[joint], high[joint], *robot.limits[joint]])
        raise _refusal(
            f"is the end of a winding: joint {joint + 1} turns from {first:.0f} to {last:.0f} degrees along the runs, "
            f"allowed is {limits[0]:.0f} to {limits[1]:.0f}, at any whole turn",
            samples,
            at=int(np.abs(joints[:, joint] - joints[0, joint]).argmax()),
            reached=samples.starts.size,
        )
    shift = np.clip(np.rint((robot.home - (low + high) / 2.0) / turn), least, most)
    return joints + turn * shift


def _whole_turns(joints: FloatArray, robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Return the least and most whole turns (..., 6) that keep continuous joints (..., s, 6) inside the limits.

    Where least exceeds most, none does.
    """
    low, high = joints.min(axis=-2), joints.max(axis=-2)
    turn = 2.0 * np.pi
    return np.ceil((robot.limits[:, 0] - low) / turn), np.floor((robot.limits[:, 1] - high) / turn)


def _refusal(what: str, samples: _Samples, *, at: int, reached: int) -> ReachError:
    base = samples.Ts_base_tool[at, :3, 3]
    work = transforms.apply(transforms.inverse(samples.T_base_work), base[None])[0]
    run, poses = int(samples.runs[at]), samples.starts.size
    return ReachError(
        f"run {run} at {_place(work)} mm (base {_place(base)} mm) {what}; the best of {SPINS * BRANCHES} "
        f"turns and branches reaches {reached} of {poses} poses: move or turn the part, or take another nozzle.",
        run=run,
        work_mm=tuple(work.tolist()),
        base_mm=tuple(base.tolist()),
        share=reached / poses,
    )


def _place(position: FloatArray) -> str:
    return f"({', '.join(f'{value:.1f}' for value in position)})"


def _wrist_distance(T_base_tool: FloatArray, arm: Arm) -> tuple[float, tuple[float, float]]:
    """Return the distance of the wrist centre from axis 2 with the arm facing it, and its bounds [mm]."""
    lengths = arm.lengths
    T_base_flange = T_base_tool @ transforms.inverse(arm.T_flange_tool)
    x, y, z = T_base_flange[:3, 3] - lengths.c4 * T_base_flange[:3, 2]
    ahead = np.sqrt(max(x**2 + y**2 - lengths.b**2, 0.0)) - lengths.a1
    forearm = np.hypot(lengths.a2, lengths.c3)
    return float(np.hypot(ahead, z - lengths.c1)), (abs(lengths.c2 - forearm), lengths.c2 + forearm)


def _confirm(path: JointPath, arm: Arm) -> None:
    commanded = tool_poses(path.poses, T_base_work=path.T_base_work)
    found = arm.tool_poses(path.joints)
    off = np.linalg.norm(found[:, :3, 3] - commanded[:, :3, 3], axis=1)
    turned = transforms.rotation_angle(np.swapaxes(commanded[:, :3, :3], 1, 2) @ found[:, :3, :3])
    worst = int(np.argmax(np.maximum(off / POSITION_TOLERANCE, turned / ROTATION_TOLERANCE)))
    if off[worst] > POSITION_TOLERANCE or turned[worst] > ROTATION_TOLERANCE:
        raise VerificationError(
            f"run {path.poses.runs[worst]}, pose {worst}: forward kinematics misses the commanded pose by "
            f"{off[worst]:.3g} mm and {turned[worst]:.3g} rad, allowed are {POSITION_TOLERANCE:g} mm and "
            f"{ROTATION_TOLERANCE:g} rad; please report this as a defect of geoprint.",
            pose=worst,
            position_mm=float(off[worst]),
            rotation_rad=float(turned[worst]),
        )


def _about_nozzle(spins: FloatArray) -> FloatArray:
    """Return (k, 4, 4) turns about the tool's z axis."""
    return transforms.rigid(Rotation.from_rotvec(spins[:, None] * [0.0, 0.0, 1.0]).as_matrix(), np.zeros(3))


def _turned(quaternions: FloatArray, spin: float) -> FloatArray:
    """Return (k, 4) attitudes turned about the tool's z axis; their signs stay continuous along the stream."""
    attitudes = Rotation.from_quat(quaternions, scalar_first=True)
    return (attitudes * Rotation.from_rotvec([0.0, 0.0, spin])).as_quat(scalar_first=True)
