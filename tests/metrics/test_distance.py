"""How far curves lie from the distance that they promise: known answers by formula, on several shapes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from geoprint.geometry import closest
from geoprint.metrics import DistanceErrors, distance_errors
from geoprint.model import FloatArray, Seed, Surface, SurfaceCurves
from tests.meshes import annulus, cylinder_patch, disc, plate
from tests.metrics.deposits import circle, straight_line

SPACING = 2.0


def on(surface: Surface, lines: Sequence[FloatArray]) -> SurfaceCurves:
    """Return (k, 3) lines as curves of a surface."""
    points, _ = closest(surface, np.concatenate(lines))
    closed = np.array([len(line) > 1 and bool(np.allclose(line[0], line[-1])) for line in lines])
    return SurfaceCurves(points, np.cumsum([0, *(len(line) for line in lines)]), closed)


def errors_of(
    surface: Surface, source: Sequence[FloatArray], lines: Sequence[FloatArray], rows: Sequence[float]
) -> DistanceErrors:
    each = np.repeat(np.asarray(rows, dtype=np.float64), [len(line) for line in lines])
    return distance_errors(
        surface, Seed(on(surface, source)), on(surface, lines), (each + 0.5) * SPACING, surface=surface, spacing=SPACING
    )  # fmt: skip


def test_lines_on_a_plate_are_off_by_what_they_were_moved() -> None:
    surface = plate((30.0, 20.0), (20, 13), jitter_seed=1)
    edge = straight_line((0.0, 0.0), (30.0, 0.0), points=31)
    lines = [straight_line((0.0, y), (30.0, y), points=11) for y in (1.0, 3.1, 4.8, 19.0)]
    found = errors_of(surface, [edge], lines, [0, 1, 2, 9])
    of_line = np.round(found.places[:, 1], 6)
    for y, off in ((1.0, 0.0), (3.1, 0.05), (4.8, -0.1), (19.0, 0.0)):
        np.testing.assert_allclose(found.errors[of_line == y], off, atol=1e-9)
    assert found.mean == pytest.approx(-0.0125)
    assert found.deviation == pytest.approx(np.std([0.0, 0.05, -0.1, 0.0]))
    assert found.largest == pytest.approx(0.1)
    assert found.unknown == 0.0


def test_a_curve_that_rises_promises_more_and_more() -> None:
    surface = plate((30.0, 20.0), (20, 13), jitter_seed=2)
    line = np.column_stack([np.linspace(0.0, 30.0, 16), np.linspace(1.0, 4.0, 16), np.zeros(16)])
    edge = straight_line((0.0, 0.0), (30.0, 0.0), points=2)
    found = distance_errors(
        surface, Seed(on(surface, [edge])), on(surface, [line]), line[:, 1], surface=surface, spacing=SPACING
    )
    np.testing.assert_allclose(found.errors, 0.0, atol=1e-9)


def test_a_rolled_plate_keeps_its_distances() -> None:
    surface = cylinder_patch(divisions=(96, 10))

    def rolled(x: FloatArray, y: FloatArray) -> FloatArray:
        turn = x / 30.0 - 0.75
        return np.column_stack([30.0 * np.sin(turn), y, 30.0 * np.cos(turn)])

    across, along = np.linspace(0.0, 45.0, 181), np.linspace(0.0, 40.0, 81)
    # From a side of the roll, around it and along it, and from a point, where distance is that of the plane.
    sides = rolled(np.full(81, 0.0), along)
    found = errors_of(surface, [sides], [rolled(np.full(81, x), along) for x in (1.0, 21.0, 43.5)], [0, 10, 21])
    np.testing.assert_allclose(np.unique(np.round(found.errors, 3)), [0.0, 0.249], atol=2e-3)
    slanting = rolled(across, 5.0 + 0.5 * across)
    point = rolled(np.array([0.0]), np.array([5.0]))
    away = across * np.hypot(1.0, 0.5)
    to_point = distance_errors(
        surface, Seed(on(surface, [point])), on(surface, [slanting]), away, surface=surface,
        spacing=SPACING,
    )  # fmt: skip
    np.testing.assert_allclose(to_point.errors, 0.0, atol=3e-3)


def test_circles_on_a_cone_lie_at_their_slant_distance_from_its_tip() -> None:
    flat = disc(radius=16.0, rings=40)
    heights = -0.75 * np.linalg.norm(flat.vertices[:, :2], axis=1)
    cone = Surface(np.column_stack([flat.vertices[:, :2], heights]), flat.faces, "cone")
    # 1.25 mm along the slope for each mm away from the axis.
    radii = [4.0, 8.0, 12.4]
    lines = [circle(r, height=-0.75 * r, points=241) for r in radii]
    found = errors_of(cone, [np.zeros((1, 3))], lines, [2, 4.5, 7])
    at = np.linalg.norm(found.places[:, :2], axis=1)
    for r, off in zip(radii, (0.0, 0.0, 0.25), strict=True):
        # Facets lie up to 0.3% inside of the cone.
        np.testing.assert_allclose(found.errors[np.abs(at - r) < 0.2], off, atol=0.02)


def test_the_way_leads_around_a_hole() -> None:
    surface = annulus(inner=8.0, outer=20.0, divisions=(96, 6))
    behind = straight_line((-19.9, -0.5), (-19.9, 0.5), points=3)
    # Straight through the hole it is 39.9 mm; around it two tangents and the arc between them.
    tangents = 2.0 * np.sqrt(19.95**2 - 8.0**2)
    around = tangents + 8.0 * (np.pi - 2.0 * np.arccos(8.0 / 19.95))
    found = errors_of(surface, [np.array([[20.0, 0.0, 0.0]])], [behind], [39.9 / SPACING - 0.5])
    assert found.unknown == 0.0
    assert found.mean == pytest.approx((around - 39.9) / SPACING, abs=0.15)
    assert found.mean > 1.5


def test_the_nearest_of_several_sources_counts() -> None:
    surface = plate((30.0, 20.0), (20, 13), jitter_seed=3)
    sources = [straight_line((0.0, 0.0), (30.0, 0.0), points=31), np.array([[15.0, 20.0, 0.0]])]
    found = errors_of(surface, sources, [straight_line((5.0, 15.0), (25.0, 15.0), points=21)], [2])
    x = found.places[:, 0]
    expected = np.minimum(15.0, np.hypot(x - 15.0, 5.0))
    np.testing.assert_allclose(found.errors, (expected - 5.0) / SPACING, atol=1e-9)


def test_what_the_budget_does_not_reach_is_unknown_and_left_out() -> None:
    surface = plate((30.0, 20.0), (20, 13), jitter_seed=4)
    edge = on(surface, [straight_line((0.0, 0.0), (30.0, 0.0), points=31)])
    lines = on(surface, [straight_line((0.0, 15.0), (30.0, 15.0), points=11)])
    promised = np.full(11, 15.0)
    whole, little = (
        distance_errors(surface, Seed(edge), lines, promised, surface=surface, spacing=SPACING, windows=windows)
        for windows in (10**7, 3000)
    )
    assert whole.unknown == 0.0
    assert 0.5 < little.unknown < 1.0
    assert len(little.places) == little.errors.size == round((1.0 - little.unknown) * whole.errors.size)
    np.testing.assert_allclose(little.errors, 0.0, atol=1e-9)
