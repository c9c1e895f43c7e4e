"""`geoprint check`: an untouched bundle passes, and whatever is edited is named with file, line and reason."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
import pytest

from geoprint.config import job_of, packaged_cell_text
from geoprint.errors import ClearanceError, InputError
from geoprint.geometry.files import save_ply
from geoprint.postprocessor import read_setup
from geoprint.reporting import Checked, Finding, check_summary, run_sheet
from geoprint.reporting.run_sheet import entry
from geoprint.robot.arm import Arm, configuration_data
from geoprint.workflow import check_bundle, plan, save_plan
from tests.commands import called
from tests.meshes import plate
from tests.shared_plans import SharedPlans

CALIBRATED = """source = "calibrated"
model_mm = [[-50, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]]
touched_mm = [[250, 50, 30], [350, 50, 30], [350, -50, 30], [250, -50, 30]]
part_mm = [-5, -4, 20]"""
LAGS = {"valve_open_s": 0.05, "valve_close_s": 0.08, "uv_lead_s": 0.02, "uv_tail_s": 0.03}


def cell_text(*, source: str = CALIBRATED, lags: Mapping[str, object] = LAGS, mode: str = "io") -> str:
    text = (
        packaged_cell_text("irb120-bent45")
        .replace('source = "demo"', source)
        .replace('mode = "io"', f'mode = "{mode}"')
    )
    for name, value in lags.items():
        text = re.sub(rf"# {name} = .*", f"{name} = {value}", text)
    return text


def write(folder: Path, *, cell: str, **asked: object) -> Path:
    """Plan a small plate and write its bundle."""
    save_ply(plate((10.0, 8.0), (10, 8), jitter_seed=1), folder / "plate.ply")
    (folder / "cell.toml").write_text(cell)
    of_all: dict[str, object] = {"unit": "mm", "spacing": 2.0, "backend": "heat", "middle": "plain"}
    job = job_of(surface=folder / "plate.ply", cell=folder / "cell.toml", **(of_all | asked))
    save_plan(plan(job), folder / "out")
    return folder / "out"


def shared_bundle(shared_plans: SharedPlans) -> Path:
    """Return the bundle of a small plate, of which a copy is taken before it is changed."""

    def made(folder: Path) -> None:
        folder.mkdir()
        write(folder, cell=cell_text())

    return shared_plans.folder("bundle of a small plate", made) / "out"


@pytest.fixture(scope="module")
def bundle(shared_plans: SharedPlans) -> Path:
    return shared_bundle(shared_plans)


@pytest.fixture
def copy(bundle: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(bundle, tmp_path / "copy"))


def test_an_untouched_bundle_passes_and_its_page_says_what_matters(bundle: Path) -> None:
    checked = check_bundle(bundle)
    assert checked.findings == ()
    sheet = run_sheet(checked)
    assert "Event Preset Time" not in sheet
    for words in (
        "plate.ply", "2 runs", "calibrated", "surface known within", "tip in base coordinates", "closest approach",
        "dry run, 20 mm higher",
        "valve doValve", "opens 0.05 s and closes 0.08 s late",
            "prints at 20 mm/s", "geoDryRun FALSE", "geoFirstRun", "material already deposited",
    ):  # fmt: skip
        assert words in " ".join(sheet.split()), words
    assert max(len(line) for line in sheet.split("\n")) <= 100
    assert sheet.count("\n") < 60


def test_the_result_object_holds_the_times_of_valve_material_and_lamp(bundle: Path) -> None:
    found = json.loads(json.dumps(check_summary(check_bundle(bundle))))
    assert found["agrees"] is True
    runs = found["switching"]["runs"]
    assert [run["run"] for run in runs] == [0, 1]
    for run, lamp in zip(runs, found["switching"]["lamp_s"], strict=True):
        # A run with leads begins and ends at its speed; where one bends as it begins, the valve waits for its ramps.
        waits = np.array([1.0, -1.0]) * (np.array(run["material_s"]) - run["deposit_s"])
        least, most = (-1e-4, 0.001) if run["run"] == 0 else (0.001, 0.01)
        assert (waits >= least).all()
        assert (waits < most).all()
        assert lamp == pytest.approx([run["material_s"][0] - 0.02, run["material_s"][1] + 0.03], abs=1e-3)
    planned = json.loads((bundle / "plan.json").read_text())["robot"][0]["program"]["switching"]
    assert planned["runs"] == runs
    assert planned["lamp_s"] == found["switching"]["lamp_s"]
    assert found["switching"]["largest_error_mm"] < 0.05


def test_a_folder_without_a_program_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"there is no folder .*nowhere; give the folder that"):
        check_bundle(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"it has no manifest\.json; give the folder that"):
        check_bundle(tmp_path)
    (tmp_path / "manifest.json").write_text("{")
    with pytest.raises(InputError, match=r"its manifest\.json cannot be read"):
        check_bundle(tmp_path)
    (tmp_path / "manifest.json").write_text('{"sha256": {"plan.json": ""}}')
    assert "plan.json cannot be read" in check_bundle(tmp_path).findings[0].reason
    (tmp_path / "beside").mkdir()
    with pytest.raises(InputError, match=r"the manifest\.json above it lists none here"):
        check_bundle(tmp_path / "beside")
    (tmp_path / "manifest.json").write_text("[" * 100_000)
    with pytest.raises(InputError, match=r"its manifest\.json cannot be read"):
        check_bundle(tmp_path)


def test_a_hash_stays_in_one_line_of_the_sheet() -> None:
    digest = "ab" * 32
    assert entry("SHA-256", [digest], width=80) == [f"SHA-256         {digest}"]
    assert entry("SHA-256", [digest], width=70) == [f"SHA-256 {digest}"]
    assert entry("SHA-256", [digest], width=40) == ["SHA-256", f"  {digest}"]
    assert entry("program", ["two runs"], width=80) == ["program           two runs"]


def test_the_command_prints_the_page_and_ends_with_5_where_something_is_wrong(
    copy: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert called(monkeypatch, "check", copy) == 0
    sheet = capsys.readouterr().out
    assert "RUN SHEET  plate.ply" in sheet
    evidence = json.loads((copy / "plan.json").read_text())["robot"][0]["evidence"]
    assert f"SHA-256           {evidence['program_sha256']}" in sheet.split("\n")
    guard = copy / "rapid" / "GeoGuard.mod"
    guard.write_text(guard.read_text().replace("    SetDO doUV,0;\n", "", 1))
    assert called(monkeypatch, "check", copy, "--json") == 5
    printed = capsys.readouterr()
    line = guard.read_text().split("\n").index("    SetDO doValve,0;") + 2
    assert json.loads(printed.out)["findings"][0]["line"] == line
    assert "geoprint: " in printed.err.split("\n")[-2]
    assert called(monkeypatch, "check", copy) == 5
    found = f"rapid/GeoGuard.mod, line {line}: the guard must say 'SetDO doUV,0;'"
    assert found in capsys.readouterr().out


def test_a_cell_with_all_that_it_may_have_plans_and_passes(tmp_path: Path) -> None:
    lags = {"flow": '"aoFlow"', "flow_per_mm3_s": 0.1, "flow_lag_s": 0.05, "vacuum": '"doVacuum"', "valve_close_s": 0.1}
    cell = cell_text(lags=lags, mode="analog")
    cell = cell.replace("# [flood]\n# duration_s = 60\n# joints", "[flood]\nduration_s = 60\njoints")
    cell += "\n[material]\ndensity_g_cm3 = 1\nconsistency_pa_sn = 9\nflow_index = 1\nyield_stress_pa = 0\n"
    cell += "uv_irradiance_mw_cm2 = 100\nuv_spot_mm = 6\nuv_dose_mj_cm2 = 100\n"
    cell = cell.replace("# [purge]", "[purge]").replace("# joints_deg = [40", "joints_deg = [40")
    cell = cell.replace("# duration_s = 2", "duration_s = 2")
    out = write(tmp_path, cell=cell)
    checked = check_bundle(out)
    assert checked.findings == ()
    sheet = " ".join(run_sheet(checked).split())
    assert "flow aoFlow (0.1 for 1 mm3/s), vacuum doVacuum while the valve is shut" in sheet
    assert "priming: 2 s" in sheet
    assert "valve opens 0 s and closes 0.1 s late" in sheet
    assert "light: 30 mJ/cm2 in one pass" in sheet
    assert "final exposure of the whole part: 60 s, by the program, after the last run" in sheet
    said = json.loads((out / "plan.json").read_text())
    assert any("one pass of the lamp gives 30" in warning for warning in said["warnings"])
    assert said["deposition"]["light"]["flood"] == 60.0
    (_, closed), (opened, _) = (run["material_s"] for run in said["robot"][0]["program"]["switching"]["runs"])
    first, last = said["robot"][0]["program"]["switching"]["vacuum_s"]
    assert first == pytest.approx([closed - 0.1, opened], abs=1e-3)
    assert last[0] < last[1]
    assert "    GeoFlood;\n" in (out / "rapid" / "GeoGuard.mod").read_text()
    assert "Event Preset Time to at least 0.05 s" in sheet
    assert "    GeoPrime;\n" in (out / "rapid" / "GeoGuard.mod").read_text()
    path = (out / "rapid" / "GeoPrint.mod").read_text()
    flow = r"TriggSpeed tGeoFlow,0\\Start,0\.05,aoFlow,(0\.1\d*)\*geoOn\\DipLag:=0\.05;"
    assert len(re.findall(flow, path)) >= 2
    (out / "rapid" / "GeoPrint.mod").write_text(re.sub(r"aoFlow,0\.1\d*\*", "aoFlow,0.25*", path, count=1))
    assert any("the flow in the move here" in finding.reason for finding in check_bundle(out).findings)


@pytest.mark.parametrize("station", ["purge", "flood"])
@pytest.mark.usefixtures("brief_proofs")
def test_a_station_at_which_the_arm_hits_something_is_refused_by_name(tmp_path: Path, station: str) -> None:
    cell = f"{cell_text()}\n[{station}]\nduration_s = 2\njoints_deg = [0, 75, 20, 0, 87, 180]\n"
    with pytest.raises(ClearanceError, match=rf"the joints of \[{station}\]: on the way from home .* table"):
        write(tmp_path, cell=cell, spacing=4.0, max_tilt=0.0)


def without_rows(text: str) -> str:
    """Leave 40 milliseconds out, while material is laid."""
    lines = text.split("\n")
    first = [line.split(",")[-2:-1] == ["1"] for line in lines].index(True) + 200
    return "\n".join([*lines[:first], *lines[first + 40 :]])


def rewritten(text: str, *, column: int, value: str) -> str:
    """Write the same value into a column of all rows."""
    header, *rows = text.rstrip("\n").split("\n")
    cells = [row.split(",") for row in rows]
    return "\n".join([header, *(",".join([*row[:column], value, *row[column + 1 :]]) for row in cells), ""])


def files_of(checked: Checked) -> set[str]:
    return {finding.file for finding in checked.findings}


EDITS: list[tuple[str, Callable[[str], str], str, str]] = [
    ("surface.ply", lambda text: text + " ", "surface.ply", "hash"),
    ("rapid/GeoPrint.mod", lambda text: text.replace("! Part", "! part"), "rapid/GeoPrint.mod", "hash"),
    ("plan.json", lambda text: text[1:], "plan.json", "cannot be read"),
    ("setup.json", lambda text: text.replace('"mode": "io"', '"mode": "oi"'), "setup.json", "no description"),
    ("setup.json", lambda text: text.replace('"speed": 20.0', '"speed": "20"'), "setup.json", "no description"),
    ("setup.json", lambda text: text.replace('"uv_lamp"', '"lamp"'), "setup.json", "no description"),
    ("trajectory.csv", lambda text: text.replace("t,q1", "t,q"), "trajectory.csv", "columns"),
    ("trajectory.csv", without_rows, "trajectory.csv", "passes target"),
    ("poses.csv", lambda text: text.replace("\n0,0,-1,0,", "\n0,0,-1,0,nan,", 1), "poses.csv", "number of columns"),
    ("targets.csv", lambda text: text.replace("\n0,0,", "\n9,0,", 1), "targets.csv", "do not rise"),
    ("targets.csv", lambda text: rewritten(text, column=2, value="0"), "targets.csv", "no material is deposited"),
    ("targets.csv", lambda text: rewritten(text, column=2, value="1"), "targets.csv", "after the last target"),
    ("targets.csv", lambda text: rewritten(text, column=3, value="1.0"), "targets.csv", "valve_close_s is 0.08 s, but"),
    ("targets.csv", lambda text: "\n".join([*text.split("\n")[:9], ""]), "targets.csv", "after the last target"),
    ("targets.csv", lambda text: rewritten(text, column=7, value="0.5"), "targets.csv", "not those of trajectory.csv"),
    ("targets.csv", lambda text: rewritten(text, column=15, value="0.5"), "targets.csv", "do not hold the tool 20 mm"),
    ("setup.json", lambda text: text.replace('"valve_close": 0.08', '"valve_close": 9'), "setup.json", "hash"),
    ("setup.json", lambda text: text.replace('"valve_open": 0.05', '"valve_open": 9'), "targets.csv", "valve_open_s"),
    (
        "setup.json", lambda text: re.sub(r'"frame": [0-9.e-]+', '"frame": 90.0', text), "rapid/GeoPrint.mod",
        "an axis leaves its quadrant where the frame lies 90 mm off",
    ),
    (
        "setup.json", lambda text: re.sub(r'"frame": [0-9.e-]+', '"frame": null', text), "setup.json",
        "lacks the tolerance of the frame",
    ),
    ("setup.json", lambda _: "[" * 100_000, "setup.json", "no description"),
    ("plan.json", lambda _: "[" * 100_000, "plan.json", "cannot be read"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "edit", "file", "reason"), EDITS)
def test_an_edited_file_is_named(copy: Path, name: str, edit: Callable[[str], str], file: str, reason: str) -> None:
    text = (copy / name).read_text(encoding="latin-1")
    edited = edit(text)
    assert edited != text
    (copy / name).write_text(edited, encoding="latin-1")
    checked = check_bundle(copy)
    assert any(finding.file == file and reason in finding.reason for finding in checked.findings), checked.findings


def rows_of(path: Path) -> list[list[str]]:
    return [line.split(",") for line in path.read_text().rstrip("\n").split("\n")]


def scaled(text: str, *, pattern: str, by: float) -> str:
    """Multiply every number that a pattern finds."""
    return re.sub(pattern, lambda match: f"{match[1]}{float(match[2]) * by:g}", text)


@pytest.mark.parametrize("by", [2.0, 0.5, 1.1])
def test_speeds_that_targets_and_cell_agree_on_but_the_trajectory_has_not_are_named(copy: Path, by: float) -> None:
    rows = rows_of(copy / "targets.csv")
    changed = [rows[0], *([*row[:5], f"{float(row[5]) * by:.6f}", *row[6:]] for row in rows[1:])]
    (copy / "targets.csv").write_text("\n".join([*(",".join(row) for row in changed), ""]))
    cell = copy / "rapid" / "GeoCell.mod"
    cell.write_text(scaled(cell.read_text(), pattern=r"(speeddata vGeo\d+:=\[)([\d.]+)", by=by))
    found = [finding for finding in check_bundle(copy).findings if "hash" not in finding.reason]
    assert [finding.file for finding in found] == ["targets.csv", "rapid/GeoPrint.mod"]
    assert re.search(r"target \d+ is reached at [\d.]+ mm/s, by trajectory\.csv", found[0].reason)
    assert "a move takes" in found[1].reason
    assert rows[found[0].line - 1][5] != changed[found[0].line - 1][5]


@pytest.mark.parametrize("zone", [2.0, 0.02, 0.0])
def test_zones_that_targets_and_cell_agree_on_but_the_neighbours_have_not_are_named(copy: Path, zone: float) -> None:
    rows = rows_of(copy / "targets.csv")
    changed = [[*row[:4], f"{zone:.6f}" if float(row[4]) > 0.0 else row[4], *row[5:]] for row in rows[1:]]
    (copy / "targets.csv").write_text("\n".join([*(",".join(row) for row in [rows[0], *changed]), ""]))
    cell, path = copy / "rapid" / "GeoCell.mod", copy / "rapid" / "GeoPrint.mod"
    if zone > 0.0:
        cell.write_text(
            re.sub(
                r"(zonedata zGeo\d+:=).*;",
                rf"\g<1>[FALSE,{zone},{zone},{zone},{zone * 10:g},{zone},"
                rf"{zone * 10:g}];",
                cell.read_text(),
            )
        )
    else:
        cell.write_text(re.sub(r"  CONST zonedata .*\n", "", cell.read_text()))
        path.write_text(re.sub(r"zGeo\d+", "fine", path.read_text()))
    found = [finding for finding in check_bundle(copy).findings if "hash" not in finding.reason]
    assert [finding.file for finding in found] == ["targets.csv"]
    assert re.search(rf"target \d+ has a zone of {zone:g} mm, by its neighbours 0\.\d+", found[0].reason)
    assert float(rows[found[0].line - 1][4]) > 0.0


def set_to(copy: Path, *, dry_run: str = "TRUE", speed: str = "25", first: str = "1") -> Checked:
    """Set the switches of a program as a person does, and check it."""
    cell = copy / "rapid" / "GeoCell.mod"
    text = cell.read_text().replace("geoDryRun:=TRUE", f"geoDryRun:={dry_run}")
    text = text.replace("geoSpeedPct:=25", f"geoSpeedPct:={speed}").replace("geoFirstRun:=1", f"geoFirstRun:={first}")
    cell.write_text(text)
    return check_bundle(copy)


def test_the_switches_that_the_run_sheet_asks_for_are_no_findings_and_it_says_how_they_stand(copy: Path) -> None:
    assert "run dry at 25 % speed (geoDryRun TRUE)" in run_sheet(check_bundle(copy))
    checked = set_to(copy, dry_run="FALSE", speed="100", first="2")
    assert checked.findings == ()
    assert "PRINT at 100 % speed, from run 2 (geoDryRun FALSE)" in run_sheet(checked)
    assert check_summary(checked)["set_to"] == {"dry_run": False, "speed_pct": 100.0, "first_run": 2}


def test_a_program_set_to_print_at_a_speed_that_it_refuses_is_told(copy: Path) -> None:
    sheet = run_sheet(set_to(copy, dry_run="FALSE"))
    assert "it will refuse to print: a fixed pressure needs geoSpeedPct 100" in sheet


@pytest.mark.parametrize(
    ("switch", "reason"),
    [
        ({"speed": "0"}, "geoSpeedPct must lie between 1 and 100, found 0"),
        ({"speed": "101"}, "geoSpeedPct must lie between 1 and 100, found 101"),
        ({"first": "0"}, "geoFirstRun must be a run of this program, 1 to 2, found 0"),
        ({"first": "3"}, "geoFirstRun must be a run of this program, 1 to 2, found 3"),
        ({"first": "1.5"}, "geoFirstRun must be a run of this program, 1 to 2, found 1.5"),
        ({"dry_run": "1"}, "geoDryRun must be TRUE or FALSE, found 1"),
    ],
)
def test_a_switch_that_the_guard_would_refuse_is_named(copy: Path, switch: dict[str, str], reason: str) -> None:
    checked = set_to(copy, **switch)
    line = next(
        k
        for k, row in enumerate((copy / "rapid" / "GeoCell.mod").read_text().split("\n"), 1)
        if re.search(rf"{reason.split()[0]}:=", row)
    )
    assert Finding("rapid/GeoCell.mod", line, reason) in checked.findings


def test_another_change_of_the_cell_beside_the_switches_is_found(copy: Path) -> None:
    cell = copy / "rapid" / "GeoCell.mod"
    cell.write_text(cell.read_text().replace("! Part", "! part"))
    assert [finding.file for finding in set_to(copy, dry_run="FALSE").findings] == ["rapid/GeoCell.mod"]


def test_configuration_data_of_the_dry_run_that_tables_and_program_agree_on_but_the_arm_has_not_are_named(
    copy: Path,
) -> None:
    rows = rows_of(copy / "targets.csv")
    target = len(rows) // 2
    cell = read_setup(copy / "setup.json").cell
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    rows[target][18] = f"{float(rows[target][18]) + np.pi / 2.0:.9f}"
    cf = [str(each) for each in configuration_data(np.array([rows[target][13:19]], dtype=float), arm=arm)[0]]
    (copy / "targets.csv").write_text("\n".join([*(",".join(row) for row in rows), ""]))
    path = copy / "rapid" / "GeoPrint.mod"
    moves = [match.start() for match in re.finditer(MOVE_OR_LIFTED, path.read_text())]
    start = moves[target - 1]
    text = path.read_text()
    line = text[start : text.index("\n", start)]
    plain = re.sub(r"GeoAloft\((.*\]\]),\[.*?\]\)", r"\1", line)
    lifted = re.sub(r"(\[\[.*?\]\])", rf"GeoAloft(\1,[{','.join(cf)}])", plain, count=1)
    path.write_text(text.replace(line, lifted))
    found = [finding for finding in check_bundle(copy).findings if "hash" not in finding.reason]
    assert len(found) == 2
    assert "do not hold the tool 20 mm above it" in found[0].reason
    assert "lifted for the dry run, the inverse kinematics gives the configuration" in found[1].reason


def test_a_name_declared_twice_is_found_even_where_the_setup_cannot_be_read(copy: Path) -> None:
    (copy / "setup.json").write_text("{}")
    guard = copy / "rapid" / "GeoGuard.mod"
    guard.write_text(guard.read_text().replace("geoCutShort", "geoRefuse"))
    reasons = [finding.reason for finding in check_bundle(copy).findings if finding.file == "rapid/GeoGuard.mod"]
    assert [reason.partition(":")[0] for reason in reasons] == ["GeoRefuse is declared twice"]


def test_a_changed_module_of_the_controller_is_found_by_hash_and_by_its_line(copy: Path) -> None:
    resident = copy / "rapid" / "controller" / "GeoResident.sys"
    text = resident.read_text()
    line = text.split("\n").index("    IF doValve=1 GeoResidentCut;") + 1
    resident.write_text(text.replace("    IF doValve=1 GeoResidentCut;\n", ""))
    (copy / "rapid" / "controller" / "EIO.cfg").write_text("EIO:CFG_1.0:6:1::\n")
    (copy / "rapid" / "controller" / "MOC.cfg").write_text("MOC:CFG_1.0:6:1::\n")
    found = {(finding.file, finding.line): finding.reason for finding in check_bundle(copy).findings}
    name = "rapid/controller/GeoResident.sys"
    assert "must say 'IF doValve=1 GeoResidentCut;'" in found.pop((name, line))
    assert set(found) <= {(name, 1), ("rapid/controller/EIO.cfg", 1), ("rapid/controller/MOC.cfg", 1)}
    assert "hash" in found["rapid/controller/EIO.cfg", 1]
    assert "does not list" in found["rapid/controller/MOC.cfg", 1]


def test_missing_and_added_files_are_named(copy: Path) -> None:
    (copy / "rapid" / "GeoGuard.mod").unlink()
    (copy / "rapid" / "More.mod").write_text("MODULE More\nENDMODULE\n")
    found = files_of(check_bundle(copy))
    assert {"rapid/GeoGuard.mod", "rapid/More.mod"} <= found


def test_a_backend_of_a_comparison_is_checked_by_the_manifest_of_the_whole(bundle: Path, tmp_path: Path) -> None:
    inner = Path(shutil.copytree(bundle, tmp_path / "compared" / "lscm"))
    listed = json.loads((inner / "manifest.json").read_text())["sha256"]
    (inner / "manifest.json").unlink()
    whole = {f"lscm/{name}": digest for name, digest in listed.items()} | {"report.html": ""}
    (tmp_path / "compared" / "manifest.json").write_text(json.dumps({"sha256": whole}))
    assert check_bundle(inner).findings == ()
    with pytest.raises(InputError, match=rf"several bundles; name one of them, {inner}\."):
        check_bundle(tmp_path / "compared")
    (inner / "surface.ply").write_text("")
    assert files_of(check_bundle(inner)) == {"surface.ply"}


# One mutation: the lines of a module, a source of randomness, the changed lines and the line to be named, or None
# where nothing in the module is fit for it.
Mutation = Callable[[list[str], Random], "tuple[list[str], int] | None"]


def on_lines(pattern: str, change: Callable[[str, Random], str], *, comment: bool = False) -> Mutation:
    """Change one of the lines, or of the comments, that match a pattern."""

    def mutate(lines: list[str], random: Random) -> tuple[list[str], int] | None:
        matching = (row for row, line in enumerate(lines) if re.search(pattern, line))
        fit = [row for row in matching if lines[row].lstrip().startswith("!") == comment]
        if not fit:
            return None
        row = random.choice(fit)
        return [*lines[:row], *change(lines[row], random).split("\n"), *lines[row + 1 :]], row + 1

    return mutate


def swap_rows(lines: list[str], random: Random) -> tuple[list[str], int] | None:
    """Exchange two moves that stand one below the other."""
    fit = [row for row in range(len(lines) - 1) if "MoveL [" in lines[row] and "MoveL [" in lines[row + 1]]
    if not fit:
        return None
    row = random.choice(fit)
    return [*lines[:row], lines[row + 1], lines[row], *lines[row + 2 :]], row + 1


def first_of_its_name(lines: list[str], row: int) -> bool:
    """Whether a trigger is declared for the first time: without a later one, the first switches at about its place."""
    name = lines[row].split(",")[0]
    return not any(line.startswith(f"{name},") for line in lines[:row])


def drop(
    lines: list[str], pattern: str, random: Random, *, only: Callable[[list[str], int], bool] | None = None
) -> tuple[list[str], int] | None:
    fit = [row for row, line in enumerate(lines) if re.search(pattern, line) and (only is None or only(lines, row))]
    if not fit:
        return None
    row = random.choice(fit)
    return [*lines[:row], *lines[row + 1 :]], row + 1


def nudged(line: str, random: Random, *, pattern: str, by: float) -> str:
    """Change one of the numbers that a pattern finds."""
    match = random.choice(list(re.finditer(pattern, line)))
    decimals = len(match[0].partition(".")[2])
    return f"{line[: match.start()]}{float(match[0]) + by:.{decimals}f}{line[match.end() :]}"


def with_another_letter(line: str, random: Random) -> str:
    place = random.choice([place for place, letter in enumerate(line) if letter != " "])
    return f"{line[:place]}~{line[place + 1 :]}"


MOVE, TRIGGER = r"(?:Move|Trigg)L \[\[", r"TriggIO "
MOVE_OR_LIFTED = r"(?:Move|Trigg)L (?:GeoAloft\()?\[\["
COORDINATE = r"(?<=[\[,])-?\d+\.\d{4}(?=[\],])"
COMPONENT = r"(?<=[\[,])-?\d\.\d{8}(?=[\],])"
KINDS: dict[str, tuple[str, Mutation]] = {
    "missing semicolon": ("GeoPrint", on_lines(r";$", lambda line, _: line[:-1])),
    "swapped groups": ("GeoPrint", on_lines(MOVE, lambda line, _: re.sub(r"\[(\[.*?\]),(\[.*?\])", r"[\2,\1", line))),
    "swapped coordinates": (
        "GeoPrint", on_lines(MOVE, lambda line, _: re.sub(r"\[\[([^,]*),([^,]*),", r"[[\2,\1,", line))),
    "NaN": ("GeoPrint", on_lines(MOVE, lambda line, _: re.sub(r"\[\[[^,]*", "[[NaN", line))),
    "infinity": ("GeoPrint", on_lines(MOVE, lambda line, _: re.sub(r"\[\[[^,]*", "[[1E39", line))),
    "33-character name": ("GeoPrint", on_lines(MOVE, lambda line, _: line.replace("tGeoNozzle", "t" * 33))),
    "wrong quaternion": (
        "GeoPrint", on_lines(MOVE, lambda line, random: nudged(line, random, pattern=COMPONENT, by=1e-4))),
    "dropped trigger": ("GeoPrint", lambda lines, random: drop(lines, TRIGGER, random, only=first_of_its_name)),
    "trigger not pulled": (
        "GeoPrint", on_lines("TriggL", lambda line, _: re.sub(r"TriggL (.*,)tGeo.*?,([a-z])", r"MoveL \1\2", line))),
    "shifted signal": (
        "GeoPrint", on_lines(TRIGGER, lambda line, random: nudged(line, random, pattern=r"\d+\.\d{4}", by=1.0))),
    "signal at the other end": (
        "GeoPrint", on_lines(TRIGGER, lambda line, _: re.sub(r"(\d\.\d{4})(\\Start)?", lambda m: m[1] + (
            "" if m[2] else "\\Start"), line, count=1))),
    "other signal": ("GeoPrint", on_lines(TRIGGER, lambda line, _: re.sub("do(Valve|UV)", "doDoor", line))),
    "on for off": ("GeoPrint", on_lines(TRIGGER, lambda line, _: re.sub(r"(0|geoOn);$", lambda m: (
        "geoOn;" if m[1] == "0" else "0;"), line))),
    "duplicated target": ("GeoPrint", on_lines("MoveL", lambda line, _: f"{line}\n{line}")),
    "deleted target": ("GeoPrint", lambda lines, random: drop(lines, "MoveL", random)),
    "swapped targets": ("GeoPrint", swap_rows),
    "moved by 2 micrometres": (
        "GeoPrint", on_lines(MOVE, lambda line, random: nudged(line, random, pattern=COORDINATE, by=0.002))),
    "changed speed": ("GeoPrint", on_lines(r"vGeo\d", lambda line, _: re.sub(r"vGeo\d+", lambda m: (
        "vGeo1" if m[0] != "vGeo1" else "vGeo2"), line))),
    "changed zone": ("GeoPrint", on_lines(MOVE, lambda line, _: re.sub(r"(fine|zGeo\d+),tGeo", lambda m: (
        "zGeo1,tGeo" if m[1] == "fine" else "fine,tGeo"), line))),
    "changed tool": ("GeoPrint", on_lines(MOVE, lambda line, _: line.replace("tGeoNozzle", "tool0"))),
    "changed work object": ("GeoPrint", on_lines(MOVE, lambda line, _: line.replace("wGeoPart", "wobj0"))),
    "changed configuration": ("GeoPrint", on_lines(MOVE, lambda line, _: re.sub(r"\],\[(-?\d),", lambda m: (
        f"],[{int(m[1]) + 1},"), line, count=1))),
    "external axis": ("GeoPrint", on_lines(MOVE, lambda line, _: line.replace("9E9", "0", 1))),
    "joint move": ("GeoPrint", on_lines("MoveL", lambda line, _: line.replace("MoveL", "MoveJ"))),
    "no error handler": ("GeoPrint", lambda lines, random: drop(lines, "RAISE;", random)),
    "not ASCII": ("GeoPrint", on_lines("Geo", lambda line, _: line.replace("Geo", "G\u00e9o", 1))),
    "changed number of the cell": (
        "GeoCell", on_lines(r"(tool|wobj|pos|joint|speed|zone|CONST num).*:=", lambda line, random: nudged(
            line, random, pattern=r"(?<=[\[,=])-?\d+(?:\.\d+)?(?=[\],;])", by=0.5))),
    "part known better": ("GeoCell", on_lines("(95 %)|lie within", lambda line, random: nudged(
        line, random, pattern=r"\d\.\d\d", by=-0.05), comment=True)),
    "nothing of how well the part is known": ("GeoPrint", lambda lines, random: drop(lines, "! Surface", random)),
    "dry run lower": ("GeoCell", on_lines("geoLift|jGeoAloft", lambda line, random: nudged(
        line, random, pattern=r"-?\d+\.\d{4,}", by=-2.0))),
    "deleted datum": ("GeoCell", lambda lines, random: drop(lines, r"^  (PERS|CONST|VAR)", random)),
    "other type": (
        "GeoCell", on_lines(r"^  (PERS|CONST) ", lambda line, _: re.sub(r"(PERS|CONST) \w+", r"\1 string", line))),
    "deleted line of the guard": ("GeoGuard", lambda lines, random: drop(lines, r"^ +[A-Z]", random)),
    "changed letter of the guard": ("GeoGuard", on_lines(r"[a-zA-Z]{4}", with_another_letter)),
    "doubled line of the guard": ("GeoGuard", on_lines(r"^ +[A-Z]", lambda line, _: f"{line}\n{line}")),
}  # fmt: skip
# Of these there are four, because what they change differs from place to place.
VARIED = (
    "changed number of the cell", "deleted datum", "deleted line of the guard", "changed letter of the guard"
)  # fmt: skip
MUTATIONS = len(KINDS) + 3 * len(VARIED)


def mutations(bundle: Path) -> Iterator[tuple[str, str, str, int]]:
    """Yield kind, module, text and line of as many different mutations as are asked for."""
    random = Random(8)  # noqa: S311  (a fixed seed: the same mutations each time)
    seen: set[str] = set()
    while len(seen) < MUTATIONS:
        for kind in (*KINDS, *3 * VARIED):
            module, mutate = KINDS[kind]
            text = (bundle / "rapid" / f"{module}.mod").read_text()
            made = mutate(text.split("\n"), random)
            assert made is not None, f"nothing in {module} is fit for {kind}"
            changed = "\n".join(made[0])
            if changed != text and changed not in seen and len(seen) < MUTATIONS:
                seen.add(changed)
                yield kind, module, changed, made[1]


def test_mutations_of_the_modules_are_found_with_file_line_and_reason(copy: Path) -> None:
    originals = {path.name: path.read_text() for path in (copy / "rapid").glob("Geo*")}
    near: dict[str, list[bool]] = {}
    for kind, module, text, line in mutations(copy):
        name = f"{module}.mod"
        (copy / "rapid" / name).write_text(text)
        findings = check_bundle(copy).findings
        (copy / "rapid" / name).write_text(originals[name])
        record = [finding for finding in findings if "hash" not in finding.reason]
        assert record, (kind, line)
        assert all(finding.file.startswith("rapid/") and finding.line >= 1 for finding in record), (kind, record)
        found = any(finding.file == f"rapid/{name}" and abs(finding.line - line) <= 1 for finding in record)
        near.setdefault(kind, []).append(found)
    assert near.keys() == KINDS.keys()
    assert sum(map(len, near.values())) == MUTATIONS
    # A speed that changed in the cell is named where a move uses it, a lost datum where it is needed. Each kind counts
    # alike, however many there are of it.
    assert np.mean([np.mean(found) for found in near.values()]) >= 0.9


def test_findings_are_printed_one_a_line(bundle: Path) -> None:
    checked = replace(check_bundle(bundle), findings=(Finding("rapid/GeoPrint.mod", 7, "x"), Finding("a.csv", 1, "y")))
    assert run_sheet(checked) == "rapid/GeoPrint.mod, line 7: x\na.csv, line 1: y"
