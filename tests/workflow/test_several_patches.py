"""Several patches of one job: each as when it is planned alone, printed one after another, or refused by its number."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from geoprint.cli.application import app
from geoprint.config import Job, job_of
from geoprint.distance import BACKENDS, Piecewise
from geoprint.errors import FieldError, GeoprintError, InputError, MeshError, ReachError
from geoprint.geometry import boundary_source, prepare, refine, united
from geoprint.geometry.files import MeshFile, load, load_file, save_ply
from geoprint.model import Surface
from geoprint.reporting import outcome_text, record_plan, recorded_comparison, run_sheet, summary
from geoprint.reporting.part_report import report_table
from geoprint.reporting.pictures import chart_pictures
from geoprint.reporting.records.comparison import PartRecord
from geoprint.results import Plan
from geoprint.toolpath import PATTERNS, arrange
from geoprint.workflow import check_bundle, compare, patches_of, plan, save_plan
from geoprint.workflow.patches import prepared_part
from geoprint.workflow.saving import plan_files
from tests.meshes import disc, plate, sphere

RADIUS = 20.0
# Two discs on the upper side of a ball, and their places.
PLACES = ((9.0, 0.0, 17.86), (-9.0, 0.0, 17.86))
RADII = (6.0, 5.0)


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ball") / "ball.ply"
    save_ply(sphere(radius=RADIUS, subdivisions=3, jitter_seed=1), path)
    return path


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("table") / "table.ply"
    save_ply(plate((60.0, 30.0), (6, 3)), path)
    return path


def disc_at(place: tuple[float, float, float], radius: float) -> dict[str, object]:
    return {"at": [*place], "radius": radius}


def box(low: tuple[float, float], high: tuple[float, float]) -> dict[str, object]:
    return {"box": [*low, -25.0, *high, 25.0]}


def job(path: Path, *patches: dict[str, object], **values: object) -> Job:
    asked: dict[str, object] = {"unit": "mm", "spacing": 2.0, "robot": False} | values
    return job_of(surface=path, patches=[*patches], **asked)


def deposited(planned: Plan, runs: tuple[int, int]) -> np.ndarray:
    poses = planned.poses
    return poses.tips[poses.deposit & (poses.runs >= runs[0]) & (poses.runs <= runs[1])]


@pytest.mark.parametrize("backend", list(BACKENDS))
def test_each_patch_is_as_even_and_lies_as_when_it_is_planned_alone(ball: Path, backend: str) -> None:
    regions = [disc_at(place, radius) for place, radius in zip(PLACES, RADII, strict=True)]
    together = plan(job(ball, *regions, backend=backend, spacing=2.5, middle="plain"))
    alone = plan(job(ball, regions[1], backend=backend, spacing=2.5, middle="plain"))
    found, (only,) = record_plan(together).patches[1], record_plan(alone).patches
    assert found.spacing.cv == pytest.approx(only.spacing.cv, rel=1e-9)
    assert found.area_mm2 == pytest.approx(only.area_mm2, rel=1e-12)
    assert found.deposit_mm == pytest.approx(only.deposit_mm, rel=1e-12)
    assert np.array_equal(deposited(together, found.runs), deposited(alone, only.runs))


def test_a_patch_is_finished_before_the_next_and_the_nearest_one_is_next(table: Path) -> None:
    regions = [box((left, 10.0), (left + 8.0, 18.0)) for left in (20.0, 50.0, 30.0, 40.0)]
    found = record_plan(plan(job(table, *regions, spacing=2.0))).patches
    runs = [figures.runs for figures in found]
    assert [first for first, _ in sorted(runs)] == [0, *(last + 1 for _, last in sorted(runs)[:-1])]
    # The first given comes first, then always the nearest.
    assert [runs.index(one) for one in sorted(runs)] == [0, 2, 3, 1]


def test_rounds_divide_the_distance_of_the_deepest_patch(ball: Path) -> None:
    regions = [disc_at(place, radius) for place, radius in zip(PLACES, RADII, strict=True)]
    planned = plan(job(ball, *regions, spacing=None, rounds=3, middle="plain"))
    assert planned.contours.spacing == plan(job(ball, regions[0], spacing=None, rounds=3)).contours.spacing
    lengths = [last - first + 1 for first, last in (figures.runs for figures in record_plan(planned).patches)]
    assert lengths == [3, 2]


@pytest.mark.parametrize(
    ("regions", "sentence"),
    [
        ([box((5, 5), (20, 15)), box((18, 10), (30, 20))], r"patches 1 and 2 overlap at .*, 2 mm inside the rim of"),
        ([box((5, 5), (20, 15)), box((40, 5), (50, 15)), box((8, 8), (12, 12))], "patches 1 and 3 overlap at"),
        ([box((5, 5), (20, 15)), box((5, 5), (20, 15))], "patches 1 and 2 overlap at"),
        ([box((10, 1), (13, 29)), box((1, 10), (59, 13))], "patches 1 and 2 overlap at .*Move them apart"),
    ],
    ids=["corner", "inside", "same", "crossing"],
)
def test_patches_that_overlap_are_refused_with_the_place(
    table: Path, regions: list[dict[str, object]], sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        patches_of(job(table, *regions), load_file(table, unit="mm"))


def test_patches_that_touch_are_not_refused(table: Path) -> None:
    regions = [box((5.0, 5.0), (20.0, 15.0)), box((20.0, 5.0), (30.0, 15.0))]
    assert len(patches_of(job(table, *regions), load_file(table, unit="mm"))) == 2


@pytest.mark.parametrize(
    ("place", "radius", "spacing", "error", "sentence"),
    [
        (
            (-9.0, 0.0, 30.0),
            5.0,
            1.5,
            InputError,
            r"^patch 2 at \(-9.00, 0.00, 30.00\) mm: the point .* lies .* mm off",
        ),
        (PLACES[1], 90.0, 1.5, FieldError, r"^patch 2 at .*: all of ball.ply lies within 90 mm"),
        (
            PLACES[1],
            2.0,
            5.0,
            FieldError,
            r"^patch 2 of ball.ply, about \(-8.93, .*\) mm: spacing is 5 mm, but the surface ends",
        ),
    ],
)
def test_a_patch_that_cannot_be_planned_is_named(
    ball: Path,
    place: tuple[float, float, float],
    radius: float,
    spacing: float,
    error: type[GeoprintError],
    sentence: str,
) -> None:
    with pytest.raises(error, match=sentence):
        plan(job(ball, disc_at(PLACES[0], 6.0), disc_at(place, radius), spacing=spacing))


def test_a_patch_whose_every_curve_is_too_short_is_named() -> None:
    small = Surface(disc(radius=2.0).vertices + np.array([50.0, 0.0, 0.0]), disc(radius=2.0).faces)
    surface = united([refine(disc(radius=12.0), edge_length=0.8), refine(small, edge_length=0.2)])
    backend = Piecewise(surface, BACKENDS["heat"])
    paths = PATTERNS["contours"]().paths(surface, boundary_source(surface), backend=backend, spacing=3.8)
    with pytest.raises(FieldError, match="every contour of patch 2 is shorter than one spacing"):
        arrange(paths, surface, speed=20.0)


def test_a_file_in_several_pieces_is_still_refused_and_pointed_to_patches() -> None:
    far = Surface(plate().vertices + np.array([100.0, 0.0, 0.0]), plate().faces)
    with pytest.raises(MeshError, match=r"has 2 separate components.*at a point .*several with a job file"):
        prepare(united([plate(), far]))


def test_patches_on_separate_pieces_have_all_of_them_in_the_way_each_once(tmp_path: Path) -> None:
    one = sphere(radius=RADIUS, subdivisions=3)
    loaded = united([one, Surface(one.vertices + np.array([50.0, 0.0, 0.0]), one.faces)])
    discs = [disc_at(place, 5.0) for place in ((0.0, 0.0, RADIUS), (50.0, 0.0, RADIUS), (50.0, RADIUS, 0.0))]
    for regions, pieces in ((discs[1:], 1), (discs, 2)):
        body = prepared_part(job(tmp_path / "two.ply", *regions), MeshFile(loaded.vertices, loaded.faces, "mm")).body
        assert body is not None
        assert len(body.faces) == pieces * len(one.faces)


def test_a_body_with_a_speck_is_in_the_way_once_however_its_patches_are_cut(tmp_path: Path) -> None:
    one = sphere(radius=RADIUS, subdivisions=3)
    speck = Surface(np.array([[0.0, 0.0, 25.0], [0.1, 0.0, 25.0], [0.0, 0.1, 25.0]]), np.array([[0, 1, 2]]))
    regions = [disc_at(PLACES[0], 5.0), box((-25.0, -25.0), (0.0, 25.0))]
    both = united([one, speck])
    body = prepared_part(job(tmp_path / "ball.ply", *regions), MeshFile(both.vertices, both.faces, "mm")).body
    assert body is not None
    assert len(body.faces) == len(one.faces) + 1


def test_patches_that_face_different_ways_have_no_demonstration_placement(ball: Path) -> None:
    regions = [disc_at((0.0, 0.0, RADIUS), 5.0), disc_at((0.0, 0.0, -RADIUS), 5.0)]
    with pytest.raises(ReachError, match="patches that face alike"):
        plan(job(ball, *regions, robot=True, place="demo"))


def lowest_between(planned: Plan) -> float:
    """Return how near to the middle of the ball the tip comes between two patches, once it is away from the first."""
    first, second = record_plan(planned).patches
    poses = planned.poses
    between = poses.tips[~poses.deposit & (poses.runs == second.runs[0])]
    gone = np.linalg.norm(between - deposited(planned, first.runs)[-1], axis=1) > 3.0
    near_second = np.linalg.norm(between - deposited(planned, second.runs)[0], axis=1) < 3.0
    return float(np.linalg.norm(between[gone & ~near_second], axis=1).min())


def test_one_program_prints_two_patches_and_says_so(ball: Path, tmp_path: Path) -> None:
    regions = [disc_at(place, radius) for place, radius in zip(PLACES, RADII, strict=True)]
    planned = plan(job(ball, *regions, spacing=2.5, robot=True, place="demo", middle="plain"))
    assert planned.robot
    assert "patch 2: " in outcome_text(record_plan(planned))
    assert lowest_between(planned) > RADIUS + 1.0
    save_plan(planned, tmp_path / "out")
    checked = check_bundle(tmp_path / "out")
    assert checked.findings == ()
    assert checked.record is not None
    first, second = checked.record.patches
    assert first.runs[0] == 0
    assert second.runs == (first.runs[1] + 1, planned.toolpath.curves.count - 1)
    assert first.area_mm2 == pytest.approx(2 * np.pi * RADIUS**2 * (1 - np.cos(0.3)), rel=0.01)
    assert second.spacing.cv is not None
    assert second.spacing.cv < 0.02
    sheet = run_sheet(checked)
    assert f"patches           1: runs 1 to {first.runs[1] + 1}, " in sheet
    assert f"2: runs {second.runs[0] + 1} to " in sheet


def test_the_report_names_every_patch_and_the_bundle_has_its_chart(ball: Path) -> None:
    regions = [disc_at(place, radius) for place, radius in zip(PLACES, RADII, strict=True)]
    compared = compare(
        job(ball, *regions, spacing=2.5, options={"lscm": {"resolution": 100}}, middle="plain"), backends=["lscm"]
    )
    record, plans = recorded_comparison([compared]), [outcome.plan for _, outcome in compared.planned]
    (part,) = record.record.parts
    assert isinstance(part, PartRecord)
    rows = [row for row in report_table(part.planned, record.plans[0], plans) if row.group.startswith("Patch")]
    assert [row.group for row in rows] == ["Patch 1", "Patch 2"]
    cv = record.plans[0]["lscm"].patches[1].spacing.cv
    assert cv is not None
    assert rows[1].values == (f"{100 * cv:.2f} %",)
    files = plan_files(plans[0], record.plans[0]["lscm"], charts=chart_pictures(plans[0]))
    assert {"chart-1.png", "chart-2.png"} < files.keys()
    assert [len(row.patches) for row in part.planned] == [2]


def test_a_whole_part_has_no_patches(table: Path) -> None:
    planned = plan(job_of(surface=table, unit="mm", spacing=4.0, robot=False))
    assert "patches" not in summary(planned)
    assert planned.workpiece.patches == ()
    assert "patch 1" not in outcome_text(record_plan(planned))


def test_the_patch_command_writes_a_numbered_file_for_each(ball: Path, tmp_path: Path) -> None:
    text = f'surface = "{ball}"\nunit = "mm"\n'
    text += "".join(f"[[patches]]\nat = {[*place]}\nradius = 5\n" for place in PLACES)
    (tmp_path / "job.toml").write_text(text)
    command = ["patch", str(tmp_path / "job.toml"), "--out", str(tmp_path / "disc.ply"), "--json"]
    done = CliRunner().invoke(app, command, catch_exceptions=False)
    assert [found["topology"] for found in json.loads(done.stdout)] == ["disc", "disc"]
    assert [len(load(tmp_path / f"disc-{number}.ply", unit="mm").faces) > 0 for number in (1, 2)] == [True, True]
    again = CliRunner().invoke(app, command)
    assert "disc-1.ply exists" in str(again.exception)
