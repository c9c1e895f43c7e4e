"""Where a camera in silico stands, and how it sees: a pinhole with a lens that bends."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.errors import InputError
from geoprint.model import FloatArray, freeze_arrays, frozen

# Newton steps that undo the bending; each doubles the figures that are right.
STEPS = 12


@final
@frozen
class Viewpoint:
    """A camera.

    Attributes:
        place: (3,) of the pinhole, in the part's coordinates [mm].
        axes: (3, 3) rows: right and down in the picture, and ahead, in the part's coordinates.
        focal: focal length [pixels].
        size: width and height of the picture [pixels]; the axis meets its middle.
        radial: k1 and k2: what lies r off the axis, at distance 1, is seen at r (1 + k1 r^2 + k2 r^4).
    """

    place: FloatArray
    axes: FloatArray
    focal: float
    size: tuple[int, int]
    radial: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        freeze_arrays(self, place="float: 3", axes="float: 3 3")

    @property
    def middle(self) -> FloatArray:
        """(2,) the pixel in which the axis meets the picture."""
        return 0.5 * (np.array(self.size, dtype=np.float64) - 1.0)

    def pixels(self, places: FloatArray) -> FloatArray:
        """Return the (k, 2) pixels (u, v) of (k, 3) places in front of the camera [mm]."""
        seen = (places - self.place) @ self.axes.T
        flat = seen[:, :2] / seen[:, 2:]
        r2 = (flat * flat).sum(axis=1)[:, None]
        return self.middle + self.focal * flat * (1.0 + r2 * (self.radial[0] + r2 * self.radial[1]))

    def rays(self) -> FloatArray:
        """Return the (h * w, 3) unit directions of all pixels, row after row."""
        columns, rows = np.meshgrid(np.arange(self.size[0]), np.arange(self.size[1]))
        bent = (np.column_stack([columns.ravel(), rows.ravel()]) - self.middle) / self.focal
        far = np.hypot(bent[:, 0], bent[:, 1])
        k1, k2 = self.radial
        near = far.copy()
        for _ in range(STEPS):
            near -= (near * (1.0 + k1 * near**2 + k2 * near**4) - far) / (1.0 + 3.0 * k1 * near**2 + 5.0 * k2 * near**4)
        flat = bent * np.divide(near, far, out=np.ones_like(far), where=far > 0.0)[:, None]
        ahead = np.column_stack([flat, np.ones(len(flat))]) @ self.axes
        return ahead / np.linalg.norm(ahead, axis=1, keepdims=True)


def looking_at(
    target: FloatArray,
    *,
    place: FloatArray,
    focal: float,
    size: tuple[int, int],
    turn: float = 0.0,
    radial: tuple[float, float] = (0.0, 0.0),
) -> Viewpoint:
    """Return a camera that looks at a place of the part.

    Args:
        target: (3,) that it looks at [mm].
        place: (3,) where it stands [mm].
        focal: focal length [pixels].
        size: width and height of the picture [pixels].
        turn: about its axis, clockwise as it sees it [rad].
        radial: k1 and k2 of its lens.

    Raises:
        InputError: it stands where it looks at.
    """
    ahead = np.asarray(target, dtype=np.float64) - place
    length = float(np.linalg.norm(ahead))
    if length == 0.0:
        raise InputError("a camera stands somewhere else than where it looks at.")
    ahead = ahead / length
    # Of the part's axes the one that is farthest from the line of sight shows what is down.
    guide = -np.eye(3)[1] if abs(ahead[1]) < 0.9 else np.eye(3)[2]
    right = np.cross(guide, ahead)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(ahead, right), ahead])
    spun = Rotation.from_rotvec(turn * ahead).apply(axes)
    return Viewpoint(np.asarray(place, dtype=np.float64), spun, focal, size, radial)
