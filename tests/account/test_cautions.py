"""What a person should know of a plan, said where it holds and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import pytest

from geoprint.account import record_plan
from geoprint.account.cautions import notes_of, warnings_of, wide_needle_notes
from geoprint.account.records.printed import StandoffRecord
from geoprint.account.records.robot import BendRecord, RobotRecord
from geoprint.config import load_cell
from geoprint.model import Cell
from geoprint.results import Plan
from tests.meshes import plate
from tests.shared_plans import SharedPlans


def cell_with(*, width: float, standoff: float, height: float) -> Cell:
    cell = load_cell(None)
    return replace(
        cell,
        tool=replace(cell.tool, needle_diameter=width),
        process=replace(cell.process, standoff=standoff, layer_height=height),
    )


@pytest.mark.parametrize(
    ("width", "standoff", "spacing", "said"),
    [
        (1.3, 0.5, 1.3, None),
        (1.3, 0.5, 1.0, "passes along the top of the beads beside its own; one of 20 gauge (0.91 mm) does not"),
        (1.3, 0.6, 0.9, "passes 0.1 mm above the beads beside its own; one of 21 gauge (0.82 mm) does not"),
        (0.51, 0.45, 0.5, "passes 0.05 mm within the beads beside its own; no common one is thinner"),
    ],
)
def test_a_needle_wider_than_the_spacing_is_said_with_one_that_is_not(
    width: float, standoff: float, spacing: float, said: str | None
) -> None:
    notes = wide_needle_notes(cell_with(width=width, standoff=standoff, height=0.5), spacing, standoff=standoff)

    assert len(notes) == (said is not None)
    assert all(str(said) in note for note in notes)


@pytest.fixture(scope="module")
def planned(shared_plans: SharedPlans) -> Plan:
    return shared_plans.plan(plate((12.0, 12.0), (8, 8)), spacing=3.0, place="demo")


@pytest.mark.parametrize(
    ("within", "noted", "warned"),
    [(None, 0, 0), (0.149, 0, 0), (0.151, 1, 0), (0.299, 1, 0), (0.301, 0, 1)],
)
def test_an_arm_that_hardly_keeps_the_standoff_is_noted_and_one_that_may_scratch_is_warned_of(
    planned: Plan, within: float | None, noted: int, warned: int
) -> None:
    told = record_plan(planned)
    assert told.uniformity is not None
    assert told.uniformity.printed is not None
    standoff = StandoffRecord(wanted_mm=0.3, within_mm=within)
    printed = told.uniformity.printed.model_copy(update={"standoff": standoff})
    told = told.model_copy(update={"uniformity": told.uniformity.model_copy(update={"printed": printed})})
    notes, warnings = (
        [text for text in said if text.startswith("the arm keeps the stand-off of 0.3 mm within")]
        for said in (notes_of(planned, told), warnings_of(planned, told))
    )
    assert (len(notes), len(warnings)) == (noted, warned)
    assert not [text for text in warnings_of(replace(planned, robot=()), told) if "keeps the stand-off" in text]


def attitude(robot: RobotRecord, *, closer: int, soonest: float) -> RobotRecord:
    targets = robot.motion.targets.model_copy(update={"closer": closer, "shortest_ms": soonest})
    return robot.model_copy(update={"motion": robot.motion.model_copy(update={"targets": targets, "laid_share": 1.0})})


TIGHT = BendRecord(
    run=0, kind="rounded", place_mm=(1.0, 2.0, 3.0), arc_mm=4.0, radius_mm=0.5, targets=3, offset_mm=0.1,
    shortest_ms=30.0,
)  # fmt: skip


def with_bends(robot: RobotRecord, bends: tuple[BendRecord, ...]) -> RobotRecord:
    targets = robot.motion.targets.model_copy(update={"bends": bends})
    return robot.model_copy(update={"motion": robot.motion.model_copy(update={"targets": targets})})


def test_targets_that_follow_too_soon_are_told_of_all_attitudes_in_one_sentence(planned: Plan) -> None:
    told = record_plan(planned)
    (robot,) = told.robot
    each = [(3, 15.0), (0, 25.0), (2, 12.5)]
    robots = tuple(attitude(robot, closer=count, soonest=soonest) for count, soonest in each)

    (said,) = [text for text in warnings_of(planned, told.model_copy(update={"robot": robots})) if "sooner" in text]
    assert said == (
        "5 targets follow the one before sooner than the controller digests them (robot.target_period_ms is 20; the "
        "soonest comes after 12.5 ms in attitude 3): the arm may slow down there."
    )
    alone = told.model_copy(update={"robot": (attitude(robot, closer=1, soonest=19.0),)})
    (one,) = [text for text in warnings_of(planned, alone) if "sooner" in text]
    assert one.startswith("1 target follows the one before sooner than the controller digests it (")
    assert "the soonest comes after 19.0 ms):" in one
    none = told.model_copy(update={"robot": (attitude(robot, closer=0, soonest=25.0),)})
    assert not [text for text in warnings_of(planned, none) if "sooner" in text]


def test_what_is_told_of_each_attitude_says_of_which(planned: Plan) -> None:
    told = record_plan(planned)
    straight, bent = (with_bends(told.robot[0], bends) for bends in ((), (TIGHT,)))
    several, alone = (
        [text for text in notes_of(planned, told.model_copy(update={"robot": robots})) if "tight bend" in text]
        for robots in ((straight, bent), (bent,))
    )
    assert [text[:32] for text in several] == ["attitude 2 of 2: in 1 tight bend"]
    assert [text[:15] for text in alone] == ["in 1 tight bend"]
