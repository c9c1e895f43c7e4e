"""The largest reachable speeds: known profiles, linear programs by another solver, toppra, and where there are none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from geoprint.errors import UsageError
from geoprint.model import FloatArray
from geoprint.robot.timing import confirmation
from geoprint.robot.timing.reachability import Problem, reachable_speeds


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
    with pytest.raises(confirmation.VerificationError, match="please report it"):
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
    with pytest.raises(UsageError, match="cannot be imported \\(libseidel is missing\\); run 'pip install"):
        confirmation.confirm(problem, problem.highest)
