"""The flow along a path as its program was executed: from when material flows and when the tip is where.

A valve that is only open or shut lets the same volume through in every second, so that where the tip is slower
more is deposited to a mm of path. An output that follows the speed of the tip deposits what was planned to a mm.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import Cell, FloatArray, IntArray, PoseStream


def executed_flow(poses: PoseStream, times: FloatArray, material: FloatArray, *, cell: Cell) -> FloatArray:
    """Return the (p,) flow at the poses that a program deposits, as it was executed [mm3/mm].

    With 'io' the valve lets through a volume a second: that of the set speed. A flow that settles rises evenly while
    the tip waits at the start of a deposit, where half of that volume comes to lie. With 'analog' the flow follows the
    speed.

    Args:
        poses: p of them, as the robot makes them, with the flow that was planned.
        times: (p,) when each is passed [s].
        material: (d, 2) when material begins and ends to flow, in order [s].
        cell: its signals and speed.
    """
    if cell.signals.mode == "analog":
        return flow_by_length(poses, times, material)
    rate = float(poses.flow.max()) * cell.process.speed
    return flow_by_time(poses, times, material, rate=rate, settle=cell.signals.settle)


def flow_by_time(
    poses: PoseStream, times: FloatArray, material: FloatArray, *, rate: float, settle: float = 0.0
) -> FloatArray:
    """Return the (p,) flow at the poses that a valve leaves which is open or shut [mm3/mm].

    Args:
        poses: p of them, as the robot makes them.
        times: (p,) when each is passed [s].
        material: (d, 2) when material begins and ends to flow, in order [s].
        rate: volume that flows in a second [mm3/s].
        settle: how long the flow rises to that where a deposit begins, of which the times know nothing [s].
    """
    begins = poses.deposited & ~np.insert(poses.deposited[:-1], 0, np.False_)
    return _spread(poses, rate * (_open(times, material) + begins * settle / 2.0))


def flow_by_length(poses: PoseStream, times: FloatArray, material: FloatArray) -> FloatArray:
    """Return the (p,) flow at the poses that an output leaves which follows the speed of the tip [mm3/mm].

    Args:
        poses: p of them, as the robot makes them, with the flow that was planned.
        times: (p,) when each is passed [s].
        material: (d, 2) when material begins and ends to flow, in order [s].
    """
    took = np.diff(times)
    shares = np.divide(_open(times, material), took, out=np.ones_like(took), where=took > 0.0)
    return _spread(poses, shares * poses.bead_lengths * (poses.flow[:-1] + poses.flow[1:]) / 2.0)


def flow_of_all(whole: PoseStream, parts: Sequence[tuple[PoseStream, FloatArray]]) -> FloatArray:
    """Return the (p,) flow at the poses of a deposit that several parts of a program deposit together [mm3/mm].

    Each step of a part lies on a step of the whole, as `paths.check_sum` has found: its volume is added to that one.

    Args:
        whole: p poses, as they were planned.
        parts: poses and flow of each, in the part's own coordinates wherever it stood.
    """
    rows, middles, _ = _steps(whole, np.zeros(whole.count))
    tree, volumes = KDTree(middles), np.zeros(whole.count - 1)
    for poses, flow in parts:
        _, places, deposited = _steps(poses, flow)
        np.add.at(volumes, rows[np.asarray(tree.query(places)[1])], deposited)
    return _spread(whole, volumes)


def deposited_volume(poses: PoseStream, flow: FloatArray) -> float:
    """Return the volume that a (p,) flow deposits along a path [mm3]: linear between the poses [mm3/mm]."""
    return float((poses.bead_lengths * (flow[:-1] + flow[1:]) / 2.0)[poses.deposited].sum())


def deposited_shares(poses: PoseStream, flow: FloatArray, *, layer_height: float) -> tuple[IntArray, FloatArray]:
    """Return the (r,) runs that deposit, and the volume that each gets over the one that was planned.

    A run that is shorter than its bead is wide is a dot: what it gets too much or too little is counted over a dot.

    Args:
        poses: p of them, as the robot makes them, with the flow that was planned.
        flow: (p,) that is deposited [mm3/mm].
        layer_height: [mm].
    """
    rows = np.flatnonzero(poses.deposited)
    runs, own = np.unique(poses.runs[rows + 1], return_inverse=True)
    found, wanted = (
        np.bincount(own, (poses.bead_lengths * (each[:-1] + each[1:]) / 2.0)[rows]) for each in (flow, poses.flow)
    )
    widest = float(poses.flow.max())
    return runs, 1.0 + (found - wanted) / np.maximum(wanted, widest * widest / layer_height)


def _steps(poses: PoseStream, flow: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return first poses (k,) of the steps that deposit material, their middles (k, 3) and volumes (k,) [mm, mm3]."""
    rows, places = np.flatnonzero(poses.deposited), poses.surface_points
    volumes = poses.bead_lengths * (flow[:-1] + flow[1:]) / 2.0
    return rows, (places[rows] + places[rows + 1]) / 2.0, volumes[rows]


def _open(times: FloatArray, material: FloatArray) -> FloatArray:
    """Return (p - 1,) how long material flows between each moment and the next [s]."""
    moments = np.concatenate([[-np.inf], material.ravel(), [np.inf]])
    before = np.searchsorted(moments, times, side="right") - 1
    passed = np.concatenate([[0.0], np.cumsum(material[:, 1] - material[:, 0])])
    # Between the two ends of a span it flows, and its number is half of that of its moment.
    flowing, span = before % 2 == 1, before // 2
    until = passed[span] + np.where(flowing, times - np.where(flowing, moments[before], 0.0), 0.0)
    return np.diff(until)


def _spread(poses: PoseStream, volumes: FloatArray) -> FloatArray:
    """Return the (p,) flow at poses that deposits the (p - 1,) volumes between them, shared by the poses at both ends.

    A volume where the tip stands still comes to its neighbours.
    """
    deposited = np.where(poses.deposited, volumes, 0.0)
    lengths = np.where(poses.deposited, poses.bead_lengths, 0.0)
    total, along = (np.append(each, 0.0) + np.insert(each, 0, 0.0) for each in (deposited, lengths))
    return np.divide(total, along, out=np.zeros_like(total), where=along > 0.0)
