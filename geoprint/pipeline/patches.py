"""Choosing the patch on a body: around a point, in a box, by the direction it faces; cut with a smooth rim."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from geoprint.backends import FastMarching
from geoprint.config import Job
from geoprint.errors import FieldError, InputError
from geoprint.export import Json
from geoprint.model import FloatArray, Surface
from geoprint.pipeline.rounding import rounded
from geoprint.surfaces import (
    Joined,
    PreparationReport,
    boundary_half_edges,
    clipped,
    closest,
    contracted,
    faces_within,
    join,
    normals,
    part_of,
    piece_at,
    point_seed,
    positions,
    prepare,
    refine,
    signed_volume,
    vertex_normals,
)

# A point may miss the body by this [mm], what is read off a screen being rounded, or by a share of the radius: the
# thickness of the slices of a label volume.
POINT_TOLERANCE = 1.0
POINT_TOLERANCE_SHARE = 0.25
# Edges for each radius: a circle cut through triangles that large is round to a thousandth of its radius.
EDGES_PER_RADIUS = 12


@final
@dataclass(frozen=True, slots=True, eq=False)
class PatchChoice:
    """Where a patch lies on its body; what is given holds together: within the radius and within the box.

    Attributes:
        at: (3,) point on or near the body [mm] that the patch holds, or None.
        radius: greatest distance from it along the surface [mm], or None.
        box: (2, 3) lowest and highest coordinates [mm], or None.
        cone: greatest angle between the surface's normal and that at the point [rad], or None.
    """

    at: FloatArray | None
    radius: float | None
    box: FloatArray | None
    cone: float | None


@final
@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """A patch cut from a body.

    Attributes:
        surface: the patch, as prepared.
        preparation: what joining the body and preparing the surroundings and the patch changed, and the patch.
        body: the whole surface it was cut from, joined and facing outward where it is closed.
        outside: how it is known which side is outside.
        missed: how far the given point lies off the body [mm], or None without a point.
    """

    surface: Surface
    preparation: PreparationReport
    body: Surface
    outside: str
    missed: float | None


def patch_of(job: Job, body: Surface) -> Patch | None:
    """Return the patch that a job cuts from its body, None where the whole body is the part.

    Raises:
        InputError: as `cut_patch`, and so the other errors.
    """
    region = job.patch
    if region is None:
        return None
    choice = PatchChoice(
        at=None if region.at is None else np.array(region.at),
        radius=region.radius,
        box=None if region.box is None else np.array(region.box).reshape(2, 3),
        cone=None if region.cone_deg is None else float(np.radians(region.cone_deg)),
    )
    return cut_patch(body, choice, longest_hole=job.fill_holes)


def cut_patch(body: Surface, choice: PatchChoice, *, longest_hole: float | None = None) -> Patch:
    """Cut a patch out of a body through its triangles.

    Distance is geodesic and measured by fast marching. Only the surroundings of the patch are prepared and, where
    triangles are coarse for the radius, refined, so that a defect elsewhere on the body does no harm.

    Args:
        body: as loaded.
        choice: where.
        longest_hole: as for `prepare` [mm].

    Raises:
        InputError: the body cannot be prepared around the patch, the point lies off it, or there is no surface in the
            box.
        FieldError: the whole body lies within the radius.
    """
    joined = join(body)
    whole, outside = _facing_outward(joined.surface, at=choice.at)
    if choice.at is None:
        near, centre, missed = whole, None, None
    else:
        centre, missed = _on_body(whole, choice.at, radius=choice.radius)
        near = _surroundings(whole, centre, radius=choice.radius)
    part, before = prepare(near, longest_hole=longest_hole)
    if choice.radius is not None:
        part = refine(part, edge_length=choice.radius / EDGES_PER_RADIUS)
    cut = clipped(part, _bounds(part, choice, centre=centre))
    if centre is not None:
        cut = piece_at(cut, centre)
    surface, after = prepare(contracted(cut))
    return Patch(surface, _all_changes(joined, before, after), whole, outside, missed)


def patch_summary(patch: Patch) -> dict[str, Json]:
    """Return what `geoprint patch --json` prints; lengths are mm."""
    found = patch.preparation
    return {
        "body": patch.body.name,
        "topology": found.topology,
        "area_mm2": rounded(found.area),
        "rims_mm": [rounded(length) for length in found.boundary_lengths],
        "faces": found.faces,
        "outside": patch.outside,
        "point_off_body_mm": None if patch.missed is None else rounded(patch.missed),
        "changes": list(found.changes()),
    }


def patch_text(patch: Patch) -> str:
    """Return the lines that a person reads."""
    found = patch.preparation
    rims = ", ".join(f"{length:.4g}" for length in found.boundary_lengths)
    lines = [
        f"patch of {patch.body.name}: {found.topology}, {found.area:.4g} mm2, rims {rims} mm, {found.faces} faces",
        f"outside: {patch.outside}",
    ]
    if found.changes():
        lines.append(f"preparing changed: {'; '.join(found.changes())}")
    return "\n".join(lines)


def _all_changes(joined: Joined, before: PreparationReport, after: PreparationReport) -> PreparationReport:
    """Return the report of the cut patch with the changes that were made on the way to it."""
    return replace(
        after,
        welded_vertices=joined.welded_vertices + before.welded_vertices + after.welded_vertices,
        dropped_degenerate_faces=joined.dropped_degenerate_faces + after.dropped_degenerate_faces,
        dropped_duplicate_faces=joined.dropped_duplicate_faces + after.dropped_duplicate_faces,
        dropped_debris_faces=before.dropped_debris_faces + after.dropped_debris_faces,
        debris_places=before.debris_places + after.debris_places,
        junction_faces=before.junction_faces + after.junction_faces,
        flipped_faces=before.flipped_faces + after.flipped_faces,
        split_vertices=before.split_vertices + after.split_vertices,
        filled_holes=before.filled_holes + after.filled_holes,
        crossings_checked=before.crossings_checked and after.crossings_checked,
    )


def _facing_outward(joined: Surface, *, at: FloatArray | None) -> tuple[Surface, str]:
    """Return a body, turned if it is closed and wound inward, and how its outside is known."""
    whole = joined if at is None else piece_at(joined, at)
    if boundary_half_edges(whole.faces).size:
        return whole, "as the file winds it"
    if signed_volume(whole) > 0:
        return whole, "away from the inside of the closed body"
    return replace(
        whole, faces=whole.faces[:, ::-1]
    ), "away from the inside of the closed body, against the file's winding"


def _on_body(body: Surface, at: FloatArray, *, radius: float | None) -> tuple[FloatArray, float]:
    """Return the (3,) point of the body nearest to a position, and how far it is [mm]."""
    points, distances = closest(body, at[None, :])
    missed = float(distances[0])
    tolerance = max(POINT_TOLERANCE, POINT_TOLERANCE_SHARE * (radius or 0.0))
    nearest = positions(body, points)[0]
    if missed > tolerance:
        raise InputError(
            f"the point {_words(at)} lies {missed:.3g} mm off {body.name}, at most {tolerance:.3g} mm is allowed; the "
            f"nearest point of its surface is {_words(nearest)}.",
            distance=missed,
            tolerance=tolerance,
        )
    return nearest, missed


def _surroundings(body: Surface, centre: FloatArray, *, radius: float | None) -> Surface:
    """Return the piece of a body that holds every line on it from a point that is no longer than the radius."""
    if radius is None:
        return body
    # No point is nearer along the surface than straight.
    return piece_at(part_of(body, faces_within(body, centre, radius=radius)), centre)


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
    return np.column_stack(columns)


def _words(place: FloatArray) -> str:
    return "({:.2f}, {:.2f}, {:.2f}) mm".format(*place)
