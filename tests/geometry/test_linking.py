"""Which nodes hang together, against a search from node to node; sizes of triangles, against their formulas."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings, strategies as st

from geoprint.geometry import component_labels, edge_lengths, face_areas
from geoprint.geometry.operators import side_lengths, thinness
from geoprint.geometry.topology import connected_nodes, edges
from geoprint.model import IntArray, Surface
from tests import meshes


@settings(max_examples=80, deadline=None)
@given(seed=st.integers(0, 10_000), nodes=st.integers(1, 30), links=st.integers(0, 30))
def test_nodes_are_numbered_by_the_first_of_their_piece(seed: int, nodes: int, links: int) -> None:
    first: IntArray = np.random.default_rng(seed).integers(0, nodes, links)
    second: IntArray = np.random.default_rng(seed + 1).integers(0, nodes, links)
    labels, pairs = list(range(nodes)), [(int(first[link]), int(second[link])) for link in range(links)]
    for _ in range(nodes):
        for one, other in pairs:
            labels[one] = labels[other] = min(labels[one], labels[other])
    wanted = [sorted(set(labels)).index(label) for label in labels]
    assert connected_nodes(first, second, nodes=nodes).tolist() == wanted


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), vertices=st.integers(3, 14), faces=st.integers(1, 25))
def test_faces_hang_together_over_edges_also_where_these_have_more_than_two(
    seed: int, vertices: int, faces: int
) -> None:
    rng = np.random.default_rng(seed)
    soup = Surface(rng.normal(size=(vertices, 3)), np.array([rng.permutation(vertices)[:3] for _ in range(faces)]))
    sides = [{frozenset(pair) for pair in edges(face[None]).tolist()} for face in soup.faces]
    labels = list(range(faces))
    for _ in range(faces):
        for one in range(faces):
            for other in range(faces):
                if sides[one] & sides[other]:
                    labels[one] = labels[other] = min(labels[one], labels[other])
    wanted = [sorted(set(labels)).index(label) for label in labels]
    assert component_labels(soup).tolist() == wanted


def test_sizes_of_triangles_are_their_sides_and_areas() -> None:
    cap = meshes.spherical_cap()
    sides = side_lengths(cap.vertices, cap.faces)
    doubled, squares = thinness(cap.vertices, cap.faces)
    np.testing.assert_allclose(np.unique(np.round(sides, 9)), np.unique(np.round(edge_lengths(cap), 9)))
    np.testing.assert_allclose(doubled, 2.0 * face_areas(cap), rtol=1e-12)
    np.testing.assert_allclose(squares, sides.max(axis=1) ** 2, rtol=1e-12)
