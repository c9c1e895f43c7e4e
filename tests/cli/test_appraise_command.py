"""`geoprint appraise` as a person meets it: tables, files on demand, one sentence where something is wrong."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Generator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from geoprint.config import job_of
from geoprint.errors import VerificationError
from geoprint.geometry import mean_normal
from geoprint.geometry.files import load, save_ply
from geoprint.inspection import outline_pose, scan_registration
from geoprint.inspection.inputs import read_beside, read_plan
from geoprint.model import FloatArray
from geoprint.reporting import read_record
from geoprint.reporting.records.inspection import AppraisalRecord, LyingRecord, ScanAppraisalRecord
from geoprint.simulation import (
    Break,
    Faults,
    Lighting,
    Sensor,
    Viewpoint,
    deposited_beads,
    looking_at,
    pictured,
    png,
    scanned,
)
from geoprint.workflow import plan, save_plan
from tests.commands import called, printed_with
from tests.geometry.files.lasting_worker import LastingWorker, lasting_worker
from tests.inspection.drawn import drawn, straight
from tests.meshes import plate

DATA = Path(__file__).parents[2] / "data"
Run = Callable[..., tuple[int, str, str]]
# What the cell that comes with geoprint prints with: its name, needle and layer height [mm].
PRINTED_WITH = ["irb120-bent45.toml", "0.6", "0.5"]
LENS = "width = 480\nheight = 400\nfx = 1150\nfy = 1150\ncx = 239.5\ncy = 199.5\nk1 = -0.1\nk2 = 0.02\n"
VIEW = looking_at(
    np.array([20.0, 15.0, 0.0]), place=np.array([30.0, 0.0, 110.0]), focal=1150.0, size=(480, 400), radial=(-0.1, 0.02)
)
MARKS = np.array([[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [40.0, 30.0, 0.0], [0.0, 30.0, 0.0], [20.0, 15.0, 0.0]])


def table(view: Viewpoint) -> str:
    """Return fiducials where a camera sees them, to a hundredth of a pixel."""
    rows = [
        f"m{k},{u:.2f},{v:.2f},{x:g},{y:g},{z:g}"
        for k, ((u, v), (x, y, z)) in enumerate(zip(view.pixels(MARKS), MARKS, strict=True))
    ]
    return "\n".join(["name,u,v,x,y,z", *rows, ""])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("appraise")
    for name, shift in (("a.png", 0.0), ("b.png", 4.0)):
        lines = [(straight(40, v + shift, 280, v + shift), 12.0) for v in (50, 110, 170)]
        (folder / name).write_bytes(png(drawn((320, 220), lines, noise=0.01)))
    (folder / "small.png").write_bytes(png(drawn((200, 220), [(straight(20, 90, 180, 90), 12.0)])))
    (folder / "lens.toml").write_text(LENS, encoding="utf-8")
    (folder / "marks.csv").write_text(table(VIEW), encoding="utf-8")
    save_ply(plate((40.0, 30.0), (20, 15)), folder / "plate.ply")
    return folder


@pytest.fixture(scope="module")
def printed(folder: Path) -> Path:
    """The folder, with a plan of the plate and a photograph of its print, which has an offset and a break."""
    job = job_of(surface=folder / "plate.ply", unit="mm", spacing=3.5, backend="fast-marching", robot=False)
    planned = plan(job)
    save_plan(planned, folder / "plan")
    random = np.random.default_rng(4)
    faults = Faults(offset=0.3, width_scale=0.5, breaks=(Break(0, 40.0, 46.0),))
    surface = planned.workpiece.surface
    beads = deposited_beads(planned.poses, surface, height=0.5, faults=faults, random=random)
    grey = pictured(surface, beads, VIEW, Lighting(np.array([0.0, 0.0, 1.0])), random=random)
    (folder / "print.png").write_bytes(png(grey))
    return folder


@pytest.fixture(scope="module")
def worker() -> Generator[LastingWorker]:
    """A process that brings scans near their parts, as often as it is asked."""
    with lasting_worker() as started:
        yield started


@pytest.fixture
def run(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    def call(line: str) -> tuple[int, str, str]:
        monkeypatch.chdir(folder)
        status = called(monkeypatch, "appraise", *line.split())
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return call


def test_two_photographs_stand_in_one_table_with_the_distance_between_them(run: Run, folder: Path) -> None:
    before = sorted(folder.iterdir())
    status, stdout, stderr = run("a.png b.png")
    assert (status, stderr) == (0, "")
    lines = stdout.splitlines()
    start = next(place for place, line in enumerate(lines) if line.startswith("photograph"))
    name, count, length, width, *_ = lines[start + 2].split()
    assert (name, count) == ("a.png", "3")
    assert float(length) == pytest.approx(3 * 252, abs=9)
    assert float(width) == pytest.approx(12.0, abs=0.3)
    assert "width and threshold chosen from the picture" in stdout
    row = next(line for line in lines if line.startswith("a.png  ") and line.split()[1] == "0")
    assert float(row.split()[2]) == pytest.approx(4.0, abs=1.0)
    assert "a.png to b.png and back: Hausdorff 4." in stdout
    assert sorted(folder.iterdir()) == before


def test_photographs_of_one_name_keep_their_distance_in_text_and_page(run: Run, folder: Path) -> None:
    (folder / "other").mkdir()
    (folder / "other" / "a.png").write_bytes((folder / "b.png").read_bytes())
    status, stdout, stderr = run("a.png other/a.png a.png --out alike")
    assert status == 0, stderr
    record = read_record(folder / "alike" / "appraisal.json", AppraisalRecord)
    apart = f"{record.pairs[0].apart_px.hausdorff:.4f}"
    assert record.pairs[0].apart_px.hausdorff == pytest.approx(4.0, abs=1.0)
    rows = [line.split()[1:] for line in stdout.splitlines() if line.startswith("a.png  ") and " 0" in line]
    assert rows[-3:] == [["0", apart, "0.0000"], [apart, "0", apart], ["0.0000", apart, "0"]]
    page = (folder / "alike" / "report.html").read_text(encoding="utf-8")
    assert re.findall(r'<td class="above">([^<]*)</td>', page) == [apart, "0.0000", apart]
    assert "the nearest of 3 pairs" in page
    assert page.count("<figure>") == 6
    assert '<th scope="row">cell, needle, layer height</th><td>needs a plan</td>' in page


def test_the_table_of_runs_fits_a_line_of_80_letters(run: Run, printed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("geoprint.inspection.commands.columns", lambda: 80)
    status, stdout, _ = run(f"{printed / 'print.png'} --plan plan --fiducials marks.csv --lens lens.toml")
    assert status == 0
    heading, _, *rows = stdout.partition("\nrun  ")[2].splitlines()[:4]
    assert heading.split("  ")[-1].strip() == "offset mm"
    assert max(len(line) for line in (f"run  {heading}", *rows)) <= 80
    assert "columns left out at this width, see `--json`: planned, CV, rms\n" in stdout
    assert re.search(r"^run 1, faults at mm: gap \d+\.\d-\d+\.\d", stdout, re.MULTILINE)


def test_a_print_is_held_against_its_plan_and_written(run: Run, printed: Path) -> None:
    asked = "print.png --plan plan --fiducials marks.csv --lens lens.toml"
    status, stdout, stderr = run(f"{asked} --out told --json")
    assert status == 0, stderr
    written = printed / "told"
    assert sorted(path.name for path in written.iterdir()) == [
        "appraisal.json", "appraisal.txt", "edges-1.png", "lines-1.csv", "manifest.json", "overlay-1.png",
        "report.html", "stretches-1.csv",
    ]  # fmt: skip
    record = read_record(written / "appraisal.json", AppraisalRecord)
    assert json.loads(stdout) == json.loads((written / "appraisal.json").read_text(encoding="utf-8"))
    (photograph,) = record.photographs
    found = photograph.on_plan
    assert found is not None
    assert (record.plan, record.part, record.shade, record.width_chosen) == ("plan", "plate.ply", "lighter", True)
    assert found.offset_mean_mm == pytest.approx(0.3, abs=0.02)
    assert found.width_mean_mm == pytest.approx(1.75, abs=0.03)
    assert found.usual == pytest.approx(0.5, abs=0.02)
    assert found.runs[0].width_planned_mm == pytest.approx(3.5, abs=0.1)
    assert record.printed is not None
    assert {part.run for part in found.parts} == {run.run for run in found.runs}
    assert found.camera.residual_px < 0.01
    assert np.abs(np.array(found.camera.place_mm) - VIEW.place).max() < 0.1
    first = found.runs[0]
    assert first.gaps_mm[0] == pytest.approx((40.0, 46.0), abs=0.8)
    assert first.missing_mm == pytest.approx(6.0, abs=1.2)
    page = (written / "report.html").read_text(encoding="utf-8")
    assert re.search(r"print\.png: [\d.]+&nbsp;% of the plan is visible and judged", page)
    assert printed_with(written / "report.html") == [*PRINTED_WITH, f"geoprint appraise {asked}"]
    cells = re.findall(r"<td>([^<]*)</td>", page.split("What is wrong, and where")[1])
    assert cells[0] == "gap"
    assert (float(cells[1]), float(cells[2])) == pytest.approx((40.0, 46.0), abs=0.8)
    with Image.open(written / "overlay-1.png") as overlay:
        assert overlay.size[0] == 480
    header, *rows = (written / "stretches-1.csv").read_text(encoding="utf-8").splitlines()
    assert header == "run,s_mm,length_mm,judged,seen,sized,width_mm,width_planned_mm,offset_mm,of_usual"
    assert sum(float(row.split(",")[2]) for row in rows) == pytest.approx(
        sum(run.length_mm for run in found.runs), abs=0.5
    )
    before = {path.name: path.read_bytes() for path in written.iterdir()}
    assert run(f"{asked} --out told")[0] == 2
    assert run(f"{asked} --out told --overwrite")[0] == 0
    assert {path.name: path.read_bytes() for path in written.iterdir()} == before


def test_without_fiducials_the_outline_places_the_camera_and_that_is_said(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Of the poses that are tried fewer are enough here, the part seen from its other side among them.
    monkeypatch.setattr(outline_pose, "COARSE", 40)
    monkeypatch.setattr(outline_pose, "FINE", 6)
    job = job_of(surface=DATA / "heart_flat_patch.ply", unit="mm", spacing=4.0, backend="fast-marching", robot=False)
    planned = plan(job)
    save_plan(planned, folder / "patch-plan")
    surface, random = planned.workpiece.surface, np.random.default_rng(4)
    up, middle = mean_normal(surface), surface.vertices.mean(axis=0)
    seen = looking_at(middle, place=middle + 200.0 * up + [30.0, 20.0, 0.0], focal=1420.0, size=(500, 500), turn=0.7)
    beads = deposited_beads(
        planned.poses, surface, height=0.5, faults=Faults(offset=0.2, width_scale=0.5), random=random
    )
    grey = pictured(surface, beads, seen, Lighting(up), random=random)
    (folder / "patch.png").write_bytes(png(grey))
    (folder / "patch.toml").write_text(
        "width = 500\nheight = 500\nfx = 1420\nfy = 1420\ncx = 249.5\ncy = 249.5\n", encoding="utf-8"
    )
    asked = "patch.png --plan patch-plan --lens patch.toml"
    status, stdout, stderr = run(f"{asked} --out patch-told --json")
    assert status == 0, stderr
    written = folder / "patch-told"
    record = read_record(written / "appraisal.json", AppraisalRecord)
    assert json.loads(stdout) == json.loads((written / "appraisal.json").read_text(encoding="utf-8"))
    found = record.photographs[0].on_plan
    assert found is not None
    outline = found.camera.outline
    assert outline is not None
    assert (found.camera.fiducials, outline.alike, outline.clearer) == (0, 1, None)
    assert outline.within_mm == pytest.approx(outline.within_px * found.camera.mm_per_px, rel=0.01)
    assert np.abs(np.array(found.camera.place_mm) - seen.place).max() < 1.5
    assert found.offset_mean_mm == pytest.approx(0.2, abs=0.06)
    page = (written / "report.html").read_text(encoding="utf-8")
    assert "outline, not fiducials, places the camera" in page
    assert "the outline that placed the camera green" in page
    with Image.open(written / "overlay-1.png") as overlay:
        green = (np.asarray(overlay.convert("RGB"))[:500] == (0, 158, 115)).all(axis=2)
    rim = np.argwhere(green)
    outermost = seen.pixels(surface.vertices)
    assert np.abs(rim.min(axis=0) - outermost.min(axis=0)[::-1]).max() < 3.0
    assert np.abs(rim.max(axis=0) - outermost.max(axis=0)[::-1]).max() < 3.0


def test_a_plate_that_looks_alike_from_two_sides_asks_for_fiducials(
    run: Run, printed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Both places are among the likeliest ones.
    monkeypatch.setattr(outline_pose, "COARSE", 20)
    monkeypatch.setattr(outline_pose, "FINE", 4)
    shown = np.asarray(Image.open(printed / "print.png").resize((240, 200)))
    small = np.pad(shown, ((100, 100), (120, 120)), mode="edge")
    Image.fromarray(small).save(printed / "away.png")
    (printed / "away.toml").write_text(LENS.replace("1150", "575"), encoding="utf-8")
    status, stdout, stderr = run("away.png --plan plan --lens away.toml")
    assert (status, stdout) == (3, "")
    assert "away.png: the outline of plate.ply fits 2 camera positions" in stderr
    assert "Give `--fiducials`" in stderr


def test_the_body_of_a_bundle_is_read_where_its_outline_is_needed(folder: Path) -> None:
    for name, asked in (("on-body", {"body": DATA / "heart.ply"}), ("cut", {})):
        surface = DATA / ("heart_flat_patch.ply" if asked else "heart.ply")
        where = {} if asked else {"patches": [{"at": [41.7, 4.0, -6.4], "radius": 10.0}]}
        job = job_of(surface=surface, unit="mm", spacing=6.0, backend="fast-marching", robot=False, **asked, **where)
        save_plan(plan(job), folder / name)
        (body,) = read_beside(folder / name)
        whole = load(DATA / "heart.ply", unit="mm")
        assert len(body.faces) == len(whole.faces)
        assert np.abs(np.ptp(body.vertices, axis=0) - np.ptp(whole.vertices, axis=0)).max() < 1e-3
    file = folder / "on-body" / "body.ply"
    file.write_bytes(file.read_bytes()[:-1] + b"x")
    with pytest.raises(VerificationError, match=r"body.ply: the file was changed"):
        read_beside(folder / "on-body")


@pytest.mark.parametrize(
    ("line", "status", "complaint"),
    [
        ("nowhere.png", 3, "there is no file `nowhere.png`"),
        ("lens.toml", 3, "`lens.toml` is not a readable image"),
        ("a.png --pose marks.csv", 2, "`--pose` is for a scan, and these are photographs"),
        ("plate.ply", 2, "`plate.ply` is a scan: give `--plan`"),
        ("plate.ply a.png", 2, "`plate.ply` is a scan: one is appraised at a time"),
        ("plate.ply --plan plan --lens lens.toml", 2, "`--lens` is not for a scan of a print"),
        ("plate.ply --before", 2, "`--before` needs `--part`"),
        ("plate.ply --before --part plate.ply --unit mm --most 0", 2, "`--most 0`: it must be a positive number"),
        ("plate.ply --before --part plate.ply --scan-unit ell", 2, "the unit `ell` is not known"),
        ("a.png small.png", 3, "`a.png` has 320 x 220 pixels and `small.png` 200 x 220"),
        ("a.png --width 0", 2, "`--width 0`: it must be a positive number"),
        ("a.png --width 100", 3, "a.png: beads of 100 pixels cannot be found"),
        ("a.png --threshold 9", 3, "a.png: no bead lighter"),
        ("a.png --lens lens.toml", 2, "`--lens` needs `--plan`"),
        ("a.png --plan plan", 2, "a plan needs the camera: give `--lens`"),
        ("a.png --plan plan --fiducials marks.csv --lens lens.toml", 3, "the lens is of photographs of 480 x 400"),
        ("a.png --plan plan --fiducials marks.csv --lens a.png", 2, "need its inner corners"),
        ("a.png --plan plan --fiducials marks.csv --lens a.png --lens lens.toml", 2, "`--lens` takes one lens"),
        ("", 2, "`geoprint appraise` needs `FILES`: photographs of prints "),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(run: Run, line: str, status: int, complaint: str) -> None:
    ended, stdout, stderr = run(line)
    assert ended == status, stderr
    assert complaint in stderr
    assert stdout == ""
    assert "Traceback" not in stderr


@pytest.mark.parametrize(
    ("fiducials", "complaint"),
    [
        ("name,u,v,x,y\na,1,2,3,4\n", "marks2.csv, line 1: found the columns name, u, v, x, y; needed are"),
        ("name,u,v,x,y,z\na,1,2,3,4,five\n", "marks2.csv, line 2: z is 'five', needed is a number of mm"),
        ("name,u,v,x,y,z\na,nan,2,3,4,5\n", "marks2.csv, line 2: u is 'nan', needed is a number of pixels"),
        ("name,u,v,x,y,z\na,1,2,3\n", "marks2.csv, line 2: found 4 cells"),
    ],
)
def test_a_wrong_row_of_fiducials_is_named(run: Run, printed: Path, fiducials: str, complaint: str) -> None:
    (printed / "marks2.csv").write_text(fiducials, encoding="utf-8")
    status, _, stderr = run("print.png --plan plan --fiducials marks2.csv --lens lens.toml")
    assert status == 3
    assert complaint in stderr


def test_a_wrong_key_of_a_lens_and_a_changed_bundle_are_named(run: Run, printed: Path) -> None:
    (printed / "lens2.toml").write_text(LENS.replace("fx = 1150", "fx = -3"), encoding="utf-8")
    status, _, stderr = run("print.png --plan plan --fiducials marks.csv --lens lens2.toml")
    assert (status, "lens2.toml, line 3: fx:" in stderr) == (2, True), stderr
    poses = printed / "plan" / "poses.csv"
    content = poses.read_bytes()
    poses.write_bytes(content.replace(b"1", b"2", 1))
    try:
        status, _, stderr = run("print.png --plan plan --fiducials marks.csv --lens lens.toml")
    finally:
        poses.write_bytes(content)
    assert (status, "poses.csv: the file was changed after it was written" in stderr) == (5, True), stderr


@pytest.mark.needs("open3d")
def test_a_scan_is_held_against_its_plan_and_written(run: Run, printed: Path) -> None:
    scan = scan_of_plan(printed, Faults(flow=1.1, width_scale=0.5, breaks=(Break(0, 40.0, 60.0),)))
    np.savetxt(printed / "print.xyz", scan)
    status, stdout, stderr = run("print.xyz --plan plan --out scanned --json")
    assert status == 0, stderr
    written = printed / "scanned"
    assert sorted(path.name for path in written.iterdir()) == [
        "appraisal.json", "appraisal.txt", "manifest.json", "parts.csv", "report.html",
    ]  # fmt: skip
    record = read_record(written / "appraisal.json", ScanAppraisalRecord)
    assert json.loads(stdout) == json.loads((written / "appraisal.json").read_text(encoding="utf-8"))
    assert (record.kind, record.printed.plan, record.printed.part, record.registration.loose) == (
        "scan",
        "plan",
        "plate.ply",
        0,
    )
    assert record.registration.shift_deviation_mm < 0.05
    assert record.registration.bead_width == pytest.approx(0.5 * 1.1**0.5, abs=0.05)
    whole = [part.ratio for part in record.parts if part.run > 0 and part.ratio is not None]
    assert np.mean(whole) == pytest.approx(1.1, abs=0.03)
    gone = [part.ratio for part in record.parts if part.run == 0 and part.start_mm > 41.0 and part.end_mm < 59.0]
    # Two pixels of the sensor are as long as such a part: of one at an end of the break a tenth is seen beside it.
    assert np.mean([ratio for ratio in gone if ratio is not None]) < 0.1
    assert max(ratio for ratio in gone if ratio is not None) < 0.2
    assert record.runs[0].missing_mm == pytest.approx(20.0, abs=8.0)
    assert "warning: " in stderr
    assert "more material than planned" in stderr
    assert record.registration.scale is None
    page = (written / "report.html").read_text(encoding="utf-8")
    assert "measured thickness" in page
    assert "print.xyz: the print has" in page
    assert printed_with(written / "report.html")[:3] == PRINTED_WITH
    before = {path.name: path.read_bytes() for path in written.iterdir()}
    assert run("print.xyz --plan plan --out scanned --overwrite")[0] == 0
    assert {path.name: path.read_bytes() for path in written.iterdir()} == before


@pytest.mark.needs("open3d")
def test_a_scan_that_is_too_large_is_measured_true_to_scale_with_a_warning(run: Run, printed: Path) -> None:
    np.savetxt(printed / "large.xyz", 1.01 * scan_of_plan(printed, Faults()))
    status, stdout, stderr = run("large.xyz --plan plan --json")
    assert status == 0, stderr
    record = ScanAppraisalRecord.model_validate_json(stdout)
    assert record.registration.scale is not None
    assert record.registration.scale.value == pytest.approx(1.0 / 1.01, abs=0.0005)
    assert record.volume_ratio.value == pytest.approx(1.0, abs=0.03)
    assert "warning: large.xyz is " in stderr
    assert "% too large; its coordinates are multiplied by 0.990" in stderr


def test_a_scan_in_another_unit_is_refused_by_the_name_of_that_unit(run: Run, printed: Path) -> None:
    np.savetxt(printed / "metres.xyz", 0.001 * scan_of_plan(printed, Faults()))
    status, _, stderr = run("metres.xyz --plan plan")
    assert status == 3
    assert "is 0.0398 mm large in mm, surface.ply is 40 mm; in m the scan would be" in stderr
    assert "give `--scan-unit m`" in stderr


@pytest.mark.needs("open3d")
def test_a_part_that_lies_otherwise_is_told_and_its_mesh_can_be_planned_on(
    run: Run, folder: Path, worker: LastingWorker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scan_registration, "run_worker", worker.run)
    random = np.random.default_rng(1)
    x, y = random.uniform(0.0, 40.0, 4000), random.uniform(0.0, 30.0, 4000)
    high = 0.3 * np.cos(np.pi * x / 20.0) + 0.02 * random.standard_normal(x.size)
    np.savetxt(folder / "lies.xyz", np.column_stack([x, y, high]))
    (folder / "pose.csv").write_text("x,y,z,q1,q2,q3,q4\n0,0,0,1,0,0,0\n", encoding="utf-8")
    asked = "lies.xyz --before --part plate.ply --unit mm --pose pose.csv"
    status, _, stderr = run(f"{asked} --out lying")
    assert status == 0, stderr
    record = read_record(folder / "lying" / "lying.json", LyingRecord)
    assert record.registration.given
    assert record.registration.loose == 3
    assert record.offset_most_mm == pytest.approx(0.3, abs=0.08)
    assert record.residual_mm == pytest.approx(0.02, abs=0.01)
    mesh = load(folder / "lying" / "lying.ply", unit="mm")
    lies = folder / "lying" / "lying.ply"
    planned = plan(job_of(surface=lies, unit="mm", spacing=10.0, backend="fast-marching", robot=False))
    assert planned.poses.deposit.any()
    assert np.ptp(mesh.vertices[:, 2]) == pytest.approx(0.6, abs=0.15)
    status, _, stderr = run(f"{asked} --most 0.1")
    assert (status, "allowed are 0.1 mm" in stderr) == (3, True), stderr


def scan_of_plan(folder: Path, faults: Faults) -> FloatArray:
    """Return the points of a scan of the print of a bundle, 3 mm off."""
    held = read_plan(folder / "plan")
    random = np.random.default_rng(4)
    beads = deposited_beads(held.poses, held.surface, height=held.height, faults=faults, random=random)
    above = looking_at(np.array([20.0, 15.0, 0.0]), place=np.array([20.0, 15.0, 300.0]), focal=610.0, size=(90, 70))
    T_work_scan = np.eye(4)
    T_work_scan[:3, 3] = [2.0, -2.0, 1.0]
    sensor = Sensor(above, noise=0.03, missing=0.2)
    return scanned(held.surface, beads, sensor, T_work_scan=T_work_scan, random=random).points
