"""The arm: its forward kinematics, and the inverse that its kind allows."""

from __future__ import annotations

from typing import Protocol, final

import numpy as np

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.kernels import writable
from geoprint.model import FloatArray, Robot
from geoprint.motion.arm.chain import chain_frames
from geoprint.motion.arm.closed_form import BRANCHES, JOINTS
from geoprint.motion.arm.confirmation import AGREEMENT, confirm, in_metres
from geoprint.motion.arm.nozzle import is_axial
from geoprint.motion.arm.numeric_inverse import NumericInverse
from geoprint.motion.arm.ortho_parallel import OrthoParallel, ortho_parallel
from geoprint.motion.arm.screws import Screws
from geoprint.motion.arm.urdf import chain_of, urdf_of

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


class Inverse(Protocol):
    """The inverse kinematics of an arm, whose kind decides how they are found; limits are not applied."""

    @property
    def shoulder(self) -> FloatArray:
        """(3,) the point of axis 1 beside axis 2, in the base frame [mm]."""
        ...

    @property
    def reach(self) -> float:
        """How far from the shoulder the flange may come at most [mm]."""
        ...

    def solutions(self, Ts_base_flange: FloatArray) -> FloatArray:
        """Return (k, 8, 6) joint angles [rad] of (k, 4, 4) poses of the flange [mm]; NaN where a branch is missing."""
        ...

    def singularity_distances(self, joints: FloatArray) -> FloatArray:
        """Return (k, 3) signed distances [mm, rad, rad] from the singularities of shoulder, elbow and wrist."""
        ...

    def wrist_distances(self, Ts_base_flange: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (k,) distances that decide about reach, and their (2,) bounds [mm]."""
        ...


@final
class Arm:
    """A six-axis arm, and the tool on its flange.

    The geometry is that of the robot's URDF. Where its axes form an ortho-parallel base and a spherical wrist, however
    the URDF counts its joints, the inverse is the closed form of [Brandstötter2014]; else it is iteration, a thousand
    times slower and without a promise to find every solution. Before anybody relies on it, the constructor leads it
    back to where it came from, and Pinocchio, where it is installed, confirms the forward kinematics.

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
        self.inverse: Inverse
        self.no_closed_form: str | None = None
        try:
            self.inverse = ortho_parallel(self.screws())
        except UsageError as error:
            self.inverse = NumericInverse(self.screws(), limits=robot.limits)
            self.no_closed_form = str(error)
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
    def closed_form(self) -> OrthoParallel | None:
        """The inverse where it is the closed form, or None where it is iteration."""
        return self.inverse if isinstance(self.inverse, OrthoParallel) else None

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
                f"the inverse kinematics of the arm {self.robot.model} miss the URDF's pose by {largest:.3g} m and the "
                f"joint angles by {astray:.3g} rad, allowed are {AGREEMENT:g} and {JOINT_AGREEMENT:g}{why}: the arm "
                "cannot move its flange in all directions; use another arm or correct its URDF.",
                position_m=largest,
                joints_rad=astray,
            )

    def _probes(self) -> FloatArray:
        """Return (k, 6) joint angles well away from the arm's singularities [rad], or any where it has no such."""
        angles = np.random.default_rng(0).uniform(-np.pi, np.pi, (32 * PROBES, JOINTS))
        ahead, bend, wrist = np.abs(self.inverse.singularity_distances(angles)).T
        away = (ahead > ASIDE * self.inverse.reach) & (np.minimum(np.sin(bend), np.sin(wrist)) > BENT)
        return (angles[away] if away.any() else angles)[:PROBES]
