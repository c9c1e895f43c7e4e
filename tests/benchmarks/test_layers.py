"""Shells whose layers have a formula: their area, the length of their paths and the volume that is laid."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.parts.shells import SPACING, TUBE_LENGTH, PathShell, flat_shell, path_shells, shells

CAPS_AND_TUBES = {shell.name: shell for shell in path_shells()}


@pytest.mark.parametrize(("name", "layer"), [*zip(CAPS_AND_TUBES, (4, 1, 1, 4), strict=True)])
def test_area_paths_and_volume_of_a_layer_are_those_of_the_formula(name: str, layer: int) -> None:
    assert CAPS_AND_TUBES[name].off(layer, thickness=2.0) == pytest.approx((0.0, 0.0, 0.0), abs=0.005)


def test_contours_that_are_one_too_few_would_be_seen() -> None:
    true = CAPS_AND_TUBES["cap, outside"]
    missing = PathShell(true.name, true.part, true.area, lambda radius: true.length(radius) * 1.01, true.sign)
    area, length, volume = missing.off(1, thickness=1.0)
    assert abs(area) < 0.005 < abs(length)
    assert abs(volume) > 0.005


def test_formulas_are_those_of_sphere_and_cylinder() -> None:
    cap, tube = CAPS_AND_TUBES["cap, outside"], CAPS_AND_TUBES["tube, inside"]
    # Rings of a cap at 1/2, 3/2 ... of the spacing cover it but for what is left about the pole.
    assert cap.length(12.0) * SPACING == pytest.approx(cap.area(12.0), rel=0.02)
    assert tube.area(10.0) == pytest.approx(2.0 * np.pi * 10.0 * TUBE_LENGTH)
    assert flat_shell().area(2.0) == pytest.approx(300.0)
    assert [shell.area(3.0) > shell.area(0.0) for shell in shells(0.2)] == [True, True, False, False]
