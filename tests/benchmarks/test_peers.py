"""The benchmark beside other programs: their curves are read right, missing programs are named."""

from __future__ import annotations

import importlib.util
from importlib.machinery import ModuleSpec

import numpy as np
import pytest

from benchmarks.parts.surfaces import cap, triangulated
from benchmarks.paths.peers import METHODS, chained, table
from geoprint.geometry import closest


def test_directed_segments_become_open_and_closed_polylines() -> None:
    places = np.arange(18.0).reshape(6, 3)
    # 0 -> 1 -> 2 is open, at level 4; 3 -> 4 -> 5 -> 3 is closed, at level 7.
    segments = np.array([[1, 2], [4, 5], [0, 1], [5, 3], [3, 4]])
    lines, levels = chained(places, segments, np.array([4, 7, 4, 7, 7]))
    assert levels == [4, 7]
    np.testing.assert_array_equal(lines[0], places[[0, 1, 2]])
    np.testing.assert_array_equal(lines[1], places[[4, 5, 3, 4]])


@pytest.mark.parametrize("name", list(METHODS))
def test_every_method_traces_each_level_of_a_cap_once_and_on_the_surface(name: str) -> None:
    if importlib.util.find_spec(METHODS[name].library) is None:
        pytest.skip(f"{METHODS[name].library} is not installed")
    surface = triangulated(cap(45.0), name="cap", faces=2_000)
    lines, levels = METHODS[name].isolines(surface, 4.0)
    assert sorted(set(levels)) == [0, 1, 2, 3, 4]
    radius = 20.0 / np.radians(45.0)
    for line, level in zip(lines, levels, strict=True):
        np.testing.assert_allclose(line[0], line[-1], atol=1e-9)
        assert closest(surface, line)[1].max() < 1e-9
        from_pole = radius * np.arccos(np.clip(line[:, 2] / np.linalg.norm(line, axis=1), -1.0, 1.0))
        np.testing.assert_allclose(20.0 - from_pole, 4.0 * (level + 0.5), atol=0.7)


def test_programs_that_are_missing_are_left_out_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing_but_geoprint(name: str) -> ModuleSpec | None:
        return ModuleSpec(name, None) if name == "geoprint" else None

    monkeypatch.setattr(importlib.util, "find_spec", nothing_but_geoprint)
    lines = list(table([triangulated(cap(45.0), name="cap", faces=500)], spacing=4.0))
    assert [line.split("|")[3].strip() for line in lines[2:-2]] == ["geoprint heat", "geoprint fast-marching"]
    assert lines[-2] == "igl (pip install libigl) is not installed and left out."
    assert lines[-1] == "potpourri3d is not installed and left out."
