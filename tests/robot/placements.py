"""Tool poses and bodies for the tests of the collision check: a tool that points straight down, and closed boxes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import BoolArray, FloatArray, Surface
from geoprint.robot.collision.sweep import Placements

# The tool frame with its z axis downwards and its x axis along x.
DOWN = np.diag([1.0, -1.0, -1.0])


def pointing_down(tips: FloatArray, *, lean: float = 0.0) -> FloatArray:
    """Return (k, 4, 4) poses with the tip at (k, 3) points [mm], leaning about the y axis by an angle [rad]."""
    attitude = Rotation.from_euler("y", lean).as_matrix() @ DOWN
    return transforms.rigid(np.broadcast_to(attitude, (len(tips), 3, 3)), tips)


def line(start: tuple[float, float, float], end: tuple[float, float, float], *, step: float = 0.5) -> FloatArray:
    """Return (k, 3) points from start to end, at most a step apart [mm]."""
    distance = float(np.linalg.norm(np.subtract(end, start)))
    return np.linspace(start, end, int(np.ceil(distance / step)) + 1)


def run_of(poses: FloatArray, *, deposit: BoolArray | None = None) -> Placements:
    """Return placements of one run that lays material throughout, unless told where."""
    depositing = np.ones(len(poses), dtype=np.bool_) if deposit is None else deposit
    depositing[-1] = False
    return Placements(poses, runs=np.zeros(len(poses), dtype=np.int64), deposit=depositing, corners=poses)


def block(low: tuple[float, float, float], high: tuple[float, float, float], *, name: str = "block") -> Surface:
    """Return the closed surface of a box with its sides along the axes [mm]."""
    bounds = np.array([low, high])
    corners = np.array([[bounds[i, 0], bounds[j, 1], bounds[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    faces = np.array(
        [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
         [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    )  # fmt: skip
    return Surface(vertices=corners, faces=faces, name=name)


def always(answer: int) -> Callable[..., int]:
    """Return a query of the collision library that gives one answer, whatever it is asked."""

    def answered(*_: object) -> int:
        return answer

    return answered
