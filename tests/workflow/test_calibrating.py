"""`geoprint calibrate`: tables in, a judged calibration out, a cell file that keeps everything else, and its plan."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.config import PACKAGED_CELLS, job_of, load_cell, packaged_cell_text
from geoprint.errors import ClearanceError, InputError, UsageError
from geoprint.geometry.files import save_ply
from geoprint.reporting import calibration_summary, calibration_text, outcome_text, record_plan, run_sheet, summary
from geoprint.robot.arm import Arm
from geoprint.robot.arm.urdf import read_urdf
from geoprint.workflow import check_bundle, plan, save_plan
from geoprint.workflow.calibrating import calibrate, calibrate_cell, calibrate_tool, save_calibrated
from geoprint.workflow.number_tables import read_points
from tests.meshes import plate

CORNERS = "name,x,y,z\na,-50,50,0\nb,50,50,0\nc,50,-50,0\nd,-50,-50,0\nmiddle,0,0,0\nfar,200,0,0\n"
TOUCHED = "name,x,y,z\na,250.1,50,30\nb,350,50.1,30\nc,350,-50,30.1\nd,250,-50.1,30\n"
# What a plan says where it knows the surface worse than a third of its stand-off.
WORSE = "of the stand-off. `geoprint calibrate --part`"


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def tables(tmp_path: Path) -> tuple[Path, Path]:
    return written(tmp_path, "touched.csv", TOUCHED), written(tmp_path, "corners.csv", CORNERS)


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "plate.ply"
    save_ply(plate((40.0, 30.0), (20, 15)), path)
    return path


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small.ply"
    save_ply(plate((16.0, 12.0), (8, 6)), path)
    return path


# The fixture


def test_a_calibrated_cell_is_written_and_says_the_same_as_its_tables(
    tables: tuple[Path, Path], tmp_path: Path
) -> None:
    touched, model = tables
    found = calibrate_cell(touched, model=model, cell=None, part=None, unit=None, noise=0.2)
    save_calibrated(found, tmp_path / "new.toml", overwrite=False)
    fixture = load_cell(tmp_path / "new.toml").fixture
    assert fixture is not None
    assert fixture.noise == 0.2
    np.testing.assert_array_equal(fixture.model, read_points(model).places[:4])
    np.testing.assert_array_equal(fixture.touched, read_points(touched).places)
    # Calibrated again without a noise, the key goes.
    again = calibrate_cell(touched, model=model, cell=tmp_path / "new.toml", part=None, unit=None, noise=None)
    assert "noise_mm" not in tomllib.loads(again.text)["work"]


def test_a_cell_that_names_the_urdf_beside_it_is_calibrated(tables: tuple[Path, Path], tmp_path: Path) -> None:
    touched, model = tables
    (tmp_path / "own.urdf").write_text(read_urdf("irb120"), encoding="utf-8")
    text = packaged_cell_text(PACKAGED_CELLS[0]).replace('arm = "irb120"', 'urdf = "own.urdf"')
    cell = written(tmp_path, "cell.toml", text)
    found = calibrate_cell(touched, model=model, cell=cell, part=None, unit=None, noise=None)
    save_calibrated(found, tmp_path / "new.toml", overwrite=False)
    assert load_cell(tmp_path / "new.toml").robot.model == "own.urdf"


def test_what_is_said_of_a_calibration_agrees_with_what_programs_read(tables: tuple[Path, Path], part: Path) -> None:
    touched, model = tables
    found = calibrate_cell(touched, model=model, cell=None, part=part, unit="mm", noise=None)
    record, text = json.loads(json.dumps(calibration_summary(found))), calibration_text(found)
    position, surface = record["position"], record["surface"]
    assert [point["name"] for point in record["points"]] == ["a", "b", "c", "d"]
    assert f"{position['deviation_mm']:.3f} mm (standard deviation)" in text
    assert f"within {surface['within_mm']:.3f} mm" in text
    assert surface["standoff_mm"] == 0.3
    assert "plate.ply" in text
    np.testing.assert_allclose(np.linalg.eigvalsh(np.array(record["covariance_mm_rad"])) > 0.0, 1.0)


def test_without_a_part_the_next_touch_is_the_listed_point_that_helps_the_fixture_most(
    tables: tuple[Path, Path],
) -> None:
    touched, model = tables
    found = calibrate_cell(touched, model=model, cell=None, part=None, unit=None, noise=None).suggestion
    assert (found.name, found.again) == ("far", False)
    np.testing.assert_allclose(found.base, [500.0, 0.0, 30.0], atol=0.5)


def test_a_part_far_from_the_fixture_is_itself_what_to_touch_next(tables: tuple[Path, Path], part: Path) -> None:
    touched, model = tables
    cell = part.with_name("cell.toml")
    cell.write_text(
        packaged_cell_text(PACKAGED_CELLS[0]).replace('source = "demo"', 'source = "demo"\npart_mm = [0, 300, 0]')
    )
    found = calibrate_cell(touched, model=model, cell=cell, part=part, unit="mm", noise=0.1)
    assert found.suggestion.name == "plate.ply"
    assert 299.0 <= found.suggestion.model[1] <= 331.0
    assert found.suggestion.deviation < found.position.deviation


def test_names_pair_the_points_whatever_their_order_and_a_swap_is_named(tmp_path: Path) -> None:
    model = written(tmp_path, "corners.csv", CORNERS)
    header, a, b, c, d = TOUCHED.splitlines()
    mixed = written(tmp_path, "mixed.csv", "\n".join([header, d, b, a, c, a]))
    found = calibrate_cell(mixed, model=model, cell=None, part=None, unit=None, noise=None)
    assert found.names == ("d", "b", "a", "c", "a")
    assert found.calibration.placement.misses.max() < 0.3
    swapped = written(tmp_path, "swapped.csv", TOUCHED.replace("a,", "-,").replace("b,", "a,").replace("-,", "b,"))
    with pytest.raises(InputError, match=r"swapped\.csv: touched points 1 and 2 look swapped.*\(1 is b, 2 is a, "):
        calibrate_cell(swapped, model=model, cell=None, part=None, unit=None, noise=None)


def test_a_point_that_the_model_lacks_or_has_twice_is_named(tables: tuple[Path, Path]) -> None:
    touched, model = tables
    touched.write_text(TOUCHED + "e,1,2,3\n")
    with pytest.raises(InputError, match=r"touched\.csv has the point 'e', which corners\.csv does not list"):
        calibrate_cell(touched, model=model, cell=None, part=None, unit=None, noise=None)
    model.write_text(CORNERS + "a,1,2,3\n")
    with pytest.raises(InputError, match=r"corners\.csv lists the point 'a' twice"):
        calibrate_cell(touched, model=model, cell=None, part=None, unit=None, noise=None)


def test_an_odd_touch_and_a_noise_that_is_too_small_are_said(tmp_path: Path) -> None:
    generator = np.random.default_rng(2)
    model = generator.uniform(-50.0, 50.0, (10, 3))
    touched = model + generator.normal(0.0, 0.02, (10, 3)) + [300.0, 0.0, 0.0]
    touched[6, 1] += 0.8
    paths = [
        written(
            tmp_path,
            f"{name}.csv",
            "name,x,y,z\n" + "".join(f"p{k},{x:.3f},{y:.3f},{z:.3f}\n" for k, (x, y, z) in enumerate(places.tolist())),
        )
        for name, places in (("touched", touched), ("model", model))
    ]
    found = calibrate_cell(paths[0], model=paths[1], cell=None, part=None, unit=None, noise=0.02)
    text = calibration_text(found)
    assert "warning: p6: by chance" in text
    assert "the residuals exceed the given noise" in text


# The tool


def test_the_tip_found_from_joint_angles_is_written_to_the_cell(tmp_path: Path) -> None:
    cell = load_cell(None)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    point, tip = np.array([350.0, 30.0, 120.0]), cell.tool.T_flange_tool[:3, 3] + [0.6, -0.4, 0.3]
    rows: list[str] = []
    down = arm.flange_poses(cell.robot.home[None])[0, :3, :3]
    for turn in ([0.0, 0, 0], [0.4, 0, 0], [-0.3, 0.2, 0], [0, -0.4, 0.3], [0.1, 0.4, -0.5]):
        rotation = Rotation.from_rotvec(turn).as_matrix() @ down
        flange = transforms.rigid(rotation, point - rotation @ tip)
        solutions = arm.solutions(flange[None] @ cell.tool.T_flange_tool)[0]
        joints = np.degrees(solutions[np.isfinite(solutions).all(axis=1)][0])
        rows.append(",".join(f"{value:.4f}" for value in joints))
    poses = written(tmp_path, "poses.csv", "j1,j2,j3,j4,j5,j6\n" + "\n".join(rows))
    found = calibrate_tool(poses, cell=None, noise=None)
    save_calibrated(found, tmp_path / "new.toml", overwrite=False)
    after = load_cell(tmp_path / "new.toml").tool.T_flange_tool
    np.testing.assert_allclose(after[:3, 3], tip, atol=0.02)
    np.testing.assert_allclose(after[:3, :3], cell.tool.T_flange_tool[:3, :3])
    assert f"{np.sqrt(0.61):.2f}" in calibration_text(found).splitlines()[0]
    record = json.loads(json.dumps(calibration_summary(found)))
    assert record["fixture_outdated"] is False
    assert record["tcp_mm"] == pytest.approx(tip, abs=0.02)


# What is asked for


@pytest.mark.parametrize(
    "given", [{}, {"touched": True}, {"model": True}, {"tcp": True, "touched": True}, {"tcp": True, "part": True}]
)
def test_tables_of_neither_or_both_are_refused(tables: tuple[Path, Path], given: dict[str, bool]) -> None:
    def path(name: str) -> Path | None:
        return tables[0] if name in given else None

    with pytest.raises(UsageError, match="`--tcp` alone"):
        calibrate(
            path("touched"), model=path("model"), tcp=path("tcp"), cell=None, part=path("part"), unit=None, noise=None
        )


@pytest.mark.parametrize("noise", [0.0, -1.0, float("nan"), float("inf")])
def test_a_noise_that_is_none_is_refused(tables: tuple[Path, Path], noise: float) -> None:
    with pytest.raises(UsageError, match="--noise-mm"):
        calibrate(tables[0], model=tables[1], tcp=None, cell=None, part=None, unit=None, noise=noise)


# The plan


def calibrated_cell(tables: tuple[Path, Path], *, noise: float) -> Path:
    touched, model = tables
    base = touched.with_name("base.toml")
    base.write_text(
        packaged_cell_text(PACKAGED_CELLS[0]).replace('source = "demo"', 'source = "demo"\npart_mm = [-8, -6, 20]')
    )
    found = calibrate_cell(touched, model=model, cell=base, part=None, unit=None, noise=noise)
    out = touched.with_name("calibrated.toml")
    save_calibrated(found, out, overwrite=True)
    return out


def stated(tables: tuple[Path, Path], **keys: list[float]) -> Path:
    """Calibrate the packaged cell as a newcomer does, and state so much of the part's place under [work]."""
    out = tables[0].with_name("stated.toml")
    save_calibrated(
        calibrate_cell(tables[0], model=tables[1], cell=None, part=None, unit=None, noise=0.05), out, overwrite=True
    )
    lines = "".join(f"{key} = {value}\n" for key, value in keys.items())
    out.write_text(out.read_text().replace('\nsource = "calibrated"\n', f'\nsource = "calibrated"\n{lines}'))
    return out


def test_a_calibrated_cell_that_does_not_state_the_parts_place_makes_programs_that_run_only_dry_and_say_so(
    tables: tuple[Path, Path], small: Path, tmp_path: Path
) -> None:
    planned = plan(job_of(surface=small, unit="mm", spacing=4.0, cell=stated(tables)))
    save_plan(planned, tmp_path / "out")
    (robot,) = planned.robot
    assert robot.program.dry_run
    modules = dict(robot.program.modules)
    assert not re.search(r"SetDO \w+,1|geoOn:=1", "".join(modules.values()))
    record = json.loads((tmp_path / "out" / "plan.json").read_text())
    assert record["robot"][0]["program"]["dry_run_only"] is True
    motion = record["robot"][0]["motion"]
    assert (motion["placement_calibrated"], motion["placement_missing"]) == (
        True, ["the pose of the part on the fixture (part_mm)"],
    )  # fmt: skip
    # Nobody knows how well the surface is known either.
    assert "surface_within_mm" not in record["robot"][0]["motion"]
    sheet = " ".join(run_sheet(check_bundle(tmp_path / "out")).split())
    assert "RUNS DRY ONLY" in sheet
    assert "geoDryRun FALSE" not in sheet
    for text in (outcome_text(record_plan(planned)), sheet, modules["GeoCell.mod"], modules["GeoPrint.mod"]):
        assert "unknown" in text.lower()
        assert "the pose of the part on the fixture (part_mm)" in text
        assert "touched points)" not in text


def test_a_part_whose_place_is_stated_prints_there_and_the_run_sheet_says_where(
    tables: tuple[Path, Path], small: Path, tmp_path: Path
) -> None:
    cell = stated(tables, part_mm=[6.0, -8.0, 20.0], part_rpy_deg=[0.0, 0.0, 90.0])
    planned = plan(job_of(surface=small, unit="mm", spacing=4.0, cell=cell))
    save_plan(planned, tmp_path / "out")
    assert planned.robot
    assert not planned.robot[0].program.dry_run
    assert "placement unknown" not in outcome_text(record_plan(planned))
    sheet = " ".join(run_sheet(check_bundle(tmp_path / "out")).split())
    assert "part on the fixture, as stated: origin at (6.00, -8.00, 20.00) mm, turned (0.00, 0.00, 90.00)" in sheet
    motion = json.loads((tmp_path / "out" / "plan.json").read_text())["robot"][0]["motion"]
    assert motion["placement_missing"] == []
    # Below a third of the stand-off nothing is said of how well the surface is known.
    assert WORSE not in outcome_text(record_plan(planned))
    check_known(motion, noise=0.05)


def test_a_turn_without_a_place_is_refused(tables: tuple[Path, Path]) -> None:
    with pytest.raises(UsageError, match="part_rpy_deg needs part_mm, the position of the part"):
        load_cell(stated(tables, part_rpy_deg=[0.0, 0.0, 90.0]))


def test_a_calibration_says_that_the_parts_place_is_still_to_be_stated(tables: tuple[Path, Path]) -> None:
    cell = stated(tables, part_mm=[0.0, 0.0, 5.0])
    for base, said in ((None, True), (cell, False)):
        found = calibrate_cell(tables[0], model=tables[1], cell=base, part=None, unit=None, noise=None)
        assert ("does not state where the part stands on the fixture" in calibration_text(found)) is said
        assert calibration_summary(found)["part_stated"] is not said


def test_a_plan_refuses_a_part_that_is_known_worse_than_its_stand_off(tables: tuple[Path, Path], small: Path) -> None:
    cell = calibrated_cell(tables, noise=0.4)
    with pytest.raises(ClearanceError, match=r"leave small\.ply uncertain.* allowed are 0\.3 mm.*--part"):
        plan(job_of(surface=small, unit="mm", spacing=4.0, cell=cell))


def test_a_plan_warns_above_a_third_of_the_stand_off(tables: tuple[Path, Path], small: Path) -> None:
    planned = plan(job_of(surface=small, unit="mm", spacing=4.0, cell=calibrated_cell(tables, noise=0.2)))
    assert WORSE in outcome_text(record_plan(planned))
    check_known(json.loads(json.dumps(summary(planned)))["robot"][0]["motion"], noise=0.2)


def check_known(motion: Mapping[str, Any], *, noise: float) -> None:
    """Check what is told of the small plate, the middle of which lies over that of the square."""
    # Its corners, 8 and 6 mm from there: a quarter and two turns over 100 mm.
    assert motion["surface_uncertainty_mm"] == pytest.approx(noise * np.sqrt(0.25 + 100.0 / 1e4), rel=0.01)
    assert motion["surface_within_mm"] == pytest.approx(1.96 * motion["surface_uncertainty_mm"], rel=1e-3)
