"""What a person should know of a plan, said where it holds and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.config import load_cell
from geoprint.geometry import Repairs
from geoprint.model import Cell, Fluid, Material
from geoprint.reporting import Checked, record_plan, run_sheet
from geoprint.reporting.cautions import details_of, notes_of, warnings_of, wide_needle_notes
from geoprint.reporting.records.evenness import StandoffRecord
from geoprint.reporting.records.plan import BendRecord, PlanRecord, QuadrantRecord, RobotRecord
from geoprint.results import Plan
from geoprint.results.workpiece import Patch
from geoprint.workflow import check_bundle, save_plan
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
        (1.3, 0.5, 1.0, "passes along the top of the neighbouring beads. Use 20 gauge (0.91 mm)"),
        (1.3, 0.6, 0.9, "passes 0.1 mm above the neighbouring beads. Use 21 gauge (0.82 mm)"),
        (0.51, 0.45, 0.5, "passes 0.05 mm within the neighbouring beads. No common needle is thinner"),
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


def test_corners_that_every_stl_has_apart_are_no_repair_and_faces_turned_are(planned: Plan) -> None:
    (prepared,) = planned.workpiece.preparations
    for repairs, noted in ((Repairs(welded_vertices=300), 0), (Repairs(welded_vertices=300, flipped_faces=2), 1)):
        workpiece = replace(planned.workpiece, preparations=(replace(prepared, repairs=repairs),))
        notes = notes_of(replace(planned, workpiece=workpiece), record_plan(planned))
        assert sum("was repaired: 2 faces turned" in note for note in notes) == noted
        assert sum("was repaired" in note for note in notes) == noted


@pytest.mark.parametrize(
    ("within", "detailed", "warned"), [(None, 0, 0), (0.149, 0, 0), (0.151, 1, 0), (0.299, 1, 0), (0.301, 0, 1)]
)
def test_an_arm_that_hardly_keeps_the_standoff_is_a_detail_and_one_that_may_scratch_is_warned_of(
    planned: Plan, within: float | None, detailed: int, warned: int
) -> None:
    record = record_plan(planned)
    assert record.uniformity is not None
    assert record.uniformity.printed is not None
    standoff = StandoffRecord(wanted_mm=0.3, within_mm=within)
    printed = record.uniformity.printed.model_copy(update={"standoff": standoff})
    record = record.model_copy(update={"uniformity": record.uniformity.model_copy(update={"printed": printed})})
    details, notes, warnings = (
        [text for text in said if text.startswith("the arm keeps the stand-off of 0.3 mm within")]
        for said in (details_of(planned, record), notes_of(planned, record), warnings_of(planned, record))
    )
    assert (len(details), len(notes), len(warnings)) == (detailed, 0, warned)
    assert not [text for text in warnings_of(replace(planned, robot=()), record) if "keeps the stand-off" in text]


@pytest.mark.parametrize(
    ("standoff", "spacing", "warned", "noted"),
    # The needle is 0.91 mm wide and beads are 0.5 mm high.
    [(0.3, 1.0, 0, 0), (0.49, 0.9, 1, 0), (0.5, 0.9, 0, 1), (0.6, 0.9, 0, 1)],
)
def test_a_needle_that_ploughs_through_beads_is_warned_of_and_one_that_passes_over_them_is_noted(
    planned: Plan, standoff: float, spacing: float, warned: int, noted: int
) -> None:
    record = record_plan(planned)
    layers = tuple(layer.model_copy(update={"standoff_mm": standoff}) for layer in record.layers)
    settings = record.settings.model_copy(update={"spacing_mm": spacing})
    record = record.model_copy(update={"layers": layers, "settings": settings})
    found = [
        [text for text in of(planned, record) if text.startswith("the needle is 0.91 mm wide")]
        for of in (warnings_of, notes_of, details_of)
    ]
    assert [len(each) for each in found] == [warned, noted, 0]


def test_borders_of_quadrants_are_noted_where_the_part_will_stand_and_are_a_detail_elsewhere(planned: Plan) -> None:
    record = record_plan(planned)
    (robot,) = record.robot
    near = QuadrantRecord(axis=4, targets_near=2, crossings=0, nearest_deg=0.5, run=0, place_mm=(1.0, 2.0, 3.0))
    motion = robot.motion.model_copy(update={"quadrants": (near,)})
    record = record.model_copy(update={"robot": (robot.model_copy(update={"motion": motion}),)})
    stated = replace(planned, job=planned.job.model_copy(update={"place": None}))
    found = [
        [text for text in of(plan, record) if text.startswith("within 1 degree of a quadrant border on")]
        for plan in (planned, stated)
        for of in (warnings_of, notes_of, details_of)
    ]
    assert [len(each) for each in found] == [0, 0, 1, 0, 1, 0]


def test_a_small_patch_of_a_large_part_is_no_reason_to_doubt_the_unit(planned: Plan) -> None:
    def doubts(plan: Plan) -> list[str]:
        return [text for text in warnings_of(plan, record_plan(plan)) if "check the unit" in text]

    part, whole = plate((4.0, 4.0), (2, 2)), plate((40.0, 40.0), (2, 2))
    small = replace(planned.workpiece, part=part)
    assert len(doubts(replace(planned, workpiece=small))) == 1
    patch = Patch(part, planned.workpiece.preparations[0], body=whole, outside="", missed=None, inside=None)
    assert doubts(replace(planned, workpiece=replace(small, patches=(patch,)))) == []
    assert len(doubts(replace(planned, workpiece=replace(small, patches=(replace(patch, body=part),))))) == 1


def attitude(robot: RobotRecord, *, closer: int, soonest: float) -> RobotRecord:
    targets = robot.motion.targets.model_copy(update={"closer": closer, "shortest_ms": soonest})
    return robot.model_copy(update={"motion": robot.motion.model_copy(update={"targets": targets})})


TIGHT = BendRecord(
    run=0, kind="rounded", place_mm=(1.0, 2.0, 3.0), arc_mm=4.0, radius_mm=0.5, targets=3, offset_mm=0.1,
    shortest_ms=30.0,
)  # fmt: skip


def with_bends(robot: RobotRecord, bends: tuple[BendRecord, ...]) -> RobotRecord:
    targets = robot.motion.targets.model_copy(update={"bends": bends})
    return robot.model_copy(update={"motion": robot.motion.model_copy(update={"targets": targets})})


def test_targets_that_follow_too_soon_are_told_of_all_attitudes_in_one_sentence(planned: Plan) -> None:
    record = record_plan(planned)

    def said(*each: tuple[int, float]) -> tuple[list[str], list[str]]:
        """Return the notes and the warnings on targets of attitudes with so many that follow so soon [ms]."""
        robots = tuple(attitude(record.robot[0], closer=count, soonest=soonest) for count, soonest in each)
        changed = record.model_copy(update={"robot": robots})
        notes, warnings = (
            [text for text in of(planned, changed) if "after the previous one" in text]
            for of in (notes_of, warnings_of)
        )
        return notes, warnings

    notes, (warning,) = said((3, 15.0), (0, 25.0), (2, 11.5))
    assert notes == []
    assert warning == (
        "5 targets are less than 20 ms after the previous one (robot.target_period_ms), the closest 11.5 ms in "
        "attitude 3: the arm may slow down there."
    )
    # From 12 ms on a controller takes them, and may only be slower.
    assert said((3, 15.0), (2, 11.99))[0] == []
    (note,), warnings = said((3, 15.0), (2, 12.0))
    assert warnings == []
    assert "the closest 12.0 ms in attitude 2: the arm may slow down there." in note
    (one,), warnings = said((1, 19.0))
    assert warnings == []
    assert one.startswith("1 target is less than 20 ms after the previous one (")
    assert "the closest 19.0 ms:" in one
    assert said((0, 25.0)) == ([], [])


def test_what_is_told_of_each_attitude_says_of_which(planned: Plan) -> None:
    record = record_plan(planned)
    straight, bent = (with_bends(record.robot[0], bends) for bends in ((), (TIGHT,)))
    several, alone = (
        [text for text in details_of(planned, record.model_copy(update={"robot": robots})) if "tight bend" in text]
        for robots in ((straight, bent), (bent,))
    )
    assert [text[:32] for text in several] == ["attitude 2 of 2: in 1 tight bend"]
    assert [text[:15] for text in alone] == ["in 1 tight bend"]


@pytest.mark.parametrize(
    ("pressure", "speed", "ceiling", "warned"), [(None, 15.0, 20.0, 0), (120.0, 20.0, 20.0, 0), (120.0, 15.0, 20.0, 1)]
)
def test_a_pressure_that_the_cell_names_is_warned_of_where_the_print_is_slower_than_the_ceiling(
    planned: Plan, pressure: float | None, speed: float, ceiling: float, warned: int
) -> None:
    record = timed(record_plan(planned), pressure=pressure, speed=speed, ceilings=(ceiling,))
    said = [text for text in warnings_of(planned, record) if "kPa" in text]
    flow = 3.0 * 0.5 * speed
    begin = f"the cell's 120 kPa suit 20 mm/s, and this prints at 15 mm/s: set the pressure for {flow:g} mm3/s"
    assert said == [f"{begin}."] * warned
    fitted = with_flow(record, valve_kpa=98.76)
    said = [text for text in warnings_of(planned, fitted) if "kPa" in text]
    assert said == [f"{begin}, by [material] 98.8 kPa."] * warned


def test_the_pressure_is_not_warned_of_where_nothing_sets_the_speed_and_counts_for_the_highest_ceiling(
    planned: Plan,
) -> None:
    record = timed(record_plan(planned), pressure=120.0, speed=15.0, ceilings=(15.0, 20.0))
    (said,) = [text for text in warnings_of(planned, record) if "kPa" in text]
    assert said.startswith("the cell's 120 kPa suit 20 mm/s, and this prints at 15")
    without = record.model_copy(update={"robot": ()})
    assert not [text for text in warnings_of(planned, without) if "kPa" in text]


def timed(record: PlanRecord, *, pressure: float | None, speed: float, ceilings: tuple[float, ...]) -> PlanRecord:
    """Return what is said of a plan that prints at a speed [mm/s], with one attitude for each ceiling."""
    settings = record.settings.model_copy(update={"pressure_kpa": pressure, "speed_mm_s": speed})
    motions = [record.robot[0].motion.model_copy(update={"speed_ceiling_mm_s": ceiling}) for ceiling in ceilings]
    robots = tuple(record.robot[0].model_copy(update={"motion": motion}) for motion in motions)
    changed = record.model_copy(update={"settings": settings, "robot": robots})
    return with_flow(changed, valve_mm3_s=3.0 * 0.5 * speed)


def with_flow(record: PlanRecord, **values: float) -> PlanRecord:
    """Return what is said of a plan whose valve lets another flow through, or at another pressure."""
    assert record.deposition is not None
    return record.model_copy(update={"deposition": record.deposition.model_copy(update=values)})


def test_a_valve_lets_spacing_times_height_times_speed_through_at_the_pressure_of_the_material(planned: Plan) -> None:
    cell = planned.workpiece.cell
    # A Newtonian fluid: the pressure rises with the flow.
    known = replace(cell, material=Material(1.1, Fluid(5.0)))
    flows: list[float] = []
    pressures: list[float | None] = []
    for own in (cell, known, known.at_speed(cell.process.speed / 2.0)):
        flow = record_plan(replace(planned, workpiece=replace(planned.workpiece, cell=own))).deposition
        assert flow is not None
        flows.append(flow.valve_mm3_s)
        pressures.append(flow.valve_kpa)
    speed = cell.process.speed
    assert flows == pytest.approx([3.0 * 0.5 * speed, 3.0 * 0.5 * speed, 3.0 * 0.5 * speed / 2.0])
    none, whole, half = pressures
    assert none is None
    assert whole is not None
    assert half is not None
    assert whole == pytest.approx(2.0 * half)
    # Mostly 8 viscosities times flow and length over pi and the fourth power of the radius [kPa] in the needle alone.
    needle = 8.0 * 5.0 * flows[1] * cell.tool.needle_length / (np.pi * (cell.tool.inner_diameter / 2.0) ** 4) / 1000.0
    assert needle < whole < 1.1 * needle


@pytest.fixture(scope="module")
def checked(planned: Plan, tmp_path_factory: pytest.TempPathFactory) -> Checked:
    folder = tmp_path_factory.mktemp("bundle") / "out"
    save_plan(planned, folder)
    return check_bundle(folder)


@pytest.mark.parametrize(
    ("named", "fitted", "said"),
    [
        (None, None, "air pressure: set it for 22.5 mm3/s at 15 mm/s layer 0.5 mm"),
        (None, 98.76, "air pressure: set it for 22.5 mm3/s at 15 mm/s, by [material] 98.8 kPa layer"),
        (120e3, 98.76, "15 mm/s, by [material] 98.8 kPa; the cell states 120 kPa for 20 mm/s layer"),
        (120e3, None, "at 15 mm/s; the cell states 120 kPa for 20 mm/s layer"),
    ],
)
def test_the_run_sheet_says_which_flow_the_pressure_lets_through(
    checked: Checked, named: float | None, fitted: float | None, said: str
) -> None:
    assert checked.setup is not None
    assert checked.record is not None
    cell = checked.setup.cell.at_speed(15.0)
    setup = replace(checked.setup, cell=replace(cell, process=replace(cell.process, pressure=named)))
    record = timed(checked.record, pressure=None, speed=15.0, ceilings=(20.0,))
    record = record if fitted is None else with_flow(record, valve_kpa=fitted)
    sheet = " ".join(run_sheet(replace(checked, setup=setup, record=record)).split())
    assert said in sheet
    assert "prints at 15 mm/s" in sheet
