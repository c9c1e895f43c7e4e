"""What each kind of error does to measured spacings, as linear maps from independent standard normal numbers.

An error of the arm moves a whole run, or strays along it; a wrong placement moves all of the part; a needle that is
bent moves the tip with the tool; an inaccurate arm moves all paths, those beside one another nearly alike. Where sample
and foot move alike, the spacing stays.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from scipy.sparse import csr_array, hstack
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from geoprint.model import ACCURACY_LENGTH, FloatArray, IntArray, PoseStream, PrintErrors
from geoprint.quality.deposited import deposited_rows
from geoprint.quality.spans import Spans

Sparse: TypeAlias = "csr_array"

# What errors are called, by the keys of the cell.
SOURCES = ("repeatability", "path_repeatability", "placement", "needle_runout", "path_accuracy")
# Numbers that belong to the cell and are alike in all its prints: shift and turn of the part, where the needle's tip
# is, and how far the arm lies off and how that changes along each axis.
OF_CELL = 20
# What strays along a run is white noise, smoothed: nodes so far apart over the correlation length, so many around.
NODE_SHARE = 0.7
NODES_AROUND = 8


def node_counts(spans: Spans, errors: PrintErrors) -> IntArray:
    """Return how many nodes each of r runs has along it."""
    counts = np.full(int(spans.runs.max(initial=-1)) + 1, NODES_AROUND)
    np.maximum.at(counts, spans.runs.ravel(), _first_nodes(spans, errors).ravel() + NODES_AROUND)
    return counts


def strays(spans: Spans, errors: PrintErrors, *, poses: PoseStream | None) -> tuple[Sparse, ...]:
    """Return by how much k spans become longer [mm], linear in normal numbers: a map of k rows for each of `SOURCES`.

    Args:
        spans: k spans between r runs.
        errors: what they are.
        poses: how the tool stands; None where nobody knows, then a bent needle is left out.

    Returns:
        Maps from the shift of each run (3 r), the nodes along all runs (3 a node), a shift and a turn of the part (6),
        the two coordinates of the needle's tip, and the arm's inaccuracy (12).
    """
    count, runs = spans.count, node_counts(spans, errors).size
    whole = _blocks(spans, spans.runs[:, :, None], np.ones((count, 2, 1)), columns=runs)
    nodes, weights = _nodes(spans, errors)
    along = _blocks(spans, nodes, weights, columns=int(node_counts(spans, errors).sum()))
    centre = spans.places.mean(axis=0) if count else np.zeros(3)
    turned = np.cross(spans.feet - centre, spans.beyond) - np.cross(spans.places - centre, spans.towards)
    placed = np.hstack([errors.placement * (spans.beyond - spans.towards), errors.placement_turn * turned])
    needle = np.zeros((count, 2)) if poses is None or not count else _needle(spans, poses)
    return (
        whole * errors.run_deviation,
        along * errors.path_deviation,
        csr_array(placed),
        csr_array(errors.needle_runout * needle),
        _inaccurate(spans, centre) * errors.accuracy_deviation,
    )


def over(maps: tuple[Sparse, ...], lengths: FloatArray) -> tuple[Sparse, ...]:
    """Return maps to spans, each over one of (k,) lengths [mm]."""
    return tuple(csr_array(one.multiply(1.0 / lengths[:, None])) for one in maps)


def together(maps: tuple[Sparse, ...]) -> Sparse:
    """Return the maps of all errors as one."""
    return csr_array(hstack(maps))


def expected_variance(of: Sparse) -> float:
    """Return the mean of the variance over k spans that a map makes of standard normal numbers."""
    rows = max(of.shape[0], 1)
    mean = np.asarray(of.sum(axis=0)) / rows
    return max(float((of.data**2).sum() / rows - (mean**2).sum()), 0.0)


def _first_nodes(spans: Spans, errors: PrintErrors) -> IntArray:
    """Return the (k, 2) first of the nodes around each sample and each foot, along their runs."""
    return np.floor(spans.arcs / (NODE_SHARE * errors.correlation)).astype(np.int64)


def _nodes(spans: Spans, errors: PrintErrors) -> tuple[IntArray, FloatArray]:
    """Return (k, 2, n) nodes around each sample and foot, counted over all runs, and their weights.

    White noise that is smoothed by exp(-(s / length)^2) has the correlation exp(-(s / length)^2 / 2).
    """
    counts = node_counts(spans, errors)
    before = np.cumsum(counts) - counts
    first = _first_nodes(spans, errors)[:, :, None] + np.arange(NODES_AROUND)
    # As many nodes behind a place as before it.
    away = NODE_SHARE * (first - NODES_AROUND // 2 + 1) - spans.arcs[:, :, None] / errors.correlation
    weights = np.exp(-(away**2))
    return before[spans.runs][:, :, None] + first, weights / np.linalg.norm(weights, axis=2, keepdims=True)


def _blocks(spans: Spans, nodes: IntArray, weights: FloatArray, *, columns: int) -> Sparse:
    """Return the map from the three coordinates of every node to the (k,) changes of length.

    Args:
        spans: k spans.
        nodes: (k, 2, n) that move the sample, and the foot.
        weights: (k, 2, n) by how much.
        columns: nodes in all.
    """
    ends = np.stack([-spans.towards, spans.beyond], axis=1)
    values = weights[:, :, :, None] * ends[:, :, None, :]
    places = 3 * nodes[:, :, :, None] + np.arange(3)
    each = int(np.prod(values.shape[1:]))
    starts = np.arange(spans.count + 1) * each
    return csr_array((values.ravel(), places.ravel(), starts), shape=(spans.count, 3 * columns))


def _inaccurate(spans: Spans, centre: FloatArray) -> Sparse:
    """Return the map from a shift and its change along each axis, about a centre; equally large everywhere.

    Two places at a and b from the centre, in lengths, have the correlation (1 + a . b) / |(1, a)| / |(1, b)|.
    """
    away = (np.stack([spans.places, spans.feet], axis=1) - centre) / ACCURACY_LENGTH
    weights = np.concatenate([np.ones((spans.count, 2, 1)), away], axis=2)
    weights /= np.linalg.norm(weights, axis=2, keepdims=True)
    return _blocks(spans, np.broadcast_to(np.arange(4), weights.shape), weights, columns=4)


def _needle(spans: Spans, poses: PoseStream) -> FloatArray:
    """Return (k, 2) by how much spans become longer where the needle's tip is off along the tool's x and y."""
    rows = deposited_rows(poses)
    nearest = KDTree(poses.surface_points[rows])
    attitudes = Rotation.from_quat(poses.quaternions[rows], scalar_first=True).as_matrix()
    here, there = (attitudes[nearest.query(places)[1]][:, :, :2] for places in (spans.places, spans.feet))
    return np.einsum("kxa,kx->ka", there, spans.beyond) - np.einsum("kxa,kx->ka", here, spans.towards)
