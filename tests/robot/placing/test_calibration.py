"""How well touched points place a part: what the uncertainty promises, measured on random trials."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.model import FloatArray, TouchedPoints
from geoprint.robot.placing.calibration import (
    FixtureCalibration,
    calibrate_fixture,
    next_touch,
    normal_uncertainty,
    position_uncertainty,
    refuse_uncertain,
    turn_uncertainty,
)

# The paper's pedestal, and where its corners are touched.
CORNERS = np.array([[-50.0, 50.0, 0.0], [50.0, 50.0, 0.0], [50.0, -50.0, 0.0], [-50.0, -50.0, 0.0]])
TOUCHED = np.array([[250.0, 50.0, 0.0], [350.0, 50.0, 0.0], [350.0, -50.0, 0.0], [250.0, -50.0, 0.0]])
TRUTH = transforms.rigid(np.eye(3), np.array([300.0, 0.0, 0.0]))
NOISE = 0.2
TRIALS = 400
# Of 400 trials with a chance of 0.95, all but one in eighty such counts lie within these, 2.5 standard deviations off.
LEAST, MOST = 0.923, 0.977


def calibrated(touched: FloatArray, *, noise: float | None = None) -> FixtureCalibration:
    return calibrate_fixture(TouchedPoints(CORNERS, touched, T_fixture_work=np.eye(4), noise=noise))


@dataclass(frozen=True)
class Trials:
    """Shares of trials in which the true transform was where the calibration said."""

    transform: float
    corner: float
    normal: float
    turn: float
    odd: float
    normal_of_known_noise: float


@cache
def trials(*, noise: float | None) -> Trials:
    generator = np.random.default_rng(8)
    kept = np.zeros((TRIALS, 6))
    for trial in range(TRIALS):
        found = calibrated(TOUCHED + generator.normal(0.0, NOISE, (4, 3)), noise=noise)
        T_fit = found.placement.T_base_fixture
        error = TRUTH @ transforms.inverse(T_fit)
        turn = Rotation.from_matrix(error[:3, :3]).as_rotvec()
        shift = transforms.apply(error, found.centre[None])[0] - found.centre
        both = np.concatenate([shift, turn])
        corner = position_uncertainty(found, transforms.apply(T_fit, CORNERS))
        corner_error = transforms.apply(error, corner.place[None])[0] - corner.place
        middle = transforms.apply(T_fit, np.array([[20.0, 10.0, 5.0]]))
        normal = normal_uncertainty(found, middle, normals=np.array([[0.0, 0.6, 0.8]]))
        normal_error = (transforms.apply(error, middle) - middle)[0] @ normal.direction
        kept[trial] = (
            np.sqrt(both @ np.linalg.solve(found.covariance, both)) <= found.statistics.noise.factor(6.0),
            np.linalg.norm(corner_error) <= corner.bound,
            abs(normal_error) <= normal.bound,
            np.linalg.norm(turn) <= turn_uncertainty(found).bound,
            bool(found.statistics.odd),
            abs(normal_error) <= 1.96 * normal.deviation,
        )
    return Trials(*kept.mean(axis=0).tolist())


@pytest.mark.parametrize("noise", [None, NOISE], ids=["estimated", "given"])
def test_the_paper_s_corners_with_noise_give_the_transform_within_the_stated_uncertainty_in_95_of_100_trials(
    noise: float | None,
) -> None:
    found = trials(noise=noise)
    for share in (found.transform, found.corner, found.normal, found.turn):
        assert LEAST <= share <= MOST, found
    # Good touches are called odd in fewer than one of a hundred calibrations; 0.02 is three deviations above that.
    assert found.odd < 0.02, found


def test_a_bound_that_forgets_how_few_points_tell_the_noise_would_fail_these_trials() -> None:
    # The same trials with the factor of a known noise: the quantiles of Student and Fisher are what makes the share.
    assert trials(noise=None).normal_of_known_noise < LEAST


def test_the_uncertainty_of_a_square_is_what_the_formula_says() -> None:
    found = calibrated(TOUCHED, noise=NOISE)
    # The middle is the mean of four touches; a corner's height adds two turns by a / (2 a) each.
    middle = position_uncertainty(found, TRUTH[None, :3, 3])
    assert middle.deviation == pytest.approx(NOISE / 2.0)
    corner = position_uncertainty(found, TOUCHED)
    assert corner.deviation == pytest.approx(NOISE * np.sqrt(0.75))
    np.testing.assert_allclose(np.abs(corner.direction), [0.0, 0.0, 1.0], atol=1e-9)
    # About an axis in the plane four arms of 50 mm hold it, about the normal arms of 71 mm: the plane's are worse.
    turn = turn_uncertainty(found)
    assert turn.deviation == pytest.approx(NOISE / 100.0)
    assert abs(turn.direction[2]) < 1e-6
    np.testing.assert_allclose(np.diag(found.covariance)[3:], NOISE**2 / np.array([1e4, 1e4, 2e4]))


def test_with_a_given_noise_a_bound_is_that_of_the_normal_distribution() -> None:
    found = calibrated(TOUCHED, noise=NOISE)
    up = normal_uncertainty(found, TRUTH[None, :3, 3], normals=np.array([[0.0, 0.0, 1.0]]))
    assert up.bound / up.deviation == pytest.approx(1.959964, abs=1e-5)
    # In the middle all directions are alike: 2.7955 is the 95th percentile of chi with three.
    assert position_uncertainty(found, TRUTH[None, :3, 3]).bound == pytest.approx(2.795483 * NOISE / 2, abs=1e-5)


def test_with_the_noise_of_four_points_a_bound_is_student_s_with_six_degrees_of_freedom() -> None:
    found = calibrated(TOUCHED + np.random.default_rng(0).normal(0.0, NOISE, (4, 3)))
    up = normal_uncertainty(found, TRUTH[None, :3, 3], normals=np.array([[0.0, 0.0, 1.0]]))
    assert up.bound / up.deviation == pytest.approx(2.446912, abs=1e-5)
    noise = found.statistics.noise
    assert noise.deviation == pytest.approx(np.sqrt((found.statistics.residuals**2).sum() / 6.0))
    # 14.4494 and 1.2373 are the 97.5th and 2.5th percentile of chi-square with six.
    np.testing.assert_allclose(
        np.array(noise.interval) / noise.deviation, np.sqrt([6 / 14.4494, 6 / 1.2373]), rtol=1e-4
    )


def test_points_that_fit_perfectly_do_not_claim_more_than_the_arm_repeats() -> None:
    assert calibrated(TOUCHED).statistics.noise.deviation == 0.01
    assert calibrated(TOUCHED).statistics.odd == ()


def test_the_distance_from_the_others_is_that_of_the_fit_without_the_point() -> None:
    found = calibrated(TOUCHED + np.random.default_rng(5).normal(0.0, NOISE, (4, 3)))
    np.testing.assert_allclose(found.statistics.misses, found.placement.misses, rtol=0.01)


def test_one_bad_touch_among_many_is_found_and_no_other() -> None:
    generator = np.random.default_rng(2)
    model = generator.uniform(-50.0, 50.0, (10, 3))
    touched = model + generator.normal(0.0, 0.05, (10, 3))
    touched[6, 1] += 1.5
    for noise in (None, 0.05):
        found = calibrate_fixture(TouchedPoints(model, touched, np.eye(4), noise=noise))
        assert found.statistics.odd == (6,)
    assert found.statistics.excess is not None
    assert found.statistics.excess < 1e-6


def test_a_warp_of_a_square_may_be_any_of_its_corners() -> None:
    touched = TOUCHED + np.random.default_rng(1).normal(0.0, 0.01, (4, 3))
    touched[0, 2] += 1.0
    assert sorted(calibrated(touched).statistics.odd) == [0, 1, 2, 3]


def test_a_noise_that_the_residuals_contradict_is_not_believed() -> None:
    touched = TOUCHED + np.random.default_rng(1).normal(0.0, NOISE, (4, 3))
    stated, estimated = (calibrated(touched, noise=noise).statistics.noise for noise in (NOISE / 5.0, None))
    assert stated == estimated
    assert not stated.given


def test_residuals_as_large_as_the_noise_given_are_no_excess() -> None:
    touched = TOUCHED + np.random.default_rng(1).normal(0.0, NOISE, (4, 3))
    excess = calibrated(touched, noise=NOISE).statistics.excess
    assert excess is not None
    assert excess > 0.05
    assert calibrated(touched).statistics.excess is None


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3),
    st.lists(st.floats(-500.0, 500.0), min_size=3, max_size=3),
)
def test_the_uncertainty_moves_with_the_fixture(turn: list[float], move: list[float]) -> None:
    model = np.array([[0.0, 0.0, 0.0], [80.0, 0.0, 0.0], [0.0, 60.0, 0.0], [10.0, 0.0, 40.0]])
    touched = model + np.random.default_rng(4).normal(0.0, 0.1, (4, 3))
    motion = transforms.rigid(Rotation.from_rotvec(turn).as_matrix(), np.array(move))
    place, normal = np.array([[30.0, 90.0, 10.0]]), np.array([[0.0, 0.6, 0.8]])
    here = calibrate_fixture(TouchedPoints(model, touched, np.eye(4)))
    there = calibrate_fixture(TouchedPoints(model, transforms.apply(motion, touched), np.eye(4)))
    moved, turned = transforms.apply(motion, place), normal @ motion[:3, :3].T
    assert position_uncertainty(there, moved).bound == pytest.approx(position_uncertainty(here, place).bound, rel=1e-6)
    wanted = normal_uncertainty(here, place, normals=normal).bound
    assert normal_uncertainty(there, moved, normals=turned).bound == pytest.approx(wanted, rel=1e-6)


def test_the_next_touch_is_the_one_that_a_new_calibration_confirms() -> None:
    candidates = np.array([[300.0, 0.0, 0.0], [380.0, 60.0, 0.0], [320.0, 20.0, 40.0], [250.0, 50.0, 0.0]])
    at = np.array([[380.0, 60.0, 20.0]])
    before = calibrated(TOUCHED, noise=NOISE)
    candidate, deviation, _ = next_touch(before, candidates, places=at)
    left: list[float] = []
    for each in candidates:
        model = np.vstack([CORNERS, each - TRUTH[:3, 3]])
        after = calibrate_fixture(TouchedPoints(model, np.vstack([TOUCHED, each]), np.eye(4), noise=NOISE))
        left.append(position_uncertainty(after, at).deviation)
    assert candidate == int(np.argmin(left)) == 1
    assert deviation == pytest.approx(left[1])
    assert deviation < position_uncertainty(before, at).deviation


def test_a_part_known_worse_than_the_stand_off_is_refused_with_both_figures() -> None:
    found = calibrated(TOUCHED, noise=NOISE)
    up = normal_uncertainty(found, TRUTH[None, :3, 3], normals=np.array([[0.0, 0.0, 1.0]]))
    refuse_uncertain(up, standoff=0.2, part="plate")
    with pytest.raises(ClearanceError, match=r"plate uncertain: 0\.20 mm .*allowed are 0\.19 mm"):
        refuse_uncertain(up, standoff=0.19, part="plate")
