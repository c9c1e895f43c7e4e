"""Fibres of more than one width, as a field file asks for them: planned, compared, layered, again, and refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import geoprint
from geoprint.config import Job, job_of
from geoprint.errors import GeoprintError, InputError, UsageError
from geoprint.geometry.files import save_ply
from geoprint.model import FloatArray
from geoprint.results import Plan
from geoprint.workflow import check_bundle, compare, plan, save_plan
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import prepare_workpiece
from tests.meshes import plate

ANALOG = Path(__file__).parents[1] / "golden" / "analog.toml"
LINES = "[[preferences]]\ndirection = [1.0, 0.0, 0.0]\n"
ALONG = LINES + "[width]\ndirection = [0.0, 1.0, 0.0]\nbegin_mm = 0.8\nend_mm = 1.6\n"
HIGH = 16.0


def _job(folder: Path, field: str = ALONG, **keys: object) -> Job:
    save_ply(plate((10.0, HIGH), (10, 16), jitter_seed=1), folder / "plate.ply")
    (folder / "own.toml").write_text(field)
    asked: dict[str, object] = {"spacing": 1.2, "robot": False, "cell": ANALOG, "pattern": "fibres"}
    return job_of(surface=folder / "plate.ply", unit="mm", field=folder / "own.toml", **(asked | keys))


def _wanted(places: FloatArray) -> FloatArray:
    return 0.8 + 0.8 * places[:, 1] / HIGH


def _off_the_wanted(paths: Plan) -> float:
    """Return by what share of it the distance of neighbouring rows is off what is wanted between them, at most."""
    curves = paths.toolpath.curves
    drawn = [curves.xyz(paths.workpiece.surface, curve) for curve in range(curves.count)]
    heights = np.sort([float(line[:, 1].mean()) for line in drawn])
    middles = np.column_stack([heights[1:] + heights[:-1]] * 3) / 2
    return float(np.abs(np.diff(heights) / _wanted(middles) - 1.0).max())


def test_rows_flow_and_evenness_follow_the_width_with_both_backends(tmp_path: Path) -> None:
    for _, compared in compare(_job(tmp_path), backends=["lscm", "heat"]).planned:
        paths = compared.plan
        assert _off_the_wanted(paths) < 0.04
        found, poses = compared.uniformity, paths.poses
        assert (found.sides.both.cv, found.gap) == (pytest.approx(0.0, abs=0.02), pytest.approx(0.0, abs=0.01))
        assert found.thickness.cv < 0.02
        assert found.levels is None
        assert paths.deposited is not None
        assert paths.deposited.mode == "analog"
        # Away from the ends of rows a strip is as wide as is wanted.
        places = poses.surface_points
        inside = poses.deposit & (places[:, 0] > 1.0) & (places[:, 0] < 9.0)
        height = paths.workpiece.cell.process.layer_height
        np.testing.assert_allclose(poses.flow[inside], height * _wanted(places[inside]), rtol=0.06)
        assert poses.flow[inside].max() > 1.7 * poses.flow[inside].min()


def test_the_least_light_and_what_is_expected_in_print_are_of_the_width_that_is_wanted(tmp_path: Path) -> None:
    lamp = "uv_irradiance_mw_cm2 = 100\nuv_spot_mm = 6\nuv_dose_mj_cm2 = 100\n"
    known = "\n[material]\ndensity_g_cm3 = 1\nconsistency_pa_sn = 9\nflow_index = 1\nyield_stress_pa = 0\n"
    (tmp_path / "lamp.toml").write_text(ANALOG.read_text() + known + lamp)
    wide = LINES + "[width]\ndirection = [0.0, 1.0, 0.0]\nbegin_mm = 1.2\nend_mm = 1.6\n"
    one, other = (plan(_job(tmp_path, field, cell=tmp_path / "lamp.toml", spacing=1.2)) for field in (LINES, wide))
    lights = [paths.light for paths in (one, other)]
    assert lights[0] is not None
    assert lights[1] is not None
    assert lights[1].all_passes * 1.6 == pytest.approx(lights[0].all_passes * 1.2, rel=0.05)
    assert one.printed is not None
    assert other.printed is not None
    # The same error is a smaller share of 1.4 mm in the mean than of 1.2 mm.
    along = [paths.printed.variances[2] for paths in (one, other) if paths.printed is not None]
    assert along[1] == pytest.approx(along[0] * (1.2 / 1.4) ** 2, rel=0.1)


def test_a_table_is_kept_in_the_bundle_which_is_planned_and_measured_again_alike(tmp_path: Path) -> None:
    rows = ["x,y,z,width", "0,0,0,0.8", "10,0,0,0.8", f"0,{HIGH},0,1.6", f"10,{HIGH},0,1.6"]
    (tmp_path / "own.csv").write_text("\n".join(rows))
    job = _job(tmp_path, LINES + "[width]\ntable = 'own.csv'\n", cell=None)
    paths = plan(job)
    assert _off_the_wanted(paths) < 0.1
    save_plan(paths, tmp_path / "out")
    (tmp_path / "own.csv").unlink()
    record = json.loads((tmp_path / "out" / "plan.json").read_text())
    np.testing.assert_allclose(record["paths"]["widths_mm"], (0.8, 1.6), atol=0.06)
    assert any("can only open and shut its valve" in warning for warning in record["warnings"])
    assert (tmp_path / "out" / "field" / "own.csv").read_text().startswith("x,y,z,width")
    save_plan(plan(geoprint.job_from(tmp_path / "out")), tmp_path / "again")
    assert (tmp_path / "out" / "manifest.json").read_bytes() == (tmp_path / "again" / "manifest.json").read_bytes()
    assert not check_bundle(tmp_path / "out", full=True).findings


def test_a_layer_has_the_widths_of_the_part_below_it(tmp_path: Path) -> None:
    about = LINES + "[width]\nplaces = [[5.0, 8.0, 0.0]]\nat_mm = 1.7\nwithin_mm = 6.0\n"
    paths = plan(_job(tmp_path, about, thickness=3.0, layer=6))
    assert paths.workpiece.widths is not None
    places = paths.poses.surface_points[paths.poses.deposit]
    assert places[:, 2].min() > 2.5
    away = np.hypot(places[:, 0] - 5.0, places[:, 1] - 8.0)
    widths = paths.toolpath.spacings
    assert widths[away < 1.2].min() > 1.6
    np.testing.assert_allclose(widths[away > 6.3], 1.2, rtol=1e-3)


def _prepared(job: Job) -> None:
    prepare_workpiece(job, Stages(lambda _: None), backends=["heat"])


@pytest.mark.parametrize(
    ("width", "keys", "refused", "sentence"),
    [
        (
            ALONG.replace("1.6", "1.9"), {}, InputError,
            r"own.toml: \[width\] asks for 1.9 mm at \(.*16.*\) mm, .* spacing of 1.2 mm .* 0.6 to 1.8 mm .*share 1.5",
        ),
        (ALONG.replace("0.8", "0.5"), {}, InputError, r"asks for 0.5 mm at .* deposits 0.6 to 1.8 mm"),
        (
            ALONG.replace("0.8", "0.11").replace("1.6", "0.2"), {"spacing": 0.18}, InputError,
            r"asks for 0.11 mm at .* a strand of 0.265 mm .* is 0.3 mm, so nothing presses",
        ),
        (ALONG.replace("1.0, 0.0]\nbegin", "0.0, 1.0]\nbegin"), {}, InputError, r"plate.ply measures 0 mm along it"),
        (ALONG, {"spacing": None, "rounds": 5}, UsageError, r"\[width\] is relative to the spacing: give `--spacing`"),
        (
            LINES + "[width]\nplaces = [[5.0, 8.0, 3.0]]\nat_mm = 1.5\nwithin_mm = 6.0\n", {}, InputError,
            r"\[width\]: the point \(5.*8.*3.*\) mm is 3 mm off plate.ply, allowed are 1 mm",
        ),
    ],
)  # fmt: skip
def test_what_a_cell_cannot_lay_is_refused_with_the_place_and_the_number(
    width: str, keys: dict[str, object], refused: type[GeoprintError], sentence: str, tmp_path: Path
) -> None:
    with pytest.raises(refused, match=sentence):
        _prepared(_job(tmp_path, width, **keys))


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        (("x,y,z,thickness", "0,0,0,1"), r"own.csv, line 1: the first row must name the columns x,y,z,width"),
        (("x,y,z,width", "0,0,0,0"), r"own.csv: the width at \(0, 0, 0\) mm is 0 mm, needed is more"),
        (("x,y,z,width", "0,0,0,-1"), r"own.csv, line 2, column width: found -1 mm"),
        (("x,y,z,width", "0,0,0,1", "0,0,0,1.2"), r"own.csv, line 3: this point is in the table twice"),
        (("x,y,z,width", "0,0,7,1"), r"own.csv: the point \(0.*7.*\) mm is 7 mm off plate"),
        (("x,y,z,width", "0,0,0,1", "5,5,0,3"), r"asks for 3 mm at \(5.*5.*0.*\) mm, .* deposits 0.6 to 1.8 mm"),
        (("x,y,z,width",), r"own.csv has a header but no rows"),
    ],
)
def test_tables_that_say_no_width_are_refused(rows: tuple[str, ...], sentence: str, tmp_path: Path) -> None:
    (tmp_path / "own.csv").write_text("\n".join(rows))
    with pytest.raises(InputError, match=sentence):
        _prepared(_job(tmp_path, LINES + "[width]\ntable = 'own.csv'\n"))


def test_a_program_of_a_cell_whose_flow_is_one_is_refused(tmp_path: Path) -> None:
    job = _job(tmp_path, robot=True, cell=None, place="demo")
    with pytest.raises(UsageError, match=r"can only open and shut its valve .* Give a cell with mode .analog."):
        _prepared(job)
