"""Seeds: where distance is zero on a surface."""

from __future__ import annotations

import numpy as np

from geoprint.errors import FieldError, InputError
from geoprint.model import FloatArray, Seed, Surface, SurfaceCurves
from geoprint.surfaces.places import in_words
from geoprint.surfaces.points import closest, positions, vertex_points
from geoprint.surfaces.topology import boundary_loops


def boundary_seed(surface: Surface) -> Seed:
    """Return every boundary loop as a closed curve, the longest first.

    Raises:
        FieldError: the surface is closed and has no boundary.
        MeshError: as `boundary_loops`.
    """
    loops = boundary_loops(surface)
    if not loops:
        raise FieldError(
            f"{surface.name} is closed, so there is no rim to start from; give a seed point on it with `--seed X Y Z`."
        )
    # A closed curve repeats its first point at its end.
    vertices = np.concatenate([np.append(loop, loop[0]) for loop in loops])
    curves = SurfaceCurves(
        points=vertex_points(surface, vertices),
        offsets=np.concatenate([[0], np.cumsum([loop.size + 1 for loop in loops])]),
        closed=np.ones(len(loops), dtype=np.bool_),
    )
    return Seed(curves=curves)


def point_seed(surface: Surface, xyz: FloatArray, *, tolerance: float) -> Seed:
    """Return the point of the surface closest to a position.

    Args:
        surface: to find it on.
        xyz: (3,) position in the part's frame [mm].
        tolerance: largest distance from the surface at which the position is still meant to be on it [mm].

    Raises:
        FieldError: the position is farther from the surface than that.
        InputError: xyz does not have three finite coordinates.
    """
    if xyz.shape != (3,) or not np.isfinite(xyz).all():
        raise InputError(f"a seed point needs three finite coordinates in mm, found {xyz.tolist()}.")
    points, distances = closest(surface, xyz[None, :])
    distance = float(distances[0])
    if distance > tolerance:
        place = "({:g}, {:g}, {:g})".format(*xyz)
        raise FieldError(
            f"the seed point {place} lies {distance:.3g} mm off {surface.name}, at most {tolerance:g} mm is allowed; "
            f"the nearest point of its surface is {in_words(positions(surface, points)[0])}.",
            distance=distance,
            tolerance=tolerance,
        )
    curves = SurfaceCurves(points=points, offsets=np.array([0, 1]), closed=np.zeros(1, dtype=np.bool_))
    return Seed(curves=curves)
