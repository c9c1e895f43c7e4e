"""Arms that do not come with geoprint, as URDF text made of chosen axes."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import FloatArray, Robot
from geoprint.robot.arm.kinematics import Arm
from geoprint.robot.arm.ortho_parallel import OrthoParallel

TURN = 2.0 * np.pi


def closed_form(arm: Arm) -> OrthoParallel:
    """Return the inverse of an arm that has a closed form."""
    assert isinstance(arm.inverse, OrthoParallel)
    return arm.inverse


def urdf(frames: FloatArray, axes: FloatArray, T_base_flange: FloatArray, *, flange: str = "tool0") -> str:
    """Return the URDF of an arm with six joints, all of them at zero.

    Args:
        frames: (6, 4, 4) frames of the joints in the base frame [mm].
        axes: (6, 3) their axes, each in its own frame.
        T_base_flange: (4, 4) the flange [mm].
        flange: name of its link.
    """
    names = ["foot", *(f"piece_{joint}" for joint in range(1, 7)), flange]
    chain = np.array([np.eye(4), *frames, T_base_flange])
    steps = transforms.inverse(chain[:-1]) @ chain[1:]
    lines = ['<robot name="other">', *(f'<link name="{name}"/>' for name in names)]
    for joint, (step, parent, child) in enumerate(zip(steps, names, names[1:], strict=False)):
        xyz = " ".join(f"{value:.17g}" for value in step[:3, 3] / 1000.0)
        rpy = " ".join(f"{value:.17g}" for value in Rotation.from_matrix(step[:3, :3]).as_euler("xyz"))
        last = joint == 6
        lines += [
            f'<joint name="turn_{joint + 1}" type="{"fixed" if last else "revolute"}">',
            f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/>',
            *([] if last else [f'<axis xyz="{" ".join(f"{value:.17g}" for value in axes[joint])}"/>', LIMIT]),
            "</joint>",
        ]
    return "\n".join([*lines, "</robot>"])


LIMIT = f'<limit lower="{-TURN}" upper="{TURN}" velocity="3" effort="0"/>'


def robot(text: str, *, flange: str = "tool0") -> Robot:
    """Return the robot of a URDF with wide limits."""
    return Robot(
        model="other.urdf",
        limits=np.tile([-np.pi, np.pi], (6, 1)),
        speeds=np.full(6, 2.0),
        accelerations=np.full(6, 10.0),
        home=np.zeros(6),
        urdf=text,
        flange=flange,
    )


def spun(seed: int) -> tuple[FloatArray, FloatArray]:
    """Return (6, 3, 3) rotations and (6, 3) shares to turn the frames of joints and shift them along their axes."""
    generator = np.random.default_rng(seed)
    return Rotation.random(6, random_state=seed).as_matrix(), generator.uniform(-50.0, 50.0, (6, 3))


def arm_of_lines(points: FloatArray, directions: FloatArray, T_base_flange: FloatArray, *, seed: int) -> Robot:
    """Return an arm with given axes, whose URDF's frames are turned at random and shifted along the axes.

    Args:
        points: (6, 3) a point on each axis, all joints at zero, in the base frame [mm].
        directions: (6, 3) unit vectors.
        T_base_flange: (4, 4) [mm].
        seed: of the random turns.
    """
    rotations, shifts = spun(seed)
    frames = transforms.rigid(rotations, points + shifts[:, :1] * directions)
    axes = np.einsum("jba,jb->ja", rotations, directions)
    return robot(urdf(frames, axes, T_base_flange))


def offset_wrist(offset: float = 40.0) -> Robot:
    """Return an arm of the size of the IRB 120 whose axis 6 passes axis 4 by an offset [mm]."""
    points = np.array([[0, 0, 0], [0, 0, 290], [0, 0, 560], [0, 0, 630], [302, 0, 630], [374, 0, 630 + offset]])
    directions = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]])
    attitude = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    return arm_of_lines(points, directions, transforms.rigid(attitude, np.array([374.0, 0.0, 630.0 + offset])), seed=1)


def three_parallel_axes() -> Robot:
    """Return an arm with axes as the UR5's: 2, 3 and 4 are parallel, 4 and 5, and 5 and 6 at right angles."""
    points = np.array(
        [
            [0, 0, 89.2],
            [0, 135.9, 89.2],
            [425, 16.2, 89.2],
            [817.3, 16.2, 89.2],
            [817.3, 109.2, 89.2],
            [817.3, 109.2, -5.5],
        ]
    )
    directions = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [0, 1, 0], [0, 0, -1], [0, 1, 0]])
    attitude = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    return arm_of_lines(points, directions, transforms.rigid(attitude, np.array([817.3, 191.5, -5.5])), seed=2)


def other_conventions(*, offsets: FloatArray, signs: FloatArray, T_base_foot: FloatArray, seed: int) -> Robot:
    """Return an arm with a spherical wrist and every offset, whose URDF counts from elsewhere and stands elsewhere.

    Args:
        offsets: (6,) angle at which each joint is at zero, counted as ABB does [rad].
        signs: (6,) 1, or -1 where a joint counts in the opposite sense.
        T_base_foot: (4, 4) foot of axis 1 in the URDF's base frame [mm].
        seed: of the random turns of its frames.
    """
    points = np.array([[0, 0, 0], [40, 0, 290], [40, 0, 560], [40, 15, 630], [342, 15, 630], [374, 15, 630]])
    directions = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]])
    attitude = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    usual = arm_of_lines(points, directions, transforms.rigid(attitude, np.array([414.0, 15.0, 630.0])), seed=seed)
    screws = Arm(usual, T_flange_tool=np.eye(4)).screws()
    turned, moved = np.eye(4), list[tuple[FloatArray, FloatArray]]()
    for point, direction, angle in zip(screws.points, screws.directions, offsets, strict=True):
        moved.append((transforms.apply(turned, point[None])[0], turned[:3, :3] @ direction))
        rotation = Rotation.from_rotvec(angle * direction).as_matrix()
        turned = turned @ transforms.rigid(rotation, point - rotation @ point)
    places = transforms.apply(T_base_foot, np.array([place for place, _ in moved]))
    axes = signs[:, None] * (np.array([axis for _, axis in moved]) @ T_base_foot[:3, :3].T)
    flange = (
        T_base_foot @ turned @ screws.T_base_flange @ transforms.rigid(spun(seed)[0][0], np.array([3.0, -2.0, 5.0]))
    )
    return arm_of_lines(places, axes, flange, seed=seed + 1)
