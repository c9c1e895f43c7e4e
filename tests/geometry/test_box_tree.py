"""The tree of boxes: every triangle in one leaf, boxes about what they hold, and slivers and points among triangles."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings, strategies as st

from geoprint.geometry.points import closest_in_triangles
from geoprint.geometry.rays import LEAF, box_tree, nearest_triangles
from geoprint.model import FloatArray


def _triangles(count: int, seed: int) -> FloatArray:
    """Return triangles of any shape: a third of them without area, some of them points."""
    random = np.random.default_rng(seed)
    corners = random.normal(size=(count, 1, 3)) * 5.0 + random.normal(size=(count, 3, 3)) * random.choice(
        [0.01, 1.0, 9.0]
    )
    flat = random.random(count) < 0.3
    corners[flat, 2] = corners[flat, 0] + random.random((int(flat.sum()), 1)) * (corners[flat, 1] - corners[flat, 0])
    points = random.random(count) < 0.1
    corners[points] = corners[points, :1]
    return corners


@given(count=st.integers(1, 60), seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_no_triangle_is_closer_than_what_is_found(count: int, seed: int) -> None:
    corners = _triangles(count, seed)
    places = np.random.default_rng(seed + 1).normal(size=(40, 3)) * 8.0
    found = nearest_triangles(places, corners, box_tree(corners))
    _, squares = closest_in_triangles(places, corners[found])
    for place, square in zip(places, squares, strict=True):
        _, every = closest_in_triangles(np.tile(place, (count, 1)), corners)
        assert square <= every.min() + 1e-9


@given(count=st.integers(1, 200), seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_boxes_hold_what_is_theirs_and_leaves_hold_every_triangle_once(count: int, seed: int) -> None:
    corners = _triangles(count, seed)
    tree = box_tree(corners)
    leaves = np.flatnonzero(tree.halves < 0)
    held = np.concatenate([tree.order[tree.firsts[leaf] : tree.lasts[leaf]] for leaf in leaves])
    assert sorted(held.tolist()) == list(range(count))
    assert (tree.lasts[leaves] - tree.firsts[leaves]).max() <= LEAF
    for box in range(len(tree.boxes)):
        own = corners[tree.order[tree.firsts[box] : tree.lasts[box]]].reshape(-1, 3)
        np.testing.assert_array_equal(tree.boxes[box], np.concatenate([own.min(axis=0), own.max(axis=0)]))
