"""A surface with a border flattened by the least squares conformal map [Levy2002], holes and all."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array

from geoprint.backends.distortion import signed_areas
from geoprint.backends.lscm.conformal_map import PinnedMap, conformal_energy, turning_pull
from geoprint.backends.lscm.overlap import refuse_overlaps
from geoprint.errors import FieldError
from geoprint.model import IntArray, Surface
from geoprint.surfaces import boundary_loops, component_labels, describe, euler_characteristic, face_areas


def conformal_chart(surface: Surface) -> Surface:
    """Flatten a disc, an annulus or a disc with more holes by the map that comes nearest to keeping angles.

    A disc is pinned at two far vertices of its border, as in [Levy2002]. With holes two pins do not settle the map: on
    a band about a cylinder z and 1/z are both conformal, and a sum of them folds. There the longest loop, as a
    function of its arc length, has its first harmonic fixed instead, which asks it to go round once,
    counter-clockwise; of maps that keep all angles, as on a plane part, that changes the scale alone. Both are
    one sparse positive definite system. The chart is scaled so that its area is the surface's, which makes chart
    lengths right on average.

    Args:
        surface: one component without handle, one boundary loop or more.

    Returns:
        The chart [mm]: the same faces, in the same order, on vertices (u, v, 0), counter-clockwise. Any loop may lie
        outside, the others are holes in it.

    Raises:
        FieldError: the surface is closed, has a handle or several components; or its chart overlaps itself, because
            triangles are flipped or collapsed, holes turned inside out, or border segments cross.
    """
    loops = boundary_loops(surface)
    _require_planar(surface, loops)
    longest = loops[0]
    unknown, first = touching_together(surface, loops)
    tied = csc_array((np.ones(unknown.size), (np.arange(unknown.size), unknown)))
    solved = PinnedMap(
        csc_array(tied.T @ conformal_energy(surface, loops) @ tied),
        coordinates=surface.vertices[first],
        pins=unknown[farthest_pair(surface, longest)],
    )
    image = solved.image
    if len(loops) > 1:
        ends = np.roll(longest, -1)
        lengths = np.linalg.norm(surface.vertices[ends] - surface.vertices[longest], axis=1)
        pull = turning_pull(unknown[longest], unknown[ends], lengths=lengths, turn=2 * np.pi, unknowns=first.size)
        image = solved.pulled(pull)
    image = image[unknown]
    flat = np.column_stack([image.real, image.imag])
    refuse_overlaps(surface, flat, loops)
    scale = np.sqrt(face_areas(surface).sum() / signed_areas(flat, surface.faces).sum())
    return Surface(np.column_stack([scale * flat, np.zeros(len(flat))]), surface.faces, name=surface.name)


def touching_together(surface: Surface, loops: tuple[IntArray, ...]) -> tuple[IntArray, IntArray]:
    """Number the places of a surface: vertices one by one, but those of its border that lie in one place as one.

    Where two holes touch in a point, or a hole the outer border, the surface has a vertex for each side; they must not
    come apart in the chart, or the sides would overlap.

    Args:
        surface: n vertices.
        loops: its boundary loops.

    Returns:
        (n,) the place of each vertex, and (k,) one vertex of each place.
    """
    border = np.concatenate(loops)
    _, one, same = np.unique(surface.vertices[border], axis=0, return_index=True, return_inverse=True)
    representative = np.arange(len(surface.vertices))
    representative[border] = border[one][same]
    first, place = np.unique(representative, return_inverse=True)
    return np.asarray(place, dtype=np.int64), first


def farthest_pair(surface: Surface, loop: IntArray) -> IntArray:
    """Return two vertices of a loop that are far apart, whatever the numbering.

    From the vertex farthest from the loop's mean the search goes to the farthest vertex again and again until the
    distance no longer grows.

    Args:
        surface: n vertices.
        loop: (l,) vertices, l >= 2.

    Returns:
        (2,) vertices.
    """
    places = surface.vertices[loop]
    here = int(np.argmax(np.linalg.norm(places - places.mean(axis=0), axis=1)))
    reach = 0.0
    while True:
        distances = np.linalg.norm(places - places[here], axis=1)
        there = int(np.argmax(distances))
        if distances[there] <= reach:
            return np.array([loop[there], loop[here]])
        here, reach = there, float(distances[there])


def _require_planar(surface: Surface, loops: tuple[IntArray, ...]) -> None:
    """Refuse what no plane has room for: of one component and b loops the Euler characteristic must be 2 - b."""
    if loops and euler_characteristic(surface) == 2 - len(loops) and not component_labels(surface).any():
        return
    raise FieldError(
        f"{surface.name} ({describe(surface)}) cannot be flattened without a cut; the backend 'lscm' needs one "
        "component with a border and without handles: give a smaller open patch, or use `--backend heat`, which plans "
        "on any surface."
    )
