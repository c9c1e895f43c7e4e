"""From poses to joint angles: one branch of the inverse and one turn about the nozzle for the whole stream.

A nozzle is round, so every pose may be turned about it; one constant turn (spin) is chosen for the stream, together
with one of the eight branches. All of them are judged on keyframes, the best are then followed along every pose.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError, VerificationError
from geoprint.model import BoolArray, FloatArray, JointPath, PoseStream
from geoprint.motion.configuration import configuration_data, singularity_distances, wrist_angles
from geoprint.motion.following import Followed, about_nozzle, follow, whole_turns
from geoprint.motion.kinematics import BRANCHES, JOINTS, Arm
from geoprint.motion.margins import MINIMUM_WRIST_ANGLE, Margin, limit_margins, smallest_margin, usable
from geoprint.motion.pose_samples import PoseSamples, keyframes, sample_poses, tool_poses
from geoprint.motion.reach_map import ReachMap, mapped
from geoprint.motion.steps import tip_ways

# An angle of joint 5 [rad] at which a turn of the tool needs no more than 4 times that turn of joints 4 and 6.
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

# Samples asked at a time whether any way serves them: about 100 MB of arrays.
SAMPLES_AT_A_TIME = 500

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
        ReachError: no way holds for the whole stream; it tells what the best one loses, and where it fails first.
        VerificationError: Pinocchio does not lead from a solution back to its pose.
    """
    samples = _samples(poses, T_base_work)
    way = _best_way(samples, arm, minimum_wrist_angle=minimum_wrist_angle, preferred_wrist_angle=preferred_wrist_angle)
    if not way.complete:
        found = _mapped(way, samples, arm, poses=poses, minimum_wrist_angle=minimum_wrist_angle)
        raise found.refusal(ways=SPINS * BRANCHES)
    joints = way.joints[samples.starts]
    path = JointPath(
        poses=replace(poses, quaternions=_turned(poses.quaternions, way.spin)),
        joints=joints,
        configuration=configuration_data(joints, arm=arm),
        branch=way.branch,
        spin=way.spin,
        T_base_work=T_base_work,
    )
    _confirm(path, arm)
    return path


def reach_map(
    poses: PoseStream, arm: Arm, *, T_base_work: FloatArray, minimum_wrist_angle: float = MINIMUM_WRIST_ANGLE
) -> ReachMap:
    """Say of every pose whether the way that `reach` takes, or else the best one, serves it, and why not.

    Args:
        poses: p poses in the work frame.
        arm: with its tool.
        T_base_work: (4, 4) where the part stands [mm].
        minimum_wrist_angle: smallest |q5| on deposit [rad].

    Returns:
        The map; complete exactly where `reach` succeeds.

    Raises:
        InputError: the stream is empty.
    """
    samples = _samples(poses, T_base_work)
    way = _best_way(samples, arm, minimum_wrist_angle=minimum_wrist_angle, preferred_wrist_angle=PREFERRED_WRIST_ANGLE)
    return _mapped(way, samples, arm, poses=poses, minimum_wrist_angle=minimum_wrist_angle)


def reach_margin(poses: PoseStream, arm: Arm, *, T_base_work: FloatArray) -> Margin:
    """Return the smallest margin, along the whole stream, of the way that `reach` takes, or else of the best one.

    Args:
        poses: p poses in the work frame.
        arm: with its tool.
        T_base_work: (4, 4) where the part stands [mm].

    Returns:
        The margin; negative where a pose is refused. Flips and windings do not count.

    Raises:
        InputError: the stream is empty.
    """
    samples = _samples(poses, T_base_work)
    way = _best_way(samples, arm, minimum_wrist_angle=MINIMUM_WRIST_ANGLE, preferred_wrist_angle=PREFERRED_WRIST_ANGLE)
    return smallest_margin(way.joints, arm, deposit=samples.deposit)


def _samples(poses: PoseStream, T_base_work: FloatArray) -> PoseSamples:
    if poses.count == 0:
        raise InputError("the pose stream is empty; there is nothing to reach: plan at least one run.")
    return sample_poses(poses, T_base_work=T_base_work)


def _best_way(samples: PoseSamples, arm: Arm, *, minimum_wrist_angle: float, preferred_wrist_angle: float) -> Followed:
    """Return the first way that holds along all samples, or else the one that fails at fewest."""
    ways = _rank_ways(
        samples, arm, minimum_wrist_angle=minimum_wrist_angle, preferred_wrist_angle=preferred_wrist_angle
    )
    tried: list[Followed] = []
    for spin, branch in ways:
        way = follow(samples, arm, spin=spin, branch=branch, minimum_wrist_angle=minimum_wrist_angle)
        if way.complete:
            return way
        tried.append(way)
    return min(tried, key=lambda way: np.count_nonzero(way.failures.reasons))


def _mapped(
    way: Followed, samples: PoseSamples, arm: Arm, *, poses: PoseStream, minimum_wrist_angle: float
) -> ReachMap:
    steps = np.where(poses.laid, tip_ways(poses), 0.0) / 2.0
    return mapped(
        way.failures,
        samples,
        servable=_servable(way, samples, arm, minimum_wrist_angle=minimum_wrist_angle),
        lengths=np.append(steps, 0.0) + np.append(0.0, steps),
        branch=way.branch,
        spin=way.spin,
    )


def _servable(way: Followed, samples: PoseSamples, arm: Arm, *, minimum_wrist_angle: float) -> BoolArray:
    """Return for each sample whether any branch and turn about the nozzle serves it by itself."""
    failing = np.flatnonzero(way.failures.reasons)
    servable = np.ones(len(samples.deposit), dtype=bool)
    for first in range(0, failing.size, SAMPLES_AT_A_TIME):
        rows = failing[first : first + SAMPLES_AT_A_TIME]
        joints = _all_ways(samples.Ts_base_tool[rows], arm)
        holds = usable(joints, arm, deposit=samples.deposit[rows], minimum_wrist_angle=minimum_wrist_angle)
        servable[rows] = holds.any(axis=0)
    return servable


def _spins() -> FloatArray:
    return 2.0 * np.pi * np.arange(SPINS) / SPINS


def _all_ways(Ts_base_tool: FloatArray, arm: Arm) -> FloatArray:
    """Return (SPINS * BRANCHES, k, 6) joint angles [rad] of (k, 4, 4) poses."""
    turned = Ts_base_tool @ about_nozzle(_spins())[:, None]
    joints = arm.solutions(turned.reshape(-1, 4, 4)).reshape(SPINS, len(Ts_base_tool), BRANCHES, JOINTS)
    return np.swapaxes(joints, 1, 2).reshape(SPINS * BRANCHES, len(Ts_base_tool), JOINTS)


def _rank_ways(
    samples: PoseSamples, arm: Arm, *, minimum_wrist_angle: float, preferred_wrist_angle: float
) -> list[tuple[float, int]]:
    """Return spins and branches to follow: those that hold at all keyframes, best first, or else the best one."""
    keys = keyframes(samples.Ts_base_tool, count=KEYFRAMES)
    joints = _all_ways(samples.Ts_base_tool[keys], arm)
    holds = usable(joints, arm, deposit=samples.deposit[keys], minimum_wrist_angle=minimum_wrist_angle)
    comfort = np.where(holds, _comfort(joints, arm, preferred_wrist_angle=preferred_wrist_angle), 0.0).min(axis=1)
    from_home = np.linalg.norm(transforms.wrapped(joints - arm.robot.home), axis=2).mean(axis=1)
    share = holds.mean(axis=1)
    # Turns missed between keyframes cost an attempt only: the winding is checked again along the whole stream.
    least, most = whole_turns(np.unwrap(joints, axis=1), arm.robot)
    order = np.lexsort([from_home, -comfort, (least > most).any(axis=1), -share])
    hold = max(int((share == 1.0).sum()), 1)
    return [(float(_spins()[way // BRANCHES]), int(way % BRANCHES)) for way in order[: min(hold, ATTEMPTS)]]


def _comfort(joints: FloatArray, arm: Arm, *, preferred_wrist_angle: float) -> FloatArray:
    """Return the smallest margin of (..., 6) solutions: 1 is comfortable, more than `ENOUGH` is not counted."""
    shoulder, elbow, _ = np.abs(singularity_distances(joints.reshape(-1, JOINTS), arm=arm)).T
    margins = [
        limit_margins(joints, arm.robot).min(axis=-1) / COMFORTABLE_LIMIT,
        wrist_angles(joints, arm=arm) / preferred_wrist_angle,
        (np.minimum(elbow, np.pi - elbow) / COMFORTABLE_ELBOW).reshape(joints.shape[:-1]),
        (shoulder / COMFORTABLE_SHOULDER).reshape(joints.shape[:-1]),
    ]
    return np.minimum(np.min(margins, axis=0), ENOUGH)


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


def _turned(quaternions: FloatArray, spin: float) -> FloatArray:
    """Return (k, 4) attitudes turned about the tool's z axis; their signs stay continuous along the stream."""
    attitudes = Rotation.from_quat(quaternions, scalar_first=True)
    return (attitudes * Rotation.from_rotvec([0.0, 0.0, spin])).as_quat(scalar_first=True)
