"""Preparing meshes: what is repaired and counted, and what is refused and where."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import InputError, MeshError
from geoprint.geometry import (
    Repairs,
    all_curves,
    boundary_source,
    described,
    face_areas,
    mean_normal,
    middle_of,
    pieces,
    positions,
    prepare,
    some_curves,
    united,
)
from geoprint.geometry.files import load
from geoprint.geometry.operators import signed_volume
from geoprint.geometry.repair import WELD_SHARE, first_equal
from geoprint.geometry.topology import boundary_loops, describe, edges
from geoprint.model import Surface, SurfaceCurves
from tests import meshes
from tests.meshes import annulus, disc, plate
from tests.shared_data import SHARED_DATA, shared

PATCHES = sorted(path.stem for path in (SHARED_DATA / "patches").glob("*.ply"))
BROKEN = sorted(path.name for path in (SHARED_DATA / "broken").glob("*") if path.suffix != ".json")


def soup(surface: Surface, *, noise: float = 0.0, seed: int = 0) -> Surface:
    """Give every face its own three vertices, as STL files do, and shake them by up to noise."""
    vertices = surface.vertices[surface.faces].reshape(-1, 3)
    shaken = vertices + np.random.default_rng(seed).uniform(-noise, noise, vertices.shape)
    return Surface(vertices=shaken, faces=np.arange(len(vertices)).reshape(-1, 3))


def with_faces(surface: Surface, *faces: tuple[int, int, int]) -> Surface:
    return Surface(vertices=surface.vertices, faces=np.concatenate([surface.faces, np.array(faces)]))


def turned(surface: Surface, which: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> Surface:
    faces = np.where(which[:, None], surface.faces[:, ::-1], surface.faces)
    return Surface(vertices=surface.vertices, faces=faces)


def together(*surfaces: Surface) -> Surface:
    shifts = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
    return Surface(
        vertices=np.concatenate([surface.vertices for surface in surfaces]),
        faces=np.concatenate([surface.faces + shift for surface, shift in zip(surfaces, shifts, strict=False)]),
    )


def shifted(surface: Surface, *by: float) -> Surface:
    return Surface(vertices=surface.vertices + np.array(by), faces=surface.faces)


def moebius(*, steps: int = 24) -> Surface:
    angle = np.linspace(0, 2 * np.pi, steps, endpoint=False)
    across = np.array([-3.0, 3.0])[:, None]
    radius = 20 + across * np.cos(angle / 2)
    vertices = np.stack([radius * np.cos(angle), radius * np.sin(angle), across * np.sin(angle / 2)], axis=-1)
    low, high = np.arange(steps), np.arange(steps) + steps
    # After one turn the lower rim continues on the upper one.
    following_low, following_high = np.append(low[1:], high[0]), np.append(high[1:], low[0])
    first = np.column_stack([low, following_low, high])
    return Surface(
        vertices=vertices.reshape(-1, 3),
        faces=np.concatenate([first, np.column_stack([following_low, following_high, high])]),
    )


@pytest.mark.parametrize(
    "surface", [meshes.plate(jitter_seed=1), meshes.annulus(), meshes.sphere(jitter_seed=1), meshes.torus()]
)
def test_a_good_mesh_comes_back_as_it_is(surface: Surface) -> None:
    prepared, report = prepare(surface)
    np.testing.assert_array_equal(prepared.faces, surface.faces)
    np.testing.assert_array_equal(prepared.vertices, surface.vertices)
    assert report.repairs == Repairs()
    assert (report.vertices, report.faces) == (len(surface.vertices), len(surface.faces))


def test_the_report_measures_the_surface() -> None:
    _, report = prepare(meshes.annulus(inner=8.0, outer=20.0, divisions=(200, 10)))
    assert report.topology == "annulus"
    assert report.area == pytest.approx(np.pi * (20**2 - 8**2), rel=1e-3)
    assert report.boundary_lengths == pytest.approx((2 * np.pi * 20, 2 * np.pi * 8), rel=1e-3)
    assert 0.2 < report.mean_edge < 1.3


def test_a_triangle_soup_is_welded_exactly() -> None:
    cap = meshes.spherical_cap(jitter_seed=1)
    prepared, report = prepare(soup(cap))
    assert report.repairs.welded_vertices == 3 * len(cap.faces) - len(cap.vertices)
    assert report.topology == "disc"
    np.testing.assert_array_equal(prepared.vertices[prepared.faces], cap.vertices[cap.faces])


@given(seed=st.integers(0, 100))
@settings(max_examples=10, deadline=None)
def test_a_soup_with_rounding_noise_is_welded_within_the_tolerance(seed: int) -> None:
    cap = meshes.spherical_cap(rings=5, jitter_seed=seed)
    size = float(np.linalg.norm(np.ptp(cap.vertices, axis=0)))
    prepared, report = prepare(soup(cap, noise=0.25 * WELD_SHARE * size, seed=seed))
    assert report.topology == "disc"
    assert len(prepared.vertices) == len(cap.vertices)
    assert report.area == pytest.approx(face_areas(cap).sum(), rel=1e-3)


def test_a_gap_wider_than_the_tolerance_stays_open() -> None:
    left, right = meshes.plate(), shifted(meshes.plate(), 40.0 + 0.05, 0.0, 0.0)
    with pytest.raises(MeshError, match="has 2 separate components"):
        prepare(together(left, right))
    _, report = prepare(together(left, shifted(meshes.plate(), 40.0 + 0.005, 0.0, 0.0)))
    assert report.repairs.welded_vertices == 7


def test_vertices_at_the_ends_of_a_short_edge_or_inside_the_surface_are_not_joined() -> None:
    plate = meshes.plate(divisions=(4, 4))
    vertices = plate.vertices.copy()
    rim, inner = np.array([0, 1]), np.array([6, 7])
    vertices[rim[1]] = vertices[rim[0]] + [0.0, 1e-3, 0.0]
    vertices[inner[1]] = vertices[inner[0]] + [0.0, 1e-3, 0.0]
    _, report = prepare(Surface(vertices=vertices, faces=plate.faces))
    assert report.repairs.welded_vertices == 0
    assert report.vertices == len(plate.vertices)


def test_duplicate_faces_are_dropped_whichever_way_they_are_wound() -> None:
    plate = meshes.plate()
    (a, b, c), (d, e, f) = plate.faces[3].tolist(), plate.faces[5].tolist()
    prepared, report = prepare(with_faces(plate, (b, c, a), (f, e, d)))
    assert report.repairs.dropped_duplicate_faces == 2
    np.testing.assert_array_equal(prepared.faces, plate.faces)


def test_faces_without_area_are_dropped() -> None:
    plate = meshes.plate()
    prepared, report = prepare(with_faces(plate, (0, 0, 9), (0, 1, 2)))
    np.testing.assert_allclose(plate.vertices[[0, 1, 2], 0], 0.0)
    assert report.repairs.dropped_degenerate_faces == 2
    np.testing.assert_array_equal(prepared.faces, plate.faces)


def test_unreferenced_vertices_are_dropped_and_the_others_keep_their_order() -> None:
    plate = meshes.plate()
    padded = Surface(vertices=np.concatenate([[[1e3, 0, 0]], plate.vertices, [[0, 1e3, 0]]]), faces=plate.faces + 1)
    prepared, report = prepare(padded)
    assert report.repairs.dropped_unreferenced_vertices == 2
    np.testing.assert_array_equal(prepared.vertices, plate.vertices)
    np.testing.assert_array_equal(prepared.faces, plate.faces)


@given(seed=st.integers(0, 100), share=st.floats(0.0, 0.4))
@settings(max_examples=15, deadline=None)
def test_mixed_winding_becomes_that_of_most_faces(seed: int, share: float) -> None:
    annulus = meshes.annulus()
    which = np.random.default_rng(seed).random(len(annulus.faces)) < share
    prepared, report = prepare(turned(annulus, which))
    assert report.repairs.flipped_faces == which.sum()
    np.testing.assert_allclose(mean_normal(prepared), [0, 0, 1], atol=1e-12)


def test_an_open_surface_keeps_the_side_that_the_file_calls_outside() -> None:
    plate = meshes.plate()
    prepared, report = prepare(turned(plate, np.ones(len(plate.faces), dtype=bool)))
    assert report.repairs.flipped_faces == 0
    assert mean_normal(prepared)[2] == pytest.approx(-1.0)


def test_where_half_of_the_faces_agree_the_first_one_stays() -> None:
    plate = meshes.plate()
    prepared, report = prepare(turned(plate, np.arange(len(plate.faces)) % 2 == 0))
    assert report.repairs.flipped_faces == len(plate.faces) // 2
    np.testing.assert_array_equal(prepared.faces[0], plate.faces[0, ::-1])


def test_a_closed_surface_is_turned_outward_even_far_from_the_origin() -> None:
    sphere = shifted(meshes.sphere(radius=20.0), 500.0, -300.0, 80.0)
    inward = turned(sphere, np.ones(len(sphere.faces), dtype=bool))
    assert signed_volume(inward) == pytest.approx(-4 / 3 * np.pi * 20**3, rel=0.02)
    prepared, report = prepare(inward)
    assert report.repairs.flipped_faces == len(sphere.faces)
    assert signed_volume(prepared) == pytest.approx(4 / 3 * np.pi * 20**3, rel=0.02)


def test_holes_that_share_a_vertex_become_one_hole() -> None:
    plate = meshes.plate(divisions=(8, 8))
    # Cells (3, 3) and (4, 4) share the vertex in the middle.
    centres = plate.vertices[plate.faces].mean(axis=1)[:, :2] / [5.0, 3.75]
    cell = np.floor(centres).astype(int)
    kept = ~((cell[:, 0] == cell[:, 1]) & np.isin(cell[:, 0], [3, 4]))
    with pytest.raises(MeshError):
        boundary_loops(Surface(vertices=plate.vertices, faces=plate.faces[kept]))
    prepared, report = prepare(Surface(vertices=plate.vertices, faces=plate.faces[kept]))
    assert (report.repairs.split_vertices, report.topology) == (1, "annulus")
    np.testing.assert_array_equal(prepared.vertices[:-1], plate.vertices)
    np.testing.assert_array_equal(prepared.vertices[-1], plate.vertices[40])
    assert [loop.size for loop in boundary_loops(prepared)] == [32, 8]


def test_pieces_that_touch_in_a_vertex_alone_are_refused() -> None:
    plate = meshes.plate()
    with pytest.raises(MeshError, match="has 2 separate components"):
        prepare(together(plate, shifted(plate, 40.0, 30.0, 0.0)))


def test_an_edge_with_three_faces_is_refused_with_its_place() -> None:
    plate = meshes.plate()
    fin = Surface(
        vertices=np.concatenate([plate.vertices, [[7.5, 5.0, 9.0]]]),
        faces=np.concatenate([plate.faces, [[8, 15, len(plate.vertices)]]]),
    )
    assert [8, 15] in edges(plate.faces).tolist()
    with pytest.raises(MeshError, match=r"more than two faces: 1, the first at \(7\.50, 5\.00, 0\.00\) mm") as caught:
        prepare(fin)
    assert caught.value.details == {"edges": 1, "place": (7.5, 5.0, 0.0)}


def test_a_moebius_strip_is_refused() -> None:
    with pytest.raises(MeshError, match="is not orientable"):
        prepare(moebius())


def test_several_pieces_are_refused_with_their_number_and_the_place_of_the_smallest() -> None:
    pieces = together(
        meshes.plate(), shifted(meshes.disc(rings=2), 100.0, 0.0, 0.0), shifted(meshes.disc(), 0, 0, 50.0)
    )
    with pytest.raises(MeshError, match=r"3 separate components.* 384 faces, the smallest with 24 at \(100\.00"):
        prepare(pieces)


@pytest.mark.parametrize("corner", ["inside", "rim"])
def test_an_edge_is_cut_at_a_vertex_that_lies_on_it(corner: str) -> None:
    plate = meshes.plate(divisions=(4, 4))
    a, b, c = plate.faces[{"inside": 12, "rim": 0}[corner]].tolist()
    middle = (plate.vertices[c] + plate.vertices[a]) / 2
    split = Surface(
        vertices=np.concatenate([plate.vertices, [middle]]),
        faces=np.array(
            [face for face in plate.faces.tolist() if face != [a, b, c]]
            + [[a, b, len(plate.vertices)], [b, c, len(plate.vertices)]]
        ),
    )
    prepared, report = prepare(split)
    assert (report.topology, report.repairs.junction_faces) == ("disc", 1)
    assert face_areas(prepared).sum() == pytest.approx(1200.0)
    assert report.repairs.changes() == ("1 faces added where vertices lie on edges (T-junctions)",)


def test_an_edge_with_several_vertices_on_it_and_a_face_with_several_such_edges_are_cut() -> None:
    corners = np.array([[0, 0, 0], [30, 0, 0], [0, 30, 0]], dtype=float)
    below = np.array([[10, 0, 0], [20, 0, 0], [0, -9, 0], [10, -9, 0], [20, -9, 0], [30, -9, 0]], dtype=float)
    beside = np.array([[0, 15, 0], [-9, 0, 0], [-9, 15, 0], [-9, 30, 0]], dtype=float)
    strips = [[0, 5, 6], [0, 6, 3], [3, 6, 7], [3, 7, 4], [4, 7, 8], [4, 8, 1], [0, 9, 10], [10, 9, 11]]
    faces = [[0, 1, 2], *strips, [9, 2, 11], [11, 2, 12]]
    prepared, report = prepare(Surface(vertices=np.concatenate([corners, below, beside]), faces=np.array(faces)))
    assert (report.topology, report.repairs.junction_faces) == ("disc", 3)
    assert face_areas(prepared).sum() == pytest.approx(450 + 270 + 270)


def test_a_missing_triangle_is_put_back_and_larger_holes_are_closed_when_asked() -> None:
    plate = meshes.plate(divisions=(20, 15), jitter_seed=1)
    area = face_areas(plate).sum()
    centres = plate.vertices[plate.faces].mean(axis=1)
    middle = int(np.argmin(np.linalg.norm(centres - [20.0, 15.0, 0.0], axis=1)))
    missing = Surface(vertices=plate.vertices, faces=np.delete(plate.faces, middle, axis=0))
    prepared, report = prepare(missing)
    assert report.topology == "disc"
    assert face_areas(prepared).sum() == pytest.approx(area)
    assert report.repairs.filled_holes[0] == pytest.approx(centres[middle])
    hole = np.linalg.norm(centres - [20.0, 15.0, 0.0], axis=1) < 6.0
    holed = Surface(vertices=plate.vertices, faces=plate.faces[~hole])
    assert prepare(holed)[1].topology == prepare(holed, longest_hole=10.0)[1].topology == "annulus"
    prepared, report = prepare(holed, longest_hole=60.0)
    assert (report.topology, len(report.repairs.filled_holes)) == ("disc", 1)
    assert face_areas(prepared).sum() == pytest.approx(area)


def test_the_rim_of_a_part_is_no_hole() -> None:
    corners = np.array([[0, 0, 0], [30, 0, 0], [0, 30, 0], [8, 8, 2]], dtype=float)
    fan = Surface(vertices=corners, faces=np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3]]))
    assert prepare(fan)[1].topology == prepare(fan, longest_hole=1e3)[1].topology == "disc"


def test_a_closed_surface_with_a_missing_triangle_becomes_closed_and_faces_outward() -> None:
    sphere = meshes.sphere(subdivisions=3)
    inward = Surface(vertices=sphere.vertices, faces=sphere.faces[1:, ::-1])
    prepared, report = prepare(inward)
    assert report.topology == "closed, genus 0"
    assert report.repairs.flipped_faces == len(sphere.faces) - 1
    assert signed_volume(prepared) == pytest.approx(signed_volume(sphere))


def test_specks_are_dropped_with_their_places_and_pieces_are_not() -> None:
    speck = Surface(vertices=np.array([[90, 0, 0], [90.5, 0, 0], [90, 0.5, 0]]), faces=np.array([[0, 1, 2]]))
    prepared, report = prepare(together(meshes.plate(), speck))
    assert (report.repairs.dropped_debris_faces, report.repairs.debris_places) == (1, ((90.0, 0.0, 0.0),))
    assert report.repairs.changes() == ("1 faces of specks dropped, at (90.00, 0.00, 0.00) mm",)
    assert len(prepared.vertices) == len(meshes.plate().vertices)


def test_a_sheet_folded_through_itself_is_refused_with_a_place() -> None:
    plate = meshes.plate(divisions=(20, 15), jitter_seed=1)
    vertices = plate.vertices.copy()
    beyond = vertices[:, 0] > 25
    # The far end goes back below the plate and comes up through it.
    vertices[beyond, 2] = -3 + 8 * (vertices[beyond, 0] - 25) / 15
    vertices[beyond, 0] = 50 - vertices[beyond, 0]
    with pytest.raises(MeshError, match="intersects itself: ") as e:
        prepare(Surface(vertices=vertices, faces=plate.faces))
    place = e.value.details["place"]
    assert isinstance(place, tuple)
    assert abs(place[2]) < 3.0


def test_a_flat_ear_on_the_rim_is_no_junction() -> None:
    plate = meshes.plate(divisions=(4, 4))
    ear = Surface(
        vertices=np.concatenate([plate.vertices, [[5.0, -1e-3, 0.0]]]),
        faces=np.concatenate([plate.faces, [[5, 0, len(plate.vertices)]]]),
    )
    np.testing.assert_allclose(plate.vertices[[0, 5]], [[0, 0, 0], [10, 0, 0]])
    assert prepare(ear)[1].topology == "disc"


def test_a_mesh_of_nothing_but_empty_faces_is_refused() -> None:
    line = Surface(vertices=np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], dtype=float), faces=np.array([[0, 1, 2]]))
    with pytest.raises(MeshError, match=r"every face is degenerate \(1\)"):
        prepare(line)


@given(seed=st.integers(0, 100))
@settings(max_examples=10, deadline=None)
def test_preparing_twice_changes_nothing_more(seed: int) -> None:
    cap = meshes.spherical_cap(rings=4, jitter_seed=seed)
    once, _ = prepare(soup(cap, noise=1e-4, seed=seed))
    twice, report = prepare(once)
    np.testing.assert_array_equal(twice.faces, once.faces)
    assert report.repairs.welded_vertices == report.repairs.flipped_faces == 0


@pytest.mark.parametrize("name", PATCHES)
def test_every_patch_has_the_topology_and_size_that_its_record_states(name: str) -> None:
    record = json.loads(shared(f"patches/{name}.json").read_text())
    prepared, report = prepare(load(shared(f"patches/{name}.ply"), unit="mm"))
    # The record counts a vertex that two holes share once, and the holes as one loop.
    stated = record["topology"] if record["chi"] >= 0 else f"disc with {record['n_boundary_loops'] - 1} holes"
    assert describe(prepared) == report.topology == stated
    assert report.area == pytest.approx(record["area"], rel=1e-3)
    lengths = [loop["length"] for loop in record["boundary_loops"]]
    assert list(report.boundary_lengths) == pytest.approx(lengths, abs=0.01)
    done = report.repairs
    assert done.welded_vertices == done.flipped_faces == done.dropped_degenerate_faces == 0


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("x_duplicate_faces.ply", {"dropped_duplicate_faces": 260}),
        ("x_both_sides.ply", {"dropped_duplicate_faces": 781}),
        ("x_random_flips.ply", {"flipped_faces": 237}),
        ("x_cracked_soup.stl", {"welded_vertices": 1903}),
        ("x_slit_unwelded.ply", {"welded_vertices": 11}),
        ("x_slivers_zero_area.ply", {"dropped_degenerate_faces": 30}),
        ("x_unreferenced_vertices.ply", {"dropped_unreferenced_vertices": 200}),
        ("x_solid_header_binary.stl", {"welded_vertices": 1903}),
        ("x_pinhole.ply", {"dropped_debris_faces": 0}),
    ],
)
def test_crafted_defects_are_repaired_to_the_patch_they_were_made_from(name: str, changes: dict[str, int]) -> None:
    prepared, report = prepare(load(shared(f"broken/{name}"), unit="mm"))
    assert (len(prepared.vertices), len(prepared.faces), report.topology) == (440, 781, "disc")
    assert report.area == pytest.approx(670.98, abs=0.02)
    assert {key: getattr(report.repairs, key) for key in changes} == changes


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("geometrycentral_moebius.obj", "is not orientable"),
        ("geometrycentral_fan3.obj", "more than two faces: 1"),
        ("x_fin.ply", "more than two faces: 1"),
        ("x_two_patches.ply", "has 2 separate components"),
        ("x_bowtie.ply", "has 2 separate components"),
        ("x_folded_selfintersect.ply", "intersects itself"),
    ],
)
def test_crafted_defects_that_cannot_be_repaired_are_refused(name: str, message: str) -> None:
    with pytest.raises(MeshError, match=message):
        prepare(load(shared(f"broken/{name}"), unit="mm"))


@pytest.mark.parametrize("name", BROKEN)
def test_no_broken_file_brings_out_anything_but_input_errors(name: str) -> None:
    path: Path = shared(f"broken/{name}")
    # Anything else than an InputError, which a MeshError is too, fails the test.
    with suppress(InputError):
        prepared, report = prepare(load(path, unit="mm"))
        assert report.faces == len(prepared.faces)
        assert describe(prepared) == report.topology


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 200), values=st.integers(1, 5))
def test_of_equal_points_the_first_stands_for_all(seed: int, count: int, values: int) -> None:
    choices = np.array([0.0, -0.0, 1.0, 2.5, -7.0, 1e300])[: values + 1]
    points = np.random.default_rng(seed).choice(choices, (count, 3))
    wanted = [next(i for i, other in enumerate(points) if (other == point).all()) for point in points]
    assert first_equal(points).tolist() == wanted


# Repairs are counted in one value: those of several steps add up, and every kind is said and described.


FIRST = Repairs(1, 2, 3, 4, 5, ((1.0, 2.0, 3.0),), 6, 7, 8, ((0.0, 0.5, 0.25),))
LATER = Repairs(welded_vertices=10, debris_places=((4.0, 5.0, 6.0),))


def test_repairs_of_several_steps_add_up() -> None:
    both = FIRST + LATER
    assert both == Repairs(11, 2, 3, 4, 5, ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)), 6, 7, 8, ((0.0, 0.5, 0.25),))
    assert FIRST + Repairs() == Repairs() + FIRST == FIRST


def test_every_kind_of_repair_is_said_with_its_number_and_where_it_matters_its_place() -> None:
    assert FIRST.changes() == (
        "1 vertices joined to others that coincide",
        "2 faces without area dropped",
        "3 duplicate faces dropped",
        "4 vertices that no face uses dropped",
        "5 faces of specks dropped, at (1.00, 2.00, 3.00) mm",
        "6 faces added where vertices lie on edges (T-junctions)",
        "7 faces turned for one winding",
        "8 vertices split where fans of faces touch",
        "1 holes closed, at (0.00, 0.50, 0.25) mm",
    )
    assert Repairs().changes() == ()


def test_the_first_places_are_said_and_how_many_more_there_are() -> None:
    (said,) = Repairs(filled_holes=((0.0, 0.0, 0.0),) * 5).changes()
    assert said == "5 holes closed, at " + ", ".join(["(0.00, 0.00, 0.00) mm"] * 3) + " and 2 more"


def test_every_field_is_described() -> None:
    assert [name for name, _, _ in described(Repairs)] == [field.name for field in fields(Repairs)]


# Surfaces in several pieces: what is put together comes apart again, and curves keep their places.


def moved(surface: Surface, along: float) -> Surface:
    return Surface(surface.vertices + np.array([along, 0.0, 0.0]), surface.faces, name=surface.name)


PARTS = (plate(), moved(annulus(), 100.0), moved(disc(), 200.0))


def test_what_is_put_together_comes_apart_in_the_same_order() -> None:
    whole = united(PARTS)
    for part, piece in zip(PARTS, pieces(whole), strict=True):
        assert np.array_equal(piece.surface.faces, part.faces)
        assert np.array_equal(piece.surface.vertices, part.vertices)
        assert np.array_equal(whole.vertices[piece.vertices], part.vertices)
    assert whole.name == "plate"


def test_one_piece_is_the_surface_itself() -> None:
    surface = plate()
    assert united([surface]) is surface
    assert pieces(surface)[0].surface is surface


def test_pieces_whose_faces_are_mixed_come_apart_too() -> None:
    whole = united(PARTS)
    mixed = Surface(whole.vertices, whole.faces[np.random.default_rng(1).permutation(len(whole.faces))])
    for piece in pieces(mixed):
        assert np.array_equal(mixed.vertices[mixed.faces[piece.faces]], piece.surface.vertices[piece.surface.faces])


def places(surface: Surface, curves: SurfaceCurves) -> list[list[list[float]]]:
    at = positions(surface, curves.points)
    return [at[a:b].tolist() for a, b in zip(curves.offsets[:-1], curves.offsets[1:], strict=True)]


def test_curves_keep_their_places_on_a_piece_and_back_on_the_whole() -> None:
    whole = united(PARTS)
    curves = boundary_source(whole).curves
    found = pieces(whole)
    assert [int(piece.holds(curves).sum()) for piece in found] == [1, 2, 1]
    for piece in found:
        own = piece.own(curves)
        assert places(piece.surface, own) == places(whole, piece.on_whole(own))
    back = all_curves([piece.on_whole(piece.own(curves)) for piece in found])
    assert sorted(places(whole, back)) == sorted(places(whole, curves))
    assert back.closed.all()


def test_curves_are_taken_in_the_order_asked_for() -> None:
    whole = united(PARTS)
    curves = boundary_source(whole).curves
    taken = some_curves(curves, np.array([2, 0]))
    assert places(whole, taken) == [places(whole, curves)[2], places(whole, curves)[0]]
    assert some_curves(curves, np.array([], dtype=np.int64)).count == 0


def test_the_middle_of_a_surface_lies_on_it() -> None:
    ring = annulus()
    assert (ring.vertices == middle_of(ring)).all(axis=1).any()
    assert np.allclose(middle_of(disc()), 0.0)
