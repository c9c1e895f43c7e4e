"""Self-intersections: known pairs, the tree against every pair, and what only touches."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.geometry import crossings as module
from geoprint.geometry.crossings import crossings
from geoprint.model import FloatArray, Surface
from tests import meshes

FLAT = [[0, 0, 0], [10, 0, 0], [0, 10, 0]]


def two(second: list[list[float]], *, faces: tuple[list[int], list[int]] = ([0, 1, 2], [3, 4, 5])) -> Surface:
    return Surface(vertices=np.array(FLAT + second, dtype=float), faces=np.array(faces))


def cross_by_definition(a: FloatArray, b: FloatArray) -> bool:
    """Whether an edge of one triangle passes through the inside of the other, by solving for the point."""
    for corners, other in ((a, b), (b, a)):
        for i in range(3):
            start, end = corners[i], corners[(i + 1) % 3]
            system = np.column_stack([other[1] - other[0], other[2] - other[0], start - end])
            u, v, t = np.asarray(np.linalg.inv(system) @ (start - other[0]), dtype=np.float64)
            if u > 0 and v > 0 and u + v < 1 and 0 < t < 1:
                return True
    return False


@pytest.mark.parametrize(
    ("surface", "cross"),
    [
        (two([[2, 2, -1], [3, 2, 1], [2, 3, 1]]), True),
        (two([[2, 2, 1], [3, 2, 2], [2, 3, 2]]), False),
        (two([[20, 2, -1], [21, 2, 1], [20, 3, 1]]), False),
        (two([[2, 2, 0], [3, 2, 1], [2, 3, 1]]), False),
        (two([[2, 2, 0], [3, 2, 0], [2, 3, 0]]), True),
        (two([[20, 2, 0], [23, 2, 0], [22, 3, 0]]), False),
        (two([[3, 1, -1], [1, 3, 1]], faces=([0, 1, 2], [0, 3, 4])), True),
        (two([[3, 1, 1], [1, 3, 1]], faces=([0, 1, 2], [0, 3, 4])), False),
        (two([[3, -3, 0]], faces=([0, 1, 2], [1, 0, 3])), False),
        (two([[3, 3, 0]], faces=([0, 1, 2], [1, 0, 3])), True),
        (two([[3, 3, 1]], faces=([0, 1, 2], [1, 0, 3])), False),
    ],
    ids=[
        "through", "above", "beside", "touching", "on it", "in its plane", "through at a common corner",
        "apart at a common corner", "flat neighbour", "folded flat onto its neighbour", "folded sharply",
    ],
)  # fmt: skip
def test_two_triangles(surface: Surface, *, cross: bool) -> None:
    assert crossings(surface, depth=1e-6)[0].tolist() == ([[0, 1]] if cross else [])


def test_what_passes_through_by_less_than_the_depth_does_not_cross() -> None:
    surface = two([[2, 2, -0.1], [3, 2, 1], [2, 3, 1]])
    assert len(crossings(surface, depth=0.09)[0]) == 1
    assert len(crossings(surface, depth=0.11)[0]) == 0


@given(seed=st.integers(0, 10_000), count=st.integers(2, 35))
@settings(max_examples=25, deadline=None)
def test_the_tree_finds_the_pairs_that_comparing_all_finds(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    centres = random.uniform(0, 30, (count, 1, 3))
    corners = centres + random.normal(0, 4, (count, 3, 3))
    surface = Surface(vertices=corners.reshape(-1, 3), faces=np.arange(3 * count).reshape(-1, 3))
    expected = [[i, j] for i, j in combinations(range(count), 2) if cross_by_definition(corners[i], corners[j])]
    pairs, complete = crossings(surface, depth=1e-9)
    assert pairs.tolist() == expected
    assert complete


@pytest.mark.parametrize("surface", [meshes.plate(jitter_seed=1), meshes.sphere(subdivisions=4), meshes.torus()])
def test_good_surfaces_do_not_cross_themselves(surface: Surface) -> None:
    pairs, complete = crossings(surface, depth=1e-6)
    assert (len(pairs), complete) == (0, True)


def test_a_search_that_is_cut_short_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(0)
    surface = Surface(vertices=random.uniform(0, 1, (900, 3)), faces=np.arange(900).reshape(-1, 3))
    monkeypatch.setattr(module, "CANDIDATES_PER_FACE", 10)
    assert not crossings(surface, depth=1e-9)[1]
    monkeypatch.setattr(module, "CANDIDATES_PER_FACE", 500)
    monkeypatch.setattr(module, "MOST_PAIRS", 50)
    pairs, complete = crossings(surface, depth=1e-9)
    assert (len(pairs), complete) == (50, False)


def test_faces_at_one_point_are_no_error() -> None:
    surface = Surface(vertices=np.zeros((6, 3)), faces=np.array([[0, 1, 2], [3, 4, 5]]))
    assert crossings(surface, depth=0.0)[1]
