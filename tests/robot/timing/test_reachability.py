"""The largest reachable speeds: known profiles, linear programs by another solver, toppra, and where there are none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from geoprint.errors import UsageError
from geoprint.model import FloatArray, Robot
from geoprint.robot.timing import confirmation
from geoprint.robot.timing.knots import Knots, path_knots
from geoprint.robot.timing.reachability import Problem, reachable_speeds
from geoprint.robot.timing.slowdown import _Profile, off_ramps  # pyright: ignore[reportPrivateUsage]
from geoprint.robot.timing.topp import Motion, _refined, _times, fastest_motion  # pyright: ignore[reportPrivateUsage]
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arm_of, solved, stream
from tests.robot.timing.test_slowdown import COUNT, LENGTH, PROCESS, ROBOT, made, timed


def straight(*, acceleration: float, ceiling: float, points: int = 101) -> Problem:
    """Return one quantity that is the path's own acceleration, over a length of 1, from rest to rest."""
    return Problem(
        np.ones((points, 1)), np.zeros((points, 1)), np.array([acceleration]), np.linspace(0.0, 1.0, points),
        np.full(points, ceiling), 0.0, 0.0,
    )  # fmt: skip


def winding(seed: int, *, points: int, joints: int = 4) -> Problem:
    """Return joints along a random smooth path."""
    rng = np.random.default_rng(seed)
    grid = np.sort(rng.uniform(0.0, 1.0, points))
    turns = rng.uniform(1.0, 8.0, joints)
    pull, square = np.cos(np.outer(grid, turns)), -turns * np.sin(np.outer(grid, turns))
    # A joint that stands still somewhere bounds the speed there alone, whatever the acceleration is.
    pull[points // 2, 0] = 0.0
    return Problem(pull, square, rng.uniform(0.5, 2.0, joints), grid, rng.uniform(0.3, 1.0, points), 0.0, 0.0)


def by_linear_programs(problem: Problem) -> FloatArray:
    """Return the largest speed at one point after the other, those before it kept, if all bands can be kept."""
    count, steps = problem.grid.size, np.diff(problem.grid)
    bands = np.zeros((count - 1, problem.bounds.size, count))
    for i, step in enumerate(steps):
        bands[i, :, i + 1] = problem.pull[i] / (2.0 * step)
        bands[i, :, i] = problem.square[i] - bands[i, :, i + 1]
    rows = bands.reshape(-1, count)
    bounds = np.tile(problem.bounds, 2 * (count - 1))
    lows, highs = np.zeros(count), problem.highest**2
    lows[[0, -1]] = highs[[0, -1]] = problem.start**2, problem.end**2
    for i in range(1, count - 1):
        ends = list(zip(lows.tolist(), highs.tolist(), strict=True))
        most = linprog(-np.eye(count)[i], np.vstack([rows, -rows]), bounds, bounds=ends).x
        assert most is not None
        lows[i], highs[i] = most[i] * (1.0 - 1e-9), most[i]
    return np.sqrt(highs)


def test_along_a_straight_line_speed_rises_and_falls_at_the_largest_acceleration() -> None:
    problem = straight(acceleration=2.0, ceiling=1.0)
    speeds = reachable_speeds(problem)
    rising = np.sqrt(2.0 * 2.0 * np.minimum(problem.grid, 1.0 - problem.grid))
    assert speeds is not None
    np.testing.assert_allclose(speeds, np.minimum(rising, 1.0), atol=1e-12)


@pytest.mark.parametrize("seed", range(30))
def test_they_are_those_of_linear_programs_over_the_whole_path(seed: int) -> None:
    problem = winding(seed, points=8)
    asked, found = by_linear_programs(problem), reachable_speeds(problem)
    assert found is not None
    # Through a narrow place the speed is a share of its ceiling, where none is left.
    np.testing.assert_allclose(found**2, asked**2, atol=2e-8)


@pytest.mark.parametrize("seed", range(30))
def test_toppra_confirms_them_and_refuses_faster_ones(seed: int) -> None:
    pytest.importorskip("toppra")
    problem = winding(seed, points=200)
    found = reachable_speeds(problem)
    assert found is not None
    confirmation.confirm(problem, found)
    slower = confirmation._speeds_of_toppra(problem)  # pyright: ignore[reportPrivateUsage]
    assert slower is not None
    np.testing.assert_allclose(found, slower, atol=1e-3)
    with pytest.raises(confirmation.VerificationError, match="Please report it"):
        confirmation.confirm(problem, 1.05 * found)


def test_a_start_that_cannot_be_held_is_lowered_and_an_end_that_cannot_be_reached_is_none() -> None:
    problem = straight(acceleration=0.5, ceiling=2.0)
    lowered = reachable_speeds(replace(problem, start=2.0))
    assert lowered is not None
    assert lowered[0] == pytest.approx(1.0)
    assert reachable_speeds(replace(problem, end=1.5)) is None


def test_a_bend_that_no_speed_passes_is_none() -> None:
    problem = straight(acceleration=1.0, ceiling=1.0)
    square = np.zeros((101, 1))
    square[50] = 1e12
    found = reachable_speeds(replace(problem, square=square))
    assert found is not None
    assert found[50] < 1e-5


def test_a_toppra_that_cannot_be_imported_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: str) -> None:
        raise ImportError("libseidel is missing")

    monkeypatch.delitem(confirmation.sys.modules, "toppra", raising=False)
    monkeypatch.setattr(confirmation, "import_module", broken)
    problem = straight(acceleration=1.0, ceiling=1.0)
    with pytest.raises(UsageError, match="cannot be imported \\(libseidel is missing\\)\\. Run 'pip install"):
        confirmation.confirm(problem, problem.highest)


# Slowdowns at their bounds: 1 % of the speed, two ideal ramps at a stop, and where deposit begins along a leg.


def turning(share: float) -> FloatArray:
    """Return angles of joint 6 at which it holds a share of 60 mm/s [rad]."""
    rate = ROBOT.speeds[5] / (60.0 * share)
    return rate * np.linspace(-LENGTH / 2.0, LENGTH / 2.0, COUNT) - ROBOT.home[5]


def test_a_dip_below_99_percent_is_listed_with_its_place_and_one_above_is_not() -> None:
    assert timed(made(turning(0.993)), speed=60.0).slowdowns == ()
    (dip,) = timed(made(turning(0.985)), speed=60.0).slowdowns
    assert dip.held_speed == pytest.approx(0.985 * 60.0, rel=1e-3)


def test_twice_the_ideal_ramp_at_each_stop_is_no_dip_and_neither_is_the_first_or_the_last_step() -> None:
    grid = np.arange(11.0)
    assert np.flatnonzero(off_ramps(grid, ramps=(1.0, 1.5))).tolist() == [2, 3, 4, 5, 6]
    assert np.flatnonzero(off_ramps(grid, ramps=(0.0, 0.0))).tolist() == [1, 2, 3, 4, 5, 6, 7, 8]
    assert not off_ramps(grid, ramps=(3.0, 3.0)).any()


def test_what_is_laid_along_a_leg_begins_where_the_deposit_does_and_lies_where_the_tip_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Half of a straight leg of 40 mm in unequal steps is laid, without a stop where depositing begins."""
    caught: list[_Profile] = []
    of = _Profile.of

    def noted(knots: Knots, first: int, last: int, motion: Motion, *, robot: Robot, set_speed: float) -> _Profile:
        caught.append(of(knots, first, last, motion, robot=robot, set_speed=set_speed))
        return caught[-1]

    monkeypatch.setattr(_Profile, "of", noted)
    x = np.concatenate([np.linspace(-20.0, 0.0, 41)[:-1], np.linspace(0.0, 20.0, 26)])
    tips = np.column_stack([x, np.zeros_like(x), np.zeros_like(x)])
    path = solved(stream(tips, deposit=np.arange(len(x)) >= 40), arm_of(bent_cell()))

    timed(path)

    (profile,) = caught
    assert profile.lengths.sum() == pytest.approx(20.0, abs=1e-6)
    assert profile.tips[0, 0] == pytest.approx(0.0, abs=1e-6)
    assert profile.tips[:, 0].max() < 20.0
    assert profile.arcs[0] == pytest.approx(20.0, abs=1e-6)
    np.testing.assert_allclose(np.diff(profile.tips[:, 0]), profile.lengths[:-1], atol=1e-6)
    np.testing.assert_allclose(profile.wanted, 20.0)


@pytest.mark.parametrize(("broken", "quartered"), [(0, (0, 1)), (2, (1, 2, 3)), (5, (4, 5))])
def test_a_broken_step_is_quartered_with_its_neighbours_and_no_others(broken: int, quartered: tuple[int, ...]) -> None:
    grid = np.array([0.0, 1.0, 3.0, 4.0, 5.0, 7.0, 8.0])
    flags = np.zeros(6, dtype=np.bool_)
    flags[broken] = True
    cuts = [grid[step] + share * (grid[step + 1] - grid[step]) for step in quartered for share in (0.25, 0.5, 0.75)]
    np.testing.assert_allclose(_refined(grid, flags), np.sort(np.append(grid, cuts)))


def test_a_step_takes_its_length_by_the_mean_of_the_speeds_at_its_ends() -> None:
    times = _times(np.array([0.0, 1.0, 4.0]), np.array([0.0, 2.0, 4.0]))
    np.testing.assert_allclose(times, [0.0, 1.0, 2.0])


def profile(*speeds: tuple[float, float]) -> _Profile:
    """Return steps of 2 mm on a leg that does not matter, all off the ramps."""
    count = len(speeds)
    path = made(np.zeros(COUNT))
    knots = path_knots(path, process=PROCESS)
    motion = fastest_motion(knots.joints, knots.lengths, ceilings=knots.ceilings, robot=ROBOT)
    return _Profile(
        motion=motion, rows=np.arange(count), run=0, lengths=np.full(count, 2.0), speeds=np.array(speeds).T,
        wanted=np.full(count, 20.0), inner=np.ones(count, dtype=np.bool_), tips=np.zeros((count, 3)),
        arcs=2.0 * np.arange(float(count)),
    )  # fmt: skip


def test_speed_is_counted_by_its_square_along_a_step() -> None:
    """From 10 to 20 mm/s at one acceleration: 15 mm/s after 125 of 300, both ways; at one speed it is all or none."""
    steps = profile((10.0, 20.0), (20.0, 10.0), (15.0, 15.0), (14.9, 14.9), (16.0, 18.0), (10.0, 14.0))
    np.testing.assert_allclose(steps.above(15.0), [175.0 / 300.0, 175.0 / 300.0, 1.0, 0.0, 1.0, 0.0])
    assert steps.slowest == 10.0


def test_the_speed_of_a_step_alone_is_the_larger_of_its_ends_and_of_more_the_smaller() -> None:
    assert profile((3.0, 8.0)).slowest == 8.0
    assert profile((9.0, 4.0)).slowest == 9.0
    assert profile((9.0, 4.0), (4.0, 9.0)).slowest == 4.0
    assert profile((9.0, 6.0), (6.0, 5.0)).slowest == 5.0
