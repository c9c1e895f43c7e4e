"""The pose stream: runs lifted to the stand-off, attitudes along them, and the travel between them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Literal, final

import numpy as np

from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream, Surface, Tool, Toolpath, freeze_arrays, frozen
from geoprint.paths.attitude import slerp, smoothed_axes, tool_quaternions
from geoprint.paths.lifting import lifting_normals
from geoprint.paths.travel import KEPT_SHARE, Terrain, crossing, over, sampled_polyline, terrain, terrain_points
from geoprint.surfaces import arc_lengths, normals, positions, vertex_normals
from geoprint.transforms import rotation_of, same_sign

# A bend sharper than this [rad] at one sample is a corner: no curve rounds it within the chord error, so the tool
# stops there for an instant.
CORNER_ANGLE = np.radians(30.0)
# Corners of what stands beside a part that stands alone.
NOTHING = np.empty((0, 3))
NOTHING.setflags(write=False)
# Steps shorter than this [mm] have no direction; where they meet others, the tool stops.
SHORTEST = 1e-9


@final
@frozen
class PosedSurface:
    """What poses on a surface need of it however it stands.

    Attributes:
        normals: (n, 3) of its vertices.
        points: (m, 3) of it, and of the body that it lies on, over which travel passes [mm].
    """

    normals: FloatArray
    points: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, normals="float: n 3", points="float: m 3")


@frozen
class _Stretch:
    """Rows of the stream that belong together: one run, or the travel to it."""

    tips: FloatArray
    quaternions: FloatArray
    normals: FloatArray
    stops: BoolArray
    deposit: bool
    run: int


def posed_surface(surface: Surface, body: Surface | None) -> PosedSurface:
    """Prepare a surface and the body that it lies on for several streams of poses.

    Raises:
        MeshError: a vertex has no normal.
    """
    return PosedSurface(vertex_normals(surface), terrain_points([surface] if body is None else [surface, body]))


def poses(
    toolpath: Toolpath,
    surface: Surface,
    *,
    R_base_work: FloatArray,
    standoff: float,
    retract: float,
    layer_height: float,
    max_tilt: float,
    tool: Tool,
    body: Surface | None,
    beside: FloatArray = NOTHING,
    travel: Literal["low", "high"] = "low",
    known: PosedSurface | None = None,
) -> PoseStream:
    """Orient the tool along a toolpath and join the runs by travel.

    On deposit the tip stands `standoff` above the surface along its normal, or in a crease too narrow for that along
    one that `lifting_normals` smoothed; the nozzle points against the further smoothed normal, and leans from the one
    along which it is lifted by no more than `max_tilt`. Between runs the tool lifts off along the nozzle, crosses as
    low as part and body allow, and comes down along the nozzle of the next run.

    Args:
        toolpath: runs in printing order.
        surface: what they lie on.
        R_base_work: (3, 3) how the part stands; `tool_quaternions` says what depends on it.
        standoff: height of the tip over the surface on deposit [mm].
        retract: lift between runs [mm].
        layer_height: bead height that sets the flow: the spacing of a point times layer height [mm].
        max_tilt: largest angle between nozzle and surface normal on deposit [rad].
        tool: that has to pass while it crosses.
        body: what the part lies on, or None.
        beside: (b, 3) corners of what else the tool passes over, on its motion from home: a table's solids [mm].
        travel: "high" crosses over everything, for where low travel turns out not to be clear.
        known: of this surface and body, so that nothing is prepared twice.

    Returns:
        The stream in the work frame; it starts and ends above the whole part, and above what stands beside it.
    """
    up = R_base_work[2]
    ready, kept = known or posed_surface(surface, body), KEPT_SHARE * retract if travel == "low" else np.inf
    ground = terrain(ready.points, beside=beside, tool=tool, up=up, kept=kept)
    top = float((np.concatenate([surface.vertices, beside]) @ up).max())
    straight = normals(surface, toolpath.curves.points, at_vertices=ready.normals)
    runs = _run_stretches(toolpath, surface, straight, R_base_work=R_base_work, standoff=standoff, max_tilt=max_tilt)
    first = _approach(runs[0], up=up, retract=retract, top=top)
    last = _retreat(runs[-1], up=up, retract=retract, top=top)
    stretches = [first, *_with_crossings(runs, ground, retract=retract), last]
    return _joined(stretches, toolpath, standoff=standoff, flow=toolpath.spacings * layer_height)


def largest_lean(stream: PoseStream) -> float:
    """Return the largest angle between nozzle and surface normal on deposit [rad]."""
    return float(_leans(stream)[stream.deposit].max(initial=0.0))


def mean_lean(stream: PoseStream) -> float:
    """Return the mean angle between nozzle and surface normal over the deposited length [rad]; 0 without any."""
    leans, lengths = _leans(stream), np.where(stream.laid, np.linalg.norm(np.diff(stream.tips, axis=0), axis=1), 0.0)
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
) -> list[_Stretch]:
    """Lift every run to the stand-off along the normals `straight` (k, 3), and point the nozzle along it."""
    curves = toolpath.curves
    everywhere = positions(surface, curves.points)
    stretches: list[_Stretch] = []
    for run, closed in enumerate(curves.closed.tolist()):
        piece = slice(*curves.offsets[run : run + 2])
        places = everywhere[piece]
        outward = lifting_normals(places, straight[piece], closed=closed, standoff=standoff)
        axes = smoothed_axes(outward, arc_lengths(places), closed=closed, max_tilt=max_tilt)
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


def _with_crossings(runs: list[_Stretch], ground: Terrain, *, retract: float) -> Iterator[_Stretch]:
    """Yield the runs, and between two of them the travel from one to the next."""
    for run, following in pairwise(runs):
        start, end = _lifted(run, -1, retract=retract), _lifted(following, 0, retract=retract)
        axes = -rotation_of(np.stack([run.quaternions[-1], following.quaternions[0]]))[:, :, 2]
        corners = crossing(start, end, axes=axes, terrain=ground, retract=retract)
        yield from (run, _travel(run, following, corners))
    yield runs[-1]


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
