"""The measure of uniformity against paths whose spacing is known."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import FieldError
from geoprint.export import poses_table
from geoprint.model import FloatArray, PoseStream, Surface
from geoprint.quality import uniformity
from tests.meshes import plate
from tests.shared_data import shared


def straight_runs(heights: list[float], *, length: float = 40.0, wobble: float = 0.0) -> PoseStream:
    """Return level runs along x on the plane z = 0; `wobble` is an amplitude [mm] of every second run."""
    x = np.linspace(0.0, length, 401)
    lines = [
        np.column_stack([x, np.full(401, y) + (k % 2) * wobble * np.sin(x), np.zeros(401)])
        for k, y in enumerate(heights)
    ]
    points: FloatArray = np.concatenate(lines)
    count = len(points)
    runs = np.repeat(np.arange(len(heights)), 401)
    return PoseStream(
        tips=points + np.array([0.0, 0.0, 0.3]),
        quaternions=np.tile([0.0, 1.0, 0.0, 0.0], (count, 1)),
        normals=np.tile([0.0, 0.0, 1.0], (count, 1)),
        runs=runs,
        levels=runs,
        layers=np.zeros(count, dtype=np.int64),
        deposit=np.ones(count, dtype=np.bool_),
        stops=np.zeros(count, dtype=np.bool_),
        arcs=np.tile(x, len(heights)),
        flow=np.ones(count),
        standoff=0.3,
    )


def fine_plate() -> Surface:
    return plate((40.0, 30.0), (160, 120))


def test_even_lines_are_one_spacing_apart_everywhere() -> None:
    found = uniformity(straight_runs([1.0, 3.0, 5.0, 7.0]), fine_plate(), spacing=2.0)
    np.testing.assert_allclose(found.ratios, 1.0, atol=1e-9)
    assert found.cv == pytest.approx(0.0, abs=1e-9)
    assert found.within_5_percent == 1.0
    assert found.length == pytest.approx(160.0)
    assert found.fill == pytest.approx(160.0 * 2.0 / 1200.0)


def test_a_line_displaced_by_a_tenth_is_reported_as_a_tenth() -> None:
    found = uniformity(straight_runs([1.0, 3.2, 5.2]), fine_plate(), spacing=2.0)
    assert sorted(set(found.ratios.round(9).tolist())) == [1.0, 1.1]
    assert found.mean == pytest.approx(1.05, abs=1e-3)
    assert found.cv == pytest.approx(0.05 / 1.05, rel=1e-2)


def test_the_uncovered_area_is_the_strip_that_no_run_reaches() -> None:
    heights = [1.0 + 2.0 * k for k in range(10)]  # covers 0 ... 20.1 of 30 mm
    found = uniformity(straight_runs(heights), fine_plate(), spacing=2.0)
    assert found.uncovered == pytest.approx((30.0 - 20.1) / 30.0, abs=0.01)


def test_offsets_cut_the_samples_into_runs() -> None:
    found = uniformity(straight_runs([1.0, 3.0, 5.0]), fine_plate(), spacing=2.0)
    assert found.offsets[0] == 0
    assert found.offsets[-1] == len(found.places)
    pieces = np.split(found.places, found.offsets[1:-1])
    assert [float(piece[0, 1]) for piece in pieces] == [3.0, 5.0]


def test_one_level_has_no_spacing_to_measure() -> None:
    with pytest.raises(FieldError, match="two levels"):
        uniformity(straight_runs([1.0]), fine_plate(), spacing=2.0)


def test_the_check_from_outside_agrees(tmp_path: Path) -> None:
    check = shared("patches").parents[1] / "checks" / "spacing.py"
    stream = straight_runs([1.0, 3.1, 5.0, 7.0], wobble=0.15)
    (tmp_path / "poses.csv").write_bytes(poses_table(stream))
    command = [sys.executable, str(check), str(tmp_path), "--spacing", "2.0", "--json"]
    outside = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    inside = uniformity(stream, fine_plate(), spacing=2.0)
    assert inside.mean == pytest.approx(outside["mean"], abs=1e-4)
    assert inside.cv == pytest.approx(outside["cv"], abs=1e-4)
