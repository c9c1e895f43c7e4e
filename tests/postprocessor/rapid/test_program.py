"""The RAPID writer: golden files, what names may not do, what is refused, and laws of what is written."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from importlib.metadata import version
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError, UsageError, VerificationError
from geoprint.model import Cell, FloatArray, Flood, Placement, PoseStream, Program, Purge, Signals, Targets
from geoprint.postprocessor.ordering import orders_of
from geoprint.postprocessor.rapid import program as rapid
from geoprint.postprocessor.rapid.cell_module import cell_module, guard_module, header_lines
from geoprint.postprocessor.rapid.language.symbols import read_task
from geoprint.postprocessor.rapid.reader import check_form
from geoprint.postprocessor.rapid.verify import verify_program
from tests.postprocessor.export_cases import (
    CELL,
    DEMONSTRATION,
    EXTENT,
    PLACEMENT,
    events,
    joint_path,
    orders,
    proven_program,
    stream,
    targets,
    tips_of,
    trajectory,
)

ANALOG = replace(
    CELL,
    signals=Signals(
        mode="analog", dispenser="doValve", uv_lamp="doUV", flow="aoFlow", flow_per_mm3_s=0.1, flow_lag=0.04
    ),
)
GOLDEN = Path(__file__).parents[2] / "golden" / "two_runs"


def write(
    poses: PoseStream | None = None,
    *,
    chosen: Targets | None = None,
    cell: Cell = CELL,
    placement: Placement = PLACEMENT,
    part_name: str = "two rings",
) -> Program:
    poses = stream() if poses is None else poses
    return proven_program(
        orders(poses, placement, chosen=chosen), cell=cell, placement=placement,
        surface_within=0.214 if placement.calibrated else None, tips_at=tips_of(poses), part_name=part_name,
        spacing=2.0, checked=("clearance of the nozzle",), not_checked=("the operator",),
    )[0]  # fmt: skip


def text_of(program: Program, module: str) -> str:
    return dict(program.modules)[module]


def code_of(program: Program) -> list[str]:
    return [line for _, text in program.modules for line in text.split("\n") if not line.lstrip().startswith("!")]


@cache
def code_under_any_name() -> list[str]:
    """Return the code of a program, whatever its part is called."""
    return code_of(write())


def golden_differences(program: Program) -> list[str]:
    """Names of the modules that are not the golden ones, byte for byte (the version apart)."""
    found = {
        name: text.replace(f"geoprint {version('geoprint')}", "geoprint VERSION") for name, text in program.modules
    }
    kept = {path.name: path.read_bytes() for path in sorted(GOLDEN.iterdir())}
    return sorted(name for name in found.keys() | kept.keys() if found.get(name, "").encode("ascii") != kept.get(name))


def test_a_program_of_two_runs_is_the_golden_one_byte_for_byte() -> None:
    assert golden_differences(write()) == []


def test_the_golden_comparison_fails_when_one_decimal_moves() -> None:
    poses = stream()
    tips = poses.tips.copy()
    tips[3, 1] += 0.0001
    assert golden_differences(write(replace(poses, tips=tips))) == ["GeoPrint.mod"]


def test_the_same_input_gives_the_same_bytes() -> None:
    assert write().modules == write().modules


def test_a_program_says_how_many_targets_it_has_and_that_it_may_deposit() -> None:
    program = write()
    moves = len(re.findall(r"(?:Move|Trigg)L ", text_of(program, "GeoPrint.mod")))
    assert (program.targets, program.dry_run) == (moves, False) == (18, False)


def test_every_program_starts_as_a_slow_dry_run_from_its_first_run_on() -> None:
    cell = text_of(write(), "GeoCell.mod")
    assert "PERS bool geoDryRun:=TRUE;" in cell
    assert "PERS num geoSpeedPct:=25;" in cell
    assert "PERS num geoFirstRun:=1;" in cell


def test_without_calibration_nothing_makes_a_program_deposit() -> None:
    program = write(placement=DEMONSTRATION)
    assert program.dry_run
    for name in ("GeoCell.mod", "GeoPrint.mod", "GeoGuard.mod"):
        assert "! PLACEMENT UNKNOWN" in text_of(program, name)
    assert not [line for line in code_of(program) if re.search(r"SetDO \w+,1|geoOn:=1", line)]
    assert [line for line in code_of(write()) if "geoOn:=1" in line]


def test_every_output_is_switched_on_by_the_variable_that_a_dry_run_keeps_at_0() -> None:
    lines = [line for line in code_of(write(cell=ANALOG)) if re.match(r" +Trigg(IO|Speed)", line)]
    values = {re.sub(r".*,|\\DipLag.*|;", "", line) for line in lines}
    flows = {value for value in values if re.fullmatch(r"0\.05\d*\*geoOn", value)}
    assert flows
    assert values - flows == {"0", "geoOn"}


def test_every_routine_that_moves_shuts_off_and_raises_on_an_error() -> None:
    for _, text in write().modules[:3]:
        for routine in re.findall(r"  PROC (.*?)  ENDPROC", text, re.DOTALL):
            moves = re.search(r"Move\w+ |TriggL |GeoRun\d+;", routine)
            assert not moves or routine.endswith("  ERROR\n    GeoSafe;\n    RAISE;\n"), routine


@pytest.mark.parametrize("loading", [False, True])
@pytest.mark.parametrize("fitted", [False, True])
@pytest.mark.parametrize("flood", [None, Flood(60.0), Flood(60.0, joints=np.zeros(6))])
@pytest.mark.parametrize("placement", [PLACEMENT, DEMONSTRATION])
@pytest.mark.parametrize("signals", [CELL.signals, ANALOG.signals])
def test_every_guard_is_whole_rapid_within_the_kernels_limits(
    *, signals: Signals, placement: Placement, flood: Flood | None, fitted: bool, loading: bool
) -> None:
    purge = Purge(joints=np.zeros(6), duration=1.0) if fitted else None
    vacuum = "doVacuum" if fitted else None
    cell = replace(CELL, signals=replace(signals, vacuum=vacuum), purge=purge, flood=flood)
    text = guard_module(cell, placement=placement, loading=loading)
    code = [line.strip() for line in text.split("\n") if not line.lstrip().startswith("!")]
    assert text.startswith("MODULE GeoGuard\n")
    assert text.endswith("ENDMODULE\n")
    assert not re.search(r"[@<|](?!>)[A-Z]", text.replace("<>", ""))
    assert sum(line.startswith("PROC ") for line in code) == code.count("ENDPROC")
    assert sum(line.startswith("FUNC ") for line in code) == code.count("ENDFUNC") == 1
    assert sum(line.endswith(" THEN") for line in code) == code.count("ENDIF")
    called = {line.split()[0].rstrip(";") for line in code if line.startswith("Geo")}
    called |= set(re.findall(r"(?:\d|FALSE|TRUE|=|5) (Geo[A-Za-z]+)", text))
    declared = {match[1] for line in code if (match := re.match(r"PROC (\w+)", line))}
    assert called <= declared
    assert max(len(word) for word in re.findall(r"\w+", text)) <= 32
    assert max(len(string) for string in re.findall(r'"([^"]*)"', text)) <= 80
    assert max(len(line) for line in text.split("\n")) <= 120
    read_task([("GeoGuard.mod", text)], signals=None, closed=False)


@settings(max_examples=200, deadline=None)
@given(
    st.floats(0.1, 2.0),
    st.sampled_from([0.0, 20.0, 400.0]),
    arrays(np.float64, 3, elements=st.floats(-1.0, 1.0)),
    arrays(np.float64, 3, elements=st.floats(-1.0, 1.0)),
    st.floats(-4.0, 0.0),
)
def test_no_frame_that_the_guard_takes_moves_a_point_of_the_part_by_more_than_a_fifth_of_the_stand_off(
    standoff: float, away: float, shift: FloatArray, turn: FloatArray, scale: float
) -> None:
    low = np.array([away, -away, 3.0])
    extent = np.stack([low, low + np.array([30.0, 20.0, 5.0])])
    cell = replace(CELL, process=replace(CELL.process, standoff=standoff))
    text = cell_module(cell, replace(orders(), extent=extent), placement=PLACEMENT, declarations=[], header=[])
    middle, largest_shift, largest_turn = (
        np.array(json.loads(match[1]))
        for name in ("pos geoMiddle", "num nGeoShift", "num nGeoTurn")
        if (match := re.search(rf"CONST {name}:=(.*);", text))
    )
    rotation = Rotation.from_rotvec(10.0**scale * turn)
    moved = transforms.rigid(rotation.as_matrix(), 10.0**scale * shift + middle - rotation.apply(middle))
    taken = np.linalg.norm(transforms.apply(moved, middle[None]) - middle) <= largest_shift
    taken &= np.degrees(rotation.magnitude()) <= largest_turn
    points = np.array([*product(*extent.T)])
    farthest = np.linalg.norm(transforms.apply(moved, points) - points, axis=1).max()
    assert farthest <= 0.2 * standoff + 1e-4 or not taken
    assert taken or farthest > 1e-3 * standoff


def test_the_guard_asks_for_the_frame_at_the_middle_of_the_part_by_limits_of_the_plan() -> None:
    guard = text_of(write(), "GeoGuard.mod")
    assert "IF VectMagn(PoseVect(shift,geoMiddle)-geoMiddle)>nGeoShift OR turn>nGeoTurn THEN\n      GeoRefuse" in guard


@pytest.mark.parametrize("placement", [PLACEMENT, DEMONSTRATION])
def test_no_program_ever_switches_the_monitoring_of_configurations_off(placement: Placement) -> None:
    code = "\n".join(code_of(write(placement=placement)))
    assert re.findall(r"Conf[LJ].*", code) == ["ConfJ\\On;", "ConfL\\On;"]
    assert code.count("MoveL GeoAloft([[") == 4


def test_the_motions_from_and_to_home_take_the_planned_time() -> None:
    found = write().modules
    assert "CONST num nGeoThere:=1.000;" in dict(found)["GeoCell.mod"]
    assert (
        "MoveAbsJ jGeoStart\\NoEOffs,vGeoHome\\T:=nGeoThere*100/geoPct,fine,tGeoNozzle;" in dict(found)["GeoGuard.mod"]
    )
    assert "MoveAbsJ jGeoHome\\NoEOffs,vGeoHome\\T:=nGeoBack*100/geoPct,fine,tGeoNozzle;" in dict(found)["GeoGuard.mod"]


def test_the_dry_run_is_lifted_along_the_bases_z_axis() -> None:
    numbers = re.search(r"geoLift:=\[\[(.*?)\]", text_of(write(), "GeoCell.mod"))
    assert numbers is not None
    lift = PLACEMENT.T_base_work[:3, :3] @ np.array([float(number) for number in numbers[1].split(",")])
    np.testing.assert_allclose(lift, [0.0, 0.0, 20.0], atol=1e-3)


def test_a_place_to_prime_is_driven_to_and_the_valve_opens_there_unless_dry() -> None:
    assert "GeoPrime" not in text_of(write(), "GeoGuard.mod")
    cell = replace(CELL, purge=Purge(joints=np.full(6, 0.1), duration=2.5))
    program = write(cell=cell)
    assert "CONST num nGeoPrime:=2.500;" in text_of(program, "GeoCell.mod")
    guard = text_of(program, "GeoGuard.mod")
    assert "    GeoPrime;\n" in guard
    assert "      SetDO doValve,1;\n      WaitTime nGeoPrime;\n      GeoSafe;\n      GeoAskStopped geoFrom;\n" in guard
    assert guard.index("    IF geoPrints AND (NOT geoDryRun) THEN\n") < guard.index("SetDO doValve,1")
    assert "SetDO doValve,1" not in text_of(write(cell=cell, placement=DEMONSTRATION), "GeoGuard.mod")


def test_the_final_exposure_is_given_by_the_lamp_on_the_arm_or_asked_of_a_person() -> None:
    by_hand = write(cell=replace(CELL, flood=Flood(60.0)))
    assert "CONST num nGeoFlood:=60.000;" in text_of(by_hand, "GeoCell.mod")
    asked = '    IF geoPrints TPWrite "Now flood the part with UV, seconds: "\\Num:=nGeoFlood;\n'
    assert asked in text_of(by_hand, "GeoGuard.mod")
    cell = replace(CELL, flood=Flood(60.0, joints=np.full(6, 0.1)))
    guard = text_of(write(cell=cell), "GeoGuard.mod")
    assert "    IF geoPrints AND (NOT geoDryRun) THEN\n      SetDO doUV,1;\n      WaitTime nGeoFlood;\n" in guard
    assert "      WaitTime nGeoFlood;\n      IF doUV=0 TPWrite" in guard
    assert guard.index("nGeoBack") < guard.index("    GeoFlood;\n")
    assert "jGeoFlood" in text_of(write(cell=cell), "GeoCell.mod")
    assert "SetDO doUV,1" not in text_of(write(cell=cell, placement=DEMONSTRATION), "GeoGuard.mod")


def test_a_vacuum_draws_by_triggers_and_is_off_when_safe() -> None:
    assert "Vacuum" not in "".join(text for _, text in write().modules)
    program = write(cell=replace(CELL, signals=replace(CELL.signals, vacuum="doSuck")))
    assert "SetDO doSuck,0;" in text_of(program, "GeoGuard.mod")
    path = text_of(program, "GeoPrint.mod")
    assert len(re.findall(r"TriggIO tGeoVacuumOn,[\d.]+(?:\\Start)?\\DOp:=doSuck,geoOn;", path)) == 2
    assert len(re.findall(r"TriggIO tGeoVacuumOff,[\d.]+(?:\\Start)?\\DOp:=doSuck,0;", path)) == 2


def test_depositing_at_a_fixed_pressure_is_refused_below_full_speed_and_allowed_where_the_flow_follows() -> None:
    assert "CSpeedOverride()<>100" in text_of(write(), "GeoGuard.mod")
    assert "CSpeedOverride" not in text_of(write(cell=ANALOG), "GeoGuard.mod")


def test_speeds_and_zones_are_shared_and_never_above_the_plan() -> None:
    text = text_of(write(), "GeoCell.mod")
    assert re.findall(r"speeddata vGeo\d:=\[([\d.]+),", text) == ["19.876", "20", "60"]
    assert re.findall(r"zonedata zGeo\d:=\[FALSE,([\d.]+),", text) == ["0.12", "0.3"]


@pytest.mark.parametrize(("zone", "written"), [(0.0009, "fine"), (0.00199, "0.0019"), (0.0999, "0.099"), (12.34, "12")])
def test_a_zone_is_rounded_down_and_below_a_micrometre_a_stop(zone: float, written: str) -> None:
    poses = stream()
    chosen = targets(poses)
    cell = text_of(write(poses, chosen=replace(chosen, zones=np.where(chosen.zones > 0, zone, 0.0))), "GeoCell.mod")
    assert re.findall(r"zonedata zGeo\d:=\[FALSE,([\d.]+),", cell) == ([] if written == "fine" else [written])


def test_thinned_targets_are_written_and_the_rest_is_not() -> None:
    poses = stream(points=12)
    chosen = targets(poses)
    kept = np.flatnonzero(poses.stops | (np.arange(poses.count) % 3 == 0))
    thin = Targets(poses=kept, zones=chosen.zones[kept], speeds=chosen.speeds[kept])
    program = write(poses, chosen=thin)
    assert program.targets == kept.size < poses.count


def test_runs_that_do_not_fit_one_module_are_loaded_one_module_ahead(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rapid, "MODULE_LINES", 55)
    program = write(stream(runs=5, points=9))
    names = [name for name, _ in program.modules]
    assert names == [
        "GeoCell.mod", "GeoGuard.mod", "GeoPath1.mod", "GeoPath2.mod", "GeoPath3.mod", "GeoPrint.mod", "GeoPrint.pgf",
    ]  # fmt: skip
    assert all(text.count("\n") <= 55 for name, text in program.modules if name.startswith("GeoPath"))
    assert "GeoPath" not in text_of(program, "GeoPrint.pgf")
    main = [line.strip() for line in text_of(program, "GeoPrint.mod").split("\n")]
    order = [
        'StartLoad\\Dynamic,diskhome\\File:="GeoPath1.mod",geoLoading;', "WaitLoad geoLoading;", "GeoBegin 5;",
        'StartLoad\\Dynamic,diskhome\\File:="GeoPath2.mod",geoLoading;', '%"GeoRun1"%;', '%"GeoRun2"%;',
        "WaitLoad geoLoading;", 'UnLoad diskhome\\File:="GeoPath1.mod";',
    ]  # fmt: skip
    start = main.index(order[0])
    assert main[start : start + len(order)] == order


def test_a_run_longer_than_a_module_is_refused_because_the_valve_is_open_along_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(rapid, "MODULE_LINES", 40)
    with pytest.raises(UsageError, match="run 1 has 93 targets"):
        write(stream(runs=1, points=90))


@pytest.mark.parametrize(
    "name",
    [
        "heart\nENDMODULE", "heart\r\n  SetDO doUV,1;", "x\x00y", "h\u0435art \u2028SetDO doUV,1;", "\x85SetDO doUV,1;",
        "", "  ", "a" * 100_000, "!", "*/", '"; SetDO doUV,1;', "</Module>", "\\On;",
    ],
)  # fmt: skip
def test_no_part_name_changes_a_line_of_code(name: str) -> None:
    program = write(part_name=name)
    assert code_of(program) == code_under_any_name()
    assert all(text.isascii() for _, text in program.modules)


@given(st.text(max_size=300))
@settings(max_examples=4, deadline=None)
def test_no_text_at_all_changes_a_line_of_code(name: str) -> None:
    assert code_of(write(part_name=name)) == code_under_any_name()


@given(st.text(max_size=300))
@settings(max_examples=200, deadline=None)
def test_the_header_of_a_part_of_any_name_is_comments_that_the_reader_takes(name: str) -> None:
    lines = header_lines(
        cell=CELL, placement=PLACEMENT, surface_within=0.214, part_name=name, spacing=2.0, runs=2, targets=18,
        checked=(), not_checked=(),
    )  # fmt: skip
    assert all(line.startswith("  ! ") and line.isascii() and line.isprintable() for line in lines)
    check_form("GeoPrint.mod", "\n".join(["MODULE GeoPrint", *lines, "ENDMODULE", ""]))


@pytest.mark.parametrize(
    "name",
    [
        "", "do valve", "doUV,1;SetDO doX", "doUV\n", "1do", "_do", "d\u00f6", "do-UV", "a" * 33, "while", "MoveL",
        "TRUE", "geoDryRun", "GEOON", "main", "tGeoNozzle", 'a"b', "do!", "<LAMP>", "run", "TriggIO",
    ],
)  # fmt: skip
def test_an_output_that_is_no_free_rapid_name_is_refused(name: str) -> None:
    for field in ("dispenser", "uv_lamp", "flow"):
        signals = replace(ANALOG.signals, **{field: name})  # pyright: ignore[reportArgumentType]
        cell = replace(CELL, signals=signals)
        with pytest.raises(UsageError, match=f"signals.{field}"):
            write(cell=cell)


def test_an_output_of_exactly_32_characters_is_taken() -> None:
    cell = replace(CELL, signals=Signals(mode="io", dispenser="a" * 32, uv_lamp="doUV"))
    assert f"SetDO {'a' * 32},0;" in text_of(write(cell=cell), "GeoGuard.mod")


def test_a_flow_without_an_output_that_somebody_stated_runs_only_dry() -> None:
    cell = replace(CELL, signals=replace(CELL.signals, mode="analog"))
    placement = replace(PLACEMENT, flow_unstated=cell.signals.flow_unstated)
    assert placement.missing[-1] == "the flow output (signals.flow and flow_per_mm3_s)"
    program = write(cell=cell, placement=placement)
    assert program.dry_run
    assert not [line for line in code_of(program) if re.search(r"SetAO|TriggSpeed|geoOn:=1", line)]
    # What is stated makes nothing missing.
    assert replace(PLACEMENT, flow_unstated=ANALOG.signals.flow_unstated).missing == PLACEMENT.missing


def test_the_flow_is_written_where_it_changes_by_a_percent_and_ends_with_each_deposit() -> None:
    poses = stream(points=40)
    poses = replace(poses, flow=np.where(poses.deposit, 0.5 * (1.0 + 0.001 * np.arange(poses.count)), 0.0))
    text = text_of(write(poses, cell=ANALOG), "GeoPrint.mod")
    scales = [float(found) for found in re.findall(r"tGeoFlow,0\\Start,0.04,aoFlow,([\d.E-]+)\*geoOn", text)]
    assert 6 <= len(scales) <= 10
    assert all(0.999 <= later / earlier <= 1.05 for earlier, later in pairwise(scales))
    assert text.count("TriggSpeed tGeoNoFlow,0,0.04,aoFlow,0;") == 2


def test_a_move_of_many_triggers_has_its_target_in_the_line_before(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = text_of(write(cell=ANALOG), "GeoPrint.mod").split("\n")
    longest = max(map(len, whole))
    monkeypatch.setattr(rapid, "LONGEST_LINE", longest - 1)
    # It is read back and executed as the plan.
    lines = text_of(write(cell=ANALOG), "GeoPrint.mod").split("\n")
    assert max(map(len, lines)) < longest
    first = next(number for number, line in enumerate(lines) if line.startswith("    geoTarget:=[["))
    assert lines[first + 1].startswith("    TriggL geoTarget,vGeo")
    parted = [number for number, line in enumerate(whole) if len(line) == longest]
    joined = [each for each in lines if not each.startswith(("    geoTarget:=", "    VAR robtarget"))]
    assert len(joined) == len(whole)
    assert [number for number, line in enumerate(joined) if "TriggL geoTarget" in line] == parted
    assert lines.count("    VAR robtarget geoTarget;") == len(parted)


@pytest.mark.parametrize(
    ("field", "value"),
    [("mass_kg", 0.0), ("cog", np.zeros(3)), ("inertia_kg_m2", np.array([0.1, -0.1, 0.1]))],
)
def test_a_load_that_a_controller_refuses_is_refused_first(field: str, value: object) -> None:
    cell = replace(CELL, tool=replace(CELL.tool, **{field: value}))  # pyright: ignore[reportArgumentType]
    with pytest.raises(UsageError, match="centre of gravity"):
        write(cell=cell)


def test_a_number_that_is_not_finite_is_refused() -> None:
    cell = replace(CELL, tool=replace(CELL.tool, mass_kg=float("nan")))
    with pytest.raises(InputError, match="finite"):
        write(cell=cell)


def test_a_placement_that_is_not_the_one_of_the_joint_path_is_refused() -> None:
    poses = stream()
    moved = replace(PLACEMENT, T_fixture_work=np.eye(4))
    with pytest.raises(InputError, match="another placement"):
        orders_of(
            joint_path(poses), targets(poses), trajectory(poses), placement=moved,
            lifted_joints=joint_path(poses).joints, extent=EXTENT,
        )  # fmt: skip


def broken_targets(**changes: object) -> Targets:
    return replace(targets(stream()), **changes)  # pyright: ignore[reportArgumentType]


def without(index: int) -> Targets:
    chosen = targets(stream())
    kept = np.delete(np.arange(chosen.poses.size), index)
    return Targets(poses=chosen.poses[kept], zones=chosen.zones[kept], speeds=chosen.speeds[kept])


@pytest.mark.parametrize(
    ("chosen", "reason"),
    [
        (without(0), "first and the last"),
        (without(17), "first and the last"),
        (without(1), "pose 1 of run 1 begins or ends a deposit"),
        (without(7), "pose 7 of run 1 begins or ends a deposit"),
        (broken_targets(poses=np.zeros(18, dtype=np.int64)), "first and the last"),
        (broken_targets(zones=np.full(18, -0.1)), "at least 0 mm"),
        (broken_targets(speeds=np.zeros(18)), "at least 0.01 mm/s"),
    ],
)
def test_targets_that_would_drive_another_path_are_refused(chosen: Targets, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        write(chosen=chosen)


def test_a_deposit_of_a_single_pose_is_refused() -> None:
    poses = stream()
    deposit = np.zeros(poses.count, dtype=np.bool_)
    deposit[2] = True
    with pytest.raises(InputError, match="alone in its deposit"):
        write(replace(poses, deposit=deposit), chosen=broken_targets(zones=np.zeros(18)))


def test_a_writer_that_errs_is_caught_before_anything_is_returned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rapid, "_ZONE_DIGITS", 0)
    with pytest.raises(VerificationError, match="zone"):
        write()


angles = st.floats(-np.pi, np.pi)
lengths = st.floats(-900.0, 900.0)


@given(frame=st.tuples(angles, angles, angles, lengths, lengths, lengths), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=8, deadline=None)
def test_any_placement_and_any_poses_read_back_as_written(frame: tuple[float, ...], seed: int) -> None:
    generator = np.random.default_rng(seed)
    rotation = Rotation.from_euler("zyx", frame[:3]).as_matrix()
    placement = replace(PLACEMENT, T_base_fixture=transforms.rigid(rotation, np.array(frame[3:])))
    poses = stream()
    quaternions = Rotation.random(poses.count, random_state=generator).as_quat(scalar_first=True)
    poses = replace(poses, tips=generator.uniform(-900, 900, (poses.count, 3)), quaternions=quaternions)
    program = write(poses, placement=placement)
    verify_program(
        program, orders(poses, placement), cell=CELL, placement=placement, surface_within=0.214, events=events(poses)
    )
    assert max(len(line) for line in code_of(program)) <= 220
