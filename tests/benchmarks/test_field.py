"""The yardstick: peers' paths are what they say, refusals are rows, and the kept figures read back."""

from __future__ import annotations

import importlib.util
from importlib.machinery import ModuleSpec
from pathlib import Path

import numpy as np
import pytest

from benchmarks.field.figures import KEPT, Figures, field_picture, line, loaded, save
from benchmarks.field.planners import PLANNERS, concentric_infill, missing_libraries, present_planners
from geoprint.errors import InputError
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


def test_planners_whose_library_is_missing_are_left_out_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(_name: str) -> ModuleSpec | None:
        return None

    monkeypatch.setattr(importlib.util, "find_spec", nothing)
    assert all(planner.ours for _, planner in present_planners())
    assert missing_libraries() == ["igl", "potpourri3d", "shapely"]


def test_figures_are_kept_to_five_decimals_and_refusals_are_rows(tmp_path: Path) -> None:
    found = [
        Figures("plate", "one", ours=True, runs=3, length_m=0.5, thickness_cv=0.0123456, following_cv=0.02, gap=0.001),
        Figures("plate", "other", ours=False, refused="it has a hole | and more"),
    ]
    save(found, tmp_path / "kept.csv")

    kept = loaded(tmp_path / "kept.csv")

    assert [each.thickness_cv for each in kept] == [0.01235, 0.0]
    assert [(each.runs, each.ours, each.refused) for each in kept] == [(3, True, ""), (0, False, found[1].refused)]
    assert line(kept[0]).startswith("| plate | one | 3 | 0.50 m | 1.23 % | 2.00 % |")
    assert "refused: it has a hole / and more" in line(kept[1])


def test_the_kept_table_has_every_planner_on_every_part_and_draws_the_same_picture_twice() -> None:
    found = loaded(KEPT)
    parts = {each.part for each in found}
    assert len(parts) == 9
    assert {(each.part, each.planner) for each in found} == {(part, name) for part in parts for name in PLANNERS}
    assert field_picture(found) == field_picture(found)
