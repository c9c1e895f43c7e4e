"""Rows beside a drawn curve: known answers on a plate and a cylinder, turns, contours around, and refusals."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.distance import BACKENDS
from geoprint.errors import FieldError, UsageError
from geoprint.geometry import PolylineDistance, boundary_source, part_source, point_source, united
from geoprint.model import FloatArray, Paths, ScalarField, Surface
from geoprint.toolpath import PATTERNS
from geoprint.toolpath.guided import parts_within
from geoprint.toolpath.medial_axis import InnerNeighbours, Strands, middles, neighbours, ridges, strands_of, stretches
from geoprint.workflow.sources import curve_source
from tests.meshes import annulus, plate, sphere

SIDES = 72
RADIUS, HEIGHT = 10.0, 30.0


def _guided(
    surface: Surface, curve: FloatArray, *, spacing: float, backend: str = "fast-marching", contours: int = 0
) -> Paths:
    source = curve_source(surface, curve)
    pattern = PATTERNS["guided"](contours=contours)
    return pattern.paths(surface, source, backend=BACKENDS[backend](surface), spacing=spacing)


def _lines(paths: Paths, surface: Surface) -> list[tuple[FloatArray, FloatArray]]:
    """Return the places of each stroke, and the row of each."""
    offsets = paths.curves.offsets
    return [
        (paths.curves.xyz(surface, curve), paths.row[offsets[curve] : offsets[curve + 1]])
        for curve in range(paths.curves.count)
    ]


def _across(length: float, at: float = 0.0) -> FloatArray:
    """Return a line along x over a plate of some length."""
    return np.array([[-length / 2.0, at, 0.0], [length / 2.0, at, 0.0]])


def _plate() -> Surface:
    """Return a plate of 20 by 12 mm about the origin."""
    corner = plate((20.0, 12.0), divisions=(80, 48))
    return Surface(corner.vertices - np.array([10.0, 6.0, 0.0]), corner.faces, corner.name)


def _tube(levels: int = 60) -> Surface:
    """Return the side of an upright prism, open at both ends."""
    turn = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ring = np.column_stack([RADIUS * np.cos(turn), RADIUS * np.sin(turn)])
    heights = np.linspace(0.0, HEIGHT, levels + 1)
    vertices = np.concatenate([np.column_stack([ring, np.full(SIDES, height)]) for height in heights])
    low = np.arange(levels * SIDES)
    right = low - low % SIDES + (low + 1) % SIDES
    faces = np.concatenate([
        np.column_stack([low, right, right + SIDES]),
        np.column_stack([low, right + SIDES, low + SIDES]),
    ])  # fmt: skip
    return Surface(vertices, faces, "tube")


def test_on_a_cylinder_rows_beside_a_helix_are_helices() -> None:
    surface = _tube()
    side = 2.0 * RADIUS * np.sin(np.pi / SIDES)
    turn = 2.0 * np.pi * np.arange(SIDES + 1) / SIDES
    curve = np.column_stack([RADIUS * np.cos(turn), RADIUS * np.sin(turn), HEIGHT * np.arange(SIDES + 1) / SIDES])
    paths = _guided(surface, curve, spacing=1.0)
    along = np.array([SIDES * side, HEIGHT])
    length = float(np.linalg.norm(along))
    judged = 0
    for places, row in _lines(paths, surface):
        # Unrolled: the part of the side that a place lies on, and how far along that.
        corner = np.mod(np.arctan2(places[:, 1], places[:, 0]), 2.0 * np.pi) * SIDES / (2.0 * np.pi)
        within = (np.floor(corner) + 0.5) * 2.0 * np.pi / SIDES
        tangent = np.column_stack([-np.sin(within), np.cos(within)])
        unrolled = np.column_stack([
            (np.floor(corner) + 0.5) * side + np.einsum("kc,kc->k", places[:, :2], tangent), places[:, 2]
        ])  # fmt: skip
        shifted = unrolled + np.array([[[-SIDES * side, 0.0]], [[0.0, 0.0]], [[SIDES * side, 0.0]]])
        foot, away = shifted @ along / length, np.abs(shifted @ np.array([-along[1], along[0]])) / length
        nearest = np.where((foot > 0.0) & (foot < length), away, np.inf).min(axis=0)
        ends = np.minimum(np.linalg.norm(shifted, axis=2), np.linalg.norm(shifted - along, axis=2)).min(axis=0)
        # On whole rows, and away from where the fronts of both sides meet or go round the ends.
        inside = (row == np.floor(row)) & (nearest < 10.0) & (ends > nearest + 1.0)
        assert np.abs(nearest - (row + 0.5))[inside].max(initial=0.0) < 1e-6
        judged += int(inside.sum())
    assert judged > 1000


@pytest.mark.parametrize("backend", sorted(BACKENDS))
def test_a_plate_is_covered_in_one_stroke(backend: str) -> None:
    surface = _plate()
    paths = _guided(surface, _across(20.0), spacing=1.0, backend=backend)
    ((places, row),) = _lines(paths, surface)
    straight = row == np.floor(row)
    rows = np.abs(places[straight, 1])
    inner = np.abs(places[straight, 0]) < 8.0
    np.testing.assert_allclose(rows[inner], row[straight][inner] + 0.5, atol=0.03)
    # Twelve rows between turns half a spacing from the rim.
    held: FloatArray = places[straight, 1][inner]
    assert {round(height + 5.5) for height in held.tolist()} == set(range(12))
    assert np.abs(places[:, 0]).max() == pytest.approx(9.5, abs=0.1)
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).sum() == pytest.approx(
        12 * 19.0 + 11 * (1.62 - 1.0), rel=0.01
    )


def test_turns_are_round_and_rows_go_there_and_back() -> None:
    surface = _plate()
    ((places, row),) = _lines(_guided(surface, _across(20.0), spacing=2.0), surface)
    steps = np.diff(places, axis=0)
    steps = steps[np.linalg.norm(steps, axis=1) > 1e-9]
    bends = np.einsum("kc,kc->k", steps[1:], steps[:-1])
    bends /= np.linalg.norm(steps[1:], axis=1) * np.linalg.norm(steps[:-1], axis=1)
    assert np.degrees(np.arccos(np.clip(bends, -1.0, 1.0))).max() < 25.0
    order = [(number, side) for side in (1, -1) for number in (range(3) if side < 0 else range(2, -1, -1))]
    runs = [places[(row == number) & (np.sign(places[:, 1]) == side), 0] for number, side in order]
    senses = [np.sign(run[-1] - run[0]) for run in runs]
    assert senses in ([1, -1] * 3, [-1, 1] * 3)


def test_contours_go_around_the_rows() -> None:
    surface = _plate()
    paths = _guided(surface, _across(20.0), spacing=1.0, contours=2)
    lines = _lines(paths, surface)
    rings = [line for line, closed in zip(lines, paths.curves.closed, strict=True) if closed]
    assert [row.max() for _, row in rings] == [0.0, 1.0]
    rim = PolylineDistance([boundary_source(surface).curves.xyz(surface, 0)], step=0.05)
    for (places, row), closed in zip(lines, paths.curves.closed, strict=True):
        if closed:
            np.testing.assert_allclose(rim(places), row + 0.5, atol=0.02)
        else:
            assert rim(places).min() == pytest.approx(2.5, abs=0.02)
            assert row.min() == 2.0


def test_rows_beside_a_part_of_the_rim_begin_with_it() -> None:
    surface = _plate()
    source = part_source(surface, np.array([-10.0, -6.0, 0.0]), np.array([10.0, -6.0, 0.0]))
    paths = PATTERNS["guided"]().paths(surface, source, backend=BACKENDS["heat"](surface), spacing=1.0)
    ((places, row),) = _lines(paths, surface)
    straight = (row == np.floor(row)) & (np.abs(places[:, 0]) < 8.0)
    np.testing.assert_allclose(places[straight, 1] + 6.0, row[straight] + 0.5, atol=0.03)
    assert set(row[straight].tolist()) == set(range(12))


def test_where_rows_do_not_fit_the_line_of_ends_is_the_last_row() -> None:
    surface = _plate()
    # The lowest row lies at -3.8 mm, and the line of ends 0.6 spacings farther down; the highest 0.4 below the other.
    paths = _guided(surface, _across(20.0, at=1.2), spacing=2.0)
    lines = _lines(paths, surface)
    assert len(lines) == 1
    places, row = lines[0]
    low = (places[:, 1] < -4.5) & (np.abs(places[:, 0]) < 8.0)
    assert places[low, 1] == pytest.approx(-5.0, abs=0.05)
    assert set(row[low].tolist()) == {3.0}
    assert places[np.abs(places[:, 0]) < 8.0, 1].max() == pytest.approx(4.2, abs=0.05)


def test_a_hole_parts_rows_and_its_rim_is_turned_at() -> None:
    surface = annulus(inner=4.0, outer=16.0, divisions=(96, 36))
    curve = np.array([[5.0, 12.0, 0.0], [-5.0, 12.0, 0.0]])
    paths = _guided(surface, curve, spacing=1.0)
    everywhere = np.concatenate([places for places, _ in _lines(paths, surface)])
    radius = np.hypot(everywhere[:, 0], everywhere[:, 1])
    assert radius.min() == pytest.approx(4.5, abs=0.1)
    assert radius.max() == pytest.approx(15.5, abs=0.1)


def test_on_a_closed_part_rows_go_round() -> None:
    surface = sphere(radius=10.0, subdivisions=4)
    curve = 10.0 * np.array([[0.0, -0.3, 0.954], [0.0, 0.0, 1.0], [0.0, 0.3, 0.954]])
    paths = _guided(surface, curve, spacing=2.0)
    assert paths.curves.closed.all()
    assert paths.curves.count == int(paths.row.max()) + 1


def test_every_piece_needs_a_line() -> None:
    first = _plate()
    both = united([first, Surface(first.vertices + np.array([0.0, 40.0, 0.0]), first.faces)])
    source = curve_source(both, _across(20.0))
    with pytest.raises(UsageError, match="need a line with two ends"):
        PATTERNS["guided"]().paths(both, source, backend=BACKENDS["heat"](both), spacing=1.0)


def test_a_border_and_a_point_are_no_line() -> None:
    surface = _plate()
    for source in (boundary_source(surface), point_source(surface, np.zeros(3), tolerance=0.1)):
        with pytest.raises(UsageError, match=r"Draw one \(`--from curve.csv`"):
            PATTERNS["guided"]().paths(surface, source, backend=BACKENDS["heat"](surface), spacing=1.0)


def test_what_has_no_room_or_no_rim_is_refused() -> None:
    surface = _plate()
    with pytest.raises(FieldError, match="within its rim and 7 contours: choose fewer"):
        _guided(surface, _across(20.0), spacing=1.0, contours=7)
    with pytest.raises(UsageError, match="0 or more"):
        PATTERNS["guided"](contours=-1)
    ball = sphere(radius=10.0, subdivisions=3)
    with pytest.raises(UsageError, match="contours need a rim"):
        _guided(ball, 10.0 * np.array([[0.0, -0.3, 0.954], [0.0, 0.3, 0.954]]), spacing=2.0, contours=1)
    source = curve_source(surface, _across(20.0))
    spacing = ScalarField(np.ones(len(surface.vertices)))
    with pytest.raises(UsageError, match="a spacing at each vertex is given"):
        PATTERNS["guided"]().paths(surface, source, backend=BACKENDS["heat"](surface), spacing=spacing)


# Ridges: strands that face each other are found on both sides, and a ridge goes on beyond the tip of a level.


def found_on(surface: Surface, *, spacing: float) -> tuple[Strands, InnerNeighbours]:
    contours = BACKENDS["fast-marching"](surface).contours(boundary_source(surface), spacing=spacing)
    strands = strands_of(surface, contours)
    return strands, neighbours(strands)


def test_the_ridge_of_a_ring_is_one_circle_seen_from_one_side() -> None:
    ring = annulus(inner=10.0, outer=16.8, divisions=(180, 28))
    strands, beside = found_on(ring, spacing=1.0)
    innermost = strands.levels == 2
    assert beside.on_ridge[innermost].mean() > 0.99
    assert not beside.on_ridge[~innermost].any()
    np.testing.assert_allclose(beside.half[innermost & beside.on_ridge], 0.9, atol=0.02)
    # Inside of every other sample lies the next level.
    assert (strands.levels[beside.inside[strands.levels < 2]] == strands.levels[strands.levels < 2] + 1).all()
    (ridge,) = ridges(strands, beside)
    line = middles(ridge, strands.places, beside)
    np.testing.assert_allclose(np.linalg.norm(line, axis=1), 13.4, atol=0.02)
    assert np.unique(strands.strand[ridge]).size == 1


def test_inwards_is_towards_larger_distance_on_either_rim() -> None:
    ring = annulus(inner=10.0, outer=16.8, divisions=(180, 28))
    strands, _ = found_on(ring, spacing=1.0)
    radii = np.linalg.norm(strands.places, axis=1)
    outwards = np.einsum("kx,kx->k", strands.inward, strands.places) / radii
    np.testing.assert_allclose(outwards, np.where(radii < 13.4, 1.0, -1.0), atol=1e-3)


def test_a_ridge_of_a_rectangle_runs_between_its_ends_and_not_into_its_corners() -> None:
    table = plate((30.0, 7.4), (90, 22))
    strands, beside = found_on(table, spacing=1.0)
    lines = [middles(ridge, strands.places, beside) for ridge in ridges(strands, beside)]
    longest = max(lines, key=len)
    # On the middle line, between the ends of the roof 3.7 mm from either side.
    np.testing.assert_allclose(longest[:, 1], 3.7, atol=0.05)
    assert longest[:, 0].min() == pytest.approx(3.7, abs=0.8)
    assert longest[:, 0].max() == pytest.approx(26.3, abs=0.8)


@pytest.mark.parametrize(
    ("chosen", "ends", "expected"),
    [
        ("0110", "open", [[1, 2]]),
        ("1011", "open", [[0], [2, 3]]),
        ("1011", "closed", [[2, 3, 0]]),
        ("1111", "closed", [[0, 1, 2, 3]]),
        ("0000", "closed", []),
        ("", "open", []),
    ],
)
def test_stretches_are_unbroken_rows(chosen: str, ends: str, expected: list[list[int]]) -> None:
    found = stretches(np.array([each == "1" for each in chosen], dtype=bool), closed=ends == "closed")
    assert [each.tolist() for each in found] == expected


# Curves cut to where a field is large enough: crossings, seams of closed ones, and what is spared.


def _parts(values: list[float], *, closed: bool = False, spared: float = 0.0) -> list[tuple[list[float], bool]]:
    """Return the parts above 1 of a curve whose places count along x."""
    places = np.column_stack([np.arange(float(len(values))), np.zeros((len(values), 2))])
    if closed:
        places[-1] = places[0]
    found = parts_within(places, np.array(values), closed=closed, least=1.0, spared=spared, grazing=0.9)
    return [(part[:, 0].tolist(), whole) for part, whole in found]


def test_a_curve_ends_where_the_field_crosses() -> None:
    assert _parts([0.0, 2.0, 2.0, 0.0, 0.5, 1.5]) == [([0.5, 1.0, 2.0, 2.5], False), ([4.5, 5.0], False)]


@pytest.mark.parametrize("closed", [True, False])
def test_all_of_it_or_none(*, closed: bool) -> None:
    assert _parts([2.0, 2.0, 3.0, 2.0], closed=closed) == [([0.0, 1.0, 2.0, 0.0 if closed else 3.0], closed)]
    assert _parts([0.0, 0.5, 0.9, 0.0], closed=closed) == []


def test_a_closed_curve_is_no_longer_one_and_goes_on_over_its_seam() -> None:
    assert _parts([2.0, 2.0, 0.0, 2.0, 2.0], closed=True) == [([2.5, 3.0, 0.0, 1.0, 1.5], False)]


def test_a_little_below_is_spared() -> None:
    assert _parts([0.95, 2.0, 0.95, 2.0, 0.0], spared=0.1) == [([0.0, 1.0, 2.0, 3.0, 3.5], False)]
    assert _parts([0.95, 0.95], spared=0.1) == [([0.0, 1.0], False)]
    assert _parts([0.95, 2.0, 0.0, 2.0, 0.95], closed=True, spared=0.1) == [([2.5, 3.0, 0.0, 1.0, 1.5], False)]


def test_a_curve_that_grazes_ends_where_it_leaves() -> None:
    ((line, _),) = _parts([0.0, 0.95, 0.95, 2.0, 0.95, 0.95, 0.0], spared=0.1)
    assert line == pytest.approx([0.9 / 0.95, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0 - 0.9 / 0.95])
    ((line, _),) = _parts([0.0, 0.95, 0.95, 0.95, 0.0], spared=0.1)
    assert line[0] == pytest.approx(0.9 / 0.95)
    assert line[-1] == pytest.approx(4.0 - 0.9 / 0.95)
