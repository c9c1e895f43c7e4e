"""The command line as a person meets it: one sentence and the right exit status, nothing half written."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import pytest

from geoprint.config import Job, packaged_cell_text
from geoprint.errors import UsageError
from geoprint.geometry.files import save_ply
from tests.commands import called
from tests.meshes import plate

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    def call(*arguments: object) -> tuple[int, str, str]:
        status = called(monkeypatch, *arguments)
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return call


def test_place_prints_where_to_stand_and_writes_nothing(run: Run, small: Path, tmp_path: Path) -> None:
    status, stdout, stderr = run("place", small, "--unit", "mm", "--spacing", 3, "--height", 40, "--json")
    assert status == 0, stderr
    found = json.loads(stdout)
    assert found["position_mm"][2] == 40.0
    assert found["calibrated"] is False
    assert "written" not in stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["plate.ply"]


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "plate.ply"
    save_ply(plate((40.0, 30.0), (20, 15), jitter_seed=1), path)
    return path


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """Return a part that is planned in a second."""
    path = tmp_path / "plate.ply"
    save_ply(plate((10.0, 8.0), (5, 4), jitter_seed=1), path)
    return path


def test_plan_writes_a_bundle_and_prints_json_when_asked(run: Run, small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    status, stdout, stderr = run("plan", small, "--unit", "mm", "--rounds", 5, "--no-robot", "--out", out, "--json")
    assert status == 0, stderr
    found = json.loads(stdout)
    assert found["paths"]["levels"] == 5
    assert "written and verified" in stderr
    assert {path.name for path in out.iterdir()} == {
        "job.toml", "manifest.json", "part.ply", "plan.json", "poses.csv", "report.html", "surface.ply", "timings.json",
    }  # fmt: skip


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compare in this process: one beside it, as tests/workflow/test_beside.py asks for, takes seconds to start."""
    monkeypatch.setattr("geoprint.cli.planning.PROCESSES", 1)


@pytest.mark.parametrize("command", ["plan", "compare"])
def test_what_is_mistyped_is_told_before_anything_is_imported_that_plans(command: str, tmp_path: Path) -> None:
    mistyped = [command, "plate.ply", "--unit", "mm", "--spacing", "0", "--out", str(tmp_path / "out")]
    code = (
        f"import sys\nsys.argv[1:] = {mistyped}\nfrom geoprint import cli\ntry:\n    cli.main()\n"
        "except SystemExit as ended:\n    print(ended.code, 'geoprint.workflow' in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "`--spacing`" in done.stderr
    assert done.stdout.split() == ["2", "False"]


def test_the_version_is_shown(run: Run) -> None:
    status, stdout, _ = run("--version")
    assert (status, stdout.strip()) == (0, version("geoprint"))


@pytest.mark.usefixtures("alone")
def test_compare_prints_the_table_and_writes_both(run: Run, small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    asked = ("--rounds", "2", "--set", "max_tilt=0", "--place", "demo", "--out", out)
    status, stdout, stderr = run("compare", small, "--unit", "mm", *asked)
    assert status == 0, stderr
    assert "covers plate.ply" in stdout or "cover plate.ply" in stdout
    assert "written and verified" in stderr
    assert sorted(path.name for path in out.iterdir()) == [
        "compare.json",
        "compare.png",
        "heat",
        "lscm",
        "manifest.json",
        "report.html",
    ]
    assert (out / "heat" / "rapid" / "GeoPrint.mod").is_file()
    # Samples are for those who ask.
    assert not [*out.rglob("spacing.csv")]


@pytest.mark.usefixtures("alone")
def test_compare_adds_samples_and_figures_when_asked(run: Run, small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    asked = ("--rounds", "3", "--no-robot", "--backend", "heat", "--samples", "--figures", "--out", out)
    status, _, stderr = run("compare", small, "--unit", "mm", *asked)
    assert status == 0, stderr
    assert (out / "heat" / "spacing.csv").is_file()
    assert (out / "figures" / "spacing-map.svg").is_file()


@pytest.mark.parametrize(
    ("arguments", "status", "complaint"),
    [
        ([], 2, "`--spacing` is missing. 10 rounds are about 1.5 mm apart on this part"),
        (["--spacing", "1", "--rounds", "3"], 2, "not both"),
        (["--step", "0.05"], 2, "write `--rounds`"),
        (["--rounds", "0"], 2, "at least 1"),
        (["--spacing", "-1"], 2, "spacing"),
        (["--spacing", "nan"], 2, "spacing"),
        (["--spacing", "1000"], 3, "only 50 mm across"),
        (["--spacing", "35"], 3, "choose a spacing below"),
        (["--spacing", "2", "--backend", "magic"], 2, "choose one of: heat, fast-marching, lscm"),
        (["--spacing", "2", "--resolution", "500"], 2, "write `--set options.lscm.resolution=VALUE`"),
        (["--spacing", "2", "--backend", "lscm", "--set", "options.lscm.resolution=9"], 2, "between 16 and 8192"),
        (["--spacing", "2", "--backend", "lscm", "--set", "options.lscm.resolution=-3"], 2, "resolution"),
        (
            ["--spacing", "2", "--backend", "lscm", "--set", "options.lscm.resolution=20"],
            3,
            "omit `options.lscm.resolution`",
        ),
        (["--spacing", "2", "--place", "moon"], 2, "place"),
        (["--spacing", "2", "--cell", "nowhere.toml"], 2, "geoprint init"),
        (["--spacing", "2", "--from", "point:0,0,99"], 3, "99"),
        (["--spacing", "2", "--body", "nowhere.stl"], 3, "nowhere.stl"),
        (["--spacing", "0.001"], 6, "spacing|edge"),
    ],
)
def test_unclear_input_is_a_helpful_sentence(
    run: Run, part: Path, tmp_path: Path, *, arguments: list[str], status: int, complaint: str
) -> None:
    out = tmp_path / "out"
    extra = [] if "--place" in arguments else ["--no-robot"]
    found, _, stderr = run("plan", part, "--unit", "mm", "--out", out, *extra, *arguments)
    assert found == status, stderr
    assert "Traceback" not in stderr
    assert any(text in stderr for text in complaint.split("|")), stderr
    assert len(stderr.strip().splitlines()) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["plate.ply"]


def test_a_file_without_a_unit_is_asked_for_one(run: Run, part: Path, tmp_path: Path) -> None:
    status, _, stderr = run("plan", part, "--spacing", "2", "--no-robot", "--out", tmp_path / "out")
    assert status == 2
    assert "has no unit" in stderr
    assert "--unit mm" in stderr


@pytest.mark.parametrize("content", [None, b"", b"solid nothing\nendsolid\n", b"this is no mesh"])
def test_a_file_that_is_no_mesh_is_refused(run: Run, tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "part.stl"
    if content is not None:
        path.write_bytes(content)
    status, _, stderr = run("plan", path, "--unit", "mm", "--spacing", "1", "--no-robot", "--out", tmp_path / "out")
    assert status == 3, stderr
    assert "part.stl" in stderr
    assert "Traceback" not in stderr


def test_an_existing_result_is_kept_unless_it_may_be_replaced(run: Run, small: Path, tmp_path: Path) -> None:
    common = ("plan", small, "--unit", "mm", "--rounds", "2", "--no-robot", "--out", tmp_path / "out")
    assert run(*common)[0] == 0
    before = (tmp_path / "out" / "poses.csv").read_bytes()
    status, _, stderr = run(*common)
    assert status == 2
    assert "--overwrite" in stderr
    assert (tmp_path / "out" / "poses.csv").read_bytes() == before
    assert run(*common, "--overwrite")[0] == 0


def test_a_folder_that_cannot_be_written_is_an_error_before_the_work(run: Run, part: Path) -> None:
    status, _, stderr = run("plan", part, "--unit", "mm", "--rounds", "4", "--no-robot", "--out", part / "below")
    assert status == 7
    assert "cannot be written" in stderr or "nothing can be written" in stderr


def test_init_writes_cells_and_a_job_that_load_and_overwrites_nothing(run: Run, tmp_path: Path) -> None:
    from geoprint.config import job_of, load_cell

    assert run("init", tmp_path / "cells")[0] == 0
    assert job_of(surface=tmp_path / "cells" / "job.toml").spacing == 1.0
    for path in (tmp_path / "cells").glob("irb*.toml"):
        assert load_cell(path).robot.model == "irb120"
    status, _, stderr = run("init", tmp_path / "cells")
    assert status == 2
    assert "exists already" in stderr


def test_init_writes_a_cell_for_an_arm_of_ones_own_and_says_what_is_left(run: Run, tmp_path: Path) -> None:
    from geoprint.config import load_cell
    from geoprint.robot.arm import read_urdf

    (tmp_path / "own.urdf").write_text(read_urdf("ur5e"), encoding="utf-8")
    status, stdout, stderr = run("init", tmp_path / "cell", "--urdf", tmp_path / "own.urdf")

    assert status == 0
    assert "inverse kinematics: in closed form." in stdout
    assert "own-cylinders.urdf" in stderr
    assert load_cell(tmp_path / "cell" / "own.toml").robot.model == "own-cylinders.urdf"
    assert sorted(path.name for path in (tmp_path / "cell").iterdir()) == ["own-cylinders.urdf", "own.toml"]
    status, _, stderr = run("init", tmp_path / "other", "--urdf", tmp_path / "own.urdf", "--flange", "hand")
    assert status == 2
    assert "has no link 'hand' for the flange" in stderr
    assert not (tmp_path / "other").exists()


def test_calibrate_reports_and_writes_only_where_told(run: Run, tmp_path: Path) -> None:
    (tmp_path / "corners.csv").write_text("name,x,y,z\na,-50,50,0\nb,50,50,0\nc,50,-50,0\nd,-50,-50,0\n")
    (tmp_path / "touched.csv").write_text("name,x,y,z\na,250.1,50,0\nb,350,50.1,0\nc,350,-50,0.1\nd,250,-50,0\n")
    asked = ("calibrate", tmp_path / "touched.csv", "--model", tmp_path / "corners.csv")
    status, stdout, stderr = run(*asked, "--json")
    assert status == 0, stderr
    assert [point["name"] for point in json.loads(stdout)["points"]] == ["a", "b", "c", "d"]
    assert len(list(tmp_path.iterdir())) == 2
    assert "touch next: " in run(*asked)[1]
    out = tmp_path / "cell.toml"
    assert run(*asked, "--out", out)[0] == 0
    status, _, stderr = run(*asked, "--out", out)
    assert (status, "--overwrite" in stderr) == (2, True)
    assert run(*asked, "--cell", out, "--out", out, "--overwrite")[0] == 0
    status, _, stderr = run("calibrate", tmp_path / "touched.csv")
    assert (status, "--model" in stderr) == (2, True)


def test_doctor_shows_versions_and_passes_its_controls(run: Run) -> None:
    status, stdout, _ = run("doctor")
    assert status == 0
    assert "kinematics control passed" in stdout
    assert "known hits and misses found right" in stdout
    for package in ("numpy", "pin", "toppra", "python-fcl"):
        assert package in stdout
    assert "not installed" not in stdout


def test_place_takes_a_patch_and_a_label_as_plan_does(run: Run, part: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def record(job: Job, **_: object) -> None:
        raise UsageError(f"label {job.label}, patch {job.patches[0].model_dump(exclude_none=True)}")

    monkeypatch.setattr("geoprint.workflow.propose_placement", record)
    rare = ("cone_deg=5.0", "box=[0.0, 0.0, 0.0, 9.0, 9.0, 9.0]", "region=wall")
    patch = ("--at", 1, 2, 3, "--radius", 4, *(word for key in rare for word in ("--set", f"patches.1.{key}")))
    status, _, stderr = run("place", part, "--unit", "mm", "--label", 7, *patch)
    assert status == 2
    given = {"at": [1.0, 2.0, 3.0], "radius": 4.0, "cone_deg": 5.0, "box": [0.0, 0.0, 0.0, 9.0, 9.0, 9.0]}
    assert f"label 7, patch {given | {'region': 'wall'}}" in stderr


def test_an_interrupt_and_a_defect_end_with_their_own_status(
    run: Run, part: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    common = ("plan", part, "--unit", "mm", "--rounds", "4", "--no-robot", "--out", tmp_path / "out")

    def fail(error: BaseException) -> Callable[..., None]:
        def raising(*_: object, **__: object) -> None:
            raise error

        return raising

    for error, status, text in (
        (KeyboardInterrupt(), 130, "stopped"),
        (MemoryError(), 6, "out of memory"),
        (RuntimeError("boom"), 1, "boom"),
    ):
        monkeypatch.setattr("geoprint.workflow.plan", fail(error))
        found, _, stderr = run(*common)
        assert found == status
        assert text in stderr


def test_the_help_names_every_command(run: Run) -> None:
    status, stdout, _ = run("--help")
    assert status == 0
    for command in ("plan", "compare", "calibrate", "init", "doctor"):
        assert command in stdout


def measured_lines(folder: Path) -> Path:
    path = folder / "lines.csv"
    rows = ["10,20,0.033", "10,20,0.035", "20,20,0.11", "20,20,0.107", "40,20,0.35", "40,20,0.34"]
    path.write_text("\n".join(["pressure_kpa,duration_s,mass_g", *rows]), encoding="utf-8")
    return path


def test_fit_flow_prints_a_table_that_the_cell_takes_and_recommend_uses(run: Run, part: Path, tmp_path: Path) -> None:
    status, table, stderr = run("fit-flow", measured_lines(tmp_path), "--density", 1.1)
    assert (status, stderr) == (0, "")
    assert "scatter by" in table
    cell = tmp_path / "cell.toml"
    cell.write_text(f"{packaged_cell_text('irb120-bent45')}\n{table}", encoding="utf-8")
    asked = ("recommend", part, "--unit", "mm", "--cell", cell, "--pressure", 40, "--rounds", 8, "--json")
    status, stdout, stderr = run(*asked)
    assert status == 0, stderr
    found = json.loads(stdout)
    # 0.345 g of 1.1 g/cm3 in 20 s.
    assert found["flow"] == pytest.approx(15.7, rel=0.03)
    assert found["depth"] == pytest.approx(15.0, rel=0.01)
    assert found["asked_spacing"] == pytest.approx(15.0 / 8, rel=0.01)
    assert found["mass_g"] == pytest.approx(40 * 30 * 0.5 * 1.1 / 1000)
    assert "rounds on this part" in run(*asked[:-1])[1]
    assert "95 %" in table


def test_fit_flow_prints_json_when_asked(run: Run, tmp_path: Path) -> None:
    status, stdout, _ = run("fit-flow", measured_lines(tmp_path), "--density", 1.1, "--json")
    assert status == 0
    found = json.loads(stdout)
    low, high = found["intervals_95"]["flow_index"]
    assert low < found["flow_index"] < high


def test_recommend_compares_with_a_good_print_where_nobody_knows_the_material(run: Run) -> None:
    asked = ("recommend", "--pressure", 20, "--rounds", 10, "--good", 10, 20)
    status, stdout, _ = run(*asked, "--json")
    assert status == 0
    assert json.loads(stdout)["layer"] == [1.0, None]
    assert "assumed: same part, material, nozzle and speed" in run(*asked)[1]


@pytest.mark.parametrize(
    ("arguments", "status", "complaint"),
    [
        (("recommend",), 2, "give `--pressure` in kPa, or process.pressure_kpa in the cell"),
        (("recommend", "--pressure", 20), 2, "has no [material]"),
        (("recommend", "--pressure", 0), 2, "must be above 0 kPa"),
        (("recommend", "--pressure", 20, "--good", 10, 20), 2, "give `--rounds` too, or process.rounds"),
        (("recommend", "--pressure", 20, "--rounds", 5, "--good", 0, 20), 2, "above 0 kPa and 1 round"),
        (("fit-flow", "LINES", "--density", 1100), 2, "below 25 g/cm3"),
        (("fit-flow", "LINES", "--density", 1.1, "--model", "bingham"), 2, "no model named 'bingham'"),
        (("fit-flow", "missing.csv", "--density", 1.1), 3, "cannot be read"),
    ],
)
def test_what_has_no_meaning_for_the_process_is_refused(
    run: Run, tmp_path: Path, arguments: tuple[object, ...], status: int, complaint: str
) -> None:
    lines = measured_lines(tmp_path)
    found, _, stderr = run(*(lines if argument == "LINES" else argument for argument in arguments))
    assert found == status
    assert complaint in stderr


def test_rounds_without_a_part_are_refused_where_the_material_is_known(run: Run, tmp_path: Path) -> None:
    cell = tmp_path / "cell.toml"
    material = "[material]\ndensity_g_cm3 = 1.1\nconsistency_pa_sn = 10\nflow_index = 0.6\nyield_stress_pa = 0\n"
    cell.write_text(f"{packaged_cell_text('irb120-bent45')}\n{material}", encoding="utf-8")
    status, _, stderr = run("recommend", "--pressure", 20, "--rounds", 5, "--cell", cell)
    assert status == 2
    assert "rounds mean a spacing on a part only" in stderr
