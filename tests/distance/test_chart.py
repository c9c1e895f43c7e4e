"""Conformal charts: of holed plates, bands and frusta by formula, of discs beside libigl, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.distance.distortion import signed_areas
from geoprint.distance.lscm_chart import conformal_chart, crossing_segments, farthest_pair, refuse_overlaps
from geoprint.errors import FieldError
from geoprint.geometry import boundary_loops, describe, edge_lengths, face_areas, prepare
from geoprint.geometry.files import load
from geoprint.model import FloatArray, IntArray, Surface
from tests.meshes import annulus, plate, sphere, torus
from tests.shared_data import shared

PATCHES = (
    "bivme_apex_disc_r30_coarse",
    "heart_walls_closed_lv_r30",
    "interventricular_groove_disc_r20",
    "lv_anterior_disc_r30",
    "lv_apex_disc_r20",
    "lv_lateral_disc_r15",
    "lv_lateral_disc_r20_jagged",
    "lv_lateral_disc_r20_slivers",
    "lv_lateral_rect_40x30",
    "tricuspid_leaflet_disc_r6",
)


def frustum(*, low: float, high: float, height: float, divisions: tuple[int, int] = (72, 24)) -> Surface:
    """Return the band of a cone about the z axis between two radii; a cylinder where they are equal."""
    flat = annulus(inner=1.0, outer=2.0, divisions=divisions, jitter_seed=3)
    x, y, _ = flat.vertices.T
    share = np.hypot(x, y) - 1.0
    radius = high + (low - high) * share
    turn = np.arctan2(y, x)
    return Surface(np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height * (1 - share)]), flat.faces)


def plate_without(*holes: tuple[float, float], radius: float = 5.0) -> Surface:
    """Return a plate without the triangles around some places."""
    whole = plate((40.0, 30.0), (32, 24), jitter_seed=1)
    middles = whole.vertices[whole.faces].mean(axis=1)[:, :2]
    kept = np.all([np.linalg.norm(middles - hole, axis=1) > radius for hole in holes], axis=0)
    used, faces = np.unique(whole.faces[kept], return_inverse=True)
    return Surface(whole.vertices[used], faces.reshape(-1, 3), name="plate with holes")


def radii_about_hole(chart: Surface) -> FloatArray:
    """Return distances from the middle of the chart's last loop."""
    rim = chart.vertices[boundary_loops(chart)[-1]]
    return np.linalg.norm(chart.vertices - rim.mean(axis=0), axis=1)


@pytest.mark.parametrize(
    ("surface", "kind"),
    [
        (annulus(jitter_seed=1), "annulus"),
        (plate_without((12.0, 11.0), (28.0, 18.0)), "disc with 2 holes"),
        (plate_without((8.0, 8.0), (20.0, 21.0), (31.0, 9.0), radius=4.0), "disc with 3 holes"),
    ],
    ids=["annulus", "two holes", "three holes"],
)
def test_the_chart_of_a_plane_part_with_holes_is_the_part_turned(surface: Surface, kind: str) -> None:
    assert describe(surface) == kind
    np.testing.assert_allclose(edge_lengths(conformal_chart(surface)), edge_lengths(surface), rtol=1e-8)


def test_a_cylinder_band_becomes_a_ring_that_grows_exponentially() -> None:
    radius, height = 12.0, 15.0
    surface = frustum(low=radius, high=radius, height=height)
    reach = radii_about_hole(conformal_chart(surface))
    along = np.abs(surface.vertices[:, 2] - surface.vertices[boundary_loops(surface)[-1][0], 2])
    np.testing.assert_allclose(np.log(reach / reach.min()), along / radius, atol=0.03)


def test_a_cone_frustum_becomes_a_ring_that_grows_as_a_power_of_the_slant() -> None:
    low, high, height = 20.0, 8.0, 20.0
    surface = frustum(low=low, high=high, height=height)
    reach = radii_about_hole(conformal_chart(surface))
    sine = (low - high) / np.hypot(low - high, height)
    slant = np.hypot(*surface.vertices[:, :2].T)
    np.testing.assert_allclose(np.log(reach / reach.min()), np.log(slant / slant.min()) / sine, atol=0.01)


def test_the_chart_of_a_band_does_not_depend_on_the_numbering() -> None:
    surface = frustum(low=20.0, high=8.0, height=20.0)
    rng = np.random.default_rng(0)
    new_number = rng.permutation(len(surface.vertices))
    renumbered = Surface(surface.vertices[np.argsort(new_number)], new_number[surface.faces])
    found, wanted = (signed_areas(chart.vertices, chart.faces) for chart in map(conformal_chart, (renumbered, surface)))
    np.testing.assert_allclose(found, wanted, rtol=1e-6)


def test_the_chart_of_a_holed_part_runs_counter_clockwise_outside_and_clockwise_round_holes() -> None:
    surface = shared("patches/lv_anterior_annulus_r25_hole_r7.ply")
    part, _ = prepare(load(surface, unit="mm"))
    chart = conformal_chart(part)
    enclosed = [loop_area(chart.vertices[loop]) for loop in boundary_loops(part)]
    assert enclosed[0] > 0.0 > enclosed[1]
    assert sum(enclosed) == pytest.approx(face_areas(part).sum())


def loop_area(corners: FloatArray) -> float:
    x, y = corners[:, 0], corners[:, 1]
    return 0.5 * float(x @ np.roll(y, -1) - np.roll(x, -1) @ y)


@pytest.mark.parametrize("name", PATCHES)
def test_the_chart_of_a_disc_is_that_of_libigl(name: str) -> None:
    igl = pytest.importorskip("igl", reason="libigl is not installed")
    surface, _ = prepare(load(shared(f"patches/{name}.ply"), unit="mm"))
    pins = farthest_pair(surface, boundary_loops(surface)[0])
    flat = np.asarray(igl.lscm(surface.vertices, surface.faces, pins, np.array([[0.0, 0.0], [1.0, 0.0]]))[0])
    chart = conformal_chart(surface).vertices
    own, theirs = (places[:, 0] + 1j * places[:, 1] for places in (chart, flat))
    first, second = own[pins]
    assert np.abs((own - first) / (second - first) - theirs).max() < 1e-6


@pytest.mark.parametrize(
    ("surface", "kind"),
    [
        (sphere(subdivisions=2), "closed, genus 0"),
        (torus(), "closed, genus 1"),
        (Surface(torus().vertices, torus().faces[1:]), "genus 1 with 1 boundary loop"),
        (
            Surface(
                np.concatenate([plate().vertices, plate().vertices + np.array([90.0, 0.0, 0.0])]),
                np.concatenate([plate().faces, plate().faces + len(plate().vertices)]),
            ),
            "2 components",
        ),
    ],
    ids=["sphere", "torus", "handle", "two plates"],
)
def test_what_is_no_part_of_a_plane_is_refused_with_its_kind_and_what_to_do(surface: Surface, kind: str) -> None:
    with pytest.raises(FieldError, match=rf"{kind}\).*smaller open patch, or use `--backend heat`"):
        conformal_chart(surface)


def test_a_chart_that_overlaps_without_a_flip_is_refused_with_its_place() -> None:
    # A ramp that rises once and a quarter round: nearly developable, so that its chart is a ring and a quarter.
    flat = plate((2.5 * np.pi, 6.0), (80, 8), jitter_seed=2)
    turn, reach = flat.vertices[:, 0], 14.0 + flat.vertices[:, 1]
    # The plate's x is the turn and its y points outwards: the winding is turned.
    vertices = np.column_stack([reach * np.cos(turn), reach * np.sin(turn), 0.8 * turn])
    with pytest.raises(FieldError, match=r"border of ramp crosses itself \d+ times in the chart, the first at \(") as e:
        conformal_chart(Surface(vertices, flat.faces[:, ::-1], name="ramp"))
    count, place = e.value.details["count"], np.array(e.value.details["place"])
    assert f"itself {count} times" in str(e.value)
    assert np.linalg.norm(vertices - place, axis=1).min() < 1e-9


def test_a_hole_turned_inside_out_is_refused_though_nothing_crosses_or_flips_there() -> None:
    # z + b / z maps a ring in two sheets where its inner radius is below sqrt(b) < 1; its loops do not cross.
    ring = annulus(inner=0.5, outer=3.0, divisions=(240, 60))
    z = ring.vertices[:, 0] + 1j * ring.vertices[:, 1]
    image = z + 0.6 / z
    flat = np.column_stack([image.real, image.imag])
    loops = boundary_loops(ring)
    ends = [np.roll(loop, -1) for loop in loops]
    assert len(crossing_segments(flat[np.concatenate(loops)], flat[np.concatenate(ends)])) == 0
    good = signed_areas(flat, ring.faces) > 1e-6
    part = Surface(ring.vertices, ring.faces[good], name="ring")
    assert good.mean() > 0.99
    with pytest.raises(FieldError, match="1 of 1 holes of ring are turned inside out"):
        refuse_overlaps(part, flat, loops)


def test_flipped_and_collapsed_triangles_are_refused_with_their_number() -> None:
    surface = plate((4.0, 4.0), (4, 4))
    flat = surface.vertices[:, :2].copy()
    refuse_overlaps(surface, flat, boundary_loops(surface))
    inner = int(np.argmin(np.linalg.norm(flat - 2.0, axis=1)))
    flat[inner] = [3.6, 3.7]
    count = int((signed_areas(flat, surface.faces) <= 0.0).sum())
    with pytest.raises(FieldError, match=f"^{count} of 32 triangles of plate are flipped or collapsed"):
        refuse_overlaps(surface, flat, boundary_loops(surface))


def crossing_by_parameters(start: FloatArray, end: FloatArray) -> IntArray:
    """Solve for the common point of every pair: slow and plain."""
    found: list[tuple[int, int]] = []
    for i in range(len(start)):
        for j in range(i + 1, len(start)):
            system = np.column_stack([end[i] - start[i], start[j] - end[j]])
            if abs(np.linalg.det(system)) > 0.0:
                shares = np.asarray(np.linalg.solve(system, start[j] - start[i]), dtype=np.float64)
                if float(shares.min()) > 0.0 and float(shares.max()) < 1.0:
                    found.append((i, j))
    return np.array(found, dtype=np.int64).reshape(-1, 2)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), spread=st.floats(0.1, 3.0))
def test_crossing_segments_are_those_with_a_common_inner_point(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    start = rng.uniform(0.0, 1.0, (40, 2))
    end = start + rng.normal(size=(40, 2)) * np.exp(spread * rng.normal(size=(40, 1))) * 0.1
    np.testing.assert_array_equal(crossing_segments(start, end), crossing_by_parameters(start, end))


def test_segments_apart_on_one_line_do_not_cross_though_rounding_puts_their_ends_on_either_side() -> None:
    start = np.array([[0.1182872602709719, -0.2595024075854812], [-0.20570465704083962, 0.4512815127458273]])
    end = np.array([[-0.1811790261929029, 0.3974763925831601], [-0.4226043838121327, 0.9271231306245735]])
    assert len(crossing_segments(start, end)) == 0


def test_holes_that_touch_in_a_point_touch_in_the_chart_as_well() -> None:
    whole = plate((40.0, 30.0), (8, 6))
    middles = whole.vertices[whole.faces].mean(axis=1)
    first = (np.abs(middles[:, 0] - 17.5) < 2.5) & (np.abs(middles[:, 1] - 12.5) < 2.5)
    second = (np.abs(middles[:, 0] - 22.5) < 2.5) & (np.abs(middles[:, 1] - 17.5) < 2.5)
    holed, _ = prepare(Surface(whole.vertices, whole.faces[~(first | second)], name="holed"))
    chart = conformal_chart(holed)
    corners = np.flatnonzero(np.linalg.norm(holed.vertices - [20.0, 15.0, 0.0], axis=1) < 1e-9)
    assert corners.size == 2
    np.testing.assert_array_equal(chart.vertices[corners[0]], chart.vertices[corners[1]])
    edge_length = np.linalg.norm(np.diff(holed.vertices[holed.faces[:, :2]], axis=1)[:, 0], axis=1)
    chart_length = np.linalg.norm(np.diff(chart.vertices[chart.faces[:, :2]], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(chart_length, edge_length, rtol=1e-9)
