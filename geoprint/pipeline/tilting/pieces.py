"""The paths of one attitude of a table: the pieces of runs that are printed in it, as a toolpath of its own.

Where a bead is interrupted and goes on in another attitude, the piece that goes on begins before the end of the other,
and over that overlap the flow of one fades as that of the other grows: both lie on the same line, and their flows are
one bead at every place of it. A valve that only opens and shuts cannot fade, so that its pieces meet without overlap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import final

import numpy as np

from geoprint.model import FloatArray, IntArray, Placement, PoseStream, SurfaceCurves, SurfacePoints, Toolpath, frozen
from geoprint.motion.tilting import Attitude
from geoprint.paths import PosedSurface
from geoprint.pipeline.standing import pose_stream
from geoprint.results import Plan
from geoprint.transforms import angles_between

# Angles of overhang are compared up to this [rad].
ANGLE_TOLERANCE = 1e-6


@final
@frozen
class Portions:
    """What is printed in one attitude, of a deposit of n poses.

    Attributes:
        pieces: (k, 2) first pose and pose behind the last, with what overlaps.
        shares: of each piece, of the flow at its poses, in [0, 1].
    """

    pieces: IntArray
    shares: tuple[FloatArray, ...]

    @property
    def rows(self) -> IntArray:
        """(m,) deposited poses, piece after piece."""
        return np.concatenate([np.arange(first, behind) for first, behind in _pairs(self.pieces)])


def portions(
    attitudes: Sequence[Attitude], poses: PoseStream, *, overlap: float, critical: float
) -> tuple[Portions, ...]:
    """Divide a deposit among attitudes, with beads that overlap and fade where one is interrupted.

    Args:
        attitudes: whose pieces together are the whole deposit.
        poses: the n deposited ones.
        overlap: along the run [mm]; no longer than the piece before, nor than what does not overhang in the attitude.
        critical: angle of overhang [rad].

    Returns:
        What is printed in each; the shares of all pieces at any place of the deposit add to 1.
    """
    starts = {first: behind for each in attitudes for first, behind in _pairs(each.pieces)}
    ends = {behind: first for first, behind in starts.items()}
    fades = {
        first: _fade(poses, first, ends, overlap=overlap, angles=angles)
        for each in attitudes
        for angles in [np.maximum(angles_between(poses.normals, each.up), critical)]
        for first in each.pieces[:, 0].tolist()
    }
    found: list[Portions] = []
    for each in attitudes:
        pieces = [(fades[first], behind) for first, behind in _pairs(each.pieces)]
        shares = [
            _shares(poses.arcs, first, behind, grown=own, fading=fades.get(behind - 1, behind - 1))
            for (first, behind), own in zip(pieces, each.pieces[:, 0].tolist(), strict=True)
        ]
        found.append(Portions(np.array(pieces), tuple(shares)))
    return tuple(found)


def attitude_paths(paths: Plan, portion: Portions, placement: Placement, *, known: PosedSurface) -> Plan:
    """Return the paths of one attitude, for a part that stands as it does then.

    Args:
        paths: of the whole part.
        portion: what is printed in the attitude.
        placement: where the part stands in it.
        known: of the whole part.
    """
    toolpath = _toolpath(paths, portion)
    workpiece = replace(paths.workpiece, placement=placement)
    stream = pose_stream(toolpath, workpiece, max_tilt_deg=paths.job.max_tilt, known=known)
    flow = paths.poses.flow[paths.poses.deposit][portion.rows] * np.concatenate(portion.shares)
    poses = replace(stream, flow=_at_deposits(stream, flow))
    return replace(paths, workpiece=workpiece, toolpath=toolpath, poses=poses, tilting=None)


def _fade(poses: PoseStream, first: int, ends: dict[int, int], *, overlap: float, angles: FloatArray) -> int:
    """Return the pose with which a piece begins that goes on where another ends: as far before as beads overlap.

    None of what overlaps is steeper than its own first pose, by (n,) angles of all poses that are critical at least.
    """
    before = ends.get(first + 1)
    if before is None or poses.runs[before] != poses.runs[first]:
        return first
    outside = (poses.arcs[first] - poses.arcs[before:first] > overlap) | (
        angles[before:first] > angles[first] + ANGLE_TOLERANCE
    )
    return before + int(np.flatnonzero(outside).max(initial=-1)) + 1


def _shares(arcs: FloatArray, first: int, behind: int, *, grown: int, fading: int) -> FloatArray:
    """Return the share of the flow at the poses of a piece: it grows to 1 at one pose, and fades from another on."""
    along = arcs[first:behind]
    shares = np.ones(behind - first)
    if grown > first:
        shares = np.minimum(shares, (along - arcs[first]) / (arcs[grown] - arcs[first]))
    if fading < behind - 1:
        shares = np.minimum(shares, (arcs[behind - 1] - along) / (arcs[behind - 1] - arcs[fading]))
    return shares


def _toolpath(paths: Plan, portion: Portions) -> Toolpath:
    whole, rows = paths.toolpath, portion.rows
    curves, firsts = whole.curves, portion.pieces[:, 0]
    runs = np.searchsorted(curves.offsets, firsts, side="right") - 1
    sizes = np.diff(portion.pieces, axis=1)[:, 0]
    points = SurfacePoints(curves.points.faces[rows], curves.points.weights[rows])
    # A closed run that is printed as one stays closed.
    entire = sizes == np.diff(curves.offsets)[runs]
    return replace(
        whole,
        curves=SurfaceCurves(points, np.append(0, np.cumsum(sizes)), curves.closed[runs] & entire),
        levels=whole.levels[runs],
        layers=whole.layers[runs],
        rows=whole.rows[rows],
        spacings=whole.spacings[rows],
    )


def _at_deposits(stream: PoseStream, values: FloatArray) -> FloatArray:
    found = np.zeros(stream.count)
    found[stream.deposit] = values
    return found


def _pairs(pieces: IntArray) -> list[tuple[int, int]]:
    return [(int(first), int(behind)) for first, behind in pieces]
