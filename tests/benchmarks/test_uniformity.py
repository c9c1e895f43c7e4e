"""The evenness benchmark: its surfaces are what they are named, its tables say what changed and who refused."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.parts.surfaces import SHAPES, cap, triangulated
from benchmarks.uniformity import BACKENDS, Evenness, Row, differences, evenness_of, loaded, picture, table
from geoprint import compare, job_of
from geoprint.surfaces import face_areas
from geoprint.surfaces.files import save_ply
from tests.meshes import spherical_cap

EVEN = Evenness(
    thickness_cv=0.002, following_cv=0.003, covered_once=1.0, gap=0.0, overlap=0.0, level_cv=0.001, width_cv=0.004
)  # fmt: skip
UNEVEN = Evenness(
    thickness_cv=0.1, following_cv=0.02, covered_once=0.979, gap=0.02, overlap=0.001, level_cv=0.08, width_cv=0.11
)  # fmt: skip
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
    assert lines[2].split(" | ")[2:6] == ["thickness CV, %", "following CV, %", "once, %", "gap, %"]
    assert len({line.count("|") for line in lines if line.startswith("|")}) == 1
    assert (
        "| 10.00 / 0.20 / 0.20 | 2.00 / 0.30 / 0.30 | 97.90 / 100.00 / 100.00 | 2.00 / 0.00 / 0.00 "
        "| 0.10 / 0.00 / 0.00 | 8.00 / 0.10 / 0.10 | 11.00 / 0.40 / 0.40 |"
    ) in lines[-3]
    assert "| - | - / 0.20 / 0.20 |" in lines[-2]
    assert lines[-1] == "cone: lscm refuses: its tip has no scale."


def test_saved_figures_read_back_and_differ_only_where_something_changed(tmp_path: Path) -> None:
    rows = [FLAT, CURVED, REFUSED]
    path = tmp_path / "rows.json"
    path.write_text(json.dumps([asdict(row) for row in rows]))
    assert loaded(path) == rows
    assert len(list(differences(rows, loaded(path)))) == 2
    better = Row("curved", (0.6, 1.3), {"heat": EVEN, "lscm": replace(UNEVEN, thickness_cv=0.05)}, {})
    assert list(differences(rows, [FLAT, better]))[2:] == [
        "| curved | lscm | thickness_cv | 0.1000 | 0.0500 | -0.0500 |",
        "| curved | fast-marching | planned only in A | | | |",
        "| cone | | only in A | | | |",
    ]


def test_the_picture_repeats_and_changes_with_a_figure() -> None:
    assert picture([FLAT, CURVED, REFUSED]) == picture([REFUSED, FLAT, CURVED])
    assert picture([FLAT, CURVED]) != picture([FLAT, Row("curved", (0.6, 1.3), ALL_EVEN, {})])


def test_flow_that_follows_evens_out_a_flattened_cap_and_levels_tell_the_distances_apart(tmp_path: Path) -> None:
    part = tmp_path / "cap.ply"
    save_ply(spherical_cap(radius=14.0, angle=1.0, rings=6, jitter_seed=1), part)
    compared = compare(job_of(surface=part, unit="mm", spacing=2.5, robot=False, middle="plain"), backends=BACKENDS)
    found = {name: evenness_of(outcome.uniformity) for name, outcome in compared.planned}
    assert list(found) == list(BACKENDS)
    flattened, marched = found["lscm"], found["fast-marching"]
    assert flattened.thickness_cv > 4.0 * flattened.following_cv
    assert flattened.level_cv > 10.0 * marched.level_cv
    for each in found.values():
        assert each.covered_once == pytest.approx(1.0 - each.gap - each.overlap)
