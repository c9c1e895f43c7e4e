"""A scan that is taken 5 degrees and 10 mm from where it is thought to be is laid onto its part; others are refused."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError, UsageError
from geoprint.inspection.scan_registration import registered
from geoprint.simulation import Faults
from tests.inspection.prints import DEPOSIT, PLATE, pose, scan_of

# 10 mm and 5 degrees.
STANDS = pose(turn=(0.05, -0.05, 0.05), shift=(6.0, -6.0, 5.2))


def test_without_open3d_it_is_said_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(name: str) -> None:
        assert name == "open3d"

    monkeypatch.setattr(importlib.util, "find_spec", nothing)
    with pytest.raises(UsageError, match=r"needs the package open3d.*\[scan\]"):
        registered(np.zeros((300, 3)), PLATE, None, start=np.eye(4))


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
def test_a_scan_10_mm_and_5_degrees_off_is_found_with_volume_width_and_offset_of_its_beads() -> None:
    scan = scan_of(Faults(flow=1.2, offset=0.15), T_work_scan=STANDS, noise=0.05, missing=0.3)
    points = scan.points[::2]
    found = registered(points, PLATE, DEPOSIT, start=np.eye(4))
    left = found.T_work_scan @ transforms.inverse(STANDS)
    shift = transforms.apply(left, found.middle[None])[0] - found.middle
    assert np.linalg.norm(shift) < 0.05
    assert np.degrees(Rotation.from_matrix(left[:3, :3]).magnitude()) < 0.1
    assert found.level == pytest.approx(1.2, abs=0.03)
    assert found.spread == pytest.approx(1.2**0.5, abs=0.03)
    assert found.offset == pytest.approx(0.15, abs=0.03)
    assert found.shift_deviation < 0.05
    assert np.degrees(found.turn_deviation) < 0.1
    assert not found.scaled
    again = registered(points, PLATE, DEPOSIT, start=np.eye(4))
    assert np.array_equal(again.T_work_scan, found.T_work_scan)


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
@pytest.mark.parametrize("larger", [1.02, 0.996])
def test_a_scan_that_is_not_true_to_scale_is_laid_with_its_scale(larger: float) -> None:
    scan = scan_of(Faults(flow=1.2, offset=0.15), T_work_scan=STANDS, noise=0.05, missing=0.3)
    found = registered(larger * scan.points[::2], PLATE, DEPOSIT, start=np.eye(4))
    assert found.scale == pytest.approx(1.0 / larger, abs=3.0 * found.scale_deviation)
    assert 0.0 < found.scale_deviation < 0.001
    assert np.cbrt(np.linalg.det(found.T_work_scan[:3, :3])) == pytest.approx(found.scale, rel=1e-9)
    assert found.level == pytest.approx(1.2, abs=0.03)


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
def test_a_scan_is_not_scaled_by_more_than_a_scanner_errs() -> None:
    scan = scan_of(Faults(), noise=0.03)
    with pytest.raises(InputError, match=r"fits plate.* only when scaled by .*at most 3 %"):
        registered(1.05 * scan.points[::2], PLATE, DEPOSIT, start=np.eye(4))


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
def test_a_scan_of_something_else_is_refused() -> None:
    points = np.random.default_rng(1).uniform(-30.0, 30.0, (500, 3))
    with pytest.raises(InputError, match=r"`scan` (does not match|is .* mm off) "):
        registered(points, PLATE, DEPOSIT, start=np.eye(4))
