"""From which sides a part is drawn so that its whole surface is seen: one for most parts, several for wrapped ones."""

from __future__ import annotations

import numpy as np

from geoprint.model import BoolArray, FloatArray, Surface
from geoprint.surfaces import face_areas, face_normals

# Surface that turns farther away from the reader than this [cosine of the angle] is too foreshortened to be read.
READABLE = 0.35
# A further side is drawn while it shows at least this share of the area anew; so many are enough for any part.
WORTH_A_SIDE = 0.08
MOST_SIDES = 4
# Directions in question, around the part and so far above or below its horizon [rad].
AROUND = 8
ELEVATIONS = (0.0, 0.6, -0.6)
# Cells along the longer side of the grid in which the foremost face hides those behind it.
CELLS = 60


def views(surface: Surface, upright: FloatArray) -> tuple[FloatArray, ...]:
    """Return (3, 3) rotations to the sides from which a part is drawn: x to the right, y up, z towards the reader.

    The first is from above; each further one is that of the directions around that shows most of what no one before it
    shows.

    Args:
        surface: the part.
        upright: (3, 3) rotation to the view from above.
    """
    areas = face_areas(surface) / face_areas(surface).sum()
    candidates = [_from(upright, azimuth, elevation) for elevation in ELEVATIONS for azimuth in _azimuths()]
    candidates.append(np.diag([1.0, -1.0, -1.0]) @ upright)
    shown = [readable(surface, R_view_work) for R_view_work in candidates]
    chosen, seen = [upright], readable(surface, upright)
    while len(chosen) < MOST_SIDES:
        gains = [float(areas[faces & ~seen].sum()) for faces in shown]
        best = int(np.argmax(gains))
        if gains[best] < WORTH_A_SIDE:
            break
        chosen.append(candidates[best])
        seen |= shown[best]
    return tuple(chosen)


def _azimuths() -> list[float]:
    return [turn * (2.0 * np.pi / AROUND) for turn in range(AROUND)]


def _from(upright: FloatArray, azimuth: float, elevation: float) -> FloatArray:
    """Return the view of whoever stands around an upright part and looks at its middle."""
    c, s, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    towards, right = np.array([c * ce, s * ce, se]), np.array([-s, c, 0.0])
    return np.stack([right, np.cross(towards, right), towards]) @ upright


def readable(surface: Surface, R_view_work: FloatArray) -> BoolArray:
    """Tell which faces turn towards the reader and lie behind no other, to about the size of a cell."""
    seen = surface.vertices @ R_view_work.T
    middles = seen[surface.faces].mean(axis=1)
    low, high = seen.min(axis=0), seen.max(axis=0)
    cell = float((high - low)[:2].max()) / CELLS
    samples = np.concatenate([seen, middles])
    columns = ((samples[:, :2] - low[:2]) / cell).astype(np.int64)
    keys = columns[:, 0] * (CELLS + 2) + columns[:, 1]
    foremost = np.full((CELLS + 2) ** 2, -np.inf)
    np.maximum.at(foremost, keys, samples[:, 2])
    facing = face_normals(surface) @ R_view_work[2] > READABLE
    # Within a cell a readable face rises by at most its slope.
    return facing & (middles[:, 2] >= foremost[keys[len(seen) :]] - cell / READABLE)
