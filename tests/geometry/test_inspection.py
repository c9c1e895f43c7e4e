"""The mesh doctor: known findings with their places, on good meshes and on refused ones."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import MeshError
from geoprint.geometry import closest, deviation, inspect, refine
from geoprint.geometry.files import save_ply
from geoprint.model import Surface
from geoprint.reporting import inspection_figure, inspection_summary, inspection_text
from geoprint.results import FileInspection
from geoprint.workflow import inspect_file
from tests import meshes
from tests.meshes import annulus, disc, plate, sphere, spherical_cap
from tests.shared_data import shared


def inspected(path: Path, *, unit: str | None = None) -> FileInspection:
    seen = inspect_file(path, unit=unit)
    assert isinstance(seen, FileInspection)
    return seen


def test_a_torus_has_one_handle_and_no_border() -> None:
    found = inspect(meshes.torus())
    assert (found.genus, found.rims, len(found.components)) == (1, (), 1)
    assert found.refusal is None
    assert found.preparation is not None
    assert found.preparation.repairs.changes() == ()


def test_holes_are_listed_with_length_and_place() -> None:
    found = inspect(meshes.annulus(inner=8.0, outer=20.0, divisions=(100, 10)))
    assert [rim.edges for rim in found.rims] == [100, 100]
    assert [rim.length for rim in found.rims] == pytest.approx([2 * np.pi * 20, 2 * np.pi * 8], rel=1e-3)
    assert np.linalg.norm(found.rims[1].place) == pytest.approx(8.0)
    assert found.genus == 0


def test_a_fin_and_a_crossing_are_counted_with_their_places() -> None:
    plate = meshes.plate()
    extra = np.array([[7.5, 5.0, 9.0], [20.0, 12.0, -5.0], [21.0, 12.0, 5.0], [20.0, 13.0, 5.0]])
    count = len(plate.vertices)
    fin = Surface(
        vertices=np.concatenate([plate.vertices, extra]),
        faces=np.concatenate([plate.faces, [[8, 15, count], [count + 1, count + 2, count + 3]]]),
    )
    found = inspect(fin)
    assert found.nonmanifold_edges.count == 1
    assert found.nonmanifold_edges.places == ((7.5, 5.0, 0.0),)
    assert found.flipped_faces.count is None
    assert found.crossings.count == len(found.crossings.places)
    assert found.crossings.places[0] == pytest.approx((20.0, 12.5, 0.0), abs=4.0)
    assert found.genus is None
    assert "edges with more than two faces: 1" in str(found.refusal)


def test_a_vertex_where_fans_touch_is_found_in_a_refused_mesh_too() -> None:
    plate = meshes.plate()
    other = plate.vertices[1:] + np.array([40.0, 30.0, 0.0])
    corner = int(np.argmax(plate.vertices[:, 0] + plate.vertices[:, 1]))
    names = np.concatenate([[corner], len(plate.vertices) + np.arange(len(other))])
    assert np.array_equal(plate.vertices[corner], plate.vertices[0] + np.array([40.0, 30.0, 0.0]))
    bowtie = Surface(
        vertices=np.concatenate([plate.vertices, other]), faces=np.concatenate([plate.faces, names[plate.faces]])
    )
    found = inspect(bowtie)
    assert "has 2 separate components" in str(found.refusal)
    assert found.nonmanifold_vertices.count == 1
    assert found.nonmanifold_vertices.places == ((40.0, 30.0, 0.0),)
    assert found.flipped_faces.count == 0
    assert [piece[0] for piece in found.components] == [len(plate.faces)] * 2


def test_slivers_are_counted_with_the_thinnest_first() -> None:
    vertices = np.array([[0, 0, 0], [40, 0, 0], [20, 0.1, 0], [20, 30, 0], [20, -0.3, 0]], dtype=float)
    found = inspect(Surface(vertices=vertices, faces=np.array([[0, 1, 2], [0, 2, 3], [2, 1, 3], [1, 0, 4]])))
    assert found.slivers.count == 2
    assert found.slivers.places[0] == pytest.approx((20.0, 0.1 / 3, 0.0))


def test_a_file_is_told_with_its_unit_and_what_each_backend_says(tmp_path: Path) -> None:
    save_ply(meshes.plate(jitter_seed=1), tmp_path / "plate.ply")
    seen = inspected(tmp_path / "plate.ply")
    assert (seen.unit, seen.assumed) == ("mm", True)
    assert (seen.low, seen.high) == (pytest.approx((0.0, 0.0, 0.0)), pytest.approx((40.0, 30.0, 0.0)))
    assert dict(seen.backends) == {"heat": "yes", "fast-marching": "yes", "lscm": "yes"}
    assert "assumed from the size: give `--unit`" in inspection_text(seen)
    summary = json.loads(json.dumps(inspection_summary(inspect_file(tmp_path / "plate.ply", unit="mm"))))
    assert (summary["unit_assumed"], summary["changes"], summary["refusal"]) == (False, [], None)
    assert summary["border"][0]["length_mm"] == pytest.approx(140.0)


def test_a_closed_surface_is_planned_from_a_point_by_all_but_lscm(tmp_path: Path) -> None:
    save_ply(meshes.sphere(), tmp_path / "ball.ply")
    answers = dict(inspected(tmp_path / "ball.ply", unit="mm").backends)
    assert answers["heat"] == answers["fast-marching"] == "yes, with `--from point:X,Y,Z`: it is closed"
    assert answers["lscm"].startswith("no: ball.ply (closed, genus 0) cannot be flattened")


def test_a_size_that_is_unusual_is_hinted_at(tmp_path: Path) -> None:
    save_ply(meshes.plate((1.5, 1.1)), tmp_path / "plate.ply")
    hint = inspected(tmp_path / "plate.ply", unit="mm").hint
    assert hint == (
        "plate.ply is 1.5 mm large in mm, most parts have 10 to 500 mm; with `--unit in` it would be 38.1 mm: check "
        "the unit."
    )


@pytest.mark.parametrize("name", ["x_folded_selfintersect.ply", "trimesh_bunny.ply", "x_pinhole.ply"])
def test_the_findings_are_drawn(name: str) -> None:
    found = inspected(shared(f"broken/{name}")).found
    assert inspection_figure(found, title=f"$ {name} $").startswith(b"\x89PNG")


def test_places_to_find_the_way_by_have_points_and_outward_normals(tmp_path: Path) -> None:
    save_ply(meshes.sphere(), tmp_path / "ball.ply")
    ball = inspected(tmp_path / "ball.ply", unit="mm").landmarks
    assert [one.name for one in ball] == [f"{end} {axis}" for axis in "xyz" for end in ("lowest", "highest")]
    for one in ball:
        assert np.dot(one.place, one.normal) == pytest.approx(np.linalg.norm(one.place), rel=0.01)
    # Of a flat plate nothing is lowest along z, and the middle of each side is taken.
    save_ply(meshes.plate(), tmp_path / "plate.ply")
    plate = {one.name: one for one in inspected(tmp_path / "plate.ply", unit="mm").landmarks}
    assert list(plate) == ["lowest x", "highest x", "lowest y", "highest y", "farthest from the border"]
    assert plate["highest x"].place == pytest.approx((40.0, 15.0, 0.0))
    assert plate["farthest from the border"].place[1] == pytest.approx(15.0, abs=3.0)
    assert plate["farthest from the border"].normal == pytest.approx((0.0, 0.0, 1.0))


def test_the_lowest_place_is_lowest_where_a_part_stands_on_two_edges(tmp_path: Path) -> None:
    flat = meshes.plate()
    arched = flat.vertices - np.outer((flat.vertices[:, 1] - 15.0) ** 2 / 50.0, [0.0, 0.0, 1.0])
    save_ply(replace(flat, vertices=arched), tmp_path / "arch.ply")
    found = {one.name: one.place for one in inspected(tmp_path / "arch.ply", unit="mm").landmarks}
    assert found["lowest z"][2] == pytest.approx(arched[:, 2].min(), abs=1e-6)
    assert found["highest z"][2] == pytest.approx(arched[:, 2].max(), abs=0.1)


def test_the_middle_of_each_loop_and_a_place_between_two_are_said(tmp_path: Path) -> None:
    save_ply(meshes.annulus(inner=8.0, outer=20.0, divisions=(60, 8)), tmp_path / "ring.ply")
    record = json.loads(json.dumps(inspection_summary(inspect_file(tmp_path / "ring.ply", unit="mm"))))
    np.testing.assert_allclose([rim["centre_mm"] for rim in record["border"]], np.zeros((2, 3)), atol=1e-6)
    inner = next(one for one in record["landmarks"] if one["name"] == "farthest from the border")
    assert np.linalg.norm(inner["place_mm"]) == pytest.approx(14.0, abs=1.0)


# The distance between two surfaces: known ones, bounds that hold, both directions.


def lifted(surface: Surface, height: float) -> Surface:
    return replace(surface, vertices=surface.vertices + np.array([0.0, 0.0, height]))


def test_two_parallel_plates_lie_their_distance_apart() -> None:
    found = deviation(plate(), lifted(plate(divisions=(5, 7)), 0.25))
    for way in (found.forward, found.backward):
        assert way.largest == pytest.approx(0.25)
        assert way.mean == pytest.approx(0.25)
        assert way.p95 == pytest.approx(0.25)
        assert 0.25 <= way.bound < 0.25 + 0.06
    assert found.rim == pytest.approx(0.25, abs=0.06)


def test_the_directions_differ_where_one_surface_is_a_part_of_the_other() -> None:
    found = deviation(disc(rings=10), annulus(inner=8.0, outer=20.0))
    assert found.forward.largest == pytest.approx(8.0, rel=0.01)
    assert found.backward.largest < 0.1
    assert found.largest is found.forward
    assert np.linalg.norm(found.forward.place) < 0.5


def test_the_largest_distance_lies_within_a_face_where_no_vertex_is() -> None:
    # A tent over a plate of two triangles: none of the plate's corners is below its top.
    flat = plate((2.0, 2.0), (1, 1))
    tent = Surface(
        vertices=np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 1, 0.5]], dtype=float),
        faces=np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]),
    )
    found = deviation(flat, tent)
    # From the middle of the plate to a side of the tent, which climbs by a half on a way of one.
    assert found.forward.largest == pytest.approx(0.5 / np.sqrt(1.25), rel=0.03)
    assert found.backward.largest == pytest.approx(0.5)
    assert closest(tent, flat.vertices)[1].max() == 0.0


def test_a_finer_mesh_of_the_same_surface_lies_on_it() -> None:
    found = deviation(spherical_cap(rings=2), refine(spherical_cap(rings=2), edge_length=8.0))
    assert found.largest.largest < 1e-9
    assert found.largest.bound < 0.15


@given(seed=st.integers(0, 2**31))
@settings(max_examples=10, deadline=None)
def test_no_point_lies_beyond_the_bound(seed: int) -> None:
    one, other = spherical_cap(rings=4), spherical_cap(rings=3, jitter_seed=seed)
    found = deviation(one, other)
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet(np.ones(3), 2000)
    corners = one.vertices[one.faces[rng.integers(0, len(one.faces), 2000)]]
    away = closest(other, np.einsum("kc,kcx->kx", weights, corners))[1]
    assert away.max() <= found.forward.bound + 1e-12
    assert found.forward.largest <= found.forward.bound


def test_a_closed_surface_and_an_open_one_are_not_compared() -> None:
    with pytest.raises(MeshError, match="the other has none"):
        deviation(sphere(), disc())
