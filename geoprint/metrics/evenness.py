"""How evenly paths cover a surface: one measurement for contours, spirals, rows, fibres, layers and anybody's paths.

The headline is the layer that a constant flow leaves (`thickness`), with what the paths cover once (`coverage`). The
spacing to the left and to the right (`sides`) and from level to level (`levels`) are details. Distances are those of
the shortest way over the triangles, from an oracle that belongs to no backend (`metrics.oracle`). Runs that touch end
to end are one, so that it does not matter where and how a path is cut.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, final

import numpy as np

from geoprint.errors import FieldError, InputError
from geoprint.geometry import closest, face_areas
from geoprint.metrics.coverage import coverage
from geoprint.metrics.deposited import at_poses, deposited_path, deposited_rows, joined, sampled
from geoprint.metrics.levels import LevelSpacings, level_spacings, levelled
from geoprint.metrics.oracle import WINDOWS_IN_ALL, FlatMesh, GeodesicDistance, Places, SurfacePath, flat_places, trace
from geoprint.metrics.sides import SideSpacing, side_spacing
from geoprint.metrics.spacing import SAMPLES_PER_SPACING, SpacingAt, deposited_area, judged_surface, shares_at
from geoprint.metrics.thickness import LevelledLayer, Levelling, Thickness, stretches_of_path
from geoprint.model import (
    FLOW_SHARES,
    BoolArray,
    FloatArray,
    IntArray,
    Polylines,
    PoseStream,
    Surface,
    SurfacePoints,
    Table,
    freeze_arrays,
    frozen,
    table_of,
)

# Anybody's polylines laid onto a surface: cut finely, each point moved to the closest place, and how far that was.


# Lines between points are cut into pieces of at most this share of the spacing, so that they follow the surface.
PIECE_SHARE = 0.5
# Ends of one run nearer than this share of the spacing close it.
CLOSED_SHARE = 0.05
# Points of a run nearer together than this share of the spacing are one.
SAME_SHARE = 1e-6
# More points take more memory than a usual machine has; each is compared with paths around it, as many as lie there.
MOST_POINTS = 20_000_000


def finely(curves: Polylines, *, spacing: float, area: float) -> Polylines:
    """Return the same polylines with points between those that are far apart, and without repeated points.

    Args:
        curves: r runs.
        spacing: wanted [mm].
        area: of the part that they cover [mm2].

    Raises:
        FieldError: there would be too many points, or too many for how often they cover the part.
    """
    sides = np.linalg.norm(np.diff(curves.points, axis=0), axis=1)
    inner = curves.runs[1:] == curves.runs[:-1]
    parts = np.where(inner, np.ceil(sides / (PIECE_SHARE * spacing)), 1.0)
    # Where neighbouring points are one, the first of them stands for both.
    parts[inner & (sides <= SAME_SHARE * spacing)] = 0.0
    total = parts.sum() + curves.count
    length = float(sides[inner].sum())
    times = max(length * spacing / area, 1.0)
    if total * times > MOST_POINTS:
        raise FieldError(
            f"the paths are {length:.3g} mm long and cover the part {times:.2g} times: {total:.3g} points at a spacing "
            f"of {spacing:.3g} mm, at most {MOST_POINTS / times:.3g} are measured. Give their intended spacing, or "
            "fewer paths.",
            points=int(total),
        )
    parts = np.append(parts, 1.0).astype(np.int64)
    owner = np.repeat(np.arange(parts.size), parts)
    ranks = np.arange(owner.size) - np.repeat(np.cumsum(parts) - parts, parts)
    following = np.minimum(owner + 1, parts.size - 1)
    shares = (ranks / parts[owner])[:, None]
    points = curves.points[owner] + shares * (curves.points[following] - curves.points[owner])
    counts = np.bincount(curves.runs[owner], minlength=curves.count)
    kept = counts > 1
    return Polylines(points[kept[curves.runs[owner]]], np.concatenate([[0], np.cumsum(counts[kept])]))


def path_on_mesh(
    mesh: FlatMesh, places: SurfacePoints, curves: Polylines, distances: FloatArray, *, spacing: float, allowed: float
) -> SurfacePath:
    """Connect the places of polylines over a surface.

    Args:
        mesh: the surface flattened.
        places: (k,) on it.
        curves: whose points they are the closest ones of.
        distances: (k,) to them [mm].
        spacing: wanted [mm].
        allowed: how far a point may be off [mm].

    Raises:
        FieldError: a point is farther off than allowed, nothing is long enough to be measured, or neighbouring
            points have no short connection on the surface.
    """
    worst = int(np.argmax(distances)) if distances.size else 0
    if distances.size and distances[worst] > allowed:
        x, y, z = curves.points[worst].tolist()
        raise FieldError(
            f"the paths lie up to {distances[worst]:.3g} mm off the part, farthest in run "
            f"{int(curves.runs[worst]) + 1} at ({x:z.3f}, {y:z.3f}, {z:z.3f}) mm, allowed are {allowed:.3g} mm. Give "
            "them in the part's coordinates and unit, fit them with `--fit`, or allow it with `--offset-up-to "
            f"{1.1 * distances[worst]:.2g}`.",
            distance_mm=float(distances[worst]),
            allowed_mm=allowed,
        )
    flat = flat_places(mesh, places)
    lengths = _moved(flat, curves)
    kept = lengths > SAME_SHARE * spacing
    if not kept.any():
        raise FieldError("all paths are too short to measure: every run is a point on the part.")
    chosen = kept[curves.runs]
    runs = np.cumsum(kept)[curves.runs[chosen]] - 1
    firsts, lasts = curves.offsets[:-1][kept], curves.offsets[1:][kept] - 1
    apart = np.linalg.norm(curves.points[lasts] - curves.points[firsts], axis=1)
    return trace(
        mesh,
        Places(flat.faces[chosen], flat.flat[chosen]),
        runs=runs,
        levels=np.zeros(int(kept.sum()), dtype=np.int64),
        closed=apart <= np.minimum(CLOSED_SHARE * spacing, 0.25 * lengths[kept]),
    )


def _moved(flat: Places, curves: Polylines) -> FloatArray:
    """Return about how long each run is on the surface: 0 where all of its points fall on one [mm]."""
    same = flat.faces[1:] == flat.faces[:-1]
    steps = np.where(
        same, np.abs(flat.flat[1:] - flat.flat[:-1]), np.linalg.norm(np.diff(curves.points, axis=0), axis=1)
    )
    inner = curves.runs[1:] == curves.runs[:-1]
    return np.bincount(curves.runs[1:][inner], steps[inner], minlength=curves.count).astype(np.float64)


SPACING_COLUMNS = ("run", "x", "y", "z", "left", "right", "width")
# Paths farther from the surface than this share of the spacing are refused, unless more is allowed.
OFF_SURFACE_SHARE = 0.1


@final
@frozen
class Uniformity:
    """How evenly paths cover a surface.

    Attributes:
        thickness: of the layer that a constant flow leaves, over the wanted one: the headline.
        followed: the same with a flow that follows the width of the strip that each stretch serves.
        field: (v,) thickness that a constant flow leaves at the vertices of the refined surface, over the wanted one;
            those of the surface itself come first.
        along: (k, 2) both of them at k samples along the paths.
        sides: spacing to the left and to the right of k samples along the paths.
        levels: spacing to the level outside; None where runs have no whole level, or nobody knows it.
        runs: (k,) run that each sample lies on.
        widths: (k,) width of the strip of surface nearest to each sample, over the spacing.
        width_cv: its coefficient of variation along all runs.
        pose_widths: (p,) that width at every pose of a stream, 0 on travel; none of paths without poses.
        run_count: how many runs were measured.
        length: of the paths on the surface [mm].
        area: of the surface [mm2].
        gap: share of it farther than 0.55 spacings from every run.
        overlap: share of it within 0.45 spacings of two stretches more than two spacings apart along the path.
        hole: area of the largest connected gap [mm2].
        unknown: share of the area for which the budget of work did not suffice; it counts as neither.
        fill: length times spacing, over the area.
        off_mean: mean distance of the points of the paths from the surface [mm].
        off_max: largest [mm].
        judged_places: (j, 3) places all over the surface [mm].
        gaps: (j,) whether each is farther than 0.55 spacings from every run.
        overlaps: (j,) whether each is within 0.45 spacings of two stretches.
        spacing: wanted distance between neighbouring paths [mm].
    """

    thickness: Thickness
    followed: Thickness
    field: FloatArray
    along: FloatArray
    sides: SideSpacing
    levels: LevelSpacings | None
    runs: IntArray
    widths: FloatArray
    width_cv: float
    pose_widths: FloatArray
    run_count: int
    length: float
    area: float
    gap: float
    overlap: float
    hole: float
    unknown: float
    fill: float
    off_mean: float
    off_max: float
    judged_places: FloatArray
    gaps: BoolArray
    overlaps: BoolArray
    spacing: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, field="float: v", along="float: k 2", runs="int: k", widths="float: k", pose_widths="float: p",
            judged_places="float: j 3", gaps="bool: j", overlaps="bool: j",
        )  # fmt: skip

    @property
    def covered_once(self) -> float:
        """Share of the area that is neither missed nor covered twice."""
        return 1.0 - self.gap - self.overlap

    def table(self) -> Table:
        """Return a row for each sample along the paths, with the columns of spacing.csv.

        They are run, x, y, z [mm], left and right (distance over the surface to the neighbour there, over the wanted
        spacing; NaN for none) and width (of the strip of surface nearest to the sample, over the wanted spacing).
        """
        columns = [self.runs, *self.sides.places.T, *self.sides.sides().T, self.widths]
        return table_of(dict(zip(SPACING_COLUMNS, columns, strict=True)))

    def layer(self, *, follows: bool) -> tuple[float, FloatArray]:
        """Return the CV of the thickness and (k,) thicknesses, with the flow that is printed.

        Args:
            follows: whether that follows the width; else it is constant.
        """
        return (self.followed.cv, self.along[:, 1]) if follows else (self.thickness.cv, self.along[:, 0])


class _Paths(NamedTuple):
    """Paths on a surface.

    Attributes:
        path: r runs.
        runs: (r,) what they are called.
        off: (p,) distance of their points from the surface [mm].
    """

    path: SurfacePath
    runs: IntArray
    off: FloatArray


def uniformity(
    poses: PoseStream,
    surface: Surface,
    *,
    spacing: float,
    windows: int = WINDOWS_IN_ALL,
    wanted: SpacingAt | None = None,
    flow_shares: tuple[float, float] = FLOW_SHARES,
) -> Uniformity:
    """Measure how evenly the deposited runs of a stream cover a surface.

    Args:
        poses: the stream; only depositing rows count.
        surface: as `MeasuredSurface`, which measures several streams in less time.
        spacing: as `MeasuredSurface`.
        windows: budget of work for each of the questions asked (spacing, nearest stretch, second stretch); what is
            left over then is bounded or unknown, and counted as such.
        wanted: as `MeasuredSurface`.
        flow_shares: least and most of a flow that follows the width, over that of a strip one spacing wide.

    Raises:
        InputError: the spacing is no positive number.
        FieldError: the path lies on another surface.
    """
    on = MeasuredSurface(surface, spacing=spacing, wanted=wanted)
    return on.uniformity(poses, windows=windows, flow_shares=flow_shares)


def measure_paths(
    surface: Surface,
    curves: Polylines | Sequence[FloatArray],
    *,
    spacing: float,
    offset_up_to: float | None = None,
    windows: int = WINDOWS_IN_ALL,
    wanted: SpacingAt | None = None,
    flow_shares: tuple[float, float] = FLOW_SHARES,
) -> Uniformity:
    """Measure how evenly any paths cover a surface: contours, spirals, fibres, or toolpaths of other programs.

    Points are moved to the closest points of the surface and joined by the shortest way over it.

    Args:
        surface: the covered surface; left and right are as seen from its outside.
        curves: the deposited paths in the surface's coordinates [mm]: a list of (k, 3) arrays, or `Polylines`.
        spacing: intended distance between neighbouring paths [mm].
        offset_up_to: largest allowed distance of a point from the surface [mm]; a tenth of the spacing by default.
        windows: as `uniformity`.
        wanted: as `uniformity`.
        flow_shares: as `uniformity`.

    Returns:
        Thickness, coverage, spacing to both sides, and strip width; lengths are in spacings, areas as shares.

    Raises:
        InputError: the spacing is not a positive number.
        FieldError: the paths lie farther off, are too short or too many, or cannot be connected over the surface.
    """
    curves = curves if isinstance(curves, Polylines) else Polylines.of(curves)
    on = MeasuredSurface(surface, spacing=spacing, wanted=wanted)
    cut = finely(curves, spacing=spacing, area=float(face_areas(surface).sum()))
    places, off = closest(on.judged.surface, cut.points)
    allowed = OFF_SURFACE_SHARE * spacing if offset_up_to is None else offset_up_to
    path = path_on_mesh(on.judged.mesh, places, cut, off, spacing=spacing, allowed=allowed)
    paths = _Paths(path, np.arange(path.lengths.size), off)
    return _measured(on, paths, None, windows=windows, flow_shares=flow_shares)


@final
class MeasuredSurface:
    """A surface on which the evenness of paths is measured, with all that does not depend on the paths.

    Args:
        surface: what paths cover. Only its shape counts: refining it changes nothing but the time.
        spacing: wanted distance between neighbouring paths [mm].
        wanted: what the spacing shall be at each place, where that differs; everything is over that then.

    Attributes:
        judged: the surface with small triangles.
        levelling: of a layer on it.
        spacing: as above.
        wanted: as above.

    Raises:
        InputError: the spacing is no positive number.
    """

    def __init__(self, surface: Surface, *, spacing: float, wanted: SpacingAt | None = None) -> None:
        _check_spacing(spacing)
        self.spacing, self.wanted = spacing, wanted
        self.judged = judged_surface(surface, spacing=spacing)
        self.levelling = Levelling(self.judged.surface, spacing=spacing, wanted=wanted)

    def uniformity(
        self,
        poses: PoseStream,
        *,
        windows: int = WINDOWS_IN_ALL,
        flow_shares: tuple[float, float] = FLOW_SHARES,
    ) -> Uniformity:
        """Measure how evenly the deposited runs of a stream cover the surface, as the function `uniformity`."""
        path, off = deposited_path(poses, *self.judged, spacing=self.spacing)
        paths = _Paths(path, np.unique(poses.runs[deposited_rows(poses)]), off)
        return _measured(self, paths, poses, windows=windows, flow_shares=flow_shares)


def _check_spacing(spacing: float) -> None:
    if not (np.isfinite(spacing) and spacing > 0.0):
        raise InputError(f"the spacing must be a positive number of mm, found {spacing}.")


def _levels(mesh: FlatMesh, paths: _Paths, *, spacing: float, windows: int) -> LevelSpacings:
    distance = GeodesicDistance(mesh, paths.path, windows=windows)
    samples = sampled(paths.path, step=spacing / SAMPLES_PER_SPACING)
    return level_spacings(mesh, paths.path, distance, samples, runs=paths.runs, spacing=spacing)


def _measured(
    on: MeasuredSurface, paths: _Paths, poses: PoseStream | None, *, windows: int, flow_shares: tuple[float, float]
) -> Uniformity:
    """Measure paths; levels, and the widths at poses, where there are any."""
    mesh, spacing, wanted = on.judged.mesh, on.spacing, on.wanted
    stretches = joined(mesh, paths.path, spacing=spacing)
    path = stretches.path
    distance = GeodesicDistance(mesh, path, windows=windows)
    samples = sampled(path, step=spacing / SAMPLES_PER_SPACING)
    covered = coverage(mesh, path, distance, samples, spacing=spacing, wanted=wanted)
    sides = side_spacing(mesh, path, samples, spacing=spacing, windows=windows, wanted=wanted)
    # Levels are those of a distance, and so one spacing apart.
    has_levels = poses is not None and wanted is None and levelled(poses)
    pieces = stretches_of_path(mesh, path, samples, spacing=spacing)
    layer = LevelledLayer(on.levelling, pieces.places)
    local = shares_at(mesh, samples.places, wanted, spacing=spacing)
    flows = spacing * local, spacing * np.clip(covered.widths * local, *flow_shares)
    constant, following = layer.fields(np.column_stack([pieces.volumes(flow) for flow in flows])).T
    return Uniformity(
        thickness=layer.over_all(constant),
        followed=layer.over_all(following),
        field=constant,
        along=np.column_stack([pieces.at_ends(layer.at_places(field), samples) for field in (constant, following)]),
        sides=sides,
        levels=_levels(mesh, paths, spacing=spacing, windows=windows) if has_levels else None,
        runs=paths.runs[stretches.runs_at(samples.runs, samples.arcs)],
        widths=covered.widths,
        width_cv=covered.width_cv,
        pose_widths=np.zeros(0) if poses is None else at_poses(poses, stretches, samples, covered.widths),
        run_count=int(paths.path.lengths.size),
        length=float(path.lengths.sum()),
        area=covered.area,
        gap=covered.gap,
        overlap=covered.overlap,
        hole=covered.hole,
        unknown=covered.unknown,
        fill=deposited_area(mesh, path, wanted, spacing=spacing) / covered.area,
        off_mean=float(paths.off.mean()),
        off_max=float(paths.off.max()),
        judged_places=covered.places,
        gaps=covered.gaps,
        overlaps=covered.overlaps,
        spacing=spacing,
    )
