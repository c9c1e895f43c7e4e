"""How far a program is proven: geoprint claims what it did, people say what they saw, and none of that is lost."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

import geoprint
from geoprint.errors import UsageError, VerificationError
from geoprint.postprocessor import Executed, NotExecuted
from geoprint.reporting import PlanRecord, check_summary, read_record
from geoprint.reporting.evidence import evidence_rows
from geoprint.reporting.part_report import evidence_table
from geoprint.reporting.records.evidence import EvidenceRecord
from geoprint.reporting.records.plan import BendRecord
from geoprint.reporting.run_sheet import check_text
from geoprint.results import Plan
from geoprint.workflow import check_bundle, plan, record_seen, save_plan
from tests.commands import called

WHEN = datetime(2026, 3, 4, 15, 6, 7, tzinfo=UTC)


def record(bundle: Path) -> EvidenceRecord:
    evidence = json.loads((bundle / "plan.json").read_text())["robot"][0]["evidence"]
    return EvidenceRecord.model_validate_json(json.dumps(evidence))


def test_a_plan_claims_that_it_was_parsed_with_figures(printed: Path) -> None:
    evidence = json.loads((printed / "plan.json").read_text())["robot"][0]["evidence"]
    files = sorted(path for path in (printed / "rapid").iterdir() if path.is_file())
    assert evidence["parsed"]["modules"] == len(files)
    assert evidence["parsed"]["lines"] == sum(len(path.read_text().splitlines()) for path in files)
    assert evidence["parsed"]["targets"] == len((printed / "targets.csv").read_text().splitlines()) - 1
    executed = evidence["executed"]
    assert executed["scenarios"][:2] == ["dry", "printing"]
    left = executed["not_executed"]
    assert executed["lines_executed"] + sum(len(each["lines"]) for each in left) == executed["lines"]
    assert len({(each["file"], each["reason"]) for each in left}) == len(left)
    assert executed["largest_motion_mm"] <= 0.001
    assert executed["largest_output_mm"] <= 0.05


def test_what_a_person_saw_stands_on_the_run_sheet_with_date_and_controller(copy: Path) -> None:
    seen = record_seen(check_bundle(copy), "loaded", note="no errors", controller="cell 3/RobotWare 6.15", when=WHEN)
    assert seen.date == "2026-03-04T15:06:07+00:00"
    record_seen(check_bundle(copy), "printed", note="two beads, even", when=WHEN)
    checked = check_bundle(copy)
    assert checked.findings == ()
    said = " ".join(check_text(checked).split())
    assert "loaded on a virtual controller: seen 2026-03-04 on cell 3/RobotWare 6.15: no errors" in said
    assert "run dry: not yet" in said
    assert "printed: seen 2026-03-04: two beads, even" in said
    found = json.loads(json.dumps(check_summary(checked)))
    assert [one["stage"] for one in found["seen"]] == ["loaded", "printed"]
    assert found["evidence"]["program_sha256"] == found["seen"][0]["program_sha256"]
    assert "evidence.json" not in json.loads((copy / "manifest.json").read_text())["sha256"]


def test_switches_do_not_make_another_program_but_another_word_does(copy: Path) -> None:
    cell = copy / "rapid" / "GeoCell.mod"
    before = check_bundle(copy).program_sha256
    cell.write_text(cell.read_text().replace("geoDryRun:=TRUE", "geoDryRun:=FALSE"))
    assert check_bundle(copy).program_sha256 == before == record(copy).program_sha256
    cell.write_text(cell.read_text().replace("geoDryRun:=FALSE", "geoDryRan:=FALSE"))
    assert check_bundle(copy).program_sha256 != before


def test_what_was_seen_of_another_program_does_not_count(copy: Path) -> None:
    seen = record_seen(check_bundle(copy), "dry", note="fine", when=WHEN)
    content = (copy / "evidence.json").read_text().replace(seen.program_sha256, "0" * 64)
    (copy / "evidence.json").write_text(content)
    said = " ".join(check_text(check_bundle(copy)).split())
    assert "run dry: not yet" in said
    assert "does not count: reported for another program: run dry 2026-03-04: fine" in said


def test_nothing_is_recorded_of_a_bundle_with_findings(copy: Path) -> None:
    (copy / "surface.ply").write_bytes(b"")
    with pytest.raises(VerificationError, match=r"differs from the plan .* \(surface\.ply: .*is not recorded"):
        record_seen(check_bundle(copy), "dry", note="fine", when=WHEN)
    assert not (copy / "evidence.json").exists()


def test_what_nobody_can_have_seen_is_refused(copy: Path, compared: Path) -> None:
    with pytest.raises(UsageError, match="`--record flown` is unknown; what people see is one of loaded, dry, printed"):
        record_seen(check_bundle(copy), "flown", note="fine")
    with pytest.raises(UsageError, match="state what you saw: `--note`"):
        record_seen(check_bundle(copy), "dry", note=" \n")
    with pytest.raises(UsageError, match="holds no program, so nobody can have seen"):
        record_seen(check_bundle(compared / "heat"), "dry", note="fine")
    checked = check_bundle(copy)
    assert checked.setup is not None
    unplaced = replace(checked.setup.placement, part_stated=False)
    nowhere = replace(checked, setup=replace(checked.setup, placement=unplaced))
    with pytest.raises(UsageError, match="only runs dry, because the pose of the part on the fixture"):
        record_seen(nowhere, "printed", note="fine")
    assert not (copy / "evidence.json").exists()


def test_evidence_that_cannot_be_read_is_a_finding_and_stays(copy: Path) -> None:
    (copy / "evidence.json").write_text('{"schema": 1, "seen": [{"stage": "flown"}]}')
    (found,) = check_bundle(copy).findings
    assert found.file == "evidence.json"
    with pytest.raises(VerificationError):
        record_seen(check_bundle(copy), "dry", note="fine")
    assert "flown" in (copy / "evidence.json").read_text()


def test_overwriting_loses_nothing_that_a_person_recorded(copy: Path, printed_plan: Plan) -> None:
    record_seen(check_bundle(copy), "dry", note="fine", when=WHEN)
    before = (copy / "evidence.json").read_bytes()
    # The same program counts on; another one keeps the entry as that of another.
    save_plan(printed_plan, copy, overwrite=True)
    assert (copy / "evidence.json").read_bytes() == before
    assert "run dry: seen 2026-03-04: fine" in check_text(check_bundle(copy))
    save_plan(plan(geoprint.job_from(copy, robot=False)), copy, overwrite=True)
    assert (copy / "evidence.json").read_bytes() == before


def test_the_command_records_and_refuses(
    copy: Path, compared: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert called(monkeypatch, "check", copy, "--note", "fine") == 2
    assert "belong to what you saw: add `--record loaded`" in capsys.readouterr().err
    assert called(monkeypatch, "check", compared, "--record", "dry", "--note", "fine") == 2
    assert "holds several bundles: name the one" in capsys.readouterr().err
    assert called(monkeypatch, "check", copy, "--record", "dry", "--note", "fine", "--controller", "c/6.15") == 0
    assert " on c/6.15: fine" in capsys.readouterr().out
    assert json.loads((copy / "evidence.json").read_text())["seen"][0]["controller"] == "c/6.15"


def test_a_check_tells_what_it_executed_itself(printed: Path) -> None:
    checked = check_bundle(printed)
    executed = json.loads((printed / "plan.json").read_text())["robot"][0]["evidence"]["executed"]
    found = json.loads(json.dumps(check_summary(checked)))["evidence"]["executed"]
    # It executes what is written, with so many digits.
    assert found.pop("largest_output_mm") == pytest.approx(executed.pop("largest_output_mm"), abs=2e-6)
    assert found == executed
    assert checked.executed is not None
    # A program that does not run, or to other targets, was not executed, whatever plan.json says.
    elsewhere = replace(checked.executed, motion=float("inf"), outputs=float("inf"))
    for other in (None, elsewhere):
        record_now = replace(checked, executed=other)
        assert "executed" not in json.loads(json.dumps(check_summary(record_now)))["evidence"]
        assert "executed: not yet" in " ".join(check_text(record_now).split())


def test_the_run_sheet_tells_of_moves_jerk_and_bends_in_plain_words(printed: Path) -> None:
    checked = check_bundle(printed)
    assert checked.record is not None
    robot = checked.record.robot[0]
    bends = tuple(
        BendRecord(
            run=number, kind="rounded", place_mm=(number, 0.0, 0.0), arc_mm=1.0, radius_mm=0.5,
            targets=7, offset_mm=number / 100, shortest_ms=12.0,
        )
        for number in range(6)
    )  # fmt: skip
    targets = robot.motion.targets.model_copy(update={"shortest_ms": 12.5, "closer": 4, "bends": bends})
    motion = robot.motion.model_copy(update={"targets": targets, "largest_jerk_m_s3": 104.2})
    bent = checked.record.model_copy(update={"robot": (robot.model_copy(update={"motion": motion}),)})
    said = " ".join(check_text(replace(checked, record=bent)).split())
    assert "shortest move 12.5 ms (4 below 20 ms" in said
    assert "largest jerk of the tip on deposit 104 m/s3" in said
    # Run 0 of plan.json has no offset; the farthest of the other five come first, numbered from 1.
    assert "off the path in 5 tight bends, the farthest (plan.json lists all): 0.050 mm in run 6 at (5.0, " in said
    assert "0.030 mm in run 4" in said
    assert "0.020 mm in run 3" not in said


def test_the_report_says_what_is_proven_of_each_backend(printed: Path, compared: Path) -> None:
    plans = [read_record(folder / "plan.json", PlanRecord) for folder in (printed, compared / "heat")]
    rows = {row.quantity: row.values for row in evidence_table(plans)}
    assert rows["printed"] == ("not yet", "no program")
    assert rows["parsed"][0].startswith("by geoprint: ")
    assert rows["executed"][0].startswith("by geoprint, without a controller, in ")
    assert rows["off the plan"][0].startswith("at most 0.000")
    assert "no simulation knows" not in rows
    assert evidence_table(plans[1:]) == []


def test_what_was_executed_here_says_that_this_is_no_controller(printed: Path) -> None:
    executed = Executed(
        scenarios=("dry", "printing"), statements=322, executed=320, motion=0.0004,
        move_time=0.00052, run_time=0.0003, outputs=0.02, not_known=("lag", "ramps"),
        not_executed=(NotExecuted(file="GeoGuard.mod", lines=(44, 46), reason="an error"),),
    )  # fmt: skip
    evidence = record(printed).model_copy(update={"executed": executed})
    rows = dict(evidence_rows(evidence, (), program_sha256=evidence.program_sha256))
    assert rows["executed"] == (
        "by geoprint, without a controller, in 2 scenarios: 320 of 322 lines, not executed 2 (plan.json says why)"
    )
    assert rows["off the plan"] == "at most 0.0004 mm, outputs 0.0200 mm, a move 0.52 ms, a run 0.03 % of its time"
    assert rows["no simulation knows"] == "lag; ramps"
    without = evidence.model_copy(update={"executed": None})
    assert dict(evidence_rows(without, (), program_sha256=""))["executed"] == "not yet"
