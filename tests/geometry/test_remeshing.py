"""Remeshing, decimation and smoothing: the same surface with another mesh, its rim and creases in place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import InputError, ResourceError
from geoprint.geometry import (
    boundary_loops,
    closest,
    decimate,
    describe,
    deviation,
    edge_lengths,
    face_areas,
    face_normals,
    mean_normal,
    prepare,
    remesh,
    signed_volume,
    smallest_angles,
    smooth,
)
from geoprint.geometry.creases import CORNER, INSIDE, ON_CREASE, ON_RIM, creases
from geoprint.geometry.files import load
from geoprint.model import FloatArray, Surface
from tests.meshes import annulus, disc, plate, sphere, spherical_cap, torus
from tests.shared_data import shared


def box(side: float = 10.0, *, divisions: int = 4) -> Surface:
    """Return a closed cube, counter-clockwise from outside."""
    top = plate((side, side), (divisions, divisions))
    half = top.vertices - np.array([side / 2, side / 2, -side / 2])
    turns = [np.eye(3), np.diag([1.0, -1.0, -1.0])]
    turns += [np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 0, -1.0], [-1, 0, 0], [0, 1, 0]])]
    turns += [np.array([[0, 1.0, 0], [0, 0, 1], [1, 0, 0]]), np.array([[0, -1.0, 0], [0, 0, -1], [1, 0, 0]])]
    faces = np.concatenate([top.faces + k * len(half) for k in range(6)])
    return prepare(Surface(vertices=np.concatenate([half @ turn.T for turn in turns]), faces=faces, name="box"))[0]


def rim_corners() -> FloatArray:
    return np.array([(0.0, 0.0, 0.0), (40.0, 0.0, 0.0), (0.0, 30.0, 0.0), (40.0, 30.0, 0.0)])


@pytest.mark.parametrize(
    ("surface", "edge_length"),
    [
        (plate(jitter_seed=1), 2.0),
        (plate(divisions=(16, 12), jitter_seed=1), 5.0),
        (spherical_cap(rings=12, jitter_seed=2), 2.0),
        (annulus(jitter_seed=3), 2.0),
        (sphere(jitter_seed=4), 3.0),
        (torus(), 3.0),
        (box(), 1.5),
    ],
    ids=["finer", "coarser", "cap", "annulus", "sphere", "torus", "box"],
)
def test_edges_come_out_even_and_the_kind_of_surface_stays(surface: Surface, edge_length: float) -> None:
    made = remesh(surface, edge_length=edge_length)
    lengths = edge_lengths(made)
    assert lengths.mean() == pytest.approx(edge_length, rel=0.2)
    assert lengths.std() / lengths.mean() < 0.2
    assert np.degrees(smallest_angles(made).min()) > 20.0
    prepared, report = prepare(made)
    assert not report.repairs.changes()
    assert report.topology == describe(surface)
    assert len(prepared.faces) == len(made.faces)
    assert closest(surface, made.vertices)[1].max() < 1e-9
    assert mean_normal(made) == pytest.approx(mean_normal(surface), abs=0.05)


def test_a_plate_keeps_its_corners_and_its_area() -> None:
    made = remesh(plate(jitter_seed=1), edge_length=3.0)
    assert float(face_areas(made).sum()) == pytest.approx(1200.0, rel=1e-12)
    assert closest(made, rim_corners())[1].max() < 1e-12
    assert (face_normals(made)[:, 2] > 0.999).all()


def test_a_box_keeps_its_creases() -> None:
    made = remesh(box(), edge_length=2.5)
    assert signed_volume(made) == pytest.approx(1000.0, rel=1e-9)
    assert deviation(box(), made).largest.bound < 0.03


def test_a_small_hole_stays_a_hole() -> None:
    made = remesh(annulus(inner=1.0, divisions=(24, 8)), edge_length=6.0)
    assert prepare(made)[1].topology == "annulus"
    assert min(loop.size for loop in boundary_loops(made)) >= 8


@pytest.mark.parametrize("edge_length", [0.0, -1.0, float("nan"), float("inf")])
def test_an_edge_length_must_be_one(edge_length: float) -> None:
    with pytest.raises(InputError, match="must be a positive number"):
        remesh(plate(), edge_length=edge_length)


def test_more_faces_than_the_limit_are_refused_before_the_work() -> None:
    with pytest.raises(ResourceError, match="at most 5,000,000 are made"):
        remesh(plate(), edge_length=1e-3)


@given(seed=st.integers(0, 2**31), edge_length=st.floats(2.0, 12.0))
@settings(max_examples=8, deadline=None)
def test_whatever_the_mesh_and_the_length_the_result_is_a_disc_that_needs_no_repair(
    seed: int, edge_length: float
) -> None:
    surface = spherical_cap(rings=6, jitter_seed=seed)
    prepared, report = prepare(remesh(surface, edge_length=edge_length))
    assert (report.topology, report.repairs.changes()) == ("disc", ())
    assert face_normals(prepared)[:, 2].min() > 0.0


def test_slivers_of_a_real_patch_are_gone() -> None:
    surface, _ = prepare(load(shared("patches/lv_lateral_disc_r20_slivers.ply"), unit="mm"))
    made = remesh(surface, edge_length=1.5)
    assert np.degrees(smallest_angles(surface).min()) < 1.0
    assert np.degrees(smallest_angles(made).min()) > 25.0
    found = deviation(surface, made)
    assert found.largest.bound < 0.06
    assert found.largest.mean < 0.003
    assert found.rim < 0.06


def test_the_kinds_of_vertices_on_a_box_with_an_open_side() -> None:
    closed = box()
    lid = face_normals(closed)[:, 2] > 0.5
    opened = prepare(replace(closed, faces=closed.faces[~lid]))[0]
    kinds = creases(opened, shortest=1.0)[1]
    # Eight corners; three points on each of four rim sides and of eight creases; nine in each of five sides.
    assert np.bincount(kinds, minlength=4)[[CORNER, ON_RIM, ON_CREASE, INSIDE]].tolist() == [8, 12, 24, 45]
    assert not (creases(opened, shortest=100.0)[1] == ON_CREASE).any()


@pytest.mark.needs("pyfqmr")
def test_decimation_gives_the_number_of_faces_and_changes_little() -> None:
    surface = sphere()
    made = decimate(surface, faces=300)
    assert len(made.faces) == pytest.approx(300, rel=0.02)
    assert prepare(made)[1].topology == "closed, genus 0"
    assert deviation(surface, made).largest.bound < 0.45
    # Whatever the unit, the same is done.
    large = decimate(replace(surface, vertices=100.0 * surface.vertices), faces=300)
    assert closest(large, 100.0 * made.vertices)[1].max() < 1.0


@pytest.mark.needs("pyfqmr")
@pytest.mark.parametrize(
    ("faces", "sentence"),
    [(0, "cannot be decimated to 0"), (10**6, "cannot be decimated to"), (8, "can be decimated to")],
)
def test_a_number_that_cannot_be_met_is_refused(faces: int, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        decimate(disc(), faces=faces)


def ripples(surface: Surface, *, wavelength: float, height: float = 0.1) -> Surface:
    """Return a plate with waves along x."""
    vertices = surface.vertices.copy()
    vertices[:, 2] += height * np.sin(2.0 * np.pi * vertices[:, 0] / wavelength)
    return replace(surface, vertices=vertices)


@pytest.mark.parametrize(("ratio", "kept"), [(0.5, 1 / 17), (1.0, 0.5), (2.0, 16 / 17), (4.0, 256 / 257)])
def test_a_ripple_keeps_the_share_of_its_height_that_the_filter_says(ratio: float, kept: float) -> None:
    wavelength = 10.0 / ratio
    rippled = ripples(plate((80.0, 60.0), (160, 40)), wavelength=10.0)
    smoothed = smooth(rippled, wavelength=wavelength)
    middle = (np.abs(rippled.vertices[:, :2] - np.array([40.0, 30.0])) < 12.0).all(axis=1)
    waves = np.sin(2.0 * np.pi * rippled.vertices[middle, 0] / 10.0)
    assert waves @ smoothed.vertices[middle, 2] / (waves @ waves) / 0.1 == pytest.approx(kept, abs=0.02)


def test_smoothing_leaves_a_sphere_and_the_creases_of_a_box_in_place() -> None:
    ball = sphere(subdivisions=4)
    assert np.abs(np.linalg.norm(smooth(ball, wavelength=8.0).vertices, axis=1) - 20.0).max() < 0.02
    assert deviation(box(), smooth(box(), wavelength=5.0)).largest.bound < 0.02


def test_noise_on_a_real_patch_falls_to_a_third() -> None:
    true, noisy = (
        prepare(load(shared(path), unit="mm"))[0]
        for path in ("patches/lv_lateral_disc_r15.ply", "broken/x_noise_0p3mm.ply")
    )
    before, after = (
        float(np.linalg.norm(closest(true, surface.vertices)[1])) for surface in (noisy, smooth(noisy, wavelength=10.0))
    )
    assert before > 0.25 * np.sqrt(len(noisy.vertices))
    assert after < before / 3


@pytest.mark.parametrize("wavelength", [0.0, float("nan")])
def test_a_wavelength_must_be_one(wavelength: float) -> None:
    with pytest.raises(InputError, match="must be a positive number"):
        smooth(plate(), wavelength=wavelength)
