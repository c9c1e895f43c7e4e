"""Choosing the patch on a body: by point, box, direction, drawn curve or region of its file; cut with a smooth rim."""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np

from geoprint.backends.marching import FastMarching
from geoprint.config import PatchRegion
from geoprint.errors import FieldError, InputError
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, frozen
from geoprint.pipeline.workpiece.drawn_curve import Enclosed, enclosed
from geoprint.results import Patch
from geoprint.surfaces import (
    boundary_half_edges,
    clipped,
    closest,
    closest_once,
    faces_within,
    in_words,
    normals,
    part_of,
    piece_at,
    point_seed,
    positions,
    signed_volume,
    turned_over,
    vertex_normals,
)
from geoprint.surfaces.files import MeshFile, region_faces
from geoprint.surfaces.remesh import contracted, refine, trimmed
from geoprint.surfaces.repair import Joined, PreparationReport, join, prepare
from geoprint.surfaces.topology import used_vertices

# A point may miss the body by this [mm], what is read off a screen being rounded, or by a share of the radius: the
# thickness of the slices of a label volume.
POINT_TOLERANCE = 1.0
POINT_TOLERANCE_SHARE = 0.25
# Edges for each radius: a circle cut through triangles that large is round to a thousandth of its radius.
EDGES_PER_RADIUS = 12


@final
@frozen
class PatchChoice:
    """Where a patch lies on its body; what is given holds together, as within the radius and within the box.

    Attributes:
        at: (3,) point on or near the body [mm] that the patch holds, or None.
        radius: greatest distance from it along the surface [mm], or None.
        box: (2, 3) lowest and highest coordinates [mm], or None.
        cone: greatest angle between the surface's normal and that at the point [rad], or None.
        curve: (k, 3) points on or near the body [mm], in order round the patch, or None; the patch is the side that
            holds the point, without one the smaller side.
        region: faces of the body, as loaded, or None.
    """

    at: FloatArray | None
    radius: float | None
    box: FloatArray | None
    cone: float | None
    curve: FloatArray | None = None
    region: IntArray | None = None


def choice_of(region: PatchRegion, body: MeshFile) -> PatchChoice:
    """Return a patch's place on a body as a job states it, with angles in rad.

    Raises:
        UsageError: the body's file has no such region.
    """
    return PatchChoice(
        at=None if region.at is None else np.array(region.at),
        radius=region.radius,
        box=None if region.box is None else np.array(region.box).reshape(2, 3),
        cone=None if region.cone_deg is None else float(np.radians(region.cone_deg)),
        curve=None if region.curve is None else np.array(region.curve),
        region=None if region.region is None else region_faces(body.regions, region.region, file=body.surface.name),
    )


def cut_patch(body: Surface, choice: PatchChoice, *, longest_hole: float | None = None) -> Patch:
    """Cut a patch out of a body through its triangles.

    Distance is geodesic and measured by fast marching. Only the surroundings of the patch are prepared and, where
    triangles are coarse for the radius, refined, so that a defect elsewhere on the body does no harm; with a curve,
    whose inside is not known before, all of the piece that it lies on. A region alone is cut out as it is; with a
    radius or a curve, which are measured on the whole body, it bounds what they leave.

    Args:
        body: as loaded.
        choice: where.
        longest_hole: as for `prepare` [mm].

    Raises:
        InputError: the body cannot be prepared around the patch, a point lies off it, the curve encloses nothing, or
            there is no surface in the box.
        FieldError: the whole body lies within the radius, or points of the curve are too far apart.
    """
    joined = join(body)
    whole, outside, turned = _facing_outward(joined.surface, at=_some_place(body, choice))
    region = None if choice.region is None else _faces_of(body, choice.region)
    near = whole
    if region is not None and choice.radius is None and choice.curve is None:
        # Nothing is measured beyond the region, so that only the region must be sound.
        joined, region = join(region), None
        near = turned_over(joined.surface) if turned else joined.surface
    centre, curve, missed = _on_body(near, choice)
    near = _surroundings(near, centre=centre, curve=curve, radius=choice.radius)
    part, before = prepare(near, longest_hole=longest_hole)
    if choice.radius is not None:
        part = refine(part, edge_length=choice.radius / EDGES_PER_RADIUS)
    kept, inside = np.ones(len(part.faces), dtype=np.bool_), None
    if curve is not None:
        drawn = enclosed(part, curve, at=centre)
        part, kept, inside = drawn.surface, drawn.inside, _inside(drawn, points=len(curve), at=centre)
    if region is not None:
        kept = _within_region(part, kept, region, tolerance=joined.tolerance)
    bounds = _bounds(part, choice, centre=centre)
    cut = clipped(part_of(part, kept), bounds[used_vertices(part.faces[kept])])
    if centre is not None:
        cut = piece_at(cut, centre)
    surface, after = prepare(trimmed(contracted(cut)))
    return Patch(surface, _all_changes(joined, before, after), whole, outside, missed, inside)


def _all_changes(joined: Joined, before: PreparationReport, after: PreparationReport) -> PreparationReport:
    """Return the report of the cut patch with all changes that were made before it was cut."""
    repairs = replace(
        joined.repairs + before.repairs + after.repairs,
        # Vertices that the patch leaves out are not told.
        dropped_unreferenced_vertices=after.repairs.dropped_unreferenced_vertices,
    )
    return replace(after, repairs=repairs, crossings_checked=before.crossings_checked and after.crossings_checked)


def _some_place(body: Surface, choice: PatchChoice) -> FloatArray | None:
    """Return a (3,) place on or near the patch [mm], None where nothing but a box is given."""
    if choice.at is not None:
        return choice.at
    if choice.curve is not None:
        return choice.curve[0]
    return None if choice.region is None else body.vertices[body.faces[choice.region[0]]].mean(axis=0)


def _facing_outward(joined: Surface, *, at: FloatArray | None) -> tuple[Surface, str, bool]:
    """Return a body, turned if it is closed and wound inward, how its outside is known, and whether it was turned."""
    whole = joined if at is None else piece_at(joined, at)
    if boundary_half_edges(whole.faces).size:
        return whole, "as the file winds it", False
    if signed_volume(whole) > 0:
        return whole, "away from the inside of the closed body", False
    return turned_over(whole), "away from the inside of the closed body, against the file's winding", True


def _faces_of(body: Surface, chosen: IntArray) -> Surface:
    kept = np.zeros(len(body.faces), dtype=np.bool_)
    kept[chosen] = True
    return part_of(body, kept)


def _within_region(part: Surface, kept: BoolArray, region: Surface, *, tolerance: float) -> BoolArray:
    """Return which of the kept faces of a surface lie on a region of the body that it was made from."""
    within = kept.copy()
    within[kept] = closest(region, part.vertices[part.faces[kept]].mean(axis=1))[1] <= tolerance
    if not within.any():
        raise InputError(f"nothing of the region of {part.name} lies within the other bounds; give fewer of them.")
    return within


def _on_body(body: Surface, choice: PatchChoice) -> tuple[FloatArray | None, FloatArray | None, float | None]:
    """Return the points of the body nearest to the point and the curve of a choice, and the largest distance [mm]."""
    given = [places for places in (choice.at, choice.curve) if places is not None]
    if not given:
        return None, None, None
    places = np.vstack(given)
    points, distances = closest_once(body, places)
    nearest = positions(body, points)
    worst = int(np.argmax(distances))
    missed = float(distances[worst])
    tolerance = max(POINT_TOLERANCE, POINT_TOLERANCE_SHARE * (choice.radius or 0.0))
    if missed > tolerance:
        raise InputError(
            f"the point {in_words(places[worst])} lies {missed:.3g} mm off {body.name}, at most {tolerance:.3g} mm is "
            f"allowed; the nearest point of its surface is {in_words(nearest[worst])}.",
            distance=missed,
            tolerance=tolerance,
        )
    curve = None if choice.curve is None else nearest[-len(choice.curve) :]
    return None if choice.at is None else nearest[0], curve, missed


def _surroundings(
    body: Surface, *, centre: FloatArray | None, curve: FloatArray | None, radius: float | None
) -> Surface:
    """Return the piece of a body on which the patch lies, less what is farther from its point than the radius."""
    if curve is not None:
        return piece_at(body, curve[0])
    if centre is None:
        return body
    if radius is not None:
        # No point is nearer along the surface than straight.
        body = part_of(body, faces_within(body, centre, radius=radius))
    return piece_at(body, centre)


def _inside(drawn: Enclosed, *, points: int, at: FloatArray | None) -> str:
    curve = f"a curve of {points} points, {drawn.length:.4g} mm long"
    if at is not None:
        return f"{curve}; the side of the point, {drawn.share:.0%} of the area"
    return f"{curve}; the smaller side, {drawn.share:.0%} of the area: `--at X Y Z` chooses the other"


def _bounds(part: Surface, choice: PatchChoice, *, centre: FloatArray | None) -> FloatArray:
    """Return (n, k) functions that are positive outside the patch."""
    columns: list[FloatArray] = []
    if choice.radius is not None and centre is not None:
        seed = point_seed(part, centre, tolerance=POINT_TOLERANCE)
        distances = FastMarching(part).distance(seed)
        if distances.maximum <= choice.radius:
            raise FieldError(
                f"all of {part.name} lies within {choice.radius:g} mm of the point, the farthest place "
                f"{distances.maximum:.3g} mm along the surface; choose a smaller radius, or plan the whole of it.",
                farthest=distances.maximum,
            )
        columns.append(distances.values - choice.radius)
    if choice.cone is not None and centre is not None:
        axis = normals(part, closest(part, centre[None, :])[0])[0]
        columns.append(np.arccos(np.clip(vertex_normals(part) @ axis, -1.0, 1.0)) - choice.cone)
    if choice.box is not None:
        lowest, highest = choice.box
        columns += [*(lowest - part.vertices).T, *(part.vertices - highest).T]
    return np.column_stack([np.empty((len(part.vertices), 0)), *columns])
