"""A level cut by what the layers fill, what holds it from below, and the sides of what is printed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np

from geoprint.errors import FieldError, InputError
from geoprint.layers.feet import Ground
from geoprint.layers.refining import fine_where
from geoprint.layers.targets import LayerTarget
from geoprint.model import FloatArray, Surface
from geoprint.surfaces import (
    PolylineDistance,
    boundary_loops,
    clipped,
    closest,
    component_labels,
    face_areas,
    in_words,
    middle_of,
    part_of,
    pieces,
)
from geoprint.surfaces.remesh import refine
from geoprint.surfaces.repair.manifold import split_vertices

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
        raise FieldError(f"nothing of it is as wide as the spacing of {spacing:g} mm: choose a smaller one.")
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
                f"about {in_words(middle_of(piece.surface))} it would hang in the air: nothing of the target lies "
                "below. Print that piece by itself, or turn the target."
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
    vertices = np.concatenate([surface.vertices, Ground(part).feet(surface.vertices[rim]).places])
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
