"""The `fibres` pattern: paths along the lines that a field file says, as stripes or as streamlines."""

from __future__ import annotations

from collections.abc import Callable
from math import radians
from pathlib import Path
from typing import ClassVar, final

import numpy as np

from geoprint.config import FieldFile, PreferenceTable, ThroughTable, WallTable
from geoprint.distance import Backend
from geoprint.errors import FieldError, InputError, UsageError, how_many
from geoprint.fibers.fields import DirectionField, carried_field
from geoprint.fibers.net import LineNet, net_of, places_of, surface_points
from geoprint.fibers.placement import SHORTEST, DepositedStroke, deposited_strokes, first_place
from geoprint.fibers.preferences import AlongCurvature, AlongDirection, AlongRim, AlongStroke, Preference
from geoprint.fibers.prescribed import prescribed_field, singularities_near, smoothest_field
from geoprint.fibers.stripes import stripes
from geoprint.fibers.wall import HelixRule, WallCoordinates, WallVoxels
from geoprint.geometry import (
    Piece,
    PolylineDistance,
    all_curves,
    boundary_half_edges,
    boundary_loops,
    closest,
    edge_lengths,
    even_points,
    on_surface,
    pieces,
    refine,
)
from geoprint.geometry.files import read_volume
from geoprint.model import (
    BoolArray,
    FloatArray,
    FollowedLines,
    IntArray,
    Paths,
    ScalarField,
    Source,
    Surface,
    SurfaceCurves,
)
from geoprint.results import StackPlace

# Gaps are looked for at places about so many spacings apart.
SPREAD_SHARE = 0.25
# How paths are deposited; the first is what a job has that says nothing.
STRIPES, STREAMLINES = "stripes", "streamlines"
LAYINGS = (STRIPES, STREAMLINES)
# Fibres are lines without a sense: who prints one may begin at either end.
LINES = 2


def lines_of(file: FieldFile, *, place: StackPlace | None = None) -> Callable[[Surface], DirectionField]:
    """Return what makes the lines of a field file on a surface.

    Args:
        file: what was read.
        place: of the layer whose middle the surface is: its lines are those of the part, carried up and turned, but
            for a wall's, which has its own as far as it goes; None of a single skin.

    What is returned raises:
        FieldError: indices do not add up to what the surface demands, a place lies off it, or it has nothing of what
            is preferred; or it lies off the wall, or labels make none.
        InputError: two singularities have one vertex, or the volume of a wall cannot be read.
    """

    def lines(surface: Surface) -> DirectionField:
        if file.wall is not None:
            return _in_wall(file.wall, surface, part=None if place is None else place.base)
        if place is None:
            return _designed(file, surface)
        # As fine as the layer, so that lines are as smooth there as on a single skin.
        below = refine(place.base, edge_length=float(np.median(edge_lengths(surface))))
        feet, heights = closest(below, surface.vertices[surface.faces].mean(axis=1))
        turned = _turned(file.through, place, heights)
        return carried_field(_designed(file, below), surface, feet=feet, turned=turned)

    return lines


def lines_along_rim(surface: Surface) -> DirectionField:
    """Return the smoothest lines that follow the rim, or where there is none the smoothest of all.

    Raises:
        MeshError: the surface is no manifold.
    """
    rim = boundary_half_edges(surface.faces).size > 0
    return smoothest_field(surface, symmetry=LINES, preferences=[AlongRim()] if rim else [])


@final
class FibrePattern:
    """The `fibres` pattern: paths along the lines of a field, one spacing apart as far as these run side by side.

    Stripes are level curves of a phase that rises by one turn a row [Knöppel2015]: their spacing is as even as a small
    lean from the lines allows, and rows end or begin where that no longer does. Streamlines follow the lines exactly:
    where these converge one ends, where they diverge another begins. No two paths cross. The spacing may differ from
    place to place: paths are as wide as it is where they lie.

    Rows are counted from half a spacing inside of the rim, where the field follows that best. A source that is one
    point lies on the first streamline, and on a stripe where the field has a sense; on a closed piece the source begins
    the first streamline. No distance of the backend is needed.

    Args:
        field: returns the lines on a surface.
        laying: `stripes` or `streamlines`.

    Raises:
        UsageError: there is no such laying.

    Examples:
        >>> FibrePattern.title
        'paths along a designed field'
    """

    title: ClassVar[str] = "paths along a designed field"
    summary: ClassVar[str] = "Even paths along a field of lines designed from singularities and preferences."

    lines_of = staticmethod(lines_of)

    def __init__(self, *, field: Callable[[Surface], DirectionField] = lines_along_rim, laying: str = STRIPES) -> None:
        if laying not in LAYINGS:
            raise UsageError(f"fibres have no placement '{laying[:40]}'; choose one of: {', '.join(LAYINGS)}.")
        self._field, self._laying = field, laying

    def paths(
        self,
        surface: Surface,
        source: Source,
        *,
        backend: Backend,  # noqa: ARG002  (another pattern's paths are level curves of its distance)
        spacing: float | ScalarField,
    ) -> Paths:
        """Return the paths; the row at which one starts is how many lie side by side from the first to it.

        Raises:
            UsageError: the field is of crosses.
            InputError: a spacing at the vertices is not positive, or there is not one for each.
            FieldError: no stroke is worth a start on a piece, or there is no such field.
        """
        wanted = _at_vertices(spacing, surface)
        field = self._field(surface)
        if field.symmetry > LINES:
            raise UsageError("fibres follow a field of lines or vectors, not of crosses: give a field of symmetry 2.")
        curves, rows, dropped = list[SurfaceCurves](), list[FloatArray](), list[float]()
        for piece in pieces(surface):
            spacings = wanted[piece.vertices][piece.surface.faces].mean(axis=1)
            net = net_of(_on_piece(field, piece), spacings=spacings)
            paths, too_short = self._deposited(piece.surface, net, piece.own(source.curves))
            if not paths:
                raise FieldError(
                    f"no path along the field on {surface.name} is {SHORTEST:g} spacings of {wanted.min():g} mm long: "
                    "choose a smaller spacing."
                )
            curves += [piece.on_whole(_curve(net, stroke)) for stroke in paths]
            rows += [_rows(stroke) for stroke in paths]
            dropped += too_short
        every, row = all_curves(curves), np.concatenate(rows)
        at_points = every.points.values(surface, wanted) if np.ptp(wanted) else np.full(row.size, wanted[0])
        return Paths(every, row, at_points, np.ones(row.size), tuple(dropped), _followed(field))

    def _deposited(
        self, surface: Surface, net: LineNet, source: SurfaceCurves
    ) -> tuple[list[DepositedStroke], list[float]]:
        """Return the paths on a piece, and the lengths of those that are too short [mm]."""
        point = source.count == 1 and source.points.faces.size == 1
        inside = None if point else first_place(net)
        first = (int(source.points.faces[0]), complex(places_of(net, source.points)[0])) if inside is None else inside
        if self._laying == STRIPES:
            return stripes(surface, net, first=first, through=inside is None)
        spread = _spread(surface, step=SPREAD_SHARE * float(net.spacings.min()))
        return deposited_strokes(net, first=first, spread=spread, beside_rim=_beside_rim(surface, net, spread))


def _at_vertices(spacing: float | ScalarField, surface: Surface) -> FloatArray:
    """Return the (n,) spacing at the vertices of a surface [mm]."""
    if not isinstance(spacing, ScalarField):
        return np.full(len(surface.vertices), float(spacing))
    values, count = spacing.values, len(surface.vertices)
    if values.size != count or values.min(initial=1.0) <= 0.0:
        raise InputError(
            f"a spacing at each vertex of {surface.name} is {how_many(count, 'number')} above 0 mm, found "
            f"{values.size} from {values.min(initial=np.inf):g}."
        )
    return values


def _followed(field: DirectionField) -> FollowedLines:
    singular = field.singularities()
    turned_about = field.surface.vertices[singular.vertices]
    return FollowedLines(field.directions()[:, 0], turned_about, singular.indices, field.axes)


def _on_piece(field: DirectionField, piece: Piece) -> DirectionField:
    return DirectionField(piece.surface, field.symmetry, field.angles[piece.faces], field.turning[piece.faces])


def _spread(surface: Surface, *, step: float) -> IntArray:
    """Return faces all over a surface, one in each cube of a side [mm], and all where they are larger."""
    cubes = np.floor(surface.vertices[surface.faces].mean(axis=1) / step).astype(np.int64)
    return np.sort(np.unique(cubes, axis=0, return_index=True)[1])


def _beside_rim(surface: Surface, net: LineNet, faces: IntArray) -> BoolArray:
    """Return which of (k,) faces have the rim within a spacing of their middle, straight, which is never farther."""
    loops = [surface.vertices[np.append(loop, loop[0])] for loop in boundary_loops(surface)]
    if not loops:
        return np.zeros(faces.size, dtype=np.bool_)
    away = PolylineDistance(loops, step=float(net.spacings.min()))(surface.vertices[surface.faces[faces]].mean(axis=1))
    return np.asarray(away <= net.spacings[faces])


def _rows(stroke: DepositedStroke) -> FloatArray:
    """Return the row of each point of a stroke, which rises by one from its start, half behind a whole one, to its end.

    Paths are no level curves of a distance: whoever measures tells those by a row that stays the same.
    """
    arcs = np.concatenate([[0.0], np.cumsum(np.abs(stroke.ends - stroke.starts))])
    return stroke.row + 0.5 + arcs / arcs[-1]


def _curve(net: LineNet, stroke: DepositedStroke) -> SurfaceCurves:
    """Return a stroke as a curve through the ends of its segments; a closed one ends where it starts."""
    last = (stroke.faces[0], stroke.starts[0]) if stroke.closed else (stroke.faces[-1], stroke.ends[-1])
    places = np.append(stroke.starts, last[1])
    points = surface_points(net, np.append(stroke.faces, last[0]), places)
    return SurfaceCurves(points, np.array([0, places.size]), np.array([stroke.closed]))


def _designed(file: FieldFile, surface: Surface) -> DirectionField:
    """Return the lines on the part itself."""
    if file.helix is not None:
        axis, angle = np.array(file.helix.axis), radians(file.helix.angle)
        heights = surface.vertices @ (axis / np.linalg.norm(axis))
        return HelixRule(angle, angle).field(surface, heights=heights, depths=np.zeros(heights.size))
    preferences = [_preference(table, surface) for table in file.preferences]
    if not file.singularities:
        return smoothest_field(surface, symmetry=LINES, preferences=preferences)
    places = np.array([table.place for table in file.singularities])
    on_surface(surface, places, what="the singularity {} of the field")
    indices = np.array([table.index for table in file.singularities])
    return prescribed_field(
        surface,
        symmetry=LINES,
        singularities=singularities_near(surface, places, indices=indices),
        preferences=preferences,
    )


def _in_wall(table: WallTable, surface: Surface, *, part: Surface | None) -> DirectionField:
    """Return the fibres of a wall on a surface within it, or on a layer over a part that is."""
    path = Path(table.volume)
    volume = read_volume(path.read_bytes(), name=path.name)
    wall, cavity, base = (np.isin(volume.labels, labels) for labels in (table.labels, table.cavity, table.base))
    rule = HelixRule(radians(table.epicardial_deg), radians(table.endocardial_deg))
    coordinates = WallCoordinates(WallVoxels(wall, cavity, base, volume.affine, path.name))
    return coordinates.field(surface, rule, part=part)


def _turned(table: ThroughTable | None, place: StackPlace, heights: FloatArray) -> FloatArray:
    """Return by what lines of a layer are turned at (m,) heights over the part [mm], counter-clockwise [rad]."""
    if table is None:
        return np.zeros(heights.size)
    if table.inner_deg is None or table.outer_deg is None:
        return np.radians(table.turn_deg_per_mm or 0.0) * heights
    share = (place.number - 0.5) / place.count
    return np.full(heights.size, radians(table.inner_deg + share * (table.outer_deg - table.inner_deg)))


def _preference(table: PreferenceTable, surface: Surface) -> Preference:
    """Return what a table prefers on a surface."""
    weighted = {} if table.weight is None else {"weight": table.weight}
    if table.direction is not None:
        return AlongDirection(np.array(table.direction), **weighted)
    if table.curvature is not None:
        return AlongCurvature(table.curvature, **weighted)
    if table.stroke is not None:
        corners = np.array(table.stroke)
        on_surface(surface, corners, what="the point of a stroke {} of the field")
        drawn = even_points(corners, step=float(np.median(edge_lengths(surface))))
        points, _ = closest(surface, drawn)
        return AlongStroke(SurfaceCurves(points, np.array([0, len(drawn)]), np.array([False])), **weighted)
    return AlongRim(**weighted)
