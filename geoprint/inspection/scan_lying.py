"""The part as it lies there, before anything is printed: how far its surface is off the file's, smoothly.

What remains of a scan, or of touched points, after it is laid onto the part is an offset along the normal at each
point. A function u over the surface is fitted to it that is as smooth as the points allow: it minimises

    sum w (u - offset)^2 / s^2 + l^4 r / s^2 * integral of (Laplacian of u)^2,

with r the points per area and s their noise, so that waves longer than 2 pi l are kept and shorter ones smoothed away
[Duchon1977]; w are the weights of [Beaton1974].
"""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import splu
from scipy.spatial import KDTree

from geoprint import transforms
from geoprint.errors import InputError, percent
from geoprint.geometry import (
    closest,
    cotangent_laplacian,
    diagonal_matrix,
    face_areas,
    lumped_mass,
    normals,
    refine,
    vertex_normals,
)
from geoprint.inspection.scan_registration import LEAST_NOISE, MAD_FACTOR, TUKEY, Registration
from geoprint.model import BoolArray, FloatArray, Surface, SurfacePoints, freeze_arrays, frozen

# Shortest length of smoothing, over the root of the part's area, and over the distance of the points.
SMOOTH_SHARE, SMOOTH_APART = 0.06, 1.5
# Edges of the fitted surface over that length.
EDGE_SHARE = 0.5
# Times that points which do not fit are weighted anew.
ROUNDS = 4
# A place farther from every point than so many lengths of smoothing is not seen.
UNSEEN_LENGTHS = 2.0
# The surface is told where at least so much of it is seen.
LEAST_SEEN = 0.5
# A point beside the part by more than its height and this share of the smoothing length is no point of it.
ASIDE_SHARE = 0.2
# Variance of the fit over s^2 / (r l^2): integral of k / (1 + k^4)^2 over 2 pi.
FIT_VARIANCE = 1.0 / 16.0
# Weight that holds places which no point reaches, over that of a point.
FAINT = 1e-9


@final
@frozen
class LyingPart:
    """A part as it lies there.

    Attributes:
        registration: of the scan.
        nominal: the part, as fine as the offset varies.
        offsets: (n,) of its vertices along their normals [mm].
        seen: (n,) whether points are near.
        deviation: standard deviation of the offset where it is seen, by noise and pose [mm].
        smoothing: length l over which it is smooth [mm].
        points: that it was fitted to.
        residual: standard deviation of these from it [mm].
    """

    registration: Registration
    nominal: Surface
    offsets: FloatArray
    seen: BoolArray
    deviation: float
    smoothing: float
    points: int
    residual: float

    def __post_init__(self) -> None:
        freeze_arrays(self, offsets="float: n", seen="bool: n")

    @property
    def surface(self) -> Surface:
        """The part as it lies there, in its own coordinates."""
        moved = self.nominal.vertices + self.offsets[:, None] * vertex_normals(self.nominal)
        return replace(self.nominal, vertices=moved)


def lying_part(
    points: FloatArray, registration: Registration, surface: Surface, *, most: float, name: str = "scan"
) -> LyingPart:
    """Fit the surface that is there.

    Args:
        points: (k, 3) of the scan, in its own coordinates [mm].
        registration: of it.
        surface: of the part.
        most: largest offset that is allowed [mm].
        name: of the scan, for messages.

    Raises:
        InputError: less than half of the part is seen, or the offset is larger somewhere.
    """
    area = float(face_areas(surface).sum())
    here = transforms.apply(registration.T_work_scan, points)
    apart = float(np.sqrt(area / len(points)))
    smoothing = max(SMOOTH_SHARE * float(np.sqrt(area)), SMOOTH_APART * apart)
    nominal = refine(surface, edge_length=EDGE_SHARE * smoothing)
    feet, away = closest(nominal, here)
    places, up = feet.xyz(nominal), normals(nominal, feet)
    offsets = ((here - places) * up).sum(axis=1)
    aside = np.sqrt(np.maximum(away**2 - offsets**2, 0.0))
    on = (aside <= np.abs(offsets) + ASIDE_SHARE * smoothing) & (away <= 3.0 * most)
    if not on.any():
        raise InputError(f"`{name}`: no point lies within {3.0 * most:.3g} mm of {surface.name}; check its pose.")
    kept = feet[on]
    fitted, noise = _fitted(nominal, kept, offsets[on], smoothing=smoothing)
    seen = np.asarray(KDTree(places[on]).query(nominal.vertices)[0]) <= UNSEEN_LENGTHS * smoothing
    _check(nominal, fitted, seen, most=most, name=name)
    density = on.sum() / area
    pose = registration.along(nominal.vertices, vertex_normals(nominal))
    moved = float(np.einsum("ki,ij,kj->k", pose, registration.covariance, pose).mean())
    return LyingPart(
        registration, nominal, fitted, seen, float(np.sqrt(FIT_VARIANCE * noise**2 / (density * smoothing**2) + moved)),
        smoothing, int(on.sum()), noise,
    )  # fmt: skip


def _fitted(
    nominal: Surface, points: SurfacePoints, offsets: FloatArray, *, smoothing: float
) -> tuple[FloatArray, float]:
    """Return the (n,) smooth offset of the vertices, and the noise of the points about it [mm]."""
    count, many = len(nominal.vertices), len(offsets)
    rows = np.repeat(np.arange(many), 3)
    at: csc_array[np.float64] = coo_array(
        (points.weights.ravel(), (rows, points.corners(nominal).ravel())), shape=(many, count)
    ).tocsc()
    mass = np.maximum(lumped_mass(nominal), 1e-12)
    stiff = cotangent_laplacian(nominal)
    smooth = smoothing**4 * many / float(mass.sum()) * (stiff @ diagonal_matrix(1.0 / mass) @ stiff)
    held = diagonal_matrix(np.full(count, FAINT))
    weights = np.ones(many)
    fitted: FloatArray = np.zeros(count)
    noise = 0.0
    for _ in range(ROUNDS):
        system = csc_array(at.T @ diagonal_matrix(weights) @ at + smooth + held)
        pulled: FloatArray = np.asarray(at.T @ (weights * offsets), dtype=np.float64)
        fitted = np.asarray(splu(system).solve(pulled), dtype=np.float64)
        rest = np.abs(offsets - at @ fitted)
        noise = max(MAD_FACTOR * float(np.median(rest)), LEAST_NOISE)
        weights = (1.0 - np.minimum(rest / (TUKEY * noise), 1.0) ** 2) ** 2
    return fitted, noise


def _check(nominal: Surface, fitted: FloatArray, seen: BoolArray, *, most: float, name: str) -> None:
    """Refuse a surface that is not seen, or too far off."""
    share = float(lumped_mass(nominal)[seen].sum() / lumped_mass(nominal).sum())
    if share < LEAST_SEEN:
        raise InputError(
            f"`{name}` shows {percent(share)} of {nominal.name}, at least {percent(LEAST_SEEN)} is needed for its "
            "pose; scan or touch more of it.",
            seen=share,
        )
    worst = int(np.argmax(np.abs(np.where(seen, fitted, 0.0))))
    if abs(fitted[worst]) > most:
        x, y, z = nominal.vertices[worst].tolist()
        raise InputError(
            f"{nominal.name} lies {fitted[worst]:+.3g} mm off its file at ({x:z.1f}, {y:z.1f}, {z:z.1f}) by `{name}`, "
            f"allowed are {most:.3g} mm. Check that it is this part, or allow more with `--most`.",
            offset_mm=float(fitted[worst]),
        )
