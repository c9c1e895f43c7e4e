"""Seeds: where distance is zero on a surface."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geoprint.errors import FieldError, InputError
from geoprint.geometry.pieces import arc_lengths
from geoprint.geometry.points import PLACE_TOLERANCE, in_words, on_surface, vertex_points
from geoprint.geometry.topology import boundary_loops
from geoprint.model import FloatArray, IntArray, Source, Surface, SurfaceCurves

# Loops that a refusal lists.
MOST_SHOWN = 5


def boundary_source(surface: Surface) -> Source:
    """Return every boundary loop as a closed curve, the longest first.

    Raises:
        FieldError: the surface is closed and has no boundary.
        MeshError: as `boundary_loops`.
    """
    return _of_vertices(surface, [np.append(loop, loop[0]) for loop in _loops(surface)])


def loop_source(surface: Surface, numbers: Sequence[int]) -> Source:
    """Return some boundary loops as closed curves.

    Args:
        surface: with a border.
        numbers: of the loops from 1, the longest; one that comes twice counts once.

    Raises:
        FieldError: the surface is closed, or has no loop of a number.
        MeshError: as `boundary_loops`.
    """
    loops = _loops(surface)
    missing = [number for number in numbers if number > len(loops)]
    if missing:
        shown = (
            f"{number}, {arc_lengths(surface.vertices[np.append(loop, loop[0])])[-1]:.3g} mm long at "
            f"{in_words(surface.vertices[loop[0]])}"
            for number, loop in enumerate(loops[:MOST_SHOWN], start=1)
        )
        raise FieldError(
            f"there is no loop {missing[0]} of the border of {surface.name}, which has {len(loops)}: "
            f"{'; '.join(shown)}{'; ...' if len(loops) > MOST_SHOWN else ''}."
        )
    chosen = [loops[number - 1] for number in dict.fromkeys(numbers)]
    return _of_vertices(surface, [np.append(loop, loop[0]) for loop in chosen])


def nearest_loop(surface: Surface, xyz: FloatArray) -> int:
    """Return the number, from 1, of the boundary loop with the vertex nearest to a place (3,) [mm].

    Raises:
        FieldError: the surface is closed.
    """
    loops = _loops(surface)
    return 1 + int(np.argmin([np.linalg.norm(surface.vertices[loop] - xyz, axis=1).min() for loop in loops]))


def part_source(surface: Surface, first: FloatArray, last: FloatArray, *, through: FloatArray | None = None) -> Source:
    """Return the part of a boundary loop between two of its vertices.

    Args:
        surface: with a border.
        first: (3,) one end is the vertex of the border nearest to it [mm].
        last: (3,) so is the other.
        through: (3,) of the two parts the one that comes nearer to this place is meant [mm]; None for the shorter one.

    Raises:
        FieldError: the surface is closed, the ends lie on different loops, or at one vertex.
    """
    numbers = [nearest_loop(surface, place) for place in (first, last)]
    loop = _loops(surface)[numbers[0] - 1]
    start, end = (int(np.argmin(np.linalg.norm(surface.vertices[loop] - place, axis=1))) for place in (first, last))
    if numbers[0] != numbers[1] or start == end:
        why = "are one vertex of the border" if numbers[0] == numbers[1] else "lie on different loops of the border"
        raise FieldError(
            f"{in_words(first)} and {in_words(last)} {why} of {surface.name}: a part of a loop has two ends on it."
        )
    around = [
        np.roll(loop, -start)[: (end - start) % loop.size + 1],
        np.roll(loop, -end)[: (start - end) % loop.size + 1],
    ]
    places = [surface.vertices[part] for part in around]
    costs = [
        arc_lengths(part)[-1] if through is None else np.linalg.norm(part - through, axis=1).min() for part in places
    ]
    return _of_vertices(surface, [around[int(np.argmin(costs))]])


def _loops(surface: Surface) -> tuple[IntArray, ...]:
    loops = boundary_loops(surface)
    if not loops:
        raise FieldError(
            f"{surface.name} is closed and has no rim to start from; give a point on it with `--from point:X,Y,Z`."
        )
    return loops


def _of_vertices(surface: Surface, chains: Sequence[IntArray]) -> Source:
    """Return curves along vertices; one that ends where it begins is closed."""
    curves = SurfaceCurves(
        points=vertex_points(surface, np.concatenate(chains)),
        offsets=np.cumsum([0, *(chain.size for chain in chains)]),
        closed=np.array([chain[0] == chain[-1] for chain in chains]),
    )
    return Source(curves=curves)


def point_source(surface: Surface, xyz: FloatArray, *, tolerance: float = PLACE_TOLERANCE) -> Source:
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
        raise InputError(f"a source point needs three finite coordinates in mm, found {xyz.tolist()}.")
    points, _ = on_surface(surface, xyz[None, :], what="the source point", tolerance=tolerance)
    curves = SurfaceCurves(points=points, offsets=np.array([0, 1]), closed=np.zeros(1, dtype=np.bool_))
    return Source(curves=curves)
