"""The arm: its forward kinematics, the inverse that its kind allows, and the freedom of a round nozzle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import cos, sin
from typing import NamedTuple, final

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.kernels import inlined, njit, uncounted, writable
from geoprint.model import FloatArray, PoseStream, Robot
from geoprint.robot.arm.confirmation import AGREEMENT, confirm, in_metres
from geoprint.robot.arm.ortho_parallel import BRANCHES, JOINTS, OrthoParallel, Screws, ortho_parallel
from geoprint.robot.arm.three_parallel import ThreeParallel, three_parallel
from geoprint.robot.arm.urdf import chain_of, urdf_of

# The chain of an arm's joints, from the base to the tool, for many joint vectors at once.


@uncounted
def chain_frames(
    joints: FloatArray, origins: FloatArray, axes: FloatArray, T_end_tool: FloatArray, frames: FloatArray
) -> int:
    """Fill in where the links and the tool are; return how many rows were filled.

    Args:
        joints: (k, 6) angles [rad].
        origins: (6, 4, 4) frame of each joint at zero in the one before [mm].
        axes: (6, 3) unit axis of each in its own frame.
        T_end_tool: (4, 4) the tool in the frame of the last link [mm].
        frames: (k, 8, 4, 4) where the base, the links and the tool are written, in the base frame [mm].
    """
    count = joints.shape[0]
    for k in range(count):
        for j in range(8):
            frames[k, j, 3, 0], frames[k, j, 3, 1], frames[k, j, 3, 2], frames[k, j, 3, 3] = 0.0, 0.0, 0.0, 1.0
        for a in range(3):
            for b in range(4):
                frames[k, 0, a, b] = 1.0 if a == b else 0.0
        for j in range(6):
            _multiply(frames[k, j], origins[j], frames[k, j + 1])
            _turn_frame(frames[k, j + 1], axes[j], joints[k, j])
        _multiply(frames[k, 6], T_end_tool, frames[k, 7])
    return count


@inlined
def _multiply(first: FloatArray, second: FloatArray, product: FloatArray) -> None:
    """Fill in the product of two rigid (4, 4) transforms."""
    for a in range(3):
        for b in range(4):
            product[a, b] = first[a, 0] * second[0, b] + first[a, 1] * second[1, b] + first[a, 2] * second[2, b]
        product[a, 3] += first[a, 3]


@inlined
def _turn_frame(frame: FloatArray, axis: FloatArray, angle: float) -> None:
    """Turn a (4, 4) frame about an axis of its own, by Rodrigues' formula."""
    x, y, z, c, s = axis[0], axis[1], axis[2], cos(angle), sin(angle)
    d = 1.0 - c
    for a in range(3):
        p, q, r = frame[a, 0], frame[a, 1], frame[a, 2]
        frame[a, 0] = p * (c + d * x * x) + q * (d * x * y + s * z) + r * (d * x * z - s * y)
        frame[a, 1] = p * (d * x * y - s * z) + q * (c + d * y * y) + r * (d * y * z + s * x)
        frame[a, 2] = p * (d * x * z + s * y) + q * (d * y * z - s * x) + r * (c + d * z * z)


# The inverse of six-axis arms that no closed form covers: damped least squares [Nakamura1986] from many starts.
#
# Such an arm has up to sixteen solutions for a pose, and nothing orders them by itself. They are distinguished here by
# the same three signs as those of arms with a spherical wrist: on which side of axis 1 the wrist is, to which side
# the elbow bends, and to which side axis 6 is turned from axis 4. For arms whose singularities are just these (a
# UR5's are) that numbers all of them. For others the name may change while the arm passes no singularity, or two
# share it: then the one that continues the row before is kept. Whoever follows a branch must look for jumps, as
# `following` does.


# A solution misses its pose by no more than this [rad, and the same share of the arm's reach]: 1e-8 mm for a metre.
CONVERGED = 1e-11
MOST_ITERATIONS = 40
# Largest turn of a joint in one iteration [rad], beyond which the linear model says nothing.
LARGEST_STEP = 0.5
# Damping as a share of the squared miss: it vanishes as the pose comes near, so that the last steps are Newton's.
DAMPING = 0.05
LEAST_DAMPING = 1e-14
# Starts for solutions that no neighbouring row gives: with 32, 1 in 50 of a lone pose is missed, with 64 1 in 1000.
STARTS = 64
# Rows within this distance of the one before (share of the reach, and entries of a rotation) follow a path: solutions
# come from their neighbours, and the starts, which take a hundred times longer, are tried at each so many rows only.
NEAR = 0.05
FRESH = 8
# Keeps the side of axis 1 defined where axis 2 is parallel to it.
TINY = 1e-300


class _Axes(NamedTuple):
    """Axes, flange and marks of an arm as the compiled loops need them; all joints at zero."""

    directions: FloatArray
    points: FloatArray
    rotation: FloatArray
    place: FloatArray
    marks: FloatArray
    scale: float


@final
class NumericInverse:
    """The inverse of any six-axis arm by iteration.

    Args:
        screws: its axes.
        limits: (6, 2) lowest and highest joint angles [rad], between which the starts are drawn.

    Attributes:
        shoulder: (3,) the point of axis 1 that is nearest to axis 2, in the base frame [mm].
        reach: how far from the shoulder the flange may come at most [mm].
    """

    __slots__ = ("_axes", "_starts", "reach", "shoulder")

    def __init__(self, screws: Screws, *, limits: FloatArray) -> None:
        low, high = np.clip(limits, -np.pi, np.pi).T
        self._starts: FloatArray = np.random.default_rng(0).uniform(low, high, (STARTS, JOINTS))
        marks = np.stack([screws.nearest(3, 4), screws.nearest(4, 5)])
        place = screws.T_base_flange[:3, 3].copy()
        self.shoulder = screws.nearest(0, 1)
        knees = [self.shoulder, screws.nearest(1, 0), screws.nearest(2, 1), *marks, screws.nearest(5, 4), place]
        self.reach = float(np.linalg.norm(np.diff(knees, axis=0), axis=1).sum())
        rotation = np.ascontiguousarray(screws.T_base_flange[:3, :3])
        self._axes = _Axes(screws.directions.copy(), screws.points.copy(), rotation, place, marks, self.reach)

    def solutions(self, Ts_base_flange: FloatArray) -> FloatArray:
        """Return the joint angles of up to eight branches, limits not applied.

        Args:
            Ts_base_flange: (k, 4, 4) poses of the flange [mm]; rows that follow a path give solutions that do.

        Returns:
            (k, 8, 6) angles [rad] in (-pi, pi], branch = 4 * wrist + 2 * shoulder + elbow; NaN where none was found,
            which proves nothing: the starts are many, not all.
        """
        found = np.full((len(Ts_base_flange), BRANCHES, JOINTS), np.nan)
        _follow(*_split(Ts_base_flange), self._axes, self._starts, found)
        return found

    def refined(self, Ts_base_flange: FloatArray, joints: FloatArray) -> FloatArray:
        """Return the solutions to which iteration leads from given joint angles.

        Args:
            Ts_base_flange: (k, 4, 4) poses of the flange [mm].
            joints: (k, 6) where to start [rad].

        Returns:
            (k, 6) angles [rad] in (-pi, pi]; NaN where the iteration does not converge.
        """
        found = joints.astype(np.float64)
        for angles, rotation, place in zip(found, *_split(Ts_base_flange), strict=True):
            if not _iterate(angles, rotation, place, self._axes):
                angles[:] = np.nan
        return found

    def singularity_distances(self, joints: FloatArray) -> FloatArray:
        """Return the three quantities whose signs tell the branches apart.

        Args:
            joints: (k, 6) [rad].

        Returns:
            (k, 3): how far the wrist lies ahead of axis 1 in the plane of the arm [mm]; the angle by which the elbow is
            bent; the angle from axis 4 to axis 6 [rad], both in (-pi, pi].
        """
        distances = np.empty((len(joints), 3))
        for row, angles in enumerate(np.ascontiguousarray(joints)):
            _sides(angles, self._axes, distances[row])
        return distances

    def wrist_distances(self, Ts_base_flange: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (k,) distances of the flange from the shoulder and (2,) bounds that none exceeds [mm]."""
        away = np.linalg.norm(Ts_base_flange[:, :3, 3] - self.shoulder, axis=1)
        return away, np.array([0.0, self.reach])


def _split(Ts: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.ascontiguousarray(Ts[:, :3, :3]), np.ascontiguousarray(Ts[:, :3, 3])


@njit
def _follow(rotations: FloatArray, places: FloatArray, axes: _Axes, starts: FloatArray, found: FloatArray) -> None:
    """Fill (k, 8, 6) solutions: from the row before, from the starts, and at last from the row after."""
    rows = places.shape[0]
    for k in range(rows):
        near = False
        if k > 0:
            _add(found[k - 1], rotations[k], places[k], axes, found[k])
            moved = np.abs(places[k] - places[k - 1]).max() / axes.scale
            near = max(moved, np.abs(rotations[k] - rotations[k - 1]).max()) < NEAR
        if not near or k % FRESH == 0:
            _add(starts, rotations[k], places[k], axes, found[k])
    for k in range(rows - 2, -1, -1):
        _add(found[k + 1], rotations[k], places[k], axes, found[k])


@njit
def _add(starts: FloatArray, rotation: FloatArray, place: FloatArray, axes: _Axes, found: FloatArray) -> None:
    """Iterate from each start and keep what has a number that is still free in (8, 6) found."""
    angles, sides = np.empty(6), np.empty(3)
    for s in range(starts.shape[0]):
        if not np.isnan(found[:, 0]).any():
            return
        if np.isnan(starts[s, 0]):
            continue
        angles[:] = starts[s]
        if _iterate(angles, rotation, place, axes):
            _sides(angles, axes, sides)
            branch = 4 * int(sides[2] < 0.0) + 2 * int(sides[0] < 0.0) + int(sides[1] < 0.0)
            if np.isnan(found[branch, 0]):
                found[branch] = angles


@njit
def _iterate(angles: FloatArray, rotation: FloatArray, place: FloatArray, axes: _Axes) -> bool:
    """Move (6,) angles by damped least squares until the flange is at a pose; say whether it got there."""
    directions, points = np.empty((6, 3)), np.empty((6, 3))
    miss, slope = np.empty(6), np.empty((6, 6))
    for _ in range(MOST_ITERATIONS):
        R, t = _forward(angles, axes, directions, points)
        at = R @ axes.place + t
        miss[:3] = (place - at) / axes.scale
        miss[3:] = _turn(rotation @ np.ascontiguousarray((R @ axes.rotation).T))
        if np.abs(miss).max() < CONVERGED:
            angles[:] = np.pi - (np.pi - angles) % (2.0 * np.pi)
            return True
        for joint in range(6):
            slope[joint, :3] = np.cross(directions[joint], at - points[joint]) / axes.scale
            slope[joint, 3:] = directions[joint]
        damping = DAMPING * (miss @ miss) + LEAST_DAMPING
        squared = np.ascontiguousarray(slope.T) @ slope + damping * np.eye(6)
        step = slope @ np.linalg.solve(squared, miss)
        angles += step * min(1.0, LARGEST_STEP / np.abs(step).max())
    return False


@njit
def _forward(
    angles: FloatArray, axes: _Axes, directions: FloatArray, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Fill (6, 3) directions and points of the turned axes; return rotation and shift of the last link."""
    rotation, shift = np.eye(3), np.zeros(3)
    for joint in range(6):
        directions[joint] = rotation @ axes.directions[joint]
        points[joint] = rotation @ axes.points[joint] + shift
        rotation = _rotation(directions[joint], angles[joint]) @ rotation
        shift = points[joint] - rotation @ axes.points[joint]
    return rotation, shift


@njit
def _rotation(axis: FloatArray, angle: float) -> FloatArray:
    """Return the (3, 3) rotation about a unit vector, by the formula of Rodrigues."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)


@njit
def _turn(R: FloatArray) -> FloatArray:
    """Return the (3,) rotation vector of a rotation; about no particular axis where it is a half turn."""
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
    sine, cosine = np.sqrt(vector @ vector), (np.trace(R) - 1.0) / 2.0
    if sine > 0.0:
        return vector * (np.arctan2(sine, cosine) / sine)
    return vector if cosine > 0.0 else np.array([np.pi, 0.0, 0.0])


@njit
def _sides(angles: FloatArray, axes: _Axes, sides: FloatArray) -> None:
    """Fill (3,) with the quantities of `NumericInverse.singularity_distances`."""
    directions, points = np.empty((6, 3)), np.empty((6, 3))
    _forward(angles, axes, directions, points)
    # The marks lie on axes 4 and 5, so that joints 4 and 5 leave them where joints 1 to 3, or 4, have put them.
    elbow = points[3] + directions[3] * ((axes.marks[0] - axes.points[3]) @ axes.directions[3])
    wrist = points[4] + directions[4] * ((axes.marks[1] - axes.points[4]) @ axes.directions[4])
    ahead = np.cross(directions[1], directions[0])
    sides[0] = (wrist - points[0]) @ ahead / max(np.sqrt(ahead @ ahead), TINY)
    lower, fore = points[2] - points[1], elbow - points[2]
    lower = lower - (lower @ directions[1]) * directions[1]
    sides[1] = np.arctan2(np.cross(lower, fore) @ directions[1], lower @ fore)
    sides[2] = np.arctan2(np.cross(directions[3], directions[5]) @ directions[4], directions[3] @ directions[5])


# The joints of a pose that agrees [rad]: at the probes they move a few times as much as the pose.
JOINT_AGREEMENT = 1e-8

# Joint vectors on which both are compared, and how far they keep from singularities [share of the reach, rad].
PROBES = 8
ASIDE = 0.05
BENT = 0.2
# From this far off [rad] iteration must lead back to a probe.
OFF_PROBE = 0.02
# Poses of the tool that are found at a time.
BLOCK = 8192
NO_TOOL = np.eye(4)


# What recognises the kinds of arms that have a closed form.
CLOSED_FORMS: tuple[Callable[[Screws], OrthoParallel | ThreeParallel], ...] = (ortho_parallel, three_parallel)


@final
class Arm:
    """A six-axis arm, and the tool on its flange.

    The geometry is that of the robot's URDF. Where its axes form an ortho-parallel base and a spherical wrist, or three
    parallel axes as those of Universal Robots, however the URDF counts its joints, the inverse is a closed form
    [Brandstötter2014; Hawkins2013]; else it is iteration, a thousand times slower and without a promise to find every
    solution. Before anybody relies on it, the constructor leads it back to where it came from, and Pinocchio, where it
    is installed, confirms the forward kinematics.

    Branches have stable numbers: 4 * wrist + 2 * shoulder + elbow, each 0 or 1 (`configuration.branch_of`).

    Args:
        robot: the arm and its limits; the limits are not applied here.
        T_flange_tool: (4, 4) tool frame in the flange frame [mm]; its z axis points out of the nozzle.

    Attributes:
        robot: as given.
        T_flange_tool: as given, read-only.
        inverse: how poses of the flange become joint angles.
        no_closed_form: why the inverse is iteration, or None where it is the closed form.

    Raises:
        UsageError: the URDF describes no such arm, the cell allows more than it, the arm cannot move its flange in all
            directions, or Pinocchio is installed and cannot be imported.
        VerificationError: Pinocchio finds other poses.
    """

    __slots__ = (
        "T_flange_tool",
        "_T_tool_flange",
        "_chain",
        "inverse",
        "no_closed_form",
        "robot",
    )

    def __init__(self, robot: Robot, *, T_flange_tool: FloatArray) -> None:
        self.robot = robot
        self.T_flange_tool: FloatArray = T_flange_tool.copy()
        self.T_flange_tool.setflags(write=False)
        self._T_tool_flange = transforms.inverse(T_flange_tool)
        self._chain = chain_of(urdf_of(robot), name=robot.model, flange=robot.flange)
        self._require_limits_of_the_arm()
        self.inverse: OrthoParallel | ThreeParallel | NumericInverse
        self.no_closed_form: str | None = None
        screws, reasons = self.screws(), list[str]()
        for recognise in CLOSED_FORMS:
            try:
                self.inverse = recognise(screws)
                break
            except UsageError as error:
                reasons.append(str(error))
        else:
            self.inverse = NumericInverse(screws, limits=robot.limits)
            self.no_closed_form = "; ".join(dict.fromkeys(reasons))
        self._verify()

    def _require_limits_of_the_arm(self) -> None:
        """Refuse a cell that allows the arm more than its maker does."""
        robot, known = self.robot, self._chain
        wider = (robot.limits < known.limits - AGREEMENT)[:, 0] | (robot.limits > known.limits + AGREEMENT)[:, 1]
        faster = robot.speeds > known.speeds * (1.0 + AGREEMENT)

        def both(joint: int, allowed: FloatArray, makers: FloatArray, unit: str) -> str:
            # Digits enough to tell the two apart.
            said, has = (", ".join(f"{value:.7g}" for value in np.degrees(each).ravel()) for each in (allowed, makers))
            return f"joint {joint + 1} {said} {unit}, the maker {has}"

        more = [
            *(both(j, robot.limits[j], known.limits[j], "degrees") for j in np.flatnonzero(wider).tolist()),
            *(
                both(j, robot.speeds[j : j + 1], known.speeds[j : j + 1], "deg/s")
                for j in np.flatnonzero(faster).tolist()
            ),
        ]
        if more:
            raise UsageError(
                f"robot: the cell allows the {robot.model} more than its maker: {'; '.join(more)}: correct "
                "limits_deg or speeds_deg_s in the cell file."
            )

    @property
    def closed_form(self) -> OrthoParallel | ThreeParallel | None:
        """The inverse where it is a closed form, or None where it is iteration."""
        return None if isinstance(self.inverse, NumericInverse) else self.inverse

    @property
    def sense_of_turn(self) -> float:
        """1 or -1 where turning the tool about its nozzle moves joint 6 only, in its sense or against it; else 0."""
        if self.closed_form is None:
            return 0.0
        T_end_tool = self.closed_form.T_end_flange @ self.T_flange_tool
        return float(self.closed_form.signs[5] * np.sign(T_end_tool[2, 2])) if is_axial(T_end_tool) else 0.0

    def screws(self) -> Screws:
        """Return the axes of the joints as lines in space, all joints at zero."""
        frames = self._frames(np.zeros((1, JOINTS)))[0]
        directions = np.einsum("jab,jb->ja", frames[1:-1, :3, :3], self._chain.axes)
        return Screws(frames[1:-1, :3, 3], directions, frames[-1])

    def flange_poses(self, joints: FloatArray) -> FloatArray:
        """Return where the flange is.

        Args:
            joints: (k, 6) joint angles [rad]; limits are not applied.

        Returns:
            (k, 4, 4) T_base_flange [mm]; the flange's z axis points out of it.
        """
        return self._frames(joints)[:, -1]

    def link_poses(self, joints: FloatArray) -> FloatArray:
        """Return where the links are: the frames in which the URDF gives their shapes.

        Args:
            joints: (k, 6) joint angles [rad]; limits are not applied.

        Returns:
            (k, 8, 4, 4) frames in the base frame [mm]: the base, which does not move, the links 1 to 6, and the tool.
        """
        return self._frames(joints, self.T_flange_tool)

    def _frames(self, joints: FloatArray, T_flange_end: FloatArray = NO_TOOL) -> FloatArray:
        """Return (k, 8, 4, 4) the base, the links 1 to 6 and what is on the flange."""
        frames = np.empty((len(joints), JOINTS + 2, 4, 4))
        angles = writable(np.asarray(joints, dtype=np.float64))
        chain = self._chain
        chain_frames(angles, chain.origins, chain.axes, chain.T_link_flange @ T_flange_end, frames)
        return frames

    def tool_poses(self, joints: FloatArray) -> FloatArray:
        """Return where the tool is.

        Args:
            joints: (k, 6) joint angles [rad]; limits are not applied.

        Returns:
            (k, 4, 4) T_base_tool [mm].
        """
        # In blocks, because of each pose there are the frames of all links too.
        first = range(0, max(len(joints), 1), BLOCK)
        return np.concatenate([self.link_poses(joints[row : row + BLOCK])[:, -1] for row in first])

    def jacobians(self, joints: FloatArray) -> FloatArray:
        """Return how the tool moves as each joint turns.

        Args:
            joints: (k, 6) joint angles [rad]; limits are not applied.

        Returns:
            (k, 6, 6) a column a joint: velocity of the tip [mm/rad] and of the turn [rad/rad], in the base frame.
        """
        frames = self.link_poses(joints)
        axes = np.einsum("kjab,jb->kja", frames[:, 1:-1, :3, :3], self._chain.axes)
        arms = frames[:, -1:, :3, 3] - frames[:, 1:-1, :3, 3]
        return np.swapaxes(np.concatenate([np.cross(axes, arms), axes], axis=2), 1, 2)

    def solutions(self, Ts_base_tool: FloatArray) -> FloatArray:
        """Return the joint angles of all eight branches, limits not applied.

        Args:
            Ts_base_tool: (k, 4, 4) poses of the tool [mm].

        Returns:
            (k, 8, 6) angles [rad] in (-pi, pi]; NaN where a branch does not exist or, without a closed form, was not
            found.
        """
        if len(Ts_base_tool) == 0:
            return np.empty((0, BRANCHES, JOINTS))
        return self.inverse.solutions(Ts_base_tool @ self._T_tool_flange)

    def _verify(self) -> None:
        """Compare the poses with Pinocchio's, and see that every solution found leads back to its pose."""
        probes = self._probes()
        frames = self._frames(probes)
        confirm(self.robot, joints=probes, Ts_base_link=frames[:, 1:-1], Ts_base_flange=frames[:, -1])
        asked = frames[:, -1]
        if isinstance(self.inverse, NumericInverse):
            found = self.inverse.refined(asked, probes + OFF_PROBE)[:, None]
        else:
            found = self.inverse.solutions(asked)
        exists = np.isfinite(found).all(axis=2)
        deviation = in_metres(self.flange_poses(found[exists]) - np.repeat(asked, exists.sum(axis=1), axis=0))
        largest = float(np.abs(deviation).max(initial=0.0))
        miss = np.abs(transforms.wrapped(found - probes[:, None])).max(axis=2)
        astray = float(np.where(exists, miss, np.inf).min(axis=1).max())
        if largest > AGREEMENT or astray > JOINT_AGREEMENT:
            why = f" ({self.no_closed_form})" if self.no_closed_form else ""
            raise UsageError(
                f"the inverse kinematics of the arm {self.robot.model} miss the URDF's pose by {largest:.3g} m and "
                f"{astray:.3g} rad, allowed are {AGREEMENT:g} and {JOINT_AGREEMENT:g}{why}. The arm cannot move its "
                "flange in all directions: use another arm, or correct its URDF.",
                position_m=largest,
                joints_rad=astray,
            )

    def _probes(self) -> FloatArray:
        """Return (k, 6) joint angles well away from the arm's singularities [rad], or any where it has no such."""
        angles = np.random.default_rng(0).uniform(-np.pi, np.pi, (32 * PROBES, JOINTS))
        ahead, bend, wrist = np.abs(self.inverse.singularity_distances(angles)).T
        away = (ahead > ASIDE * self.inverse.reach) & (np.minimum(np.sin(bend), np.sin(wrist)) > BENT)
        return (angles[away] if away.any() else angles)[:PROBES]


# The freedom of a round nozzle: it may turn about its axis, and lean; and when turning it helps nothing.
#
# A pose of the path is turned and leaned in the tool's own frame: R = R_path @ exp((x, y, 0)) @ Rz(turn). The tip
# stays.

# A nozzle whose axis misses that of the flange by no more than this [mm, sine] lies on it: rounding of a cell file.
AXIAL_OFFSET = 1e-3
AXIAL_TILT = 1e-5


def is_axial(T_end_tool: FloatArray) -> bool:
    """Say whether turning about the nozzle moves joint 6 only: the tool's z axis lies on that of joint 6.

    Args:
        T_end_tool: (4, 4) tool in a frame whose z axis is that of joint 6: the flange's of any usual arm [mm].
    """
    offset, axis = np.hypot(*T_end_tool[:2, 3]), np.hypot(*T_end_tool[:2, 2])
    return bool(offset <= AXIAL_OFFSET and axis <= AXIAL_TILT)


def about_nozzle(rotations: FloatArray) -> FloatArray:
    """Return (k, 4, 4) turns [rad] about the tool's z axis."""
    return transforms.rigid(Rotation.from_rotvec(rotations[:, None] * [0.0, 0.0, 1.0]).as_matrix(), np.zeros(3))


def turned(poses: PoseStream, *, rotations: FloatArray, leans: FloatArray) -> PoseStream:
    """Return poses that lean and turn about the nozzle; signs of the quaternions stay continuous along the stream.

    Args:
        poses: p poses of the path.
        rotations: (p,) about the nozzle [rad].
        leans: (p, 2) about the x and y axes of the tool of the path [rad].
    """
    lean = np.column_stack([leans, np.zeros(poses.count)])
    turn = np.column_stack([np.zeros((poses.count, 2)), rotations])
    attitudes = Rotation.from_quat(poses.quaternions, scalar_first=True)
    attitudes = attitudes * Rotation.from_rotvec(lean) * Rotation.from_rotvec(turn)
    return replace(poses, quaternions=attitudes.as_quat(scalar_first=True))


def tilts(poses: PoseStream) -> FloatArray:
    """Return the (p,) angles between nozzle and surface normal [rad]; exact for small ones too."""
    axes = -transforms.rotation_of(poses.quaternions)[:, :, 2]
    across = np.linalg.norm(np.cross(axes, poses.normals), axis=1)
    return np.arctan2(across, np.einsum("ij,ij->i", axes, poses.normals))
