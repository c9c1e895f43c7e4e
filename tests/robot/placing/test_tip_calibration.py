"""The tool centre point from poses about one fixed point."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError
from geoprint.model import FloatArray
from geoprint.robot.placing.calibration import calibrate_tip

TIP = np.array([84.9, 0.3, 124.7])
POINT = np.array([350.0, 20.0, 100.0])
NOISE = 0.1


def poses(turns: Rotation, *, noise: FloatArray | None = None) -> FloatArray:
    """Flange poses that hold the tip at the point, each touched a little off."""
    rotations = (Rotation.from_euler("y", 180, degrees=True) * turns).as_matrix()
    off = np.zeros((len(rotations), 3)) if noise is None else noise
    return transforms.rigid(rotations, POINT + off - rotations @ TIP)


def tilted(degrees: float, count: int = 4) -> Rotation:
    """One upright pose and others tilted from it, evenly about it."""
    about = np.linspace(0.0, 2.0 * np.pi, count - 1, endpoint=False)
    axes = np.column_stack([np.cos(about), np.sin(about), np.zeros(count - 1)])
    return Rotation.from_rotvec(np.vstack([np.zeros((1, 3)), np.radians(degrees) * axes]))


def test_exact_poses_give_the_tip_and_the_point() -> None:
    found = calibrate_tip(poses(tilted(30.0)))
    np.testing.assert_allclose(found.tip, TIP, atol=1e-9)
    np.testing.assert_allclose(found.touched, POINT, atol=1e-9)


@pytest.mark.parametrize("noise", [None, NOISE], ids=["estimated", "given"])
def test_the_tip_lies_within_the_stated_bound_in_95_of_100_trials(noise: float | None) -> None:
    generator = np.random.default_rng(6)
    within = 0
    for _ in range(400):
        found = calibrate_tip(poses(tilted(40.0, 5), noise=generator.normal(0.0, NOISE, (5, 3))), noise=noise)
        within += np.linalg.norm(found.tip - TIP) <= found.bound
    assert 0.923 <= within / 400 <= 0.977


def test_the_tip_is_known_least_along_the_direction_that_swings_least() -> None:
    found = calibrate_tip(poses(tilted(30.0)), noise=NOISE)
    # Tilted about axes in its xy plane, the flange's x and y swing half as much as its z; lengths of their means:
    cosine = np.cos(np.radians(30.0))
    z, x = (1.0 + 3.0 * cosine) / 4.0, (1.0 + 3.0 * (1.0 + cosine) / 2.0) / 4.0
    assert abs(found.direction[2]) < 1e-9
    assert found.deviation == pytest.approx(NOISE / np.sqrt(4.0 * (1.0 - x**2)))
    assert found.statistics.cofactor[2, 2] == pytest.approx(1.0 / (4.0 * (1.0 - z**2)))


@pytest.mark.parametrize("count", [0, 1, 3])
def test_fewer_than_four_poses_are_refused(count: int) -> None:
    with pytest.raises(InputError, match=f"in {count} poses?; at least 4"):
        calibrate_tip(poses(tilted(30.0))[:count])


@pytest.mark.parametrize(
    ("turns", "along"),
    [
        (Rotation.from_euler("z", [[0], [60], [120], [200]], degrees=True), r"\(-?0\.00, -?0\.00, -?1\.00\)"),
        (Rotation.from_euler("y", [[-40], [-10], [10], [40]], degrees=True), r"\(-?0\.00, -?1\.00, -?0\.00\)"),
        (Rotation.from_euler("z", [[0], [0], [0], [0]]), "of the flange"),
        (tilted(4.0), "needed are 6"),
    ],
    ids=["turned about the nozzle alone", "tilted about one axis", "not turned", "hardly tilted"],
)
def test_orientations_that_do_not_determine_the_tip_are_refused_with_the_open_direction(
    turns: Rotation, along: str
) -> None:
    with pytest.raises(InputError, match=f"do not fix the tip along .*{along}"):
        calibrate_tip(poses(turns))


def test_a_pose_in_which_the_tip_was_elsewhere_is_refused_by_its_number() -> None:
    off = np.zeros((6, 3))
    off[3] = [0.0, 5.0, 0.0]
    with pytest.raises(InputError, match=r"pose 4 of 6 has the tip .* allowed are 2 mm"):
        calibrate_tip(poses(tilted(40.0, 6), noise=off))


def test_a_pose_that_is_off_by_less_is_found_odd() -> None:
    off = np.random.default_rng(0).normal(0.0, 0.03, (8, 3))
    off[3, 1] += 1.0
    assert calibrate_tip(poses(tilted(40.0, 8), noise=off)).statistics.odd == (3,)
