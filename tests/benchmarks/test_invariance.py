"""The benchmark of invariance and convergence: its parts, its changes, and what its tables say of known figures."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from benchmarks.paths.invariance import (
    CHANGES,
    Case,
    Change,
    Paths,
    by_change,
    even_rows_cv,
    extrapolated,
    part_files,
    refined,
    save,
    spacing_on,
    twice,
)
from geoprint.geometry import closest, face_areas
from geoprint.geometry.files import load
from tests.meshes import plate

ROWS = Paths(
    plate((12.0, 6.0), (6, 3)),
    tuple(np.column_stack([np.linspace(0.0, 12.0, 13), np.full(13, y), np.zeros(13)]) for y in (1.0, 3.0, 5.0)),
    2.0,
)


def test_twelve_parts_are_there_and_those_by_formula_have_their_area(tmp_path: Path) -> None:
    parts = {name: load(file, unit="mm") for name, file in part_files(tmp_path).items()}
    assert len(parts) == 12
    for name, area in (("L", 40 * 16 + 16 * 18), ("annulus", np.pi * (20**2 - 8**2)), ("cone", np.pi * 15 * 30)):
        assert face_areas(parts[name]).sum() == pytest.approx(area, rel=0.01)
    assert spacing_on(parts["plate"]) == 2.89  # 40 mm by 30 mm, a twelfth of the side of the square


@pytest.mark.parametrize("change", [*CHANGES, refined], ids=lambda change: change.__name__)
def test_a_change_keeps_length_and_area_and_lines_on_the_part(change: Change) -> None:
    after = change(ROWS)
    scale = after.spacing / ROWS.spacing
    count = 2 if change is twice else 1
    length = sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in after.lines)
    assert length == pytest.approx(count * scale * 36.0)
    assert face_areas(after.part).sum() == pytest.approx(count * scale**2 * 72.0)
    assert closest(after.part, np.concatenate(after.lines))[1].max() == pytest.approx(0.0, abs=1e-9)


def test_what_halves_twice_as_well_each_time_has_order_two_and_its_limit() -> None:
    order, limit = extrapolated([1.0 + h**2 for h in (0.4, 0.2, 0.1)])
    assert (order, limit) == (pytest.approx(2.0), pytest.approx(1.0))


@pytest.mark.parametrize("values", [[1.0, 0.9, 0.95], [1.0, 0.9, 0.7], [1.0, 1.0, 1.0]])
def test_what_does_not_approach_anything_has_no_order(values: list[float]) -> None:
    assert extrapolated(values) == (None, values[-1])


def test_even_rows_vary_by_the_harmonic_that_the_spread_leaves() -> None:
    # Half of (2 pi 0.6)^2 is 7.106; in 32 implicit steps that leaves 1.2221^-32 of an amplitude of 2.
    assert even_rows_cv() == pytest.approx(0.00231, abs=1e-5)


def test_the_table_of_changes_says_what_changed_most_and_where(tmp_path: Path) -> None:
    plain = np.array([2.0, 1.0, 0.5, 0.0])
    cases = [
        Case("plate", "slices", 2.0, plain, {"cut": plain + np.array([0.0, 0.1, 0.0, 0.0])}),
        Case("cone", "slices", 2.0, plain, {"cut": plain - np.array([0.01, 0.0, 0.0, 0.0]), "moved": plain}),
        Case("dome", "spiral, heat", 2.0, np.zeros(4), {}, "no spiral"),
    ]
    lines = list(by_change(cases))
    assert "| cut | 2 | 0.0100 | 0.1000 | 0.0000 | 0.0000 | plate: slices |" in lines
    assert "| begun elsewhere | 0 | 0.0000 | 0.0000 | 0.0000 | 0.0000 |  |" in lines
    save(cases, tmp_path / "all.csv")
    with (tmp_path / "all.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["part"], row["change"], row["off: following CV"]) for row in rows] == [
        ("plate", "", "0.000000"), ("plate", "cut", "0.100000"), ("cone", "", "0.000000"), ("cone", "cut", "0.000000"),
        ("cone", "moved", "0.000000"), ("dome", "refused: no spiral", None),
    ]  # fmt: skip
