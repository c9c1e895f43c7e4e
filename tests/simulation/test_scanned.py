"""A simulated print as a scanner sees it: no volume is lost, faults are as put in, noise and holes as asked for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import KDTree

from geoprint.errors import InputError
from geoprint.model import FloatArray
from geoprint.simulation import Break, DepositedBeads, Faults, Sensor, deposited_beads, heights, looking_at, scanned
from tests.inspection.drawn import rows_on_plate, stream
from tests.meshes import plate

SPACING, HEIGHT = 4.0, 0.5
PLATE = plate((40.0, 30.0), (20, 15))
POSES = stream(rows_on_plate(), flow=SPACING * HEIGHT)
VIEW = looking_at(np.array([20.0, 15.0, 0.0]), place=np.array([20.0, 15.0, 300.0]), focal=900.0, size=(160, 130))


def deposited(faults: Faults) -> DepositedBeads:
    return deposited_beads(POSES, PLATE, height=HEIGHT, faults=faults, random=np.random.default_rng(3))


def grid(step: float) -> FloatArray:
    x, y = np.meshgrid(np.arange(-5.0, 45.0, step), np.arange(-5.0, 35.0, step))
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])


@pytest.mark.parametrize(
    ("faults", "share"),
    [
        (Faults(), 1.0),
        (Faults(width_scale=1.4), 1.0),
        (Faults(flow=1.2), 1.2),
        (Faults(viscosity=1.25), 0.8),
        (Faults(lag=3.0), 0.9),
        (Faults(breaks=(Break(2, 10.0, 25.0),)), 1.0 - 0.5 / 6.0),
    ],
)
def test_the_height_field_holds_the_volume_that_was_laid(faults: Faults, share: float) -> None:
    volume = float(heights(deposited(faults), grid(0.1)).sum()) * 0.1**2
    assert volume == pytest.approx(share * 6 * 30.0 * SPACING * HEIGHT, rel=0.01)


def test_a_bead_is_a_parabola_across() -> None:
    away = np.linspace(0.0, 1.9, 20)
    feet = np.column_stack([np.full(20, 20.0), 5.0 - away, np.zeros(20)])
    crest = 1.5 * SPACING * HEIGHT / SPACING
    assert heights(deposited(Faults()), feet) == pytest.approx(crest * (1.0 - (away / 2.0) ** 2), abs=0.01 * crest)


def test_a_scan_shows_the_part_at_the_pose_it_was_taken_from() -> None:
    T_work_scan = np.eye(4)
    T_work_scan[:3, 3] = [3.0, -2.0, 7.0]
    scan = scanned(PLATE, deposited(Faults()), Sensor(VIEW), T_work_scan=T_work_scan, random=np.random.default_rng(1))
    assert scan.points + T_work_scan[:3, 3] == pytest.approx(scan.feet + [[0.0, 0.0, 1.0]] * scan.heights[:, None])
    assert scan.heights == pytest.approx(heights(deposited(Faults()), scan.feet))
    bare = scanned(PLATE, None, Sensor(VIEW), T_work_scan=np.eye(4), random=np.random.default_rng(1))
    assert np.abs(bare.points[:, 2]).max() < 1e-9


def test_noise_and_holes_are_as_large_as_asked_for() -> None:
    sensor = Sensor(VIEW, noise=0.05, missing=0.3, patch=2.0)
    whole = scanned(PLATE, None, Sensor(VIEW), T_work_scan=np.eye(4), random=np.random.default_rng(1))
    scan = scanned(PLATE, None, sensor, T_work_scan=np.eye(4), random=np.random.default_rng(1))
    assert len(scan.points) == pytest.approx(0.7 * len(whole.points), abs=1.0)
    assert scan.points[:, 2].std() == pytest.approx(0.05, rel=0.1)
    # Holes are patches, not single points: most places that are lost have lost neighbours.
    away, _ = KDTree(scan.feet).query(whole.feet)
    lost = whole.feet[away > 0.0]
    near = KDTree(lost).query_ball_point(lost, 0.6, return_length=True)
    assert (near >= 3).mean() > 0.9


@pytest.mark.parametrize("wrong", [{"noise": -0.1}, {"missing": 1.0}, {"patch": 0.0}])
def test_a_sensor_that_cannot_be_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match="a sensor has no negative noise"):
        Sensor(VIEW, **wrong)


@pytest.mark.parametrize(("flow", "viscosity", "lag"), [(0.0, 1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, -0.1)])
def test_a_print_that_cannot_be_is_refused(flow: float, viscosity: float, lag: float) -> None:
    with pytest.raises(InputError, match="a print has a positive flow and viscosity"):
        Faults(flow=flow, viscosity=viscosity, lag=lag)


def test_a_sensor_that_looks_away_is_refused() -> None:
    away = looking_at(np.array([20.0, 15.0, 600.0]), place=np.array([20.0, 15.0, 300.0]), focal=900.0, size=(20, 20))
    with pytest.raises(InputError, match="the sensor does not see"):
        scanned(PLATE, None, Sensor(away), T_work_scan=np.eye(4), random=np.random.default_rng(1))
