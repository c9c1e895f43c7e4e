"""The pose stream: runs lifted to the stand-off, attitudes along them, and the travel between them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Literal, final

import numpy as np
from scipy.ndimage import gaussian_filter1d

from geoprint.geometry import SmoothNormals, arc_lengths, positions, smooth_normals, whole_steps
from geoprint.model import (
    BoolArray,
    FloatArray,
    IntArray,
    PoseStream,
    Surface,
    Tool,
    Toolpath,
    comparable,
    freeze_arrays,
    frozen,
)
from geoprint.toolpath.lifting import SHORTEST, lifting_normals, outward_normals
from geoprint.toolpath.resample import ROUNDING
from geoprint.transforms import interpolate_poses, quaternion_of, rigid, rotation_of, same_sign, smallest_rotation

# Attitude of the tool along a run: nozzle against the smoothed surface normal, the rest by the smallest rotation.
#
# Normals interpolated on a triangle mesh carry its facets as noise. A tenth of a degree of it at half a millimetre
# spacing would cost most of the print speed, because the wrist has to follow. So the axis is smoothed along the arc
# before anything moves, and leans no farther from the normal than it may; the tip stays where it is. Where the part
# begins or ceases to bend, as at a fillet, the tool would have to turn as suddenly: there it turns ahead and behind.


# Standard deviation of the smoothing along the arc [mm]: about an edge of a well-made part mesh. A shorter one leaves
# so much of 0.05 degrees of noise that a print at 20 mm/s slows down, a longer one only leans more.
SMOOTHING_LENGTH = 1.0
# Where the tool would turn too suddenly it grows up to this one; how far is found by so many halvings.
LONGEST_SMOOTHING = 4.0
SMOOTHING_HALVINGS = 10
# Even samples per shortest standard deviation on which the filter works.
SAMPLES_PER_DEVIATION = 8

# The tool frame over a flat part: z straight down, x along the x axis of the base.
STRAIGHT_DOWN = np.diag([1.0, -1.0, -1.0])


def smoothed_axes(
    normals: FloatArray, arcs: FloatArray, *, closed: bool, max_tilt: float, largest_bend: float = np.inf
) -> FloatArray:
    """Smooth unit normals along one run with a Gaussian window, and keep them in the cone about each normal.

    The window is as short as facets allow, and longer where the axes bend more than they should, as far as none leaves
    its cone. An axis that the shortest window leans too far from its normal, where the part bends fast, is turned back
    to the edge of the cone by the smallest rotation.

    Args:
        normals: (k, 3) unit normals.
        arcs: (k,) rising arc lengths from 0 [mm].
        closed: whether the run ends where it starts; then the window runs across the seam.
        max_tilt: largest angle between an axis and its normal [rad], in [0, pi / 2).
        largest_bend: second derivative of the axis by arc length that is wanted at most [rad/mm2].

    Returns:
        (k, 3) unit vectors.
    """
    shortest, longest = SMOOTHING_LENGTH, LONGEST_SMOOTHING
    axes, bend = _filtered(normals, arcs, deviation=shortest, closed=closed)
    for _ in range(SMOOTHING_HALVINGS if bend > largest_bend else 0):
        between = (shortest + longest) / 2.0
        tried, bend = _filtered(normals, arcs, deviation=between, closed=closed)
        if bend > largest_bend and (np.einsum("ij,ij->i", tried, normals) >= np.cos(max_tilt)).all():
            shortest, axes = between, tried
        else:
            longest = between
    cosine = np.einsum("ij,ij->i", axes, normals)
    aside = axes - cosine[:, None] * normals
    aside /= np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    edge = np.cos(max_tilt) * normals + np.sin(max_tilt) * aside
    return np.where((cosine < np.cos(max_tilt))[:, None], edge, axes)


def tool_quaternions(axes: FloatArray, *, R_base_work: FloatArray) -> FloatArray:
    """Return the attitude of the tool for nozzles that point against given axes.

    The tool over a level surface has its z axis straight down in the base frame and its x axis along the base's; a
    leaning one is turned from there by the smallest rotation.

    Args:
        axes: (k, 3) unit vectors in the work frame, out of the surface.
        R_base_work: (3, 3) rotation from work to base frame.

    Returns:
        (k, 4) unit quaternions w x y z of the tool frame in the work frame, of one sign from row to row.
    """
    R_work_level = R_base_work.T @ STRAIGHT_DOWN
    rotations = smallest_rotation(R_work_level[:, 2], -axes) @ R_work_level
    return same_sign(quaternion_of(rotations))


def slerp(start: FloatArray, end: FloatArray, shares: FloatArray) -> FloatArray:
    """Return (k, 4) attitudes at (k,) shares of the shorter turn between two quaternions (4,)."""
    T_start, T_end = (rigid(rotation_of(quaternion), np.zeros(3)) for quaternion in (start, end))
    poses = np.broadcast_to(T_start, (shares.size, 4, 4)), np.broadcast_to(T_end, (shares.size, 4, 4))
    return same_sign(quaternion_of(interpolate_poses(*poses, shares)[:, :3, :3]))


def _filtered(normals: FloatArray, arcs: FloatArray, *, deviation: float, closed: bool) -> tuple[FloatArray, float]:
    """Return unit normals after a Gaussian filter of one standard deviation [mm], and their largest bend [rad/mm2]."""
    length = float(arcs[-1])
    count = int(whole_steps(length, step=SMOOTHING_LENGTH / SAMPLES_PER_DEVIATION))
    even: FloatArray = np.linspace(0.0, length, count + 1)
    sampled = np.column_stack([np.interp(even, arcs, normals[:, i]) for i in range(3)])
    sigma = deviation / (length / count)
    if closed:
        around = gaussian_filter1d(sampled[:-1], sigma, axis=0, mode="wrap")
        smooth: FloatArray = np.vstack([around, around[:1]])
    else:
        smooth = gaussian_filter1d(sampled, sigma, axis=0, mode="nearest")
    smooth /= np.linalg.norm(smooth, axis=1, keepdims=True)
    # A steady turn bends a unit vector as well, towards its opposite: that part costs no acceleration.
    bends: FloatArray = np.diff(smooth, n=2, axis=0)
    bends -= np.einsum("ij,ij->i", bends, smooth[1:-1])[:, None] * smooth[1:-1]
    bend = float(np.linalg.norm(bends, axis=1).max(initial=0.0)) / (length / count) ** 2
    axes = np.column_stack([np.interp(arcs, even, smooth[:, i]) for i in range(3)])
    return axes / np.linalg.norm(axes, axis=1, keepdims=True), bend


# Moves between runs: lift off along the nozzle, cross as low as part and body allow, come down along the nozzle.


# Travel is sampled this finely [mm], so that the joints' spline follows the straight line.
TRAVEL_STEP = 1.0
# Lead-ins and lead-outs are sampled so finely [mm], as runs are.
LEAD_STEP = 0.25
# So far from the ends of a run [mm] no bend may be tighter than leads allow; it counts over such a length.
LOOKED_AHEAD = 2.0
BEND_LENGTH = 0.5
# Points of part and body by which a crossing is planned are about this far apart [mm]: well below what it keeps.
TERRAIN_STEP = 1.0
# Faces that are cut into points at a time, so that a body of millions of them takes little memory.
FACES_AT_A_TIME = 100_000
# A crossing keeps this share of the retract height from everything.
KEPT_SHARE = 0.5
# A tool that leans farther than this from upright [cosine] is planned as if it leant no more.
LEAST_UPRIGHT = 0.3
# Shorter means of two unit vectors have no direction.
LEAST_LENGTH = 1e-6


@final
@frozen
class Terrain:
    """What travel passes over, and the outline of the tool that passes.

    Attributes:
        points: (n, 3) of part and body in the work frame, TERRAIN_STEP apart [mm].
        up: (3,) unit vector away from the table.
        needle_radius: [mm].
        cone_heights: (2,) where the cone begins and ends, over the tip [mm].
        barrel_radius: [mm].
        kept: distance that a crossing keeps from all points [mm]; infinite: it goes over everything.
    """

    points: FloatArray
    up: FloatArray
    needle_radius: float
    cone_heights: tuple[float, float]
    barrel_radius: float
    kept: float

    def __post_init__(self) -> None:
        freeze_arrays(self, points="float: n 3", up="float: 3")

    @property
    def top(self) -> float:
        """Highest coordinate of all points along `up` [mm]."""
        return float((self.points @ self.up).max())

    def under(self, line: FloatArray, axes: FloatArray) -> Terrain:
        """Return the same with those points alone that can lift a tool on its way along a line, and some more.

        Kept is every point as near to the line on the ground as the barrel and the distance to keep, and farther by as
        much as the most leaning axis goes aside up to the height of the point.

        Args:
            line: (k, 3) tips from end to end of a straight line [mm].
            axes: (k, 3) unit vectors from the tip into the tool there.
        """
        upright = float((axes @ self.up).min())
        if upright < LEAST_UPRIGHT or not np.isfinite(self.kept):
            return self
        reach = self.barrel_radius + self.kept
        heights = self.points @ self.up
        above = np.maximum(heights - float((line @ self.up).min()), 0.0) + reach
        # On the ground, from the start of the line.
        ground = self.points - line[0] - (heights - float(line[0] @ self.up))[:, None] * self.up
        ahead = line[-1] - line[0] - float((line[-1] - line[0]) @ self.up) * self.up
        shares = np.clip(ground @ ahead / max(float(ahead @ ahead), np.finfo(np.float64).tiny), 0.0, 1.0)
        aside = np.linalg.norm(ground - shares[:, None] * ahead, axis=1)
        near = aside <= ROUNDING + reach + above * np.sqrt(1.0 - min(upright, 1.0) ** 2) / upright
        return replace(self, points=self.points[near])

    def lift(self, tip: FloatArray, axis: FloatArray) -> float:
        """Return how far a tip has to go up so that needle, cone and barrel keep their distance [mm], or less than 0.

        A point at a distance d from the tool's axis may be as high over the tip as the tool is as thick as d there, but
        for the kept distance, which is taken off both.

        Args:
            tip: (3,) [mm].
            axis: (3,) unit vector from the tip into the tool.
        """
        if not np.isfinite(self.kept):
            return np.inf
        offsets = self.points - tip
        heights: FloatArray = offsets @ axis
        aside: FloatArray = np.linalg.norm(offsets - heights[:, None] * axis, axis=1) - self.kept
        free: FloatArray = np.interp(aside, [self.needle_radius, self.barrel_radius], self.cone_heights)
        free[aside <= self.needle_radius] = 0.0
        needed: FloatArray = (heights - free + self.kept)[aside <= self.barrel_radius]
        return float(needed.max(initial=-np.inf)) / max(float(axis @ self.up), LEAST_UPRIGHT)


def terrain_points(surfaces: Sequence[Surface]) -> FloatArray:
    """Return (m, 3) points of part and, where there is one, body by which travel over them is planned [mm]."""
    return _apart(np.concatenate([_points(surface) for surface in surfaces]))


def terrain(points: FloatArray, *, beside: FloatArray, tool: Tool, up: FloatArray, kept: float) -> Terrain:
    """Return what travel passes over.

    Args:
        points: as `terrain_points`.
        beside: (b, 3) corners of what else stands there [mm].
        tool: that passes.
        up: (3,) unit vector away from the table.
        kept: distance to keep [mm]; infinite to go over everything.
    """
    return Terrain(
        points=_apart(np.concatenate([points, beside])),
        up=up,
        needle_radius=tool.needle_diameter / 2,
        cone_heights=(tool.needle_length, tool.needle_length + tool.cone_length),
        barrel_radius=tool.barrel_diameter / 2,
        kept=kept,
    )


def crossing(start: FloatArray, end: FloatArray, *, axes: FloatArray, terrain: Terrain, retract: float) -> FloatArray:
    """Return the corners of the travel between two lifted points: the lowest one that does not bob.

    It runs over the straight line on the ground, like a string over the heights that the tool needs there while it
    turns from one attitude to the other, and at most over everything.

    Args:
        start: (3,) lifted end of the last run [mm].
        end: (3,) lifted start of the next one [mm].
        axes: (2, 3) unit vectors from the tip into the tool, at both.
        terrain: what is to be kept clear.
        retract: height of lifted points over the surface [mm].

    Returns:
        (c, 3) corners, c >= 2; first is start, last is end. Two where the straight line is free.
    """
    line, _ = sampled_polyline(np.stack([start, end]))
    shares = np.linspace(0.0, 1.0, len(line))
    turned = axes[0] + shares[:, None] * (axes[1] - axes[0])
    lengths: FloatArray = np.linalg.norm(turned, axis=1)
    turned /= np.maximum(lengths, np.finfo(np.float64).tiny)[:, None]
    top = terrain.top
    most = np.array([over(tip, up=terrain.up, retract=retract, top=top) for tip in line])
    highest = (most - line) @ terrain.up
    met = terrain.under(line, turned)
    lifts = np.array([met.lift(tip, axis) for tip, axis in zip(line, turned, strict=True)])
    # In the middle between opposite attitudes the tool may lie in any direction.
    lifts = np.where(lengths > LEAST_LENGTH, np.minimum(lifts, highest), highest)
    lifts[[0, -1]] = 0.0
    if np.isfinite(terrain.kept):
        rows = _string_over(shares, lifts)
        return line[rows] + lifts[rows, None] * terrain.up
    return np.stack([start, most[0], most[-1], end])


def over(point: FloatArray, *, up: FloatArray, retract: float, top: float) -> FloatArray:
    """Return the (3,) place straight above a point from where everything is below by two retract heights [mm]."""
    return point + max(top + 2.0 * retract - float(point @ up), 0.0) * up


def sampled_polyline(corners: FloatArray, *, step: float = TRAVEL_STEP) -> tuple[FloatArray, IntArray]:
    """Sample a polyline evenly between its corners, corners included.

    Args:
        corners: (c, 3) [mm], c >= 2.
        step: largest distance between neighbouring samples [mm].

    Returns:
        (k, 3) samples, and (c,) the rows of the corners among them.
    """
    arcs = arc_lengths(corners)
    counts = whole_steps(np.diff(arcs), step=step)
    rows = np.concatenate([[0], np.cumsum(counts)])
    pieces = np.repeat(np.arange(counts.size), counts)
    share = (np.arange(int(rows[-1])) - rows[pieces]) / counts[pieces]
    samples = corners[pieces] + share[:, None] * (corners[pieces + 1] - corners[pieces])
    return np.vstack([samples, corners[-1:]]), rows


def _string_over(shares: FloatArray, heights: FloatArray) -> IntArray:
    """Return the rows at which a string bends that is stretched over heights from the first to the last."""
    rows: list[int] = []
    for row in range(len(shares)):
        while len(rows) > 1:
            (x, y), (u, v) = ((shares[k] - shares[rows[-2]], heights[k] - heights[rows[-2]]) for k in (rows[-1], row))
            if y * u > v * x + ROUNDING:
                break
            rows.pop()
        rows.append(row)
    return np.array(rows)


def _apart(points: FloatArray) -> FloatArray:
    """Return the first of (n, 3) points in each cell of a grid, in the order of the cells."""
    cells = np.floor(points / TERRAIN_STEP + ROUNDING)
    # Several times as fast as NumPy's unique rows.
    order = np.lexsort(cells.T[::-1])
    other = np.append(np.True_, (np.diff(cells[order], axis=0) != 0.0).any(axis=1))
    return points[order[other]]


def _points(surface: Surface) -> FloatArray:
    """Return points on every face of a surface, about TERRAIN_STEP apart."""
    blocks = range(0, len(surface.faces), FACES_AT_A_TIME)
    return np.concatenate([
        surface.vertices,
        *(_inner_points(surface.vertices[surface.faces[first : first + FACES_AT_A_TIME]]) for first in blocks),
    ])  # fmt: skip


def _inner_points(triangles: FloatArray) -> FloatArray:
    """Return points between the corners of (m, 3, 3) triangles, about TERRAIN_STEP apart from one another and these."""
    found, rest = [np.empty((0, 3))], triangles
    while len(rest):
        sides = np.linalg.norm(rest - np.roll(rest, -1, axis=1), axis=2).max(axis=1)
        rest = rest[sides > (1.0 + ROUNDING) * TERRAIN_STEP]
        a, b, c = rest[:, 0], rest[:, 1], rest[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        found += [ab, bc, ca]
        rest = np.concatenate(
            [np.stack(three, axis=1) for three in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    return np.concatenate(found)


# A bend sharper than this [rad] at one sample is a corner: no curve rounds it within the chord error, so the tool
# stops there for an instant.
CORNER_ANGLE = np.radians(30.0)
# Corners of what stands beside a part that stands alone.
NOTHING = np.empty((0, 3))
NOTHING.setflags(write=False)


@final
@frozen
class PosedSurface:
    """What poses on a surface need of it however it stands.

    Attributes:
        surface: n vertices.
        normals: smooth across the facets of the part.
        points: (m, 3) of it, and of the body that it lies on, over which travel passes [mm].
    """

    surface: Surface
    normals: SmoothNormals
    points: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, points="float: m 3")


@final
@comparable
class Leads:
    """How the tool comes up to its speed before a deposit begins, and slows down only behind its end.

    Attributes:
        length: of the straight lead-in before a run, and of the lead-out behind it [mm].
        radius: of the tightest bend near the ends of a run that is passed at speed [mm]; a tighter one has no lead.
    """

    length: float
    radius: float


@frozen
class _Stretch:
    """Rows of the stream that belong together: one run, or the travel to it."""

    tips: FloatArray
    quaternions: FloatArray
    normals: FloatArray
    stops: BoolArray
    deposit: bool
    run: int


def posed_surface(surface: Surface, *, part: Surface, body: Surface | None) -> PosedSurface:
    """Prepare a surface and the body that it lies on for several streams of poses.

    Args:
        surface: what runs lie on.
        part: that it was refined from.
        body: what the part lies on, or None.

    Raises:
        MeshError: a vertex has no normal.
    """
    points = terrain_points([surface] if body is None else [surface, body])
    return PosedSurface(surface, smooth_normals(surface, part), points)


def poses(
    toolpath: Toolpath,
    posed: PosedSurface,
    *,
    R_base_work: FloatArray,
    standoff: float,
    retract: float,
    layer_height: float,
    max_tilt: float,
    tool: Tool,
    largest_bend: float = np.inf,
    leads: Leads | None = None,
    beside: FloatArray = NOTHING,
    travel: Literal["low", "high"] = "low",
) -> PoseStream:
    """Orient the tool along a toolpath and join the runs by travel.

    On deposit the tip stands `standoff` above the surface along its smooth normal, or in a crease too narrow for that
    along one that `lifting_normals` smoothed. The nozzle points against the further smoothed normal, and leans from
    that of the lift by no more than `max_tilt`. With leads, a run lies between two straight ways at its height on which
    the tool comes up to its speed and slows down. Between runs the tool lifts off along the nozzle, crosses as low as
    part and body allow, and comes down along the nozzle of the next run.

    Args:
        toolpath: runs in printing order.
        posed: the surface that they lie on.
        R_base_work: (3, 3) how the part stands; `tool_quaternions` says what depends on it.
        standoff: height of the tip over the surface on deposit [mm].
        retract: lift between runs [mm].
        layer_height: bead height that sets the flow: the spacing of a point times layer height [mm].
        max_tilt: largest angle between nozzle and surface normal on deposit [rad].
        tool: that has to pass while it crosses.
        largest_bend: second derivative of the nozzle's direction by length that is wanted at most [rad/mm2].
        leads: how runs begin and end in motion; None where the tool comes to rest where a deposit begins and ends.
        beside: (b, 3) corners of what else the tool passes over, on its motion from home: a table's solids [mm].
        travel: "high" crosses over everything, for where low travel turns out not to be clear.

    Returns:
        The stream in the work frame; it starts and ends above the whole part, and above what stands beside it.
    """
    up = R_base_work[2]
    surface, kept = posed.surface, KEPT_SHARE * retract if travel == "low" else np.inf
    ground = terrain(posed.points, beside=beside, tool=tool, up=up, kept=kept)
    top = float((np.concatenate([surface.vertices, beside]) @ up).max())
    straight = outward_normals(toolpath, surface, posed.normals, standoff=standoff)
    runs = _run_stretches(
        toolpath, surface, straight, R_base_work=R_base_work, standoff=standoff, max_tilt=max_tilt,
        largest_bend=largest_bend,
    )  # fmt: skip
    printed = [_with_leads(run, leads) for run in runs]
    first = _approach(printed[0][0], up=up, retract=retract, top=top)
    last = _retreat(printed[-1][-1], up=up, retract=retract, top=top)
    stretches = [first, *_with_crossings(printed, ground, retract=retract), last]
    return _joined(stretches, toolpath, standoff=standoff, flow=toolpath.spacings * layer_height)


def largest_lean(stream: PoseStream) -> float:
    """Return the largest angle between nozzle and surface normal on deposit [rad]."""
    return float(_leans(stream)[stream.deposit].max(initial=0.0))


def mean_lean(stream: PoseStream) -> float:
    """Return the mean angle between nozzle and surface normal over the deposited length [rad]; 0 without any."""
    leans = _leans(stream)
    lengths = np.where(stream.deposited, np.linalg.norm(np.diff(stream.tips, axis=0), axis=1), 0.0)
    total = float(lengths.sum())
    return float(lengths @ (leans[1:] + leans[:-1]) / (2.0 * total)) if total > 0.0 else 0.0


def _leans(stream: PoseStream) -> FloatArray:
    axes = -rotation_of(stream.quaternions)[:, :, 2]
    across = np.linalg.norm(np.cross(axes, stream.normals), axis=1)
    return np.arctan2(across, np.einsum("ij,ij->i", axes, stream.normals))


def _run_stretches(
    toolpath: Toolpath,
    surface: Surface,
    straight: FloatArray,
    *,
    R_base_work: FloatArray,
    standoff: float,
    max_tilt: float,
    largest_bend: float,
) -> list[_Stretch]:
    """Lift every run to the stand-off along the normals `straight` (k, 3), and point the nozzle along it."""
    curves = toolpath.curves
    everywhere = positions(surface, curves.points)
    stretches: list[_Stretch] = []
    for run, closed in enumerate(curves.closed.tolist()):
        piece = slice(*curves.offsets[run : run + 2])
        places = everywhere[piece]
        outward = lifting_normals(places, straight[piece], closed=closed, standoff=standoff)
        axes = smoothed_axes(outward, arc_lengths(places), closed=closed, max_tilt=max_tilt, largest_bend=largest_bend)
        stretches.append(
            _Stretch(
                tips=places + standoff * outward,
                quaternions=tool_quaternions(axes, R_base_work=R_base_work),
                normals=outward,
                stops=_ends(piece.stop - piece.start),
                deposit=True,
                run=run,
            )
        )
    return stretches


def _with_leads(run: _Stretch, leads: Leads | None) -> list[_Stretch]:
    """Return a run between a lead-in and a lead-out, or without one where it bends as soon as it begins or ends.

    There the tool would have to slow down again: it starts from rest, or comes to it.
    """
    before, behind = (
        None if leads is None or _bends(run.tips[::inwards], leads) else _lead(run, leads.length, inwards=inwards)
        for inwards in (1, -1)
    )
    stops = run.stops.copy()
    stops[0], stops[-1] = before is None, behind is None
    return [each for each in (before, replace(run, stops=stops), behind) if each is not None]


def _bends(tips: FloatArray, leads: Leads) -> bool:
    """Tell whether a polyline that begins with a lead soon has a bend that is tighter than it may be."""
    arcs = arc_lengths(tips)
    directions = np.diff(tips, axis=0) / np.maximum(np.diff(arcs), SHORTEST)[:, None]
    angles = np.arccos(np.clip(np.einsum("ij,ij->i", directions[1:], directions[:-1]), -1.0, 1.0))
    turned = np.cumsum(np.concatenate([[0.0], angles, [0.0]]))
    begins = arcs[arcs <= LOOKED_AHEAD - BEND_LENGTH]
    ends = np.interp(begins + BEND_LENGTH, arcs, turned)
    return bool((ends - turned[: begins.size] > BEND_LENGTH / leads.radius).any())


def _lead(run: _Stretch, length: float, *, inwards: int) -> _Stretch:
    """Return the straight way to the start of a run (1 row inwards), or from its end (-1); the tool turns on evenly."""
    end, inner, *_ = rows = np.arange(len(run.tips))[::inwards][:3]
    steps = np.diff(run.tips[rows], axis=0)
    sizes = np.linalg.norm(steps, axis=1)
    directions = steps / np.maximum(sizes, SHORTEST)[:, None]
    # The chord of a bend has the direction of its middle.
    along = directions[0] + (directions[0] - directions[-1]) * sizes[0] / sizes.sum()
    count = int(whole_steps(length, step=LEAD_STEP))
    away = length * np.arange(1, count + 1) / count
    before, behind = (
        np.broadcast_to(rigid(rotation_of(run.quaternions[row]), run.tips[row]), (count, 4, 4)) for row in (inner, end)
    )
    turned = interpolate_poses(before, behind, 1.0 + away / sizes[0])[:, :3, :3]
    order = np.arange(count)[::-inwards]
    return _Stretch(
        tips=(run.tips[end] - away[:, None] * along / np.linalg.norm(along))[order],
        quaternions=same_sign(quaternion_of(turned))[order],
        normals=np.tile(run.normals[end], (count, 1)),
        stops=order == count - 1,
        deposit=False,
        run=run.run,
    )


def _with_crossings(printed: list[list[_Stretch]], ground: Terrain, *, retract: float) -> Iterator[_Stretch]:
    """Yield the runs with their leads, and between two of them the travel from one to the next."""
    for (*own, run), (following, *_) in pairwise(printed):
        start, end = _lifted(run, -1, retract=retract), _lifted(following, 0, retract=retract)
        axes = -rotation_of(np.stack([run.quaternions[-1], following.quaternions[0]]))[:, :, 2]
        corners = crossing(start, end, axes=axes, terrain=ground, retract=retract)
        yield from (*own, run, _travel(run, following, corners))
    yield from printed[-1]


def _ends(count: int) -> BoolArray:
    """Tell which of a run's poses are its ends, where the tool comes to rest."""
    return np.isin(np.arange(count), [0, count - 1])


def _corners(points: FloatArray) -> BoolArray:
    """Tell where a polyline bends sharply; its ends always count."""
    directions = np.diff(points, axis=0)
    directions /= np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), SHORTEST)
    bend = np.einsum("ij,ij->i", directions[1:], directions[:-1]) < np.cos(CORNER_ANGLE)
    return np.concatenate([[True], bend, [True]])


def _lifted(stretch: _Stretch, row: int, *, retract: float) -> FloatArray:
    """Return the tip's place above one row, moved back along the nozzle."""
    return stretch.tips[row] - retract * rotation_of(stretch.quaternions[row])[:, 2]


def _travel(run: _Stretch, following: _Stretch, bends: FloatArray) -> _Stretch:
    """Lift off, cross, come down; the ends themselves are rows of the runs. The tool turns while it crosses."""
    ends = np.vstack([run.tips[-1:], bends, following.tips[:1]])
    tips, rows = sampled_polyline(ends)
    arcs = arc_lengths(tips)
    lifted, lowering = arcs[rows[1]], arcs[rows[-2]]
    shares = np.clip((arcs - lifted) / max(lowering - lifted, 1e-9), 0.0, 1.0)
    stops = np.zeros(arcs.size, dtype=np.bool_)
    stops[rows] = _corners(ends)
    stops[rows[[1, -2]]] = True
    before: BoolArray = shares[:, None] < 0.5
    inner = slice(1, -1)
    return _Stretch(
        tips=tips[inner],
        quaternions=slerp(run.quaternions[-1], following.quaternions[0], shares)[inner],
        normals=np.where(before, run.normals[-1:], following.normals[:1])[inner],
        stops=stops[inner],
        deposit=False,
        run=following.run,
    )


def _approach(run: _Stretch, *, up: FloatArray, retract: float, top: float) -> _Stretch:
    """Come down to the first run from over the whole part, where the robot arrives from home."""
    lifted = _lifted(run, 0, retract=retract)
    tips, corners = sampled_polyline(np.stack([over(lifted, up=up, retract=retract, top=top), lifted, run.tips[0]]))
    return _straight(run, 0, tips[:-1], stops=corners[:-1])


def _retreat(run: _Stretch, *, up: FloatArray, retract: float, top: float) -> _Stretch:
    """Lift off from the last run and rise over the whole part, where the robot leaves for home."""
    lifted = _lifted(run, -1, retract=retract)
    tips, corners = sampled_polyline(np.stack([run.tips[-1], lifted, over(lifted, up=up, retract=retract, top=top)]))
    return _straight(run, -1, tips[1:], stops=corners[1:] - 1)


def _straight(run: _Stretch, row: int, tips: FloatArray, *, stops: IntArray) -> _Stretch:
    count = tips.shape[0]
    at_rest = np.zeros(count, dtype=np.bool_)
    at_rest[stops] = True
    return _Stretch(
        tips=tips,
        quaternions=np.tile(run.quaternions[row], (count, 1)),
        normals=np.tile(run.normals[row], (count, 1)),
        stops=at_rest,
        deposit=False,
        run=run.run,
    )


def _joined(stretches: list[_Stretch], toolpath: Toolpath, *, standoff: float, flow: FloatArray) -> PoseStream:
    sizes = np.array([stretch.tips.shape[0] for stretch in stretches])
    runs = np.repeat([stretch.run for stretch in stretches], sizes)
    deposit = np.repeat([stretch.deposit for stretch in stretches], sizes)
    levels, flows = np.full(runs.size, -1), np.zeros(runs.size)
    levels[deposit], flows[deposit] = np.floor(toolpath.rows), flow
    return PoseStream(
        tips=np.concatenate([stretch.tips for stretch in stretches]),
        quaternions=same_sign(np.concatenate([stretch.quaternions for stretch in stretches])),
        normals=np.concatenate([stretch.normals for stretch in stretches]),
        runs=runs,
        levels=levels,
        layers=toolpath.layers[runs],
        deposit=deposit,
        stops=np.concatenate([stretch.stops for stretch in stretches]),
        arcs=np.concatenate([arc_lengths(stretch.tips) for stretch in stretches]),
        flow=flows,
        standoff=standoff,
    )
