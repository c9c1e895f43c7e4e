"""The jerk of the tip over 10 ms, whenever the rows begin and however many of them lay material."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.model import Trajectory
from geoprint.robot.timing import joints_at, largest_jerk
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arm_of, line, solved, stream

ARM = arm_of(bent_cell())
PATH = solved(stream(line((0.0, 0.0, 0.0), (20.0, 0.0, 0.0), count=161)), ARM)


def jerk(rows: int, *, begin: float = 0.0, apart: float = 1e-3) -> float:
    """Return the jerk of a tip with 2000 m/s3 that lays material over so many of its rows."""
    moments = apart * np.arange(100.0)
    places = 1.0 + 1e3 * 2000.0 * moments**3 / 6.0
    deposited = np.zeros(100, dtype=np.bool_)
    deposited[:rows] = True
    joints = joints_at(PATH.poses.tips[:, 0], PATH.joints, places)
    made = Trajectory(
        times=begin + moments, joints=joints, runs=np.zeros(100, dtype=np.int64), deposit=deposited,
        pose_times=np.zeros(161), stretched=0, slowest_deposit=0.0, slowdowns=(), share_at_speed=0.0,
        share_on_ramps=0.0,
    )  # fmt: skip
    return largest_jerk(made, ARM, T_base_work=PATH.T_base_work)


def test_jerk_is_told_from_four_places_10_ms_apart_that_are_all_laid() -> None:
    assert jerk(30) == 0.0
    assert jerk(31) == pytest.approx(2000.0, rel=0.05)


@pytest.mark.parametrize("begin", [0.5, 30.0])
def test_jerk_does_not_depend_on_when_the_rows_begin(begin: float) -> None:
    assert jerk(31, begin=begin) == pytest.approx(2000.0, rel=0.05)
    assert jerk(30, begin=begin) == 0.0


def test_rows_half_as_far_apart_are_looked_at_over_the_same_time() -> None:
    assert jerk(60, apart=5e-4) == 0.0
    assert jerk(61, apart=5e-4) == pytest.approx(2000.0, rel=0.05)
