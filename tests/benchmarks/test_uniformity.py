"""The evenness benchmark: its surfaces are what they are named, its tables say what changed and who refused."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from benchmarks.parts.surfaces import SHAPES, cap, triangulated
from benchmarks.uniformity import Evenness, Row, differences, loaded, picture, table
from geoprint.surfaces import face_areas

EVEN = Evenness(cv=0.002, p95=1.003, gap=0.0, overlap=0.0, width_cv=0.004)
UNEVEN = Evenness(cv=0.1, p95=1.2, gap=0.02, overlap=0.001, width_cv=0.11)
ALL_EVEN = {"lscm": EVEN, "heat": EVEN, "fast-marching": EVEN}
FLAT = Row("flat", (0.97, 1.03), ALL_EVEN, {})
CURVED = Row("curved", (0.6, 1.3), {**ALL_EVEN, "lscm": UNEVEN}, {})
REFUSED = Row("cone", None, {"heat": EVEN, "fast-marching": EVEN}, {"lscm": "its tip has no scale."})


@pytest.mark.parametrize("half_angle", [20.0, 45.0, 70.0])
def test_a_cap_has_the_depth_and_the_area_of_its_sphere(half_angle: float) -> None:
    angle = np.radians(half_angle)
    radius = 20.0 / angle
    shape = cap(half_angle)
    surface = triangulated(shape, name="cap", faces=3_000)
    np.testing.assert_allclose(np.linalg.norm(surface.vertices, axis=1), radius)
    assert face_areas(surface).sum() == pytest.approx(2 * np.pi * radius**2 * (1 - np.cos(angle)), rel=0.005)
    assert shape.distance is not None
    assert shape.distance(np.array([[0.0, 0.0, radius]])) == pytest.approx(20.0)


def test_the_hemisphere_is_still_one() -> None:
    shape = SHAPES["cap"]()
    assert shape.distance is not None
    assert shape.distance(np.array([[0.0, 0.0, 20.0]])) == pytest.approx(10.0 * np.pi)
    np.testing.assert_allclose(shape.lift(shape.borders[0])[:, 2], 0.0, atol=1e-9)


def test_the_table_goes_from_nearly_flat_to_curved_and_tells_who_refuses() -> None:
    lines = list(table([REFUSED, CURVED, FLAT]))
    firsts = [line.split("|")[1].strip() for line in lines if line.startswith("|")]
    assert firsts[2:] == ["**nearly flat**", "flat", "**curved**", "curved", "cone"]
    assert "| 10.00 / 0.20 / 0.20 | 1.200 / 1.003 / 1.003 | 2.00 / 0.00 / 0.00 |" in lines[-3]
    assert "| - | - / 0.20 / 0.20 |" in lines[-2]
    assert lines[-1] == "cone: lscm refuses: its tip has no scale."


def test_saved_figures_read_back_and_differ_only_where_something_changed(tmp_path: Path) -> None:
    rows = [FLAT, CURVED, REFUSED]
    path = tmp_path / "rows.json"
    path.write_text(json.dumps([asdict(row) for row in rows]))
    assert loaded(path) == rows
    assert len(list(differences(rows, loaded(path)))) == 2
    better = Row("curved", (0.6, 1.3), {"heat": EVEN, "lscm": Evenness(0.05, 1.2, 0.02, 0.001, 0.11)}, {})
    assert list(differences(rows, [FLAT, better]))[2:] == [
        "| curved | lscm | cv | 0.1000 | 0.0500 | -0.0500 |",
        "| curved | fast-marching | planned only in A | | | |",
        "| cone | | only in A | | | |",
    ]


def test_the_picture_repeats_and_changes_with_a_figure() -> None:
    assert picture([FLAT, CURVED, REFUSED]) == picture([REFUSED, FLAT, CURVED])
    assert picture([FLAT, CURVED]) != picture([FLAT, Row("curved", (0.6, 1.3), ALL_EVEN, {})])
