"""Choosing the patch on a body: by point, box, direction, drawn curve or region of its file; cut with a smooth rim."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations, pairwise
from typing import final

import numpy as np

from geoprint.config import Job, PatchRegion
from geoprint.distance.fast_marching import FastMarching
from geoprint.errors import FieldError, InputError, how_many, naming, percent
from geoprint.geometry import (
    PLACE_TOLERANCE,
    Joined,
    PolylineDistance,
    PreparationReport,
    SurfaceLine,
    boundary_half_edges,
    boundary_loops,
    boundary_source,
    clipped,
    closest,
    closest_once,
    connected_nodes,
    contracted,
    edge_faces,
    edge_keys,
    edge_lengths,
    edges,
    face_areas,
    faces_within,
    half_edges,
    halved,
    in_words,
    inscribed,
    join,
    normals,
    part_of,
    piece_at,
    point_source,
    positions,
    prepare,
    refine,
    signed_volume,
    trimmed,
    triple,
    turned_over,
    united,
    vertex_normals,
    with_vertex,
)
from geoprint.geometry.files import MeshFile, region_faces
from geoprint.geometry.topology import used_vertices
from geoprint.metrics.oracle import shortest_way
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, frozen
from geoprint.results import Patch

# A closed curve drawn on a body: points joined by the shortest lines over the triangles, and what it encloses.


def enclosed(surface: Surface, points: FloatArray, *, at: FloatArray | None) -> tuple[Surface, BoolArray, float, float]:
    """Draw a closed curve into the triangles of a surface and choose one of its sides.

    Args:
        surface: manifold, in one piece.
        points: (k, 3) on the surface [mm], in order round the curve; one that repeats its predecessor is left out, and
            so is the last where it repeats the first.
        at: (3,) on the side that is meant [mm]; None for the one with the smaller area.

    Returns:
        The surface with the curve along edges; (m,) which faces of it lie on the chosen side; the length of the curve
        [mm]; and which share of the area is inside.

    Raises:
        InputError: fewer than three different points, the curve meets itself, or it does not divide the surface.
        FieldError: two neighbouring points have no connection that can be found.
    """
    corners: list[int] = []
    for point in points:
        surface, vertex = with_vertex(surface, point)
        corners.append(vertex)
    corners = [vertex for vertex, before in zip(corners, [corners[-1], *corners[:-1]], strict=True) if vertex != before]
    if len(corners) < 3:
        raise InputError(
            (
                f"a closed curve on {surface.name} needs at least three points, found "
                f"{how_many(len(corners), 'different point')}."
            ),
            points=len(corners),
        )
    repeated = [vertex for index, vertex in enumerate(corners) if vertex in corners[:index]]
    if repeated:
        raise _meeting(surface, surface.vertices[repeated[0]])
    surface, chain, length = _drawn(surface, corners)
    left, right = _sides(surface, chain)
    areas = face_areas(surface)
    if at is None:
        inside = left if areas[left].sum() <= areas[right].sum() else right
    else:
        inside = left if left[closest(surface, at[None, :])[0].faces[0]] else right
    return surface, inside, length, float(areas[inside].sum() / areas.sum())


def _drawn(surface: Surface, corners: list[int]) -> tuple[Surface, IntArray, float]:
    """Join vertices in turn; return the surface with these lines as edges, their vertices in turn and their length."""
    chain, length = np.array(corners[:1]), 0.0
    for first, last in pairwise([*corners, corners[0]]):
        line = shortest_way(surface, first, last)
        _refuse_meeting(surface, line, chain)
        surface, vertices = inscribed(surface, line)
        chain, length = np.concatenate([chain, vertices[1:]]), length + line.length
    return surface, chain[:-1], length


def _refuse_meeting(surface: Surface, line: SurfaceLine, chain: IntArray) -> None:
    """Refuse a line that meets those drawn before it anywhere but at its own ends."""
    count = len(surface.vertices)
    drawn = edge_keys(np.column_stack([chain[:-1], chain[1:]]), vertices=count)
    crossed = edge_keys(line.edges, vertices=count)
    passes = (line.edges[:, 0] == line.edges[:, 1]) & np.isin(line.edges[:, 0], chain)
    # It starts where the last line ended, and the closing one ends where the first began.
    passes[0] = False
    passes[-1] &= line.edges[-1, 0] != chain[0]
    met = np.flatnonzero(passes | np.isin(crossed, drawn))
    if met.size:
        raise _meeting(surface, line.places(surface)[met[0]])


def _meeting(surface: Surface, place: FloatArray) -> InputError:
    return InputError(
        f"the curve on {surface.name} crosses itself at {in_words(place)}. Give its points in order around the patch, "
        "each once, and more of them at sharp turns.",
        place=triple(place),
    )


def _sides(surface: Surface, chain: IntArray) -> tuple[BoolArray, BoolArray]:
    """Return (m,) which faces lie on the left and on the right of a closed chain of edges."""
    ends, beside = edges(surface.faces), edge_faces(surface.faces)
    count, following = len(surface.vertices), np.roll(chain, -1)
    drawn = edge_keys(np.column_stack([chain, following]), vertices=count)
    joined = beside[(beside[:, 1] >= 0) & ~np.isin(edge_keys(ends, vertices=count), drawn)]
    labels = connected_nodes(*joined.T, nodes=len(surface.faces))
    halves = half_edges(surface.faces) @ np.array([count, 1])
    on_left = np.unique(labels[np.flatnonzero(np.isin(halves, chain * count + following)) // 3])
    on_right = np.unique(labels[np.flatnonzero(np.isin(halves, following * count + chain)) // 3])
    if np.intersect1d(on_left, on_right).size or min(on_left.size, on_right.size) == 0:
        raise InputError(
            f"the curve does not divide {surface.name} into inside and outside: it follows a handle or the border. "
            "Draw it around the patch."
        )
    return np.isin(labels, on_left), np.isin(labels, on_right)


# A point may miss the body by a share of the radius, too: the thickness of the slices of a label volume.
POINT_TOLERANCE_SHARE = 0.25
# No farther from a border than so many margins edges are at most such a share of one long.
MARGINS_REFINED, MARGIN_SHARE = 1.5, 0.25
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
        part, kept, length, share = enclosed(part, curve, at=centre)
        inside = _inside(length, share, points=len(curve), at=centre)
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
        # Vertices that the patch leaves out are not reported.
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
    tolerance = max(PLACE_TOLERANCE, POINT_TOLERANCE_SHARE * (choice.radius or 0.0))
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


def _inside(length: float, share: float, *, points: int, at: FloatArray | None) -> str:
    curve = f"a curve of {points} points, {length:.4g} mm long"
    if at is not None:
        return f"{curve}; the side of the point, {percent(share)} of the area"
    return f"{curve}; the smaller side, {percent(share)} of the area: `--at X Y Z` chooses the other"


def _bounds(part: Surface, choice: PatchChoice, *, centre: FloatArray | None) -> FloatArray:
    """Return (n, k) functions that are positive outside the patch."""
    columns: list[FloatArray] = []
    if choice.radius is not None and centre is not None:
        source = point_source(part, centre)
        distances = FastMarching(part).distance(source)
        if distances.maximum <= choice.radius:
            raise FieldError(
                f"all of {part.name} lies within {choice.radius:g} mm of the point; the farthest point is "
                f"{distances.maximum:.3g} mm away along the surface. Choose a smaller radius, or plan the whole part.",
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


# The patches of one job: cut from one body, kept apart, and put together to the part that is planned.


# Patches may reach over each other's rim by this [mm], which no bead notices, or by this share of an edge: as far as a
# cut slides vertices beside it.
OVERLAP_TOLERANCE = 0.1
OVERLAP_SHARE = 0.1
# Patches are cut into triangles this many times smaller than they are to find where they overlap.
TRIANGLES_ACROSS = 30


@final
@frozen
class PreparedPart:
    """The part of a job, on the side that the file is wound to.

    Attributes:
        surface: as prepared; of several patches their union, in their order.
        preparations: what preparing changed, patch by patch.
        patches: that it was cut as, none where the file is the part.
        body: what they were cut from, or None.
    """

    surface: Surface
    preparations: tuple[PreparationReport, ...]
    patches: tuple[Patch, ...]
    body: Surface | None


def prepared_part(job: Job, loaded: MeshFile) -> PreparedPart:
    """Prepare what a file holds, or cut the patches out of it that a job names.

    Raises:
        MeshError: the file cannot be prepared.
        InputError: a patch cannot be cut, or two overlap; of several patches the sentence says which.
    """
    patches = patches_of(job, loaded)
    if not patches:
        whole, preparation = prepare(loaded.surface, longest_hole=job.fill_holes)
        surface, changed = without_empty(whole, preparation, job.keep_outs, margin=job.margin)
        return PreparedPart(surface, (changed,), (), None if surface is whole else whole)
    surface = united([patch.surface for patch in patches])
    return PreparedPart(surface, tuple(patch.preparation for patch in patches), patches, _common_body(patches))


def patches_of(job: Job, body: MeshFile, *, observe: Callable[[str], None] = lambda _: None) -> tuple[Patch, ...]:
    """Return the patches that a job cuts from its body, in its order; none where the whole body is the part.

    Raises:
        UsageError: the body's file has no such region.
        InputError: as `cut_patch`, and so the other errors; or two patches overlap. The sentence says which.
    """
    several = len(job.patches) > 1
    patches: list[Patch] = []
    for number, region in enumerate(job.patches, start=1):
        observe("cutting")
        place = "" if region.at is None else f" at {in_words(np.array(region.at))}"
        with naming(f"patch {number}{place}" if several else ""):
            patches.append(cut_patch(body.surface, choice_of(region, body), longest_hole=job.fill_holes))
    _refuse_overlaps(patches)
    nearest = [_nearest_patch(patches, np.array(curve)) for curve in job.keep_outs if patches]
    for number, patch in enumerate(patches):
        curves = [curve for curve, there in zip(job.keep_outs, nearest, strict=True) if there == number]
        with naming(f"patch {number + 1}" if several else ""):
            surface, preparation = without_empty(patch.surface, patch.preparation, curves, margin=job.margin)
        patches[number] = replace(patch, surface=surface, preparation=preparation)
    return tuple(patches)


def _nearest_patch(patches: Sequence[Patch], curve: FloatArray) -> int:
    """Return which patch a curve lies on."""
    return int(np.argmin([closest(patch.surface, curve)[1].max() for patch in patches]))


def without_empty(
    surface: Surface,
    preparation: PreparationReport,
    keep_outs: Sequence[Sequence[Sequence[float]]],
    *,
    margin: float | None,
) -> tuple[Surface, PreparationReport]:
    """Cut off a part what stays empty: the inside of closed curves, as holes, then a strip along every border.

    Args:
        surface: as prepared, in one piece.
        preparation: what that changed.
        keep_outs: k points on or near the part each [mm], in order round what is left out: the smaller side.
        margin: width of the strip along the surface [mm]; None for no strip.

    Returns:
        The rest of the part, the surface itself where nothing is cut off, and all that was changed.

    Raises:
        InputError: a point lies off the part, or as `enclosed`; with several curves the sentence says which. Or the
            strip leaves nothing of the part, or several pieces, or there is no border.
        FieldError: as `enclosed`.
    """
    for number, curve in enumerate(keep_outs, start=1):
        with naming(f"keep-out {number}" if len(keep_outs) > 1 else "the keep-out"):
            _, points, _ = _on_body(surface, PatchChoice(None, None, None, None, curve=np.array(curve)))
            assert points is not None  # noqa: S101  # They were given.
            drawn, inside, *_ = enclosed(surface, points, at=None)
            surface, preparation = _rest(part_of(drawn, ~inside), preparation)
    if margin is not None:
        surface, preparation = _rest(_within(surface, margin), preparation)
    return surface, preparation


def _rest(kept: Surface, preparation: PreparationReport) -> tuple[Surface, PreparationReport]:
    """Return what is left of a part, prepared, and all that was changed."""
    # A keep-out of three points looks as a missing triangle does, and is no hole to be filled.
    surface, after = prepare(trimmed(contracted(kept)), longest_hole=0.0)
    repairs = preparation.repairs + after.repairs
    crossings_checked = preparation.crossings_checked and after.crossings_checked
    return surface, replace(after, repairs=repairs, crossings_checked=crossings_checked)


def _within(surface: Surface, margin: float) -> Surface:
    """Return what of a part lies farther from its border than so much along the surface [mm]."""
    if not boundary_half_edges(surface.faces).size:
        raise InputError(
            f"{surface.name} is closed and has no border along which a margin could stay empty: leave `margin` out, or "
            "cut patches from it."
        )
    while True:
        distances = _from_border(surface)
        # Where edges are about as long as the strip is wide, it would be cut as roughly as they are.
        near = surface.faces[distances[surface.faces].min(axis=1) < MARGINS_REFINED * margin]
        ends = edges(near)
        long = np.linalg.norm(np.diff(surface.vertices[ends], axis=1)[:, 0], axis=1) > MARGIN_SHARE * margin
        if not long.any():
            break
        surface = halved(surface, ends[long])
    if distances.max() <= margin:
        raise InputError(
            f"a margin of {margin:g} mm leaves nothing of {surface.name}: no place is farther than "
            f"{distances.max():.3g} mm from its border. Choose a smaller one.",
            farthest=float(distances.max()),
        )
    return clipped(surface, margin - distances[:, None])


def _from_border(surface: Surface) -> FloatArray:
    """Return the (n,) distances of vertices from the border along the surface [mm]."""
    if np.unique(boundary_half_edges(surface.faces)).size == len(surface.vertices):
        # Of triangles so coarse none has a corner inside.
        return np.zeros(len(surface.vertices))
    return FastMarching(surface).distance(boundary_source(surface)).values


def _refuse_overlaps(patches: Sequence[Patch]) -> None:
    """Refuse patches of which one lies on another: there material would be deposited twice."""
    for (i, one), (j, other) in combinations(enumerate(patches, start=1), 2):
        edge = max(float(edge_lengths(patch.surface).mean()) for patch in (one, other))
        allowed = max(OVERLAP_TOLERANCE, OVERLAP_SHARE * edge)
        for first, second, number in ((one, other, j), (other, one, i)):
            depth, place = _deepest(first.surface, second.surface, near=allowed)
            if depth > allowed:
                raise InputError(
                    f"patches {i} and {j} overlap at {in_words(place)}, {depth:.2g} mm inside the rim of patch "
                    f"{number}, allowed are {allowed:.2g} mm. Move them apart, or make one smaller.",
                    depth=depth,
                )


def _deepest(surface: Surface, other: Surface, *, near: float) -> tuple[float, FloatArray]:
    """Return how far inside the rim of another surface points of one lie on it at most [mm], and where; 0 for none.

    Points on the other surface are those that are no farther from it than `near` [mm].
    """
    size = float(np.sqrt(face_areas(surface).sum())) / TRIANGLES_ACROSS
    points = refine(surface, edge_length=size).vertices
    low, high = other.vertices.min(axis=0) - near, other.vertices.max(axis=0) + near
    points = points[((points >= low) & (points <= high)).all(axis=1)]
    if len(points):
        points = points[closest(other, points)[1] <= near]
    if not len(points):
        return 0.0, surface.vertices[0]
    rims = [other.vertices[np.append(loop, loop[0])] for loop in boundary_loops(other)]
    # A closed surface has no rim: all that lies on it lies inside.
    depths = PolylineDistance(rims, step=size)(points) if rims else np.full(len(points), np.inf)
    return float(depths.max()), points[int(depths.argmax())]


def _common_body(patches: Sequence[Patch]) -> Surface:
    """Return what patches were cut from: the piece of the file that they lie on, or all such pieces, each once."""
    kept: list[Surface] = []
    for body in sorted((patch.body for patch in patches), key=lambda body: -len(body.faces)):
        corners = body.vertices[body.faces[0]]
        if not any((one.vertices[:, None] == corners).all(axis=2).any(axis=0).all() for one in kept):
            kept.append(body)
    return united(kept)
