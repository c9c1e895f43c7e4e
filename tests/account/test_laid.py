"""A program that lays another volume than its paths ask for says so, and how it would not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from geoprint.account import record_plan
from geoprint.account.prints.laid import laid_share, laid_warnings
from geoprint.account.records.plan import PlanRecord
from geoprint.results import Plan
from tests.meshes import plate
from tests.shared_plans import SharedPlans


@pytest.fixture(scope="module")
def planned(shared_plans: SharedPlans) -> Plan:
    return shared_plans.plan(plate((12.0, 12.0), (8, 8)), spacing=3.0, place="demo")


def _slowed(planned: Plan, *, times: float, mode: str = "io") -> Plan:
    """Return a plan whose program takes so many times as long, while the valve does what it did."""
    (robot,), cell = planned.robot, planned.workpiece.cell
    slower = replace(
        robot,
        trajectory=replace(robot.trajectory, pose_times=times * robot.trajectory.pose_times),
        switching=replace(robot.switching, material=times * robot.switching.material),
    )
    signals = replace(cell.signals, mode=mode, flow="aoFlow", flow_per_mm3_s=0.1)
    workpiece = replace(planned.workpiece, cell=replace(cell, signals=signals))
    return replace(planned, robot=(slower,), workpiece=workpiece)


def test_a_valve_lays_by_time_and_an_output_by_length(planned: Plan) -> None:
    once = laid_share(planned, planned.robot[0])
    assert once is not None
    # Ramps at the ends of runs are slower than the rest.
    assert 1.0 <= once < 1.2
    twice = _slowed(planned, times=2.0)
    assert laid_share(twice, twice.robot[0]) == pytest.approx(2.0 * once)
    followed = _slowed(planned, times=2.0, mode="analog")
    assert laid_share(followed, followed.robot[0]) == pytest.approx(1.0, abs=0.02)


def warned(told: PlanRecord, *, held: float) -> str:
    """Return the warning of a plan whose joints hold so much."""
    motion = told.robot[0].motion.model_copy(update={"largest_even_speed_mm_s": held})
    (said,) = laid_warnings(told.model_copy(update={"robot": (told.robot[0].model_copy(update={"motion": motion}),)}))
    return said


def test_what_is_laid_too_much_is_warned_of_with_what_helps(planned: Plan) -> None:
    twice = record_plan(_slowed(planned, times=2.0))
    (said,) = [text for text in twice.warnings if "TIMES THE VOLUME" in text]
    assert f"LAYS {twice.robot[0].motion.laid_share:.2f} TIMES THE VOLUME of its paths" in said
    lowered = warned(twice, held=8.04)
    assert "the joints do not hold 20 mm/s" in lowered
    assert "speed_mm_s of 8.0, with the pressure" in lowered
    short = warned(twice, held=25.0)
    assert "short runs hardly reach 20 mm/s" in short
    assert "speed_mm_s" not in short
    followed = record_plan(_slowed(planned, times=2.0, mode="analog"))
    assert not any("TIMES THE VOLUME" in text for text in followed.warnings)
