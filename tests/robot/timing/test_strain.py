"""What a motion uses of the joints' limits, against polynomials whose extremes are known by formula."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from geoprint.model import FloatArray, Robot
from geoprint.robot.timing.topp import GriddedPath, excess, path_accelerations, strains
from tests.robot.cells import bent_cell

ROBOT: Robot = replace(bent_cell().robot, speeds=np.full(6, 2.0), accelerations=np.full(6, 8.0))


def along(joint: int, cubic: tuple[float, float, float]) -> CubicSpline[np.float64]:
    """Return a path of which one joint is a s + b s^2 + c s^3, and the others rest."""
    a, b, c = cubic
    s = np.linspace(0.0, 1.0, 5)
    joints = np.zeros((5, 6))
    joints[:, joint] = a * s + b * s**2 + c * s**3
    return CubicSpline(s, joints)


def strained(joint: int, cubic: tuple[float, float, float], speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
    path = GriddedPath.of(along(joint, cubic), np.array([0.0, 1.0]))
    rates, changes = np.hsplit(strains(path, speeds, robot=ROBOT), 2)
    assert not np.delete(rates, joint, axis=1).any()
    assert np.delete(changes, joint, axis=1).max() < 1e-6
    return rates[:, joint], changes[:, joint]


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("joint", range(6))
def test_a_joint_that_turns_faster_and_faster_either_way_is_fastest_at_the_end_of_the_step(
    joint: int, sign: float
) -> None:
    # q = s^2 at 1 m/s: 2 rad/s at the end, 2 rad/s2 all along; the other way round at the start.
    rates, changes = strained(joint, (0.0, sign, 0.0), np.ones(2))
    assert rates == pytest.approx([1.0])
    assert changes == pytest.approx([np.sqrt(2.0 / 8.0)])
    rates, _ = strained(joint, (-2.0 * sign, sign, 0.0), np.ones(2))
    assert rates == pytest.approx([1.0])


def test_a_joint_that_is_fastest_within_the_step_is_seen_in_its_middle() -> None:
    # q' = 6 s - 6 s^2 is 1.5 in the middle and 0 at both ends; q'' = 6 - 12 s.
    rates, changes = strained(3, (0.0, 3.0, -2.0), np.full(2, 2.0))
    assert rates == pytest.approx([1.5])
    assert changes == pytest.approx([np.sqrt(6.0 * 4.0 / 8.0)])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_largest_acceleration_within_a_step_is_that_of_the_parabola(sign: float) -> None:
    # From rest to 2 m/s: u = 2, v^2 = 4 s; q' u + q'' v^2 with q' = 3 c s^2 + a and q'' = 6 c s is 2 a + 30 c s^2.
    _, changes = strained(1, (sign, 0.0, 0.0), np.array([0.0, 2.0]))
    assert changes == pytest.approx([np.sqrt(2.0 / 8.0)])
    # q' = 2 b s and q'' = 2 b make 4 b s + 8 b s: 12 b at the end.
    _, changes = strained(1, (0.0, sign, 0.0), np.array([0.0, 2.0]))
    assert changes == pytest.approx([np.sqrt(12.0 / 8.0)])
    # Slowing from 2 to 0 m/s, u = -2 and v^2 = 4 - 4 s: q' = 1 - 2 s and q'' = -2 make 12 s - 10.
    _, changes = strained(1, (sign * 1.0, -sign, 0.0), np.array([2.0, 0.0]))
    assert changes == pytest.approx([np.sqrt(10.0 / 8.0)])


def test_an_extreme_inside_a_step_counts_more_than_its_ends_and_its_middle() -> None:
    # q = 2 s^2 - 2 s^3 with u = 3/2 and v^2 = 1 + 3 s: the vertex of q' u + q'' v^2 lies within the step.
    s = np.linspace(0.0, 1.0, 100_001)
    speeds = np.array([1.0, 2.0])
    slope, bend, square = 4.0 * s - 6.0 * s**2, 4.0 - 12.0 * s, 1.0 + 3.0 * s
    values = (slope * 1.5 + bend * square)[[0, 50_000, -1]]
    parabola = np.polyval(np.polyfit([0.0, 0.5, 1.0], values, 2), s)
    _, changes = strained(4, (0.0, 2.0, -2.0), speeds)
    assert changes == pytest.approx([np.sqrt(np.abs(parabola).max() / 8.0)])


def test_excess_is_the_largest_of_speeds_and_accelerations_step_by_step() -> None:
    path, speeds = GriddedPath.of(along(2, (0.0, 1.0, 0.0)), np.array([0.0, 0.5, 1.0])), np.array([4.0, 4.0, 4.0])
    rates, changes = np.hsplit(strains(path, speeds, robot=ROBOT), 2)
    assert rates[:, 2] == pytest.approx([2.0, 4.0])
    assert changes[:, 2] == pytest.approx([2.0, 2.0])
    assert excess(path, speeds, robot=ROBOT) == pytest.approx([2.0, 4.0])


def test_a_stretch_of_a_path_is_strained_as_it_is_in_the_whole() -> None:
    grid = np.linspace(0.0, 1.0, 9)
    path, speeds = GriddedPath.of(along(5, (1.0, -2.0, 1.5)), grid), np.linspace(0.5, 3.0, 9)
    whole = strains(path, speeds, robot=ROBOT)
    np.testing.assert_array_equal(strains(path.between(2, 6), speeds[2:7], robot=ROBOT), whole[2:6])


def test_path_accelerations_are_half_the_change_of_the_squared_speed_over_the_length() -> None:
    assert path_accelerations(np.array([0.0, 0.5, 2.5]), np.array([1.0, 2.0, 0.0])) == pytest.approx([3.0, -1.0])
