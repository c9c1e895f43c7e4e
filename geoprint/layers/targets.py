"""What layers fill: a closed shape or a thickness at every place, and levels cut by it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, final

import numpy as np

from geoprint.errors import FieldError, InputError, MeshError
from geoprint.geometry import (
    PolylineDistance,
    boundary_loops,
    clipped,
    closest,
    component_labels,
    edges,
    face_areas,
    face_normals,
    half_edges,
    in_words,
    middle_of,
    part_of,
    pieces,
    positions,
    refine,
    signed_volume,
    turned_over,
)
from geoprint.geometry.manifold import split_vertices
from geoprint.geometry.topology import numbered_pairs
from geoprint.layers.feet import Ground
from geoprint.layers.refining import fine_where
from geoprint.model import FloatArray, IntArray, Surface, SurfacePoints

# What layers fill: a closed shape, or a thickness at every place of the part; and how deep within it places lie.


# Weights below this count as none: the closest place lies on an edge or at a corner.
ON_EDGE = 1e-9
# The height of a shape is looked for at places so far apart [mm], at most so many across it.
LOOKED_AT, MOST_ACROSS = 1.0, 200
# A vertex of a shape that lies on the part is over it, as exactly as files are written [mm].
TOUCHING = 1e-3
# So many places tell a volume to a few thousandths; steps of the additive sequence that spreads them over a box: powers
# of one over the root of x^4 = x + 1 [Roberts2018].
PLACES = 200_000
STEPS = (0.8191725133961645, 0.6710436067037893, 0.5497004779019703)
# Where its edges pass the rim is found by so many halvings: a thousandth of a millimetre and less.
HALVINGS = 12


class LayerTarget(Protocol):
    """What layers fill.

    Attributes:
        thickness: the largest over the part [mm].
    """

    thickness: float

    @property
    def volume(self) -> float | None:
        """Of what is over the part [mm3], or None where nobody knows."""
        ...

    def depth(self, places: FloatArray) -> FloatArray:
        """Return how deep (k, 3) places lie within [mm], below 0 outside."""
        ...


@final
class TargetShape:
    """A closed shape.

    Args:
        shape: closed and without triangles that cross, of either winding.
        part: that the layers lie on.

    Raises:
        MeshError: the shape is open.
        FieldError: nothing of it is over the outer side of the part.
    """

    def __init__(self, shape: Surface, part: Surface) -> None:
        loops = boundary_loops(shape)
        if loops:
            raise MeshError(
                f"the target {shape.name} is open: it has {len(loops)} border{'s' if len(loops) > 1 else ''}. Close "
                "it, or give a `--thickness`."
            )
        volume = signed_volume(shape)
        self._part, self._shape = part, shape if volume > 0.0 else turned_over(shape)
        self._faces = face_normals(self._shape)
        pairs, edge = numbered_pairs(half_edges(self._shape.faces))
        self._edge: IntArray = edge.reshape(-1, 3)
        self._edges = np.zeros((len(pairs), 3))
        np.add.at(self._edges, edge, np.repeat(self._faces, 3, axis=0))
        self._corners = _angle_weighted(self._shape, self._faces)
        self.thickness = self._highest(part)

    @property
    def volume(self) -> float | None:
        """Of what is over the part [mm3]: exact where all of it is, else by places spread over the box around it."""
        ground, vertices = Ground(self._part), self._shape.vertices
        feet, distances = ground.feet(vertices)
        inside, outer = ground.beyond(vertices, feet) <= TOUCHING, distances >= -TOUCHING
        if (inside & outer).all():
            return signed_volume(self._shape)
        low, sides = vertices.min(axis=0), np.ptp(vertices, axis=0)
        places = low + sides * np.mod(0.5 + np.outer(np.arange(PLACES), STEPS), 1.0)
        within = places[self.depth(places) >= 0.0]
        feet, distances = ground.feet(within)
        over = (distances >= 0.0) & (ground.beyond(within, feet) <= 0.0)
        return float(over.sum() / PLACES * sides.prod())

    def depth(self, places: FloatArray) -> FloatArray:
        """Return how deep (k, 3) places lie within the shape [mm], below 0 outside; exact up to rounding.

        The sign is that of the mean normal of the faces about the closest place, weighted by their angles
        [Baerentzen2005].
        """
        points, distances = closest(self._shape, places)
        outwards = np.einsum("kx,kx->k", places - positions(self._shape, points), self._normals(points))
        return np.where(outwards > 0.0, -distances, distances)

    def _normals(self, points: SurfacePoints) -> FloatArray:
        """Return (k, 3) the normals that tell the sides of points: of their face, of their edge, or of their corner."""
        off = points.weights <= ON_EDGE
        found = self._faces[points.faces].copy()
        on_edge, at_corner = off.sum(axis=1) == 1, off.sum(axis=1) == 2
        # A weight of nothing is that of the corner which the edge lies opposite to.
        opposite = (off[on_edge].argmax(axis=1) + 1) % 3
        found[on_edge] = self._edges[self._edge[points.faces[on_edge], opposite]]
        corner = points.weights[at_corner].argmax(axis=1)
        found[at_corner] = self._corners[self._shape.faces[points.faces[at_corner], corner]]
        return found

    def _highest(self, part: Surface) -> float:
        """Return how high the shape ends over the part [mm]."""
        across = float(np.linalg.norm(np.ptp(self._shape.vertices, axis=0)))
        looked_at = refine(self._shape, edge_length=max(LOOKED_AT, across / MOST_ACROSS))
        ground = Ground(part)
        over = ground.feet(_standing_on(ground, looked_at))[1]
        if over.max(initial=0.0) <= 0.0:
            raise FieldError(
                f"no part of the target {self._shape.name} lies over the outer side of {part.name}. Check "
                "coordinates, unit and printed side (`--flip`)."
            )
        return float(over.max())


@final
class TargetThickness:
    """A thickness that varies over the part.

    Args:
        part: refined as far as the thickness is linear in its triangles.
        thickness: (n,) at its vertices [mm], along the distance from it; 0 where nothing shall lie.

    Raises:
        FieldError: it is 0 everywhere.
    """

    def __init__(self, part: Surface, thickness: FloatArray) -> None:
        self.thickness = float(thickness.max())
        if self.thickness <= 0.0:
            raise FieldError(f"the thickness over {part.name} is 0 everywhere: increase it.")
        self._part, self._thickness = part, thickness

    @property
    def volume(self) -> float | None:
        """None: it is what the layers hold."""
        return None

    def depth(self, places: FloatArray) -> FloatArray:
        """Return how far below the top (k, 3) places lie [mm], below 0 over it."""
        points, distances = closest(self._part, places)
        return points.values(self._part, self._thickness) - distances


def _standing_on(ground: Ground, surface: Surface) -> FloatArray:
    """Return the vertices of a surface over or under the part, and where its edges pass the rim; there may be none."""
    if not ground.rimmed:
        return surface.vertices
    beyond = ground.beyond(surface.vertices, ground.feet(surface.vertices)[0])
    pairs = edges(surface.faces)
    passing = pairs[np.sign(beyond[pairs]).prod(axis=1) < 0.0]
    ends = np.take_along_axis(passing, beyond[passing].argsort(axis=1), axis=1)
    inner, outer = surface.vertices[ends[:, 0]], surface.vertices[ends[:, 1]]
    for _ in range(HALVINGS):
        middles = (inner + outer) / 2.0
        out = (ground.beyond(middles, ground.feet(middles)[0]) > 0.0)[:, None]
        inner, outer = np.where(out, inner, middles), np.where(out, middles, outer)
    return np.concatenate([surface.vertices[beyond <= 0.0], inner])


def _angle_weighted(surface: Surface, upright: FloatArray) -> FloatArray:
    """Return (n, 3) the sum of the (m, 3) normals of the faces about each vertex, weighted by their angles there."""
    corners = surface.vertices[surface.faces]
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    sines = np.linalg.norm(np.cross(ahead, back), axis=2)
    angles = np.arctan2(sines, np.einsum("mcx,mcx->mc", ahead, back))
    total = np.zeros_like(surface.vertices)
    np.add.at(total, surface.faces, angles[:, :, None] * upright[:, None])
    return total


# A level cut by what the layers fill, what holds it from below, and the sides of what is printed.


# A layer may stand out over the one below by this share of its own height: what leans by 45 degrees stands by itself.
OUT_SHARE = 1.0
# Sides with less area [mm2] are left out: where the rim stands in a crease.
LEAST_AREA = 1e-6
# The rim of a piece is cut to this share of the spacing to find its width: that sets speed, not accuracy.
STEP_SHARE = 0.1
# The width of a piece is looked for at places so far apart, over the spacing.
WIDTH_SHARE = 0.1


def cut(part: Surface, level: Surface, target: LayerTarget, *, height: float, tolerance: float) -> Surface:
    """Return what of a level lies within a target.

    Args:
        part: that the level is over.
        level: its surface.
        target: what the layers fill.
        height: of the level over the part [mm].
        tolerance: how far the new rim may lie off the target between its vertices [mm], if halving edges reaches it.

    Raises:
        FieldError: nothing of it does.
    """
    surface = fine_where(Ground(part), level, target.depth, height=height, tolerance=tolerance)
    depths = target.depth(surface.vertices)
    if depths.min() >= 0.0:
        return level
    try:
        return split_vertices(clipped(surface, -depths[:, None]))
    except InputError as error:
        raise FieldError(f"nothing of the target lies {height:.3g} mm over {part.name}.") from error


def without_crumbs(surface: Surface, *, spacing: float) -> tuple[Surface, float]:
    """Return a surface without pieces so narrow that no path fits in, and the area of these [mm2].

    Raises:
        FieldError: no piece is left.
    """
    wide = np.array([_is_wide(piece.surface, spacing=spacing) for piece in pieces(surface)])
    if not wide.any():
        raise FieldError(f"all of it is narrower than the spacing of {spacing:g} mm: choose a smaller one.")
    if wide.all():
        return surface, 0.0
    kept = wide[component_labels(surface)]
    return part_of(surface, kept), float(face_areas(surface)[~kept].sum())


def area_standing_out(part: Surface, surface: Surface, target: LayerTarget, *, below: float, height: float) -> float:
    """Return how much of a layer stands out over the one below by more than its own height [mm2].

    Args:
        part: that the layers lie on.
        surface: in the middle of the layer.
        target: that both fill.
        below: height of the middle of the layer below over the part [mm].
        height: of a layer [mm].

    Raises:
        FieldError: a piece of it has nothing below.
    """
    ground = Ground(part)
    depths = target.depth(ground.raised(surface.vertices, below))
    middles = surface.vertices[surface.faces].mean(axis=1)
    held = target.depth(ground.raised(middles, below)) > 0.0
    labels = component_labels(surface)
    for number, piece in enumerate(pieces(surface)):
        if not held[labels == number].any():
            raise FieldError(
                f"about {in_words(middle_of(piece.surface))} it would hang in the air, with no target below. Print "
                "that component by itself, or turn the target."
            )
    if held.all() or depths.max() <= 0.0:
        return float(face_areas(surface)[~held].sum())
    # A place that hangs may still be near the target that rises beside it: how far out it is shows on the layer itself.
    _, out = closest(clipped(surface, -depths[:, None]), middles)
    return float(face_areas(surface)[out > OUT_SHARE * height].sum())


@final
class Columns:
    """What layers fill, seen from above: a place counts where one of them lies under or over it.

    Args:
        part: that the layers lie on.
        target: what they fill.
        middles: their heights over the part [mm], at least one.
    """

    def __init__(self, part: Surface, target: LayerTarget, middles: Sequence[float]) -> None:
        self.thickness = target.thickness
        self._ground, self._target, self._middles = Ground(part), target, middles

    @property
    def volume(self) -> float | None:
        """That of what they fill."""
        return self._target.volume

    def depth(self, places: FloatArray) -> FloatArray:
        """Return how deep (k, 3) places lie within the widest column [mm], below 0 outside of all."""
        depths = [self._target.depth(self._ground.raised(places, middle)) for middle in self._middles]
        return np.max(depths, axis=0)


def with_sides(part: Surface, surface: Surface) -> Surface:
    """Return a level over a part with the sides of what lies under it: from its rim straight down to the part."""
    loops = boundary_loops(surface)
    if not loops:
        return surface
    rim, ahead = np.concatenate(loops), np.concatenate([np.roll(loop, -1) for loop in loops])
    vertices = np.concatenate([surface.vertices, Ground(part).feet(surface.vertices[rim])[0]])
    foot = np.full(len(vertices), -1)
    foot[rim] = len(surface.vertices) + np.arange(len(rim))
    sides = np.concatenate([
        np.column_stack([ahead, rim, foot[rim]]),
        np.column_stack([ahead, foot[rim], foot[ahead]]),
    ])  # fmt: skip
    kept = sides[face_areas(Surface(vertices, sides)) > LEAST_AREA]
    return Surface(vertices, np.concatenate([surface.faces, kept]), surface.name)


def _is_wide(piece: Surface, *, spacing: float) -> bool:
    """Say whether a place of a piece is half a spacing [mm] from its rim, so that the first path has room."""
    loops = boundary_loops(piece)
    if not loops:
        return True
    away = PolylineDistance([piece.vertices[np.append(loop, loop[0])] for loop in loops], step=STEP_SHARE * spacing)
    if away(piece.vertices).max() > spacing / 2.0:
        return True
    # Its triangles may be so large that the vertices all lie near the rim, whatever lies between them.
    fine = refine(piece, edge_length=WIDTH_SHARE * spacing)
    return bool(away(fine.vertices).max() > spacing / 2.0)
