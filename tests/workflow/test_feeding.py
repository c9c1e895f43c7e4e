"""A plan with feedback: flow and valve as the last print of these paths teaches them, or a sentence why not."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint import cli
from geoprint.config import job_of, packaged_cell_text
from geoprint.errors import GeoprintError, InputError, UsageError, VerificationError
from geoprint.geometry.files import save_ply
from geoprint.inspection.executing import printed_program
from geoprint.inspection.inputs import read_plan
from geoprint.inspection.scan_target import PlannedDeposit
from geoprint.model import FloatArray
from geoprint.postprocessor import json_bytes
from geoprint.reporting import as_json, read_record
from geoprint.reporting.prints import record_printed
from geoprint.reporting.records.inspection import (
    EstimateRecord,
    FromPlanRecord,
    PartOfRunRecord,
    RegistrationRecord,
    ScanAppraisalRecord,
    ScanFileRecord,
    ScannedRunRecord,
    sealed,
)
from geoprint.reporting.records.plan import PlanRecord
from geoprint.results import Plan
from geoprint.workflow import compare, job_from, plan, save_plan
from geoprint.workflow.feedback import with_feedback
from tests.meshes import plate

ANALOG = 'mode = "analog"\nflow = "aoFlow"\nflow_per_mm3_s = 0.1'
NOTHING = EstimateRecord(value=1.0, deviation=0.01)


@pytest.fixture(scope="module", params=["heat"])
def planned(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Return the plan of a plate with two runs, whose cell sets the flow along the path."""
    folder = tmp_path_factory.mktemp("planned")
    save_ply(plate((20.0, 16.0), (8, 6)), folder / "plate.ply")
    text = packaged_cell_text("irb120-bent45").replace('mode = "io"', ANALOG)
    (folder / "analog.toml").write_text(text, encoding="utf-8")
    job = job_of(
        surface=folder / "plate.ply", unit="mm", spacing=4.0, backend=request.param, robot=False,
        cell=folder / "analog.toml",
    )  # fmt: skip
    return plan(job)


@pytest.fixture(scope="module")
def bundle(planned: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the bundle of that plan."""
    folder = tmp_path_factory.mktemp("fed") / "plan"
    save_plan(planned, folder)
    return folder


def appraisal(bundle: Path, share: Callable[[FloatArray, FloatArray], FloatArray]) -> ScanAppraisalRecord:
    """Return the appraisal of a print of a bundle: each part of a run has a share of its volume, by where it lies."""
    printed = read_plan(bundle)
    deposit = PlannedDeposit(printed.poses, spacing=printed.spacing, height=printed.height)
    runs, parts = deposit.runs, deposit.parts
    firsts = np.unique(parts, return_index=True)[1]
    lasts = np.append(firsts[1:], parts.size) - 1
    starts, ends = runs.arcs[firsts] - 0.5 * runs.lengths[firsts], runs.arcs[lasts] + 0.5 * runs.lengths[lasts]
    numbers, shares = runs.runs[firsts], share(starts, ends)
    program = printed_program(bundle, printed, runs=numbers, starts=starts, ends=ends)
    row = (1.0, 0.0, 0.0, 0.0)
    record = ScanAppraisalRecord(
        schema=2,
        version="1",
        kind="scan",
        printed=record_printed(program),
        scan=ScanFileRecord(file="print.ply", sha256="0" * 64, unit="mm", points=1000, used=900),
        registration=RegistrationRecord(
            scale=None,
            pose=(row, row, row, row), middle_mm=(0.0, 0.0, 0.0), covariance=(), shift_deviation_mm=0.003,
            turn_deviation_deg=0.01, given=False, loose=0, noise_mm=0.05, on_part=1.0, bead_width=1.0, offset_mm=0.0,
        ),
        layer_height_mm=printed.height,
        seen=1.0,
        covered=NOTHING,
        bare=0.0,
        volume_seen_mm3=NOTHING,
        volume_ratio=NOTHING,
        volume_planned_mm3=deposit.volume,
        thickness_mm=NOTHING,
        from_plan=FromPlanRecord(mean=NOTHING, rms_mm=0.1, p5_mm=0.0, p95_mm=0.1, noise_mm=0.01),
        runs=tuple(
            ScannedRunRecord(
                run=run, length_mm=float(runs.lengths[runs.runs == run].sum()), seen_mm=0.0, missing_mm=0.0,
                ratio=None, crest_mm=None, offset_mm=None,
            )
            for run in np.unique(runs.runs).tolist()
        ),
        parts=tuple(
            PartOfRunRecord(
                run=int(numbers[k]), start_mm=float(starts[k]), end_mm=float(ends[k]), ratio=float(shares[k]),
                deviation=0.01, offset_mm=None, offset_deviation_mm=None,
            )
            for k in range(numbers.size)
        ),
    )  # fmt: skip
    return sealed(record)


def written(folder: Path, record: ScanAppraisalRecord) -> Path:
    path = folder / "appraisal.json"
    path.write_bytes(json_bytes(as_json(record)))
    return path


def fed(bundle: Path, record: ScanAppraisalRecord, folder: Path) -> PlanRecord:
    return save_plan(plan(job_from(bundle, feedback=written(folder, record))), folder / "fed")


def feeding(planned: Plan, record: ScanAppraisalRecord) -> Plan:
    """Return a plan with the feedback, as the last stage of its paths adds it; they are not planned again."""
    text = json_bytes(as_json(record)).decode()
    return with_feedback(replace(planned, workpiece=replace(planned.workpiece, feedback_text=text)))


@pytest.fixture(scope="module")
def lacking(bundle: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the bundle whose last print had four fifths of its volume everywhere."""
    folder = tmp_path_factory.mktemp("lacking")
    fed(bundle, appraisal(bundle, lambda starts, _: np.full(starts.size, 0.8)), folder)
    return folder / "fed"


def test_what_a_print_lacks_is_commanded_on_top_and_told(bundle: Path, lacking: Path) -> None:
    record = read_record(lacking / "plan.json", PlanRecord)
    assert record.feedback is not None
    assert [change.name for change in record.feedback.changes] == ["constant"]
    before, after = read_plan(bundle), read_plan(lacking)
    assert after.poses.flow == pytest.approx(before.poses.flow)
    nominal = before.spacing * before.height
    commanded = (after.factors * after.poses.flow)[after.poses.deposit]
    assert commanded == pytest.approx(
        np.minimum(1.25 * before.poses.flow[before.poses.deposit], 1.5 * nominal), rel=0.01
    )
    (note,) = (note for note in record.notes if note.startswith("feedback: print.ply shows"))
    assert (
        "print.ply shows the volume of plan 20.0 % (RMS) off what its program deposits: 0.80 of it everywhere" in note
    )


def test_a_print_as_planned_changes_no_byte_of_the_path(bundle: Path, tmp_path: Path) -> None:
    record = fed(bundle, appraisal(bundle, lambda starts, _: np.ones(starts.size)), tmp_path)
    assert (tmp_path / "fed" / "poses.csv").read_bytes() == (bundle / "poses.csv").read_bytes()
    assert any("none of it significant" in note for note in record.notes)


def test_a_second_print_is_held_against_what_was_wanted_and_corrected_further(
    bundle: Path, lacking: Path, tmp_path: Path
) -> None:
    again = appraisal(lacking, lambda starts, _: np.full(starts.size, 0.96))
    assert min(part.factor for part in again.printed.parts) == pytest.approx(1.0 / 0.8, rel=0.01)
    record = fed(bundle, again, tmp_path).feedback
    assert record is not None
    assert record.least_factor == pytest.approx(1.0 / 0.8 / 0.96, rel=0.01)


# What is fed depends on the paths alone, and not on who made them: one test takes those of the other backend.
@pytest.mark.parametrize("planned", ["lscm"], indirect=True)
def test_a_late_valve_is_commanded_earlier(planned: Plan, bundle: Path, tmp_path: Path) -> None:
    def late(starts: FloatArray, ends: FloatArray) -> FloatArray:
        return 1.0 - np.where(starts == 0.0, 0.8 / (ends - starts), 0.0)

    path = written(tmp_path, appraisal(bundle, late))
    again = plan(job_from(bundle, feedback=path))
    assert again.fed is not None
    assert again.fed.correction.opening == pytest.approx(0.8, abs=0.1)
    cell = planned.workpiece.cell
    found = again.workpiece.cell.signals.valve_open - cell.signals.valve_open
    assert found == pytest.approx(again.fed.correction.opening / cell.process.speed)


def test_a_bundle_with_feedback_is_planned_again_to_the_same_bytes(bundle: Path, tmp_path: Path) -> None:
    fed(bundle, appraisal(bundle, lambda starts, _: np.linspace(0.7, 0.9, starts.size)), tmp_path)
    (tmp_path / "appraisal.json").unlink()
    save_plan(plan(job_from(tmp_path / "fed")), tmp_path / "again")
    names = {path.name for path in (tmp_path / "fed").iterdir()}
    assert {"feedback.json", "feedback.csv"} < names
    differ = [
        name
        for name in names - {"timings.json"}
        if (tmp_path / "fed" / name).is_file()
        and (tmp_path / "fed" / name).read_bytes() != (tmp_path / "again" / name).read_bytes()
    ]
    assert differ == []
    (tmp_path / "fed" / "feedback.json").write_text("{}", encoding="utf-8")
    with pytest.raises(VerificationError, match=r"feedback\.json"):
        job_from(tmp_path / "fed")


def test_a_table_of_flow_that_was_changed_is_refused(lacking: Path, tmp_path: Path) -> None:
    table = shutil.copytree(lacking, tmp_path / "fed") / "feedback.csv"
    table.write_bytes(table.read_bytes()[:-40])
    with pytest.raises(VerificationError, match=r"feedback\.csv"):
        read_plan(tmp_path / "fed")


def changed(record: ScanAppraisalRecord, **changes: object) -> ScanAppraisalRecord:
    """Return an appraisal of another program, with the seal that `appraise` would have given it."""
    return sealed(record.model_copy(update={"printed": record.printed.model_copy(update=changes)}))


def test_feedback_on_other_paths_or_another_part_is_refused(planned: Plan, bundle: Path, tmp_path: Path) -> None:
    record = appraisal(bundle, lambda starts, _: np.full(starts.size, 0.8))
    with pytest.raises(InputError, match=r"the feedback: it has 2 runs, the plan has \d+: plan what was printed"):
        plan(job_from(bundle, feedback=written(tmp_path, record), spacing=2.5))
    first, *others = record.printed.runs
    longer = first.model_copy(update={"length_mm": first.length_mm + 0.5})
    with pytest.raises(InputError, match=r"run 1 was .* mm long in print, .* mm in the plan"):
        feeding(planned, changed(record, runs=(longer, *others)))
    x, y, z = first.middle_mm
    higher = first.model_copy(update={"middle_mm": (x, y, z + 0.5)})
    with pytest.raises(InputError, match=r"run 1 is 0\.50 mm off the plan, so another layer or other"):
        feeding(planned, changed(record, runs=(higher, *others)))
    with pytest.raises(InputError, match=r"whose file differs from plate\.ply. Plan the part that was printed"):
        feeding(planned, changed(record, part_sha256="f" * 64))


def on_valve(tmp_path: Path) -> Path:
    """Return a cell like that of the bundle, but for its valve, which only opens and shuts."""
    cell = tmp_path / "io.toml"
    cell.write_text(packaged_cell_text("irb120-bent45"), encoding="utf-8")
    return cell


def test_what_is_of_the_dispenser_or_the_material_is_not_carried_to_another_dispenser(
    bundle: Path, tmp_path: Path
) -> None:
    path = written(tmp_path, appraisal(bundle, lambda starts, _: np.full(starts.size, 0.8)))
    said = r'signals\.mode was "analog", in io\.toml it is "io".*`geoprint plan --from plan --cell io\.toml --out next`'
    with pytest.raises(UsageError, match=said):
        plan(job_from(bundle, feedback=path, cell=on_valve(tmp_path)))


def test_a_print_as_its_program_deposits_it_changes_nothing_on_any_dispenser(bundle: Path, tmp_path: Path) -> None:
    record = appraisal(bundle, lambda starts, _: np.ones(starts.size))
    # The program itself deposits 1.6 times the volume of one run, and so does its print.
    parts = tuple(part.model_copy(update={"deposited": 1.6}) if part.run else part for part in record.printed.parts)
    rows = tuple(part.model_copy(update={"ratio": 1.6}) if part.run else part for part in record.parts)
    program = record.printed.model_copy(update={"parts": parts})
    again = sealed(record.model_copy(update={"parts": rows, "printed": program}))
    made = plan(job_from(bundle, feedback=written(tmp_path, again), cell=on_valve(tmp_path)))
    assert made.fed is not None
    assert made.fed.correction.changes == ()


def test_a_valve_that_lets_too_little_through_is_passed_by_slower(bundle: Path, tmp_path: Path) -> None:
    cell = on_valve(tmp_path)
    save_plan(plan(job_from(bundle, cell=cell)), tmp_path / "valve")
    recorded = appraisal(tmp_path / "valve", lambda starts, _: np.full(starts.size, 0.8))
    record = save_plan(plan(job_from(tmp_path / "valve", feedback=written(tmp_path, recorded))), tmp_path / "slower")
    assert record.feedback is not None
    assert record.feedback.speed_mm_s == pytest.approx(16.0, rel=0.01)
    assert record.settings.speed_mm_s == record.feedback.speed_mm_s
    printed = read_plan(tmp_path / "slower")
    # Beside a pressure that stays: 1.25 times the flow at 0.8 times the speed.
    assert printed.factors[printed.poses.deposit] * record.settings.speed_mm_s == pytest.approx(20.0)
    much = written(tmp_path, appraisal(tmp_path / "valve", lambda starts, _: np.full(starts.size, 1.25)))
    with pytest.raises(UsageError, match=r"takes 25 mm/s, but .*speed_mm_s .* is 20\. Lower the air"):
        plan(job_from(tmp_path / "valve", feedback=much))


@pytest.mark.parametrize(
    ("text", "error", "said"),
    [
        ("", InputError, "it is not an appraisal of a print"),
        ("[1, 2", InputError, "it is not an appraisal of a print"),
        ('{"printed": 3}', InputError, r"it is not an appraisal of a print; give the appraisal\.json of"),
        (
            '{"photographs": [{}]}',
            InputError,
            "its photograph was not compared with a plan: run `geoprint appraise PHOTO",
        ),
        ('{"plan": "p", "photographs": [{}, {}]}', InputError, "it covers 2 photographs, but feedback needs one"),
        ('{"plan": "p", "version": "0.1.0"}', InputError, "appraise the print again, `geoprint appraise FILE --plan p"),
        ('{"printed": {"plan": "p"}, "version": "9"}', InputError, "its figures were edited"),
        ("[" * 100_000, InputError, "it is not an appraisal of a print"),
        (None, UsageError, "cannot be read"),
    ],
)
def test_what_is_no_appraisal_of_a_print_is_refused_with_the_next_step(
    bundle: Path, tmp_path: Path, text: str | None, error: type[GeoprintError], said: str
) -> None:
    path = tmp_path / "appraisal.json"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    with pytest.raises(error, match=f"`--feedback .*{said}"):
        plan(job_from(bundle, feedback=path))


def test_figures_that_somebody_has_edited_are_refused(bundle: Path, tmp_path: Path) -> None:
    path = written(tmp_path, appraisal(bundle, lambda starts, _: np.full(starts.size, 0.8)))
    path.write_text(path.read_text(encoding="utf-8").replace('"ratio": 0.8', '"ratio": 0.9', 1), encoding="utf-8")
    said = r"its figures were edited .* again: `geoprint appraise FILE --plan plan --out appraised`"
    with pytest.raises(InputError, match=said):
        plan(job_from(bundle, feedback=path))


@pytest.mark.parametrize("wrong", [{"deviation": -1.0}, {"end_mm": 0.0}])
def test_figures_that_cannot_be_are_refused(planned: Plan, bundle: Path, wrong: dict[str, float]) -> None:
    record = appraisal(bundle, lambda starts, _: np.ones(starts.size))
    feeding(planned, record)
    parts = (record.parts[0].model_copy(update=wrong), *record.parts[1:])
    with pytest.raises(InputError, match=r"^the feedback: "):
        feeding(planned, sealed(record.model_copy(update={"parts": parts})))


def test_feedback_is_of_one_plan_and_no_comparison(bundle: Path, tmp_path: Path) -> None:
    path = written(tmp_path, appraisal(bundle, lambda starts, _: np.ones(starts.size)))
    with pytest.raises(UsageError, match="fits the paths of one plan, but several are made here"):
        compare(job_from(bundle, feedback=path))


def test_the_option_of_the_command_plans_with_it(
    bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, appraisal(bundle, lambda starts, _: np.full(starts.size, 0.8)))
    asked = ["plan", "--from", str(bundle), "--feedback", str(path), "--out", str(tmp_path / "out"), "--json"]
    monkeypatch.setattr("sys.argv", ["geoprint", *asked])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code in {0, None}
    assert json.loads(capsys.readouterr().out)["feedback"]["changes"][0]["cause"] == "constant"
    record = read_record(tmp_path / "out" / "plan.json", PlanRecord)
    assert record.feedback is not None
