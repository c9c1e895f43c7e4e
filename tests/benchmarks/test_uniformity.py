"""The evenness benchmark: its surfaces are what they are named, its tables say what changed and who refused."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.parts.surfaces import SHAPES, cap, triangulated
from benchmarks.paths.uniformity import (
    BACKENDS,
    COLUMNS,
    DATA,
    KEPT,
    OWN,
    PAGE,
    README,
    Row,
    differences,
    kept,
    loaded,
    measured,
    page,
    row_of,
    table,
    with_rows,
)
from geoprint.geometry import face_areas

KEYS = [metric.key for metric in COLUMNS]
EVEN = dict(zip(KEYS, (0.002, 0.003, 1.0, 0.0, 0.0, 0.001, 0.01, 0.001, 0.004), strict=True))
UNEVEN = dict(zip(KEYS, (0.1, 0.02, 0.979, 0.02, 0.001, 0.2, 0.5, 0.08, 0.11), strict=True))
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
        "| 0.10 / 0.00 / 0.00 | 20.00 / 0.10 / 0.10 | 50.00 / 1.00 / 1.00 | 8.00 / 0.10 / 0.10 | 11.00 / 0.40 / 0.40 |"
    ) in lines[-4]
    assert "| - | - / 0.20 / 0.20 |" in lines[-3]
    assert lines[-1] == "cone: lscm refuses: its tip has no scale."


def test_kept_figures_read_back_and_differ_only_where_something_changed() -> None:
    rows = [FLAT, CURVED, REFUSED]
    assert loaded(kept(rows)) == rows
    assert len(list(differences(rows, loaded(kept(rows))))) == 2
    better = Row("curved", (0.6, 1.3), {"heat": EVEN, "lscm": {**UNEVEN, "thickness.cv": 0.05}}, {})
    assert list(differences(rows, [FLAT, better]))[2:] == [
        "| curved | lscm | thickness.cv | 0.1000 | 0.0500 | -0.0500 |",
        "| curved | fast-marching | planned only in A | | | |",
        "| cone | | only in A | | | |",
    ]


def test_page_and_readme_show_the_kept_figures() -> None:
    text = KEPT.read_text(encoding="utf-8")
    rows, readme = loaded(text), README.read_text(encoding="utf-8")
    assert set(OWN) < {row.part for row in rows}
    assert PAGE.read_text(encoding="utf-8") == page(rows), (
        "write it again: python -m benchmarks.paths.uniformity --write"
    )
    assert readme == with_rows(readme, rows), "write it again: python -m benchmarks.paths.uniformity --write"
    assert sum(line.startswith(tuple(f"| {part} |" for part in OWN)) for line in readme.splitlines()) == len(OWN)


def test_the_kept_figures_are_what_the_command_gives() -> None:
    # Of one part: what changes the others' figures alone changes golden results, which hold all backends on them.
    part = "heart, apex"
    (row,) = (each for each in loaded(KEPT.read_text(encoding="utf-8")) if each.part == part)
    found = row_of(part, measured(DATA / OWN[part]))
    for name in BACKENDS:
        # As they are written, and what rounding on another machine turns over.
        assert found.backends[name] == pytest.approx(row.backends[name], abs=3e-4), name
