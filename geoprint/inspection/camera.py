"""The camera of a photograph: a pinhole with a lens that bends, and where it stood beside the part [Zhang2000]."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import InputError, percent
from geoprint.model import FloatArray, freeze_arrays, frozen

# Steps that undo the bending of a lens; each takes an error down to about a tenth.
MOST_STEPS = 40
# Undone to this [focal lengths]: a hundredth of a pixel of any camera is a thousand times more.
UNBENT = 1e-9
# A lens bends the corners of its picture by no more than this share.
MOST_BENT = 0.5
# What is within so many standard deviations is so with 95 % confidence; a pose has so many unknowns.
WITHIN_95, POSE = 1.96, 6.0


@final
@frozen
class Lens:
    """What of a camera does not depend on where it stands.

    Coordinates of the camera: z ahead, x to the right and y down in the picture.

    Attributes:
        size: width and height of the photographs it is of [pixels].
        focal: (2,) focal length in the directions of u and v [pixels].
        centre: (2,) where the axis meets the picture [pixels].
        radial: (2,) k1 and k2: what lies r off the axis, at distance 1, is seen at r (1 + k1 r^2 + k2 r^4).
        residual: root mean square error of the corners that it was calibrated from [pixels]; 0 where it was given.
    """

    size: tuple[int, int]
    focal: FloatArray
    centre: FloatArray
    radial: FloatArray
    residual: float = 0.0

    def __post_init__(self) -> None:
        freeze_arrays(self, focal="float: 2", centre="float: 2", radial="float: 2")
        if self.focal.min() <= 0.0:
            raise InputError(f"a lens has a positive focal length, found {tuple(self.focal.tolist())} pixels.")
        corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]) * np.array(self.size)
        square = float((((corners - self.centre) / self.focal) ** 2).sum(axis=1).max())
        bent = abs(float(self.radial[0]) * square + float(self.radial[1]) * square**2)
        if bent > MOST_BENT:
            raise InputError(
                f"the lens bends the corner of its picture by {percent(bent)}, allowed are {percent(MOST_BENT)}; check "
                "k1 and k2, or calibrate it from a checkerboard.",
                bent=bent,
            )

    def seen(self, places: FloatArray) -> FloatArray:
        """Return the (k, 2) pixels at which (k, 3) places in the camera's coordinates are seen [mm], z > 0."""
        flat = places[:, :2] / places[:, 2:]
        return flat * self._bending(flat) * self.focal + self.centre

    def directions(self, pixels: FloatArray) -> FloatArray:
        """Return the (k, 3) directions in the camera's coordinates, of z = 1, in which (k, 2) pixels look."""
        bent = (pixels - self.centre) / self.focal
        flat = bent
        for _ in range(MOST_STEPS):
            before, flat = flat, bent / self._bending(flat)
            if np.abs(flat - before).max(initial=0.0) < UNBENT:
                break
        return np.column_stack([flat, np.ones(len(flat))])

    def _bending(self, flat: FloatArray) -> FloatArray:
        square = (flat**2).sum(axis=1, keepdims=True)
        return 1.0 + self.radial[0] * square + self.radial[1] * square**2


@final
@frozen
class OutlinePlacing:
    """How the outline of a part placed a camera.

    Attributes:
        pixels: (k, 2) the part's outline as the camera sees it, in no order [pixels].
        within: places of the part are seen within this of where they are, all of them in 95 of 100 poses [pixels].
        alike: from how many places of the camera the outline looks alike.
        clearer: how many times nearer to the plan the printed lines lie than from the next of these; None where there
            was nothing to decide.
    """

    pixels: FloatArray
    within: float
    alike: int
    clearer: float | None

    def __post_init__(self) -> None:
        freeze_arrays(self, pixels="float: k 2")


@final
@frozen
class Camera:
    """A lens, and where it stood.

    Attributes:
        lens: its own.
        T_camera_work: (4, 4) turns coordinates of the part into those of the camera [mm].
        residual: root mean square distance of the fiducials, or the outline, from where it sees them [pixels].
        fiducials: how many it was placed by; 0 where it was placed by the outline.
        outline: how it was placed by the part's outline; None where by fiducials.
    """

    lens: Lens
    T_camera_work: FloatArray
    residual: float
    fiducials: int
    outline: OutlinePlacing | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self, T_camera_work="float: 4 4")

    @property
    def deviation(self) -> float:
        """Of where places of the part are seen together, as far as what placed the camera tells [pixels]."""
        if self.outline is not None:
            return self.outline.within / WITHIN_95
        # Two coordinates a fiducial, of which a pose takes six.
        free = 2.0 * self.fiducials - POSE
        if free <= 0.0:
            return 0.0
        return self.residual * float(np.sqrt(self.fiducials / free * 2.0 / self.fiducials))

    @property
    def place(self) -> FloatArray:
        """(3,) where the pinhole is, in the part's coordinates [mm]."""
        return transforms.inverse(self.T_camera_work)[:3, 3]

    def seen(self, places: FloatArray) -> FloatArray:
        """Return the (k, 2) pixels at which (k, 3) places of the part are seen [mm]."""
        return self.lens.seen(transforms.apply(self.T_camera_work, places))

    def directions(self, pixels: FloatArray) -> FloatArray:
        """Return the (k, 3) unit directions, in the part's coordinates, in which (k, 2) pixels look."""
        ahead = self.lens.directions(pixels) @ self.T_camera_work[:3, :3]
        return ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
