"""What every backend promises, asked of each entry of the registry."""

from __future__ import annotations

import ast
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

import geoprint
from geoprint.distance import (
    BACKENDS,
    accuracy,
    backend,
    backend_names,
    compared_backends,
    most_accurate_backend,
    register,
)
from geoprint.distance.interface import diagnostics
from geoprint.errors import FieldError, UsageError
from geoprint.geometry import PolylineDistance, boundary_source, even_points, positions, refine
from geoprint.model import Contours, FloatArray, ScalarField, Surface
from tests.distance.bands import band
from tests.meshes import cylinder_patch, plate, spherical_cap

every_backend = pytest.mark.parametrize("name", sorted(BACKENDS))

# Stated error of each backend where it is consistent, as a share of the spacing of 20 triangles a plate.
STATED_ERROR = 0.012
# A backend that is exact on the plane has no error that falls with the triangles, only rounding and its own tolerance.
EXACT = 1e-5


def distance(name: str, surface: Surface) -> FloatArray:
    return BACKENDS[name](surface).distance(boundary_source(surface)).values


def lopsided_cap() -> Surface:
    """Return a cap without symmetry, so that no choice of a backend hangs on a tie."""
    cap = spherical_cap(rings=10, jitter_seed=7)
    x, y, z = cap.vertices.T
    return Surface(np.column_stack([1.3 * x + 0.004 * x**2, y + 0.03 * x, z]), cap.faces)


def spacing_ratios(surface: Surface, contours: Contours) -> FloatArray:
    """Return the straight distance of points on every level from the level outside, over the spacing."""
    lines = np.split(positions(surface, contours.curves.points), contours.curves.offsets[1:-1])
    levels = [[lines[i] for i in np.flatnonzero(contours.levels == level)] for level in np.unique(contours.levels)]
    step = contours.spacing / 20
    distances = [
        PolylineDistance(outer, step=step)(np.vstack([even_points(line, step=5 * step) for line in inner]))
        for outer, inner in pairwise(levels)
    ]
    return np.concatenate(distances) / contours.spacing


def plate_distance(surface: Surface, size: tuple[float, float]) -> FloatArray:
    x, y = surface.vertices[:, 0], surface.vertices[:, 1]
    return np.minimum(np.minimum(x, size[0] - x), np.minimum(y, size[1] - y))


@every_backend
def test_distance_is_zero_at_the_seed_and_nowhere_negative(name: str) -> None:
    surface = spherical_cap(rings=12, jitter_seed=2)
    values = distance(name, surface)
    source = boundary_source(surface)
    rim = np.unique(surface.faces[source.curves.points.faces][source.curves.points.weights > 0.5])
    np.testing.assert_allclose(values[rim], 0.0, atol=1e-12)
    assert values.min() >= 0.0
    assert values.max() > 20.0


@every_backend
def test_distance_on_a_plate_is_that_to_the_nearest_edge(name: str) -> None:
    size = (40.0, 30.0)
    surface = plate(size, (80, 60), jitter_seed=5)
    error = np.abs(distance(name, surface) - plate_distance(surface, size))
    assert error.mean() < STATED_ERROR * 2.0
    assert error.max() < 0.3


@every_backend
def test_rolling_a_plate_into_a_cylinder_changes_nothing(name: str) -> None:
    angle, radius, length = 1.5, 30.0, 40.0
    flat = plate((angle * radius, length), (60, 50), jitter_seed=5)
    rolled = cylinder_patch(radius=radius, angle=angle, length=length, divisions=(60, 50), jitter_seed=5)
    np.testing.assert_allclose(distance(name, rolled), distance(name, flat), atol=0.005)


@every_backend
def test_a_strip_rolled_up_and_joined_keeps_its_distances_from_the_long_sides(name: str) -> None:
    surface = band(low=12.0, high=12.0, height=15.0, divisions=(144, 32))
    heights = surface.vertices[:, 2]
    error = np.abs(distance(name, surface) - np.minimum(heights, 15.0 - heights))
    assert error.mean() < STATED_ERROR * 2.0
    assert error.max() < 0.3


@every_backend
def test_the_error_on_a_plate_falls_with_the_triangles(name: str) -> None:
    size = (40.0, 30.0)
    errors: list[float] = []
    for cells in (20, 40, 80):
        surface = plate(size, (cells, 3 * cells // 4), jitter_seed=3)
        errors.append(float(np.abs(distance(name, surface) - plate_distance(surface, size)).mean()))
    order = np.log2(errors[0] / errors[2]) / 2
    assert order > 0.7 or max(errors) < EXACT


@every_backend
@settings(max_examples=5, deadline=None)
@given(angles=st.tuples(*[st.floats(-180, 180)] * 3), scale=st.floats(0.2, 5.0))
def test_rigid_motion_and_scale_leave_distances_as_they_are(
    name: str, angles: tuple[float, float, float], scale: float
) -> None:
    surface = lopsided_cap()
    turn = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    moved = Surface(scale * surface.vertices @ turn.T + [5.0, -70.0, 11.0], surface.faces)
    np.testing.assert_allclose(distance(name, moved) / scale, distance(name, surface), atol=1e-9)


@every_backend
def test_renumbering_moves_no_distance_far(name: str) -> None:
    surface = lopsided_cap()
    rng = np.random.default_rng(0)
    order = rng.permutation(len(surface.vertices))
    new_number = np.argsort(order)
    renumbered = Surface(surface.vertices[order], rng.permutation(new_number[surface.faces]))
    np.testing.assert_allclose(distance(name, renumbered), distance(name, surface)[order], atol=0.01)


@every_backend
def test_contours_lie_half_a_spacing_and_then_whole_spacings_from_the_seed(name: str) -> None:
    size = (40.0, 30.0)
    surface = plate(size, (80, 60), jitter_seed=5)
    contours = BACKENDS[name](surface).contours(boundary_source(surface), spacing=2.0)
    places = positions(surface, contours.curves.points)
    wanted = np.repeat((contours.levels + 0.5) * 2.0, np.diff(contours.curves.offsets))
    found = np.minimum(
        np.minimum(places[:, 0], size[0] - places[:, 0]), np.minimum(places[:, 1], size[1] - places[:, 1])
    )
    assert np.abs(found - wanted).mean() < STATED_ERROR * 2.0
    assert sorted(set(contours.levels.tolist())) == list(range(int(contours.levels.max()) + 1))
    assert contours.curves.closed.all()


@every_backend
def test_the_edges_asked_for_scale_with_part_and_spacing_and_are_at_most_half_a_spacing(name: str) -> None:
    part = spherical_cap(rings=6, jitter_seed=2)
    wider = Surface(3.0 * part.vertices, part.faces)
    for spacing in (0.01, 0.3, 1.0, 10.0):
        wanted = BACKENDS[name].edge_length(part, spacing=spacing)
        assert 0.0 < wanted <= spacing / 2
        assert BACKENDS[name].edge_length(wider, spacing=3.0 * spacing) == pytest.approx(3.0 * wanted)


@every_backend
def test_a_part_with_the_edges_asked_for_gets_even_contours(name: str) -> None:
    part = cylinder_patch(radius=30.0, angle=1.0, length=24.0, divisions=(6, 5), jitter_seed=3)
    spacing = 1.0
    surface = refine(part, edge_length=BACKENDS[name].edge_length(part, spacing=spacing))
    contours = BACKENDS[name](surface).contours(boundary_source(surface), spacing=spacing)
    ratios = spacing_ratios(surface, contours)
    assert ratios.mean() == pytest.approx(1.0, abs=0.005)
    assert ratios.std() < 0.01


@every_backend
@pytest.mark.parametrize("spacing", [0.0, -1.0, float("nan"), float("inf")])
def test_a_meaningless_spacing_is_refused(name: str, spacing: float) -> None:
    surface = plate()
    with pytest.raises(UsageError, match="spacing"):
        BACKENDS[name](surface).contours(boundary_source(surface), spacing=spacing)


@every_backend
def test_a_spacing_larger_than_the_part_names_one_that_fits(name: str) -> None:
    surface = plate()
    with pytest.raises(FieldError, match="choose a spacing below"):
        BACKENDS[name](surface).contours(boundary_source(surface), spacing=100.0)


# The slope of a field: known on a plate, broken on its diagonals, and reported by area.


def test_a_plane_of_slope_one_has_no_error_and_no_cut_locus() -> None:
    surface = plate((40.0, 30.0), (20, 15), jitter_seed=1)
    found = diagnostics(surface, ScalarField(surface.vertices[:, 0].copy()))
    assert found.mean_slope_error == pytest.approx(0.0, abs=1e-12)
    assert found.p95_slope_error == pytest.approx(0.0, abs=1e-12)
    assert found.cut_locus_share == 0.0


def test_a_slope_off_by_a_twentieth_is_reported_as_such() -> None:
    surface = plate((40.0, 30.0), (20, 15), jitter_seed=1)
    found = diagnostics(surface, ScalarField(1.05 * surface.vertices[:, 0]))
    assert found.mean_slope_error == pytest.approx(0.05)
    assert found.p95_slope_error == pytest.approx(0.05)


def test_triangles_over_the_ridge_between_two_edges_are_the_cut_locus() -> None:
    surface = plate((40.0, 30.0), (21, 15))
    x = surface.vertices[:, 0]
    found = diagnostics(surface, ScalarField(np.minimum(x, 40.0 - x)))
    assert found.cut_locus_share == pytest.approx(1 / 21, rel=1e-6)
    assert found.mean_slope_error == pytest.approx(0.0, abs=1e-12)
    flat = diagnostics(surface, ScalarField(np.ones(x.size)))
    assert flat.cut_locus_share == 1.0
    assert flat.mean_slope_error == pytest.approx(1.0)


# What the backends say of themselves, and who is chosen by it.


def test_every_backend_says_what_it_is_in_words_of_its_own() -> None:
    assert backend_names()[: len(BACKENDS)] == tuple(BACKENDS)
    found = [backend(name) for name in BACKENDS]
    assert len({entry.factory.title for entry in found}) == len(BACKENDS)
    for entry in found:
        assert entry.summary.endswith(".")
        assert entry.summary != entry.factory.title


def test_a_chart_and_a_mesh_are_compared_and_the_most_accurate_is_advised() -> None:
    assert compared_backends() == ("lscm", "heat")
    assert most_accurate_backend().name == "fast-marching"
    ranks = [accuracy(backend(name)) for name in ("lscm", "heat", "fast-marching")]
    assert ranks == sorted(set(ranks))


def test_a_name_that_is_built_in_cannot_be_registered_again() -> None:
    with pytest.raises(UsageError, match="a backend named 'heat' exists already"):
        register("heat", BACKENDS["lscm"])


def test_no_room_but_their_own_knows_the_name_of_a_backend() -> None:
    package = Path(geoprint.__file__).parent
    texts = {path.relative_to(package): path.read_text(encoding="utf-8") for path in package.rglob("*.py")}
    found = {
        (path.as_posix(), node.value)
        for path, text in texts.items()
        # Most files hold none of the names, and need not be parsed for it.
        # Scripts to be copied choose one, as everybody who plans.
        if path.parts[0] != "distance" and path.parent.name != "examples" and any(name in text for name in BACKENDS)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Constant) and node.value in BACKENDS
    }
    # The one that plans where nobody chooses.
    assert found <= {("config/job.py", "heat"), ("cli/options.py", "heat")}
