"""The arm: forward kinematics by Pinocchio and all eight closed-form inverse solutions.

Pinocchio works in metres; nothing outside this module sees them.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass
from importlib import import_module, resources
from types import ModuleType
from typing import TYPE_CHECKING, final

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.model import FloatArray, Robot
from geoprint.motion.closed_form import BRANCHES, JOINTS, all_branches

if TYPE_CHECKING:
    import pinocchio

MILLIMETRES_PER_METRE = 1000.0
FLANGE_FRAME = "tool0"

# Forward and inverse kinematics are two closed forms of the same few lengths: they differ by rounding only, unless
# the arm is of another kind [m, and the same number for entries of a rotation].
AGREEMENT = 1e-9

# Joint vectors [rad] on which both are compared: every joint moves, alone and together, away from singularities.
_PROBES = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.5, 0.0],
        [0.7, 0.4, -0.3, 0.0, 0.9, 0.0],
        [-0.6, 0.9, -0.8, 0.8, -0.7, 1.1],
        [1.9, -0.5, 0.3, -1.4, 1.2, -2.3],
        [-2.4, 0.2, -1.1, 2.2, 0.6, 2.9],
    ]
)


@final
@dataclass(frozen=True, slots=True)
class Lengths:
    """The lengths of an arm with an ortho-parallel base and a spherical wrist, in the letters of [Brandstötter2014].

    Attributes:
        a1: from axis 1 to axis 2, ahead [mm].
        a2: from the forearm's axis 4 up to axis 3 [mm]; negative where axis 4 runs above axis 3.
        b: sideways offset of the wrist centre [mm].
        c1: height of axis 2 [mm].
        c2: length of the lower arm, axis 2 to axis 3 [mm].
        c3: length of the forearm, axis 3 to the wrist centre along axis 4 [mm].
        c4: from the wrist centre to the flange [mm].
    """

    a1: float
    a2: float
    b: float
    c1: float
    c2: float
    c3: float
    c4: float


@final
class Arm:
    """A six-axis arm with a spherical wrist, and the tool on its flange.

    The geometry is that of the URDF in the package data whose name is `robot.model`. The inverse is the closed form
    of [Brandstötter2014] for arms with an ortho-parallel base and a spherical wrist; its lengths are read from the
    origins of the URDF's joints, and the constructor compares both kinematics before anybody relies on them.

    Branches have stable numbers: 4 * wrist + 2 * shoulder + elbow, see `configuration.branch_of`.

    Args:
        robot: the arm and its limits; the limits are not applied here.
        T_flange_tool: (4, 4) tool frame in the flange frame [mm]; its z axis points out of the nozzle.

    Attributes:
        robot: as given.
        T_flange_tool: as given, read-only.
        lengths: read from the URDF.

    Raises:
        UsageError: the arm has no URDF, is of a kind that the closed form does not cover, or a package is missing.
    """

    __slots__ = (
        "T_flange_tool",
        "_T_link_flange",
        "_T_tool_flange",
        "_axes",
        "_flange",
        "_model",
        "_origins",
        "_pinocchio",
        "lengths",
        "robot",
    )

    def __init__(self, robot: Robot, *, T_flange_tool: FloatArray) -> None:
        self.robot = robot
        self.T_flange_tool: FloatArray = T_flange_tool.copy()
        self.T_flange_tool.setflags(write=False)
        self._T_tool_flange = transforms.inverse(T_flange_tool)
        self._pinocchio = _required("pinocchio", package="pin")
        self._model: pinocchio.Model = self._pinocchio.buildModelFromXML(read_urdf(robot.model))
        if self._model.nq != JOINTS or not self._model.existFrame(FLANGE_FRAME):
            raise UsageError(
                f"the arm {robot.model} has {self._model.nq} joints, flange frame '{FLANGE_FRAME}' "
                f"{'present' if self._model.existFrame(FLANGE_FRAME) else 'absent'}; geoprint needs six joints and "
                f"that frame: correct its URDF."
            )
        self._require_limits_of_the_arm()
        self._flange = self._model.getFrameId(FLANGE_FRAME)
        self.lengths = self._lengths()
        self._origins, self._axes = self._chain()
        at_rest = np.zeros((1, JOINTS))
        self._T_link_flange = transforms.inverse(self._joint_frames(at_rest[0])[-1]) @ self.flange_poses(at_rest)[0]
        self._verify()

    def _require_limits_of_the_arm(self) -> None:
        """Refuse a cell that allows the arm more than its maker does."""
        model, robot = self._model, self.robot
        room = 1.0 + AGREEMENT
        wider = (robot.limits[:, 0] < model.lowerPositionLimit * room) | (
            robot.limits[:, 1] > model.upperPositionLimit * room
        )
        faster = robot.speeds > model.velocityLimit * room
        if wider.any() or faster.any():
            joint = int(np.argmax(wider | faster))
            lowest, highest = np.degrees([model.lowerPositionLimit[joint], model.upperPositionLimit[joint]])
            raise UsageError(
                f"robot: the cell allows joint {joint + 1} {np.degrees(robot.limits[joint]).round(1).tolist()} degrees "
                f"at {np.degrees(robot.speeds[joint]):.1f} deg/s, the maker of the {robot.model} "
                f"[{lowest:.1f}, {highest:.1f}] at {np.degrees(model.velocityLimit[joint]):.1f}: correct limits_deg "
                "or speeds_deg_s in the cell file."
            )

    def flange_poses(self, joints: FloatArray) -> FloatArray:
        """Return where the flange is, by Pinocchio.

        Args:
            joints: (k, 6) joint angles [rad]; limits are not applied.

        Returns:
            (k, 4, 4) T_base_flange [mm]; the flange's z axis points out of it.
        """
        data = self._model.createData()
        poses = np.empty((len(joints), 4, 4))
        for row, angles in enumerate(np.ascontiguousarray(joints, dtype=np.float64)):
            self._pinocchio.framesForwardKinematics(self._model, data, angles)
            poses[row] = data.oMf[self._flange].homogeneous
        poses[:, :3, 3] *= MILLIMETRES_PER_METRE
        return poses

    def link_poses(self, joints: FloatArray) -> FloatArray:
        """Return where the links are: the frames in which the URDF gives their shapes.

        The chain of origins and turns that Pinocchio reads from the URDF, for all rows at once; the constructor
        compares it with Pinocchio's own.

        Args:
            joints: (k, 6) joint angles [rad]; limits are not applied.

        Returns:
            (k, 8, 4, 4) frames in the base frame [mm]: the base, which does not move, the links 1 to 6, and the tool.
        """
        poses = np.tile(np.eye(4), (len(joints), JOINTS + 2, 1, 1))
        for joint in range(JOINTS):
            turns = Rotation.from_rotvec(joints[:, joint, None] * self._axes[joint]).as_matrix()
            before = poses[:, joint] @ self._origins[joint]
            poses[:, joint + 1] = transforms.rigid(before[:, :3, :3] @ turns, before[:, :3, 3])
        poses[:, -1] = poses[:, -2] @ self._T_link_flange @ self.T_flange_tool
        return poses

    def joint_places(self, joints: FloatArray) -> FloatArray:
        """Return where the arm's joints are: its skeleton, to be drawn.

        Args:
            joints: (k, 6) joint angles [rad]; limits are not applied.

        Returns:
            (k, 8, 3) places of the base, the six joints and the flange in the base frame [mm].
        """
        data = self._model.createData()
        places = np.zeros((len(joints), JOINTS + 2, 3))
        for row, angles in enumerate(np.ascontiguousarray(joints, dtype=np.float64)):
            self._pinocchio.framesForwardKinematics(self._model, data, angles)
            places[row, 1:-1] = [data.oMi[joint].translation for joint in range(1, JOINTS + 1)]
            places[row, -1] = data.oMf[self._flange].translation
        return places * MILLIMETRES_PER_METRE

    def tool_poses(self, joints: FloatArray) -> FloatArray:
        """Return where the tool is.

        Args:
            joints: (k, 6) joint angles [rad]; limits are not applied.

        Returns:
            (k, 4, 4) T_base_tool [mm].
        """
        return self.flange_poses(joints) @ self.T_flange_tool

    def solutions(self, Ts_base_tool: FloatArray) -> FloatArray:
        """Return the joint angles of all eight branches, limits not applied.

        On a singularity of the wrist (joint 5 at zero) only the sum of joints 4 and 6 is determined; the solution
        given there is one of many.

        Args:
            Ts_base_tool: (k, 4, 4) poses of the tool [mm].

        Returns:
            (k, 8, 6) angles [rad] in (-pi, pi]; NaN where a branch does not exist.
        """
        if len(Ts_base_tool) == 0:
            return np.empty((0, BRANCHES, JOINTS))
        return all_branches(Ts_base_tool @ self._T_tool_flange, np.array(astuple(self.lengths)))

    def _lengths(self) -> Lengths:
        """Read the lengths off the joint origins at zero angles, where the forearm points ahead along x."""
        data = self._model.createData()
        self._pinocchio.framesForwardKinematics(self._model, data, np.zeros(JOINTS))
        origins = np.array([data.oMi[joint].translation for joint in range(1, JOINTS + 1)]) * MILLIMETRES_PER_METRE
        flange = data.oMf[self._flange].translation * MILLIMETRES_PER_METRE
        _, shoulder, elbow, forearm, wrist, _ = origins
        return Lengths(
            a1=float(shoulder[0]),
            a2=float(elbow[2] - forearm[2]),
            b=float(wrist[1]),
            c1=float(shoulder[2]),
            c2=float(elbow[2] - shoulder[2]),
            c3=float(wrist[0] - elbow[0]),
            c4=float(flange[0] - wrist[0]),
        )

    def _chain(self) -> tuple[FloatArray, FloatArray]:
        """Return (6, 4, 4) frames of the joints at zero in the one before [mm], and (6, 3) axes in their own frames."""
        at_rest = self._joint_frames(np.zeros(JOINTS))
        turned = self._joint_frames(np.ones(JOINTS))
        origins = transforms.inverse(at_rest[:-1]) @ at_rest[1:]
        steps = transforms.inverse(turned[:-1]) @ turned[1:]
        turns = np.swapaxes(origins[:, :3, :3], 1, 2) @ steps[:, :3, :3]
        return origins, Rotation.from_matrix(turns).as_rotvec()

    def _joint_frames(self, angles: FloatArray) -> FloatArray:
        """Return (7, 4, 4) the base and the frames of the six joints at (6,) angles, by Pinocchio [mm]."""
        data = self._model.createData()
        self._pinocchio.framesForwardKinematics(self._model, data, angles)
        frames = np.array([np.eye(4), *(data.oMi[joint].homogeneous for joint in range(1, JOINTS + 1))])
        frames[:, :3, 3] *= MILLIMETRES_PER_METRE
        return frames

    def _verify(self) -> None:
        """Compare the inverse with Pinocchio: every branch found must lead back to the pose it was asked for."""
        asked = self.tool_poses(_PROBES)
        known = np.array([[*self._joint_frames(q), pose] for q, pose in zip(_PROBES, asked, strict=True)])
        links = self.link_poses(_PROBES) - known
        links[:, :, :3, 3] /= MILLIMETRES_PER_METRE
        found = self.solutions(asked)
        exists = np.isfinite(found).all(axis=2)
        deviation = self.tool_poses(found[exists]) - np.repeat(asked, exists.sum(axis=1), axis=0)
        deviation[:, :3, 3] /= MILLIMETRES_PER_METRE
        largest = max(float(np.abs(deviation).max(initial=0.0)), float(np.abs(links).max()))
        miss = np.abs((found - _PROBES[:, None, :] + np.pi) % (2.0 * np.pi) - np.pi).max(axis=2)
        astray = float(np.where(exists, miss, np.inf).min(axis=1).max())
        if largest > AGREEMENT or astray > AGREEMENT:
            raise UsageError(
                f"the arm {self.robot.model} is not of the kind whose inverse kinematics geoprint knows (joint axes "
                f"z y y x y x, spherical wrist): its closed form misses the URDF's pose by {largest:.3g} m and the "
                f"joint angles by {astray:.3g} rad, allowed is {AGREEMENT:g}; use another arm or correct its URDF.",
                position_m=largest,
                joints_rad=astray,
            )


def read_urdf(model: str) -> str:
    """Return the URDF text of an arm in the package data.

    Raises:
        UsageError: there is none of that name.
    """
    files = {entry.name: entry for entry in resources.files("geoprint.robots").iterdir()}
    entry = files.get(f"{model}.urdf")
    if entry is None:
        known = ", ".join(sorted(name.removesuffix(".urdf") for name in files if name.endswith(".urdf")))
        raise UsageError(f"robot.model names the arm '{model}', which geoprint does not know; known are: {known}.")
    return entry.read_text(encoding="utf-8")


def _required(module: str, *, package: str) -> ModuleType:
    try:
        return import_module(module)
    except ImportError as error:
        raise UsageError(
            f"the robot chain needs {module}, which is not installed ({error}); run 'pip install {package}', "
            f"or leave the chain out with --no-robot.",
            package=package,
        ) from error
