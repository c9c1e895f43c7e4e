"""What overhangs, on parts whose angles are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.geometry import closest
from geoprint.metrics import fibre_angles, overhang
from geoprint.model import FloatArray, FollowedLines, PoseStream, Surface, SurfaceCurves
from tests.meshes import plate
from tests.metrics.deposits import circle, deposited, straight_line

CRITICAL = np.radians(30.0)
Z = np.array([0.0, 0.0, 1.0])


def on_cap(polars: FloatArray, *, radius: float = 30.0) -> PoseStream:
    """Return rows about the pole of a sphere at so many angles from it [rad], with its normals."""
    rows = [circle(radius * np.sin(polar), height=radius * np.cos(polar)) for polar in polars]
    stream = deposited(rows, range(len(rows)))
    points = np.concatenate(rows)
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    return replace(stream, normals=normals, tips=points + stream.standoff * normals)


def test_rows_of_a_cap_overhang_from_the_critical_angle_on() -> None:
    polars = np.radians([10.0, 29.9, 30.1, 60.0, 85.0])
    found = overhang(on_cap(polars), up=Z, critical=CRITICAL)
    lengths = np.sin(polars)
    assert found.share == pytest.approx(lengths[2:].sum() / lengths.sum(), rel=1e-6)
    assert found.length == pytest.approx(2.0 * np.pi * 30.3 * lengths[2:].sum(), rel=1e-4)
    assert found.largest == pytest.approx(np.radians(85.0), abs=1e-9)
    assert np.degrees(found.angles) == pytest.approx([85.0, 60.0, 30.1])


def test_a_step_of_a_meridian_overhangs_where_either_of_its_ends_does() -> None:
    # From the pole to 70 degrees, four steps between 0, 17.5, 35, 52.5 and 70 degrees: all but the first end beyond 30.
    polars = np.radians(np.linspace(0.0, 70.0, 5))
    normals = np.column_stack([np.sin(polars), np.zeros(5), np.cos(polars)])
    stream = deposited([30.0 * normals], [0])
    meridian = replace(stream, normals=normals, tips=30.3 * normals)
    up, down = (overhang(each, up=Z, critical=CRITICAL) for each in (meridian, meridian.taken(np.arange(5)[::-1])))
    assert (up.share, down.share) == pytest.approx((3.0 / 4.0, 3.0 / 4.0))
    assert up.length == pytest.approx(3 * 2.0 * 30.3 * np.sin(np.radians(17.5 / 2.0)))
    shares = [overhang(meridian, up=Z, critical=float(np.radians(angle))).share for angle in (52.4, 52.6)]
    assert shares == pytest.approx([2.0 / 4.0, 1.0 / 4.0])


def test_a_part_that_is_turned_overhangs_by_the_turn_alone() -> None:
    stream = deposited([straight_line((0.0, 0.0), (40.0, 0.0))], [0])
    leaning = np.radians(31.0)
    up = np.array([np.sin(leaning), 0.0, np.cos(leaning)])
    assert overhang(stream, up=Z, critical=CRITICAL).length == 0.0
    found = overhang(stream, up=up, critical=CRITICAL)
    assert (found.share, found.largest) == pytest.approx((1.0, leaning))
    assert overhang(stream, up=-Z, critical=CRITICAL).largest == pytest.approx(np.pi)


def test_each_line_counts_in_the_attitude_of_the_pose_that_ends_it() -> None:
    stream = deposited([straight_line((0.0, 0.0), (40.0, 0.0), points=5)], [0])
    aside = np.array([1.0, 0.0, 0.0])
    found = overhang(stream, up=np.array([aside, Z, Z, aside, Z]), critical=CRITICAL)
    assert found.length == pytest.approx(10.0)


def test_travel_and_what_is_not_deposited_do_not_count() -> None:
    stream = on_cap(np.radians([60.0, 20.0]))
    none = overhang(replace(stream, deposit=np.zeros(stream.count, dtype=np.bool_)), up=Z, critical=CRITICAL)
    assert (none.length, none.share, none.largest, none.rows.size) == (0.0, 0.0, 0.0, 0)
    deposit = np.arange(stream.count) >= stream.count // 2
    assert overhang(replace(stream, deposit=deposit), up=Z, critical=CRITICAL).share == 0.0


def test_a_stretch_of_a_run_is_listed_once_where_it_is_steepest() -> None:
    angles = np.radians([0.0, 40.0, 50.0, 40.0, 0.0, 35.0, 0.0])
    normals = np.column_stack([np.sin(angles), np.zeros(7), np.cos(angles)])
    stream = replace(deposited([straight_line((0.0, 0.0), (6.0, 0.0), points=7)], [0]), normals=normals)
    found = overhang(stream, up=Z, critical=CRITICAL)
    assert found.rows.tolist() == [2, 5]


# Angles of paths to lines and axes, on plates where both are known by construction.


PLATE = plate((20.0, 20.0), (10, 10))


def _lines(angle_deg: float, *, axes: bool) -> FollowedLines:
    """Return lines at an angle to the x axis, and the axes x and y between which it counts."""
    count, angle = len(PLATE.faces), np.radians(angle_deg)
    along = np.tile([np.cos(angle), np.sin(angle), 0.0], (count, 1))
    frame = np.tile(np.eye(3)[:2], (count, 1, 1)) if axes else None
    return FollowedLines(along, np.zeros((0, 3)), np.zeros(0), frame)


def _paths(surface: Surface, *rows: tuple[float, float]) -> SurfaceCurves:
    """Return straight paths through the middle, each at an angle [degrees] and of a length [mm], with both senses."""
    corners: list[FloatArray] = []
    for number, (angle_deg, length) in enumerate(rows):
        angle = np.radians(angle_deg + 180.0 * (number % 2))
        half = 0.5 * length * np.array([np.cos(angle), np.sin(angle), 0.0])
        corners.append(np.linspace(-half, half, 7) + np.array([10.0, 10.0, 0.0]))
    points, _ = closest(surface, np.concatenate(corners))
    return SurfaceCurves(points, 7 * np.arange(len(rows) + 1), np.zeros(len(rows), dtype=np.bool_))


def test_paths_along_their_lines_are_off_by_nothing_and_have_their_helix_angle() -> None:
    found = fibre_angles(PLATE, _paths(PLATE, (-60.0, 10.0), (-60.0, 6.0)), _lines(-60.0, axes=True))
    assert found.off == pytest.approx(0.0, abs=1e-6)
    assert found.helix is not None
    assert np.degrees(found.helix) == pytest.approx(-60.0)


def test_angles_are_means_by_length_and_neither_sense_nor_a_right_angle_breaks_them() -> None:
    # Angles of lines have no beginning: 88 and 94 degrees are six apart, and their mean is no level line.
    found = fibre_angles(PLATE, _paths(PLATE, (88.0, 5.0), (94.0, 10.0)), _lines(90.0, axes=True))
    assert np.degrees(found.off) == pytest.approx((2.0 * 5.0 + 4.0 * 10.0) / 15.0)
    assert np.degrees(found.most_off) == pytest.approx(4.0)
    assert found.helix is not None
    assert found.spread is not None
    assert np.degrees(found.helix) % 180.0 == pytest.approx(92.0)
    assert np.degrees(found.spread[1] - found.spread[0]) == pytest.approx(6.0)


def test_lines_without_an_axis_have_no_helix_angle() -> None:
    found = fibre_angles(PLATE, _paths(PLATE, (30.0, 8.0)), _lines(20.0, axes=False))
    assert np.degrees(found.off) == pytest.approx(10.0)
    assert found.helix is None
    assert found.spread is None
