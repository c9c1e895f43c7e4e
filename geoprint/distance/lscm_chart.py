"""Parametrization by the least squares conformal map [Levy2002], holes and all, and whether it overlaps."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.spatial import KDTree

from geoprint.distance.distortion import signed_areas
from geoprint.distance.sparse_solver import ComplexArray, SymmetricSolver, nested_dissection, picked
from geoprint.errors import FieldError
from geoprint.geometry import (
    boundary_loops,
    component_labels,
    cotangent_laplacian,
    describe,
    euler_characteristic,
    face_areas,
    in_words,
    triple,
)
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.transforms import EQUAL, nearest

# Does a flattened surface lie in the plane once? Turned triangles, turned holes and borders that cross.


# Chart triangles with less than this share of the mean chart area count as collapsed.
COLLAPSED_SHARE = 1e-9
# Segments of one search tree differ in length by at most this factor, so that a long one does not widen the search
# among short ones: a conformal chart may hold both a thousandfold.
LENGTH_CLASS_FACTOR = 2.0


def refuse_overlaps(surface: Surface, flat: FloatArray, loops: tuple[IntArray, ...]) -> None:
    """Refuse a chart in which two places of the surface fall on one.

    Where no triangle is turned, a place of the plane is covered as often as the border winds about it. So the chart
    is one to one exactly when the loops neither cross themselves nor each other, one of them runs
    counter-clockwise, and the others, the holes, run clockwise. Without the last condition a hole that is turned
    inside out would lie on top of the surface.

    Args:
        surface: n vertices, m faces; messages name its places.
        flat: (n, 2) vertices in the plane [mm].
        loops: boundary loops with the surface on their left, as `boundary_loops` returns them.

    Raises:
        FieldError: triangles are flipped or collapsed, holes are turned inside out, or the border crosses itself.
    """
    areas = signed_areas(flat, surface.faces)
    bad = areas <= COLLAPSED_SHARE * abs(areas.mean())
    if bad.any():
        place = surface.vertices[surface.faces[int(np.argmax(bad))]].mean(axis=0)
        count = int(bad.sum())
        raise _overlap(f"{count} of {areas.size} triangles of {surface.name} are flipped or collapsed", place, count)
    turned = [loop for loop in loops if _enclosed(flat[loop]) > 0.0][1:]
    if turned:
        place = surface.vertices[turned[0]].mean(axis=0)
        raise _overlap(
            f"{len(turned)} of {len(loops) - 1} holes of {surface.name} are turned inside out", place, len(turned)
        )
    start, end = np.concatenate(loops), np.concatenate([np.roll(loop, -1) for loop in loops])
    crossing = crossing_segments(flat[start], flat[end])
    if len(crossing):
        place = surface.vertices[start[crossing[0, 0]]]
        raise _overlap(f"the border of {surface.name} crosses itself {len(crossing)} times", place, len(crossing))


def crossing_segments(start: FloatArray, end: FloatArray) -> IntArray:
    """Return the pairs of segments in the plane that cross at a point inside both.

    Segments are sought by their middles in one k-d tree for each class of lengths: each segment asks the classes of
    its own length and longer. On borders of meshes, which do not crowd, that is O(s log s).

    Args:
        start: (s, 2) first ends.
        end: (s, 2) second ends.

    Returns:
        (p, 2) segments, the smaller first, rows ascending. Segments that touch at an end or lie on one line do not
        cross.

    Examples:
        >>> crossing_segments(np.array([[0.0, 0], [0, 2], [5, 5]]), np.array([[2.0, 2], [2, 0], [6, 5]]))
        array([[0, 1]])
    """
    lengths = np.sqrt(((end - start) ** 2).sum(axis=1))
    middles = 0.5 * (start + end)
    floor = max(float(lengths.max(initial=0.0)), np.finfo(np.float64).tiny) * np.finfo(np.float64).eps
    classes = np.floor(np.log(np.maximum(lengths, floor)) / np.log(LENGTH_CLASS_FACTOR))
    found: list[IntArray] = [np.empty((0, 2), dtype=np.int64)]
    for size in np.unique(classes):
        members, asking = np.flatnonzero(classes == size), np.flatnonzero(classes <= size)
        # Middles of two segments that meet are at most half of both lengths apart.
        near = KDTree(middles[asking]).sparse_distance_matrix(
            KDTree(middles[members]), float(lengths[members].max()), output_type="coo_matrix"
        )
        pairs = np.column_stack([asking[near.row], members[near.col]])
        found.append(pairs[_cross_inside(start[pairs], end[pairs])])
    return np.unique(np.sort(np.concatenate(found), axis=1), axis=0)


def _cross_inside(start: FloatArray, end: FloatArray) -> BoolArray:
    """Tell which of (p, 2, 2) pairs of segments have the ends of each on both sides of the other."""
    a, b, c, d = start[:, 0], end[:, 0], start[:, 1], end[:, 1]
    parted = _cross(b - a, c - a) * _cross(b - a, d - a) < 0.0
    parted &= _cross(d - c, a - c) * _cross(d - c, b - c) < 0.0
    # Of segments on one line rounding decides the sides; those that are apart have boxes that are apart.
    boxes = (np.maximum(a, b) >= np.minimum(c, d)) & (np.maximum(c, d) >= np.minimum(a, b))
    return parted & boxes.all(axis=1)


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def _enclosed(polygon: FloatArray) -> float:
    """Return the area [mm2] inside a closed polygon, positive where it runs counter-clockwise."""
    return 0.5 * float(_cross(polygon, np.roll(polygon, -1, axis=0)).sum())


def _overlap(what: str, place: FloatArray, count: int) -> FieldError:
    return FieldError(
        f"{what} in the UV map, the first at {in_words(place)}: the flattened part would overlap itself. Use "
        "`--backend heat`, or a smaller patch.",
        place=triple(place),
        count=count,
    )


# The conformal energy of a map to the plane and the maps of least energy [Levy2002] [Mullen2008, section 2].


def conformal_energy(surface: Surface, loops: tuple[IntArray, ...]) -> csc_array:
    """Return the Hermitian (n, n) matrix E for which conj(z) E z is the conformal energy of a map z = u + iv.

    It is Dirichlet's energy less the area of the image, which only the border enters: holes need no cut, because
    their loops enclose the area that is missing. It is zero exactly where all angles are kept.

    Args:
        surface: n vertices.
        loops: all its boundary loops, the surface on their left.
    """
    start, end = np.concatenate(loops), np.concatenate([np.roll(loop, -1) for loop in loops])
    entries = np.concatenate([np.full(start.size, -0.25j), np.full(start.size, 0.25j)])
    where = np.concatenate([start, end]), np.concatenate([end, start])
    count = len(surface.vertices)
    enclosed = coo_array((entries, where), shape=(count, count))
    return csc_array(0.5 * cotangent_laplacian(surface) - csc_array(enclosed))


def turning_pull(start: IntArray, end: IntArray, *, lengths: FloatArray, turn: float, unknowns: int) -> ComplexArray:
    """Return the vector c for which conj(c) z is how far the image of a line goes along one that turns evenly.

    Each chord of the image counts by its part along the direction that the line has there. A loop that turns by
    2 pi has the first Fourier coefficient of its image counted, up to a factor.

    Args:
        start: (l,) unknown at the start of each edge of the line.
        end: (l,) unknown at its end.
        lengths: (l,) length of each edge [mm].
        turn: by how much the direction turns from the start of the line to its end [rad].
        unknowns: their number n.

    Returns:
        (n,) vector c; conj(c) z stays when z is moved as a whole.
    """
    middles = (np.cumsum(lengths) - 0.5 * lengths) / lengths.sum()
    directions = np.exp(1j * turn * middles)
    result: ComplexArray = np.zeros(unknowns, dtype=np.complex128)
    np.add.at(result, end, directions)
    np.add.at(result, start, -directions)
    return result


@final
class PinnedMap:
    """The map of least energy that sends one unknown to 0 and another to 1, and maps of least energy under a pull.

    Args:
        energy: (n, n) as `conformal_energy` returns it.
        coordinates: (n, 3) position of each unknown, for the order of elimination alone.
        pins: (2,) the unknown at 0 and the one at 1.

    Raises:
        FieldError: the system is singular.
    """

    def __init__(self, energy: csc_array, *, coordinates: FloatArray, pins: IntArray) -> None:
        self._free = np.setdiff1d(np.arange(len(coordinates)), pins)
        inner = picked(energy, self._free)
        self._solver = SymmetricSolver(inner, order=nested_dissection(inner, coordinates=coordinates[self._free]))
        image: ComplexArray = np.zeros(len(coordinates), dtype=np.complex128)
        image[pins[1]] = 1.0
        image[self._free] = self._solver.solve(-np.asarray(energy @ image)[self._free])
        # E z is zero at the free unknowns, so that one row of it is the energy; what is below zero is rounding.
        force: ComplexArray = np.asarray(energy[[pins[1]]] @ image, dtype=np.complex128)
        self._energy = max(float(force[0].real), 0.0)
        self.image = image

    def pulled(self, pull: ComplexArray) -> ComplexArray:
        """Return the map z of least energy among those of one value of conj(pull) z, whatever the pins.

        It is a sum of the pinned map p and of the response q to the pull with both pins at 0; that the energy is
        least is one linear equation for their shares, conj(conj(pull) p) to conj(p) E p. Where p keeps all angles its
        energy is zero, and it is the answer.

        Args:
            pull: (n,) complex; conj(pull) z must not change when the whole map is moved.

        Returns:
            (n,) images, the first pin at 0; turn and scale are left open.
        """
        response = np.zeros_like(self.image)
        response[self._free] = self._solver.solve(pull[self._free])
        return np.conj(np.vdot(pull, self.image)) * self.image + self._energy * response


# A surface with a border flattened by the least squares conformal map [Levy2002], holes and all.


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
    """Return two vertices of a loop that are far apart, whatever numbering and rounding are.

    From the vertex farthest from the loop's mean the search goes to the farthest vertex again and again until the
    distance no longer grows.

    Args:
        surface: n vertices.
        loop: (l,) vertices, l >= 2.

    Returns:
        (2,) vertices.
    """
    places = surface.vertices[loop]
    here = nearest(-np.linalg.norm(places - places.mean(axis=0), axis=1), places)
    reach = 0.0
    while True:
        distances = np.linalg.norm(places - places[here], axis=1)
        there = nearest(-distances, places)
        if distances[there] <= reach + EQUAL:
            return np.array([loop[there], loop[here]])
        here, reach = there, float(distances[there])


def _require_planar(surface: Surface, loops: tuple[IntArray, ...]) -> None:
    """Refuse what no plane has room for: of one component and b loops the Euler characteristic must be 2 - b."""
    if loops and euler_characteristic(surface) == 2 - len(loops) and not component_labels(surface).any():
        return
    raise FieldError(
        f"{surface.name} ({describe(surface)}) cannot be flattened: 'lscm' needs one component with a border and no "
        "handles. Give a smaller open patch, or use `--backend heat`, which plans on any surface."
    )
