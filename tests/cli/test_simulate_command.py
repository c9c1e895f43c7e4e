"""`geoprint simulate` as a person meets it: what a program lays as it stands, and one sentence where it cannot."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.programs.simulated import FIXTURE, LAGS, Modules, edited, late, left_open, slowed, within_run
from geoprint import cli
from geoprint.config import job_of
from geoprint.geometry.files import save_ply
from geoprint.inspection import simulated
from geoprint.reporting import read_record
from geoprint.reporting.records.inspection import SimulatedRecord
from geoprint.workflow import check_bundle, plan, save_plan
from tests.commands import called
from tests.meshes import plate
from tests.workflow.test_checking import cell_text

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plate of which a program was written, with a known placement and a valve that lags."""
    folder = tmp_path_factory.mktemp("simulate")
    save_ply(plate((16.0, 12.0), (12, 9), jitter_seed=1), folder / "plate.ply")
    (folder / "cell.toml").write_text(cell_text(source=FIXTURE, lags=LAGS), encoding="utf-8")
    job = job_of(surface=folder / "plate.ply", unit="mm", spacing=2.5, backend="lscm", cell=folder / "cell.toml")
    save_plan(plan(job), folder / "planned")
    return folder / "planned"


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    def call(*arguments: object) -> tuple[int, str, str]:
        status = called(monkeypatch, "simulate", *arguments)
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return call


def record_of(run: Run, folder: Path, *options: object) -> SimulatedRecord:
    status, stdout, stderr = run(folder, "--json", *options)
    assert status == 0, stderr
    return SimulatedRecord.model_validate_json(stdout)


def test_a_program_as_written_lays_what_its_plan_says_that_it_lays(run: Run, bundle: Path) -> None:
    record = record_of(run, bundle)
    assert (record.laid_by, len(record.runs)) == ("program", 3)
    planned = json.loads((bundle / "plan.json").read_text())
    settings, (robot,) = planned["settings"], planned["robot"]
    rate = settings["spacing_mm"] * settings["layer_height_mm"] * settings["speed_mm_s"]
    flowing = [run["material_s"] for run in robot["program"]["switching"]["runs"]]
    assert [each.laid_mm3 for each in record.runs] == pytest.approx(
        [rate * (end - begin) for begin, end in flowing], rel=1e-3
    )
    assert record.laid_mm3 / record.wanted_mm3 == pytest.approx(robot["motion"]["deposited"]["share"], rel=1e-2)
    assert all(each.beside_mm3 == 0.0 and each.longest_bare_mm < 0.3 for each in record.runs)


def test_a_speed_halved_in_one_run_lays_twice_as_much_there_and_no_more_elsewhere(
    run: Run, bundle: Path, tmp_path: Path
) -> None:
    copy = edited(bundle, tmp_path / "copy", lambda modules: slowed(modules, run=1, factor=2.0))
    assert check_bundle(copy).findings
    before, after = record_of(run, bundle), record_of(run, copy)
    # From when the valve opens to when it shuts, whose lags stay as long.
    assert after.runs[0].laid_mm3 / before.runs[0].laid_mm3 == pytest.approx(2.0, abs=0.05)
    assert after.runs[1].laid_mm3 == pytest.approx(before.runs[1].laid_mm3, rel=1e-3)


def test_a_valve_that_opens_late_or_stays_open_shows(run: Run, bundle: Path, tmp_path: Path) -> None:
    opens_late = edited(bundle, tmp_path / "late", lambda modules: late(modules, run=1))
    stays_open = edited(bundle, tmp_path / "open", lambda modules: left_open(modules, run=1))
    before, lacking, oozing = (record_of(run, each) for each in (bundle, opens_late, stays_open))
    assert lacking.runs[0].longest_bare_mm > before.runs[0].longest_bare_mm + 0.2
    assert lacking.runs[0].laid_mm3 < before.runs[0].laid_mm3
    assert oozing.runs[1].beside_mm3 > 1.0
    assert oozing.runs[1].laid_mm3 > before.runs[1].laid_mm3 + 1.0


def test_a_program_with_another_number_of_targets_is_refused_in_one_sentence(
    run: Run, bundle: Path, tmp_path: Path
) -> None:
    def shortened(modules: Modules) -> Modules:
        lines = modules["GeoPrint.mod"].split("\n")
        first = next(number for number, line in enumerate(lines) if line.lstrip().startswith("MoveL "))
        return {**modules, "GeoPrint.mod": "\n".join([*lines[:first], *lines[first + 1 :]])}

    status, _, stderr = run(edited(bundle, tmp_path / "copy", shortened))
    assert (status, stderr.count("\n")) == (5, 1)
    assert "targets along its path, targets.csv has" in stderr
    stuck = edited(
        bundle,
        tmp_path / "stuck",
        lambda modules: within_run(modules, 1, lambda text: text.replace("  ERROR\n", "    EXIT;\n  ERROR\n")),
    )
    status, _, stderr = run(stuck)
    assert status == 5
    assert "the program does not run to its end" in stderr
    for path in stuck.glob("rapid/*.mod"):
        path.unlink()
    status, _, stderr = run(stuck)
    assert (status, stderr.count("\n")) == (5, 1)
    assert "there is no procedure main. Do not run this program; write it again from its plan." in stderr


def test_a_dry_program_whose_flow_nothing_sets_is_refused_with_the_keys_that_do(run: Run, tmp_path: Path) -> None:
    save_ply(plate((16.0, 12.0), (12, 9), jitter_seed=1), tmp_path / "plate.ply")
    text = cell_text(source=FIXTURE, lags=LAGS).replace('mode = "io"', 'mode = "analog"')
    assert 'mode = "analog"' in text
    (tmp_path / "cell.toml").write_text(text, encoding="utf-8")
    job = job_of(surface=tmp_path / "plate.ply", unit="mm", spacing=2.5, backend="lscm", cell=tmp_path / "cell.toml")
    save_plan(plan(job), tmp_path / "dry")
    status, _, stderr = run(tmp_path / "dry")
    assert (status, stderr.count("\n")) == (3, 1)
    assert "State signals.flow and signals.flow_per_mm3_s in a cell file" in stderr


def test_scan_and_photograph_are_written_to_be_appraised(
    run: Run, bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Beads are 20 pixels wide.
    monkeypatch.setattr(simulated, "PHOTOGRAPH_PIXELS", 400)
    monkeypatch.setattr(simulated, "SCAN_PIXELS", 100)
    out = tmp_path / "out"
    pictured = ("--tone", "srgb", "--exposure", 0.8, "--blur", 1, "--defocus", 2)
    status, stdout, stderr = run(bundle, "--spread", 0.5, "--flow", 0.9, *pictured, "--seed", 3, "--out", out, "--json")
    assert status == 0, stderr
    assert f"written and verified: {out}" in stderr
    assert sorted(path.name for path in out.iterdir()) == [
        "lens.toml", "manifest.json", "marks.csv", "print.png", "scan.xyz", "simulated.json", "simulated.txt",
    ]  # fmt: skip
    record = read_record(out / "simulated.json", SimulatedRecord)
    assert json.loads(stdout) == json.loads((out / "simulated.json").read_text(encoding="utf-8"))
    assert (record.spread, record.flow, record.seed) == (0.5, 0.9, 3)
    marks = ["--fiducials", out / "marks.csv", "--lens", out / "lens.toml"]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(
            "sys.argv", ["geoprint", "appraise", str(out / "print.png"), "--plan", str(bundle), *map(str, marks)]
        )
        with pytest.raises(SystemExit) as ended:
            cli.main()
    assert not ended.value.code
    assert run(bundle, "--out", out)[0] == 2


def test_a_plan_without_a_robot_is_laid_by_its_paths(run: Run, tmp_path: Path) -> None:
    save_ply(plate((16.0, 12.0), (12, 9)), tmp_path / "plate.ply")
    job = job_of(surface=tmp_path / "plate.ply", unit="mm", spacing=2.5, backend="fast-marching", robot=False)
    save_plan(plan(job), tmp_path / "planned")
    record = record_of(run, tmp_path / "planned", "--flow", 1.2)
    assert record.laid_by == "paths"
    assert record.laid_mm3 / record.wanted_mm3 == pytest.approx(1.2, rel=1e-2)
    status, stdout, _ = run(tmp_path / "planned")
    assert status == 0
    assert "by its paths, without a program" in stdout
    assert run(tmp_path)[0] == 3
    assert run(tmp_path / "planned", "--flow", 0)[0] == 3
    assert run(tmp_path / "planned", "--tone", "film")[0] == 2
    assert run(tmp_path / "planned", "--exposure", 0)[0] == 3
