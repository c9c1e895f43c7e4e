"""The volume that a program deposits over what its paths ask for: by time with a valve, by length with an output."""

from __future__ import annotations

import io
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from PIL import Image

from geoprint.model import FloatArray, Signals
from geoprint.reporting import record_plan, switching_figure
from geoprint.reporting.figures import COLOURS
from geoprint.reporting.prints import record_deposited
from geoprint.reporting.records.plan import DepositedRecord
from geoprint.results import Plan, RobotPlan
from tests.meshes import plate
from tests.postprocessor.export_cases import CELL, joint_path, stream
from tests.shared_plans import SharedPlans

# Three circles with radii of 10, 9 and 8 mm, so that their lengths are as these; the cell prints at 20 mm/s.
POSES = stream(runs=3, points=30)
LENGTHS = np.array([10.0, 9.0, 8.0])
FOLLOWING = Signals(mode="analog", dispenser="doValve", uv_lamp="doUV", flow="aoFlow", flow_per_mm3_s=1.0)
ANALOG = replace(CELL, signals=FOLLOWING)


@pytest.fixture(scope="module")
def planned(shared_plans: SharedPlans) -> Plan:
    return shared_plans.plan(plate((12.0, 12.0), (8, 8)), spacing=3.0, place="demo")


def executed(planned: Plan, *, takes: tuple[float, float, float], flows: tuple[float, float] = (0.0, 1.0)) -> RobotPlan:
    """Return a program whose runs take so many times their length over 20 mm/s.

    Material flows in every run from one share of that time to another.
    """
    runs = np.where(POSES.deposited, np.array(takes)[POSES.runs[:-1]], 1.0)
    times: FloatArray = np.append(0.0, np.cumsum(runs * POSES.bead_lengths / 20.0))
    ends = [np.flatnonzero(POSES.deposit & (POSES.runs == run))[[0, -1]] for run in range(3)]
    deposits: FloatArray = times[np.array(ends)]
    material: FloatArray = deposits[:, :1] + np.diff(deposits, axis=1) * np.array(flows)
    (robot,) = planned.robot
    return replace(
        robot,
        joint_path=joint_path(POSES),
        trajectory=replace(robot.trajectory, pose_times=times),
        switching=replace(
            robot.switching, runs=np.arange(3.0), deposits=deposits, material=material, errors=np.zeros((3, 2))
        ),
    )


def shares(record: DepositedRecord | None) -> tuple[float, float, float]:
    """Return what all runs together get, and the runs that get least and most, over the planned volume."""
    assert record is not None
    return record.share, record.least_run, record.most_run


def test_a_run_that_takes_twice_as_long_gets_twice_its_volume_from_a_valve_and_its_own_from_an_output(
    planned: Plan,
) -> None:
    slow = executed(planned, takes=(1.0, 2.0, 1.5))
    whole = LENGTHS @ [1.0, 2.0, 1.5] / LENGTHS.sum()
    assert shares(record_deposited(slow, CELL)) == pytest.approx((whole, 1.0, 2.0), rel=1e-4)
    assert shares(record_deposited(slow, ANALOG)) == pytest.approx((1.0, 1.0, 1.0))


def test_a_valve_is_set_for_the_speed_of_the_print(planned: Plan) -> None:
    as_planned = executed(planned, takes=(1.0, 1.0, 1.0))
    assert shares(record_deposited(as_planned, CELL)) == pytest.approx((1.0, 1.0, 1.0))
    # It prints at 20 mm/s, and its valve lets through what is right at 16.
    assert shares(record_deposited(as_planned, CELL.at_speed(16.0))) == pytest.approx((0.8, 0.8, 0.8))
    assert shares(record_deposited(as_planned, ANALOG.at_speed(16.0))) == pytest.approx((1.0, 1.0, 1.0))


def test_a_run_gets_nothing_while_the_valve_is_shut(planned: Plan) -> None:
    late = executed(planned, takes=(1.0, 2.0, 1.0), flows=(0.25, 0.75))
    assert shares(record_deposited(late, CELL))[1:] == pytest.approx((0.5, 1.0))
    assert shares(record_deposited(late, ANALOG)) == pytest.approx((0.5, 0.5, 0.5))


def test_where_nothing_is_deposited_there_is_no_share(planned: Plan) -> None:
    robot = executed(planned, takes=(1.0, 1.0, 1.0))
    dry = replace(POSES, deposit=np.zeros(POSES.count, dtype=np.bool_), flow=np.zeros(POSES.count))
    assert record_deposited(replace(robot, joint_path=joint_path(dry)), CELL) is None


def test_a_plan_deposits_each_run_within_five_percent_and_the_whole_within_two(planned: Plan) -> None:
    motion = record_plan(planned).robot[0].motion
    assert motion.deposited == record_deposited(planned.robot[0], planned.workpiece.cell)
    whole, least, most = shares(motion.deposited)
    assert 0.95 < least <= whole <= most < 1.05
    assert whole == pytest.approx(1.0, abs=0.02)


# The figure of dispenser and lamp.


DEPOSITS: FloatArray = np.array([[1.0, 3.0], [4.0, 8.0]])
LAMP = DEPOSITS + np.array([-0.05, 0.1])
NOTHING = np.empty((0, 2))


def pixels(drawn: bytes, colour: str) -> int:
    """Count the pixels of a colour."""
    seen = np.asarray(Image.open(io.BytesIO(drawn)).convert("RGB"))
    wanted = [int(colour[place : place + 2], 16) for place in (1, 3, 5)]
    return int((seen == wanted).all(axis=2).sum())


@cache
def usual() -> bytes:
    """Return the figure of a dispenser that lays all deposits, with the lamp about them."""
    return switching_figure(DEPOSITS, DEPOSITS, LAMP, NOTHING, title="a $x$")


def test_the_figure_is_the_same_for_the_same_times() -> None:
    assert usual.__wrapped__() == usual()


def test_each_row_is_as_long_as_its_times() -> None:
    whole = usual()
    half = switching_figure(DEPOSITS, DEPOSITS[1:], LAMP, NOTHING, title="t")
    # Edges and letters are smoothed, so that some of their pixels have a colour in between.
    assert pixels(whole, COLOURS[1]) == pytest.approx(pixels(whole, COLOURS[0]), rel=0.02)
    assert pixels(half, COLOURS[1]) < 0.95 * pixels(whole, COLOURS[1])
    assert pixels(whole, COLOURS[2]) > 1.01 * pixels(whole, COLOURS[1])


def test_a_vacuum_has_a_row_of_its_own_where_there_is_one() -> None:
    drawn = switching_figure(DEPOSITS, DEPOSITS, LAMP, DEPOSITS + 1.0, title="t")
    assert pixels(usual(), COLOURS[3]) == 0
    assert pixels(drawn, COLOURS[3]) > 0.5 * pixels(drawn, COLOURS[0])
