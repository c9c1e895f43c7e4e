"""Anybody's polylines laid onto a surface: cut finely, each point moved to the closest place, and how far that was."""

from __future__ import annotations

import numpy as np

from geoprint.errors import FieldError
from geoprint.model import FloatArray, Polylines, SurfacePoints
from geoprint.quality.oracle import FlatMesh, Places, SurfacePath, flat_places, trace

# Lines between points are cut into pieces of at most this share of the spacing, so that they follow the surface.
PIECE_SHARE = 0.5
# Ends of one run nearer than this share of the spacing close it.
CLOSED_SHARE = 0.05
# Points of a run nearer together than this share of the spacing are one.
SAME_SHARE = 1e-6
# More points take more memory than a usual machine has.
MOST_POINTS = 20_000_000


def finely(curves: Polylines, *, spacing: float) -> Polylines:
    """Return the same polylines with points between those that are far apart, and without repeated points.

    Args:
        curves: r runs.
        spacing: wanted [mm].

    Raises:
        FieldError: there would be too many points.
    """
    sides = np.linalg.norm(np.diff(curves.points, axis=0), axis=1)
    inner = curves.runs[1:] == curves.runs[:-1]
    parts = np.where(inner, np.ceil(sides / (PIECE_SHARE * spacing)), 1.0)
    # Where neighbouring points are one, the first of them stands for both.
    parts[inner & (sides <= SAME_SHARE * spacing)] = 0.0
    total = parts.sum() + curves.count
    if total > MOST_POINTS:
        raise FieldError(
            f"the paths are {sides[inner].sum():.3g} mm long, {total:.3g} points at a spacing of {spacing:.3g} mm, "
            f"at most {MOST_POINTS} are measured; give a larger spacing or fewer paths.",
            points=int(total),
        )
    parts = np.append(parts, 1.0).astype(np.int64)
    owner = np.repeat(np.arange(parts.size), parts)
    ranks = np.arange(owner.size) - np.repeat(np.cumsum(parts) - parts, parts)
    following = np.minimum(owner + 1, parts.size - 1)
    shares = (ranks / parts[owner])[:, None]
    points = curves.points[owner] + shares * (curves.points[following] - curves.points[owner])
    counts = np.bincount(curves.runs[owner], minlength=curves.count)
    kept = counts > 1
    return Polylines(points[kept[curves.runs[owner]]], np.concatenate([[0], np.cumsum(counts[kept])]))


def laid_path(
    mesh: FlatMesh, places: SurfacePoints, curves: Polylines, distances: FloatArray, *, spacing: float, allowed: float
) -> SurfacePath:
    """Connect the places of polylines over a surface.

    Args:
        mesh: the surface laid flat.
        places: (k,) on it.
        curves: whose points they are the closest ones of.
        distances: (k,) to them [mm].
        spacing: wanted [mm].
        allowed: how far a point may be off [mm].

    Raises:
        FieldError: a point is farther off than allowed, nothing is long enough to be measured, or neighbouring
            points have no short connection on the surface.
    """
    worst = int(np.argmax(distances)) if distances.size else 0
    if distances.size and distances[worst] > allowed:
        x, y, z = curves.points[worst].tolist()
        raise FieldError(
            f"the paths lie up to {distances[worst]:.3g} mm off the part, farthest in run "
            f"{int(curves.runs[worst]) + 1} at ({x:.3f}, {y:.3f}, {z:.3f}) mm, allowed are {allowed:.3g} mm: give the "
            "paths in the part's own coordinates and unit, let `--fit` lay them onto it, or allow it with "
            f"`--offset-up-to {1.1 * distances[worst]:.2g}`.",
            distance_mm=float(distances[worst]),
            allowed_mm=allowed,
        )
    flat = flat_places(mesh, places)
    lengths = _moved(flat, curves)
    kept = lengths > SAME_SHARE * spacing
    if not kept.any():
        raise FieldError("no path is long enough to be measured: every run is a point on the part.")
    chosen = kept[curves.runs]
    runs = np.cumsum(kept)[curves.runs[chosen]] - 1
    firsts, lasts = curves.offsets[:-1][kept], curves.offsets[1:][kept] - 1
    apart = np.linalg.norm(curves.points[lasts] - curves.points[firsts], axis=1)
    return trace(
        mesh,
        Places(flat.faces[chosen], flat.flat[chosen]),
        runs=runs,
        levels=np.zeros(int(kept.sum()), dtype=np.int64),
        closed=apart <= np.minimum(CLOSED_SHARE * spacing, 0.25 * lengths[kept]),
    )


def _moved(flat: Places, curves: Polylines) -> FloatArray:
    """Return about how long each run is on the surface: 0 where all of its points fall on one [mm]."""
    same = flat.faces[1:] == flat.faces[:-1]
    steps = np.where(
        same, np.abs(flat.flat[1:] - flat.flat[:-1]), np.linalg.norm(np.diff(curves.points, axis=0), axis=1)
    )
    inner = curves.runs[1:] == curves.runs[:-1]
    return np.bincount(curves.runs[1:][inner], steps[inner], minlength=curves.count).astype(np.float64)
