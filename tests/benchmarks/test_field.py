"""The yardstick: planners' paths are what they say, refusals are rows, and the kept figures read back."""

from __future__ import annotations

import importlib.util
import math
from importlib.machinery import ModuleSpec
from pathlib import Path

import numpy as np
import pytest

from benchmarks import DATA, ROOT
from benchmarks.field.figures import (
    KEPT,
    Figures,
    field_picture,
    loaded,
    median_interval,
    save,
    share_interval,
    standings,
)
from benchmarks.field.page import field_page
from benchmarks.field.parts import FAMILIES, listed_parts, taken_parts
from benchmarks.field.planners import (
    PLANNERS,
    concentric_infill,
    missing_libraries,
    plane_slices,
    present_planners,
)
from benchmarks.field.study import PATHS, RECORD, field_study, figures_in, finished, hours, judge
from benchmarks.parts.tables import row
from geoprint.errors import InputError
from geoprint.geometry import prepare
from geoprint.model import Surface
from geoprint.sweep.running import CELLS, run_cell
from tests.meshes import cylinder_patch, plate, sphere


def test_concentric_infill_of_a_rectangle_is_rectangles_half_a_spacing_and_then_whole_ones_inside() -> None:
    pytest.importorskip("shapely")
    rings = concentric_infill(plate((40.0, 20.0), (20, 10)), spacing=4.0)
    sizes = sorted(tuple(np.ptp(ring, axis=0).round(6).tolist()) for ring in rings)
    assert sizes == [(28.0, 8.0, 0.0), (36.0, 16.0, 0.0)]


def test_what_has_no_rim_or_overhangs_cannot_be_projected() -> None:
    pytest.importorskip("shapely")
    with pytest.raises(InputError, match="has no rim"):
        concentric_infill(sphere(radius=10.0), spacing=2.0)
    with pytest.raises(InputError, match="overhangs"):
        concentric_infill(cylinder_patch(radius=10.0, angle=np.radians(220.0)), spacing=2.0)


def test_plane_slices_of_a_rectangle_are_rows_along_its_longer_side() -> None:
    lines = plane_slices(plate((40.0, 20.0), (20, 10)), spacing=4.0)
    assert [tuple(np.ptp(line, axis=0).round(6).tolist()) for line in lines] == [(40.0, 0.0, 0.0)] * 5
    heights = sorted(line[0, 1] for line in lines)
    assert np.diff(heights) == pytest.approx([4.0] * 4)


def test_planners_whose_library_is_missing_are_left_out_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(_name: str) -> ModuleSpec | None:
        return None

    monkeypatch.setattr(importlib.util, "find_spec", nothing)
    assert "potpourri3d, robust heat method" not in dict(present_planners())
    assert missing_libraries() == ["igl", "potpourri3d", "shapely"]


@pytest.mark.parametrize("family", ["formula", "heart"])
def test_a_family_makes_sound_parts_and_the_same_ones_for_a_seed(family: str) -> None:
    first, again = (FAMILIES[family](np.random.default_rng(3)) for _ in range(2))
    for _ in range(3):
        made, same = next(first), next(again)
        assert isinstance(made, Surface)
        assert isinstance(same, Surface)
        assert np.array_equal(made.vertices, same.vertices)
        prepare(made)


def test_a_cell_is_a_toolpath_that_measure_reads_or_a_refusal_and_a_submission_needs_no_planner(tmp_path: Path) -> None:
    taken_parts([DATA / "plate.ply"], tmp_path / "parts", squares=30.0)
    (part,) = listed_parts(tmp_path / "parts")
    assert part.spacing == pytest.approx(np.sqrt(1200.0 / 30.0), abs=0.01)
    (tmp_path / "yours").mkdir()
    rows = [f"{x},{y},0,{y}" for y in (-12, -6, 0, 6, 12) for x in (-19, 19)]
    (tmp_path / "yours" / "plate.csv").write_text("\n".join(["x,y,z,run", *rows]))
    (tmp_path / "none").mkdir()
    submissions = {name: tmp_path / name for name in ("yours", "none")}
    study = field_study([part], tmp_path / "parts", ["plane slicing"], submissions)
    out = tmp_path / "out"
    for cell in study.cells:
        run_cell(cell, out / CELLS / cell.name, work=lambda cell, place: judge(cell, place, submissions=submissions))

    sliced, yours, none = figures_in(study, out)

    assert (out / CELLS / study.cells[0].name / PATHS).read_text().startswith("x,y,z,run\n")
    assert (out / CELLS / study.cells[1].name / RECORD).is_file()
    assert (sliced.runs, yours.runs) == (5, 5)
    assert (sliced.gap, sliced.overlap) == (0.0, 0.0)
    assert yours.length_m == pytest.approx(0.19)
    assert (none.status, none.reason) == ("refused", "there is no toolpath for plate.")
    assert hours(study, out) > 0.0
    page = field_page([sliced, yours, none], study, hours=1.5).decode()
    assert "there is no toolpath for plate." in page
    assert "1.50 h" in page

    (tmp_path / "yours" / "plate.csv").write_text("\n".join(["x,y,z,run", *rows[:4]]))
    edited = field_study([part], tmp_path / "parts", ["plane slicing"], submissions)
    assert [each.status for each in figures_in(edited, out)] == ["done", "missing", "refused"]
    assert finished(edited, out).cells == ()
    assert finished(study, out).cells == study.cells


def test_medians_have_intervals_by_rank_and_a_refusal_is_worse_than_any_figure() -> None:
    # The 40th of 100 and its mirror: of 100 tosses fewer than 40 are heads in 1.8 %, fewer than 41 in 2.8 %.
    assert median_interval([float(value) for value in range(1, 101)]) == (40.0, 50.5, 61.0)
    assert median_interval([1.0, 2.0, math.inf]) == (-math.inf, 2.0, math.inf)
    assert median_interval([1.0, 2.0, 3.0, 4.0, 5.0, math.inf]) == (1.0, 3.5, math.inf)
    # Wilson's own interval of 8 of 10.
    assert share_interval(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    found = [
        Figures("a", "f", "one", ours=True, thickness_cv=0.01),
        Figures("b", "f", "one", ours=True, thickness_cv=0.02),
        Figures("a", "f", "other", ours=False, thickness_cv=0.005),
        Figures("b", "f", "other", ours=False, status="refused", reason="it has a hole"),
        Figures("a", "f", "third", ours=False, status="refused", reason="it has a hole"),
        Figures("b", "f", "third", ours=False, status="failed", reason="it took too long"),
    ]
    one, other, third = standings(found)
    assert one[:5] == ["one", "2", "0", "0", "1.50 %"]
    assert other[1:5] == ["1", "1", "0", "refused half"]
    assert other[7].startswith("50 % (")
    assert third[1:4] == ["0", "1", "1"]


def test_figures_are_kept_to_four_decimals_and_refusals_are_rows(tmp_path: Path) -> None:
    found = [
        Figures(
            "plate", "own", "one", ours=True, runs=3, length_m=0.5, thickness_cv=0.012345, following_cv=0.02, gap=0.001
        ),
        Figures("plate", "own", "other", ours=False, status="refused", reason="it has a hole | and more"),
    ]
    save(found, tmp_path / "kept.csv")

    kept = loaded(tmp_path / "kept.csv")

    assert [each.thickness_cv for each in kept] == [0.0123, 0.0]
    assert [(each.runs, each.ours, each.done, each.reason) for each in kept] == [
        (3, True, True, ""),
        (0, False, False, found[1].reason),
    ]


def test_the_kept_table_has_every_planner_on_every_part_and_draws_the_same_picture_twice() -> None:
    found = loaded(KEPT)
    parts = {each.part for each in found}
    assert {(each.part, each.planner) for each in found} == {(part, name) for part in parts for name in PLANNERS}
    assert not [each for each in found if each.status in {"failed", "missing"}]
    assert field_picture(found) == field_picture(found)


def test_the_guide_shows_the_kept_figures() -> None:
    text = (ROOT / "geoprint/guide/pages/explanation/planners.md").read_text(encoding="utf-8")
    for name, parts, _, _, thickness, _, missed, better in standings(loaded(KEPT)):
        assert row(name, parts, thickness, missed, better) in text
