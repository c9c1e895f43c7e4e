"""Shells whose layers have a formula: their area, the length of their paths and the volume that is laid."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import numpy as np
import pytest

from geoprint.config import job_of
from geoprint.geometry import face_areas, turned_over
from geoprint.geometry.files import save_ply
from geoprint.model import Surface
from geoprint.workflow import plan
from tests.distance.bands import band
from tests.meshes import spherical_cap

# Of caps and tubes [mm], and the opening angle of caps [rad].
RADIUS, CAP_ANGLE = 12.0, 0.8
# Length of the tube [mm].
TUBE_LENGTH = 6.0
SPACING = 1.0


@final
@dataclass(frozen=True, slots=True, eq=False)
class PathShell:
    """A part over which contours from its rim have a length by formula.

    Attributes:
        name: as the test has it.
        part: on its printed side.
        area: of its layer at a radius [mm] from the axis or the centre [mm2].
        length: of that layer's contours, SPACING apart and half of it from the rim [mm].
        sign: 1 where layers lie farther out than the part, -1 where farther in.
    """

    name: str
    part: Surface
    area: Callable[[float], float]
    length: Callable[[float], float]
    sign: float

    def off(self, layer: int, *, thickness: float) -> tuple[float, float, float]:
        """Plan a layer without a robot and return by how much area, path length and laid volume are off, relative."""
        with TemporaryDirectory() as folder:
            path = Path(folder, "part.ply")
            save_ply(self.part, path)
            planned = plan(
                job_of(surface=path, unit="mm", spacing=SPACING, thickness=thickness, layer=layer, robot=False)
            )
        poses, place = planned.poses, planned.workpiece.place
        assert place is not None
        radius = RADIUS + self.sign * (place.bottom + place.height / 2.0)
        steps = np.linalg.norm(np.diff(poses.surface_points, axis=0), axis=1)
        area = float(face_areas(planned.workpiece.part).sum())
        length, volume = float(steps[poses.deposited].sum()), float((steps * poses.flow[:-1])[poses.deposited].sum())
        return (
            area / self.area(radius) - 1.0,
            length / self.length(radius) - 1.0,
            volume / (self.length(radius) * SPACING * place.height) - 1.0,
        )


def path_shells() -> Iterator[PathShell]:
    """Yield cap and tube, outside and inside."""
    cap = spherical_cap(radius=RADIUS, angle=CAP_ANGLE, rings=32)
    tube = band(low=RADIUS, high=RADIUS, height=TUBE_LENGTH, divisions=(96, 8))
    for sign, side in ((1.0, "outside"), (-1.0, "inside")):
        for name, part, area, length in (
            ("cap", cap, _cap_area, _cap_length),
            ("tube", tube, _tube_area, _tube_length),
        ):
            yield PathShell(f"{name}, {side}", part if sign > 0.0 else turned_over(part), area, length, sign)


def _cap_area(radius: float) -> float:
    return float(2.0 * np.pi * radius**2 * (1.0 - np.cos(CAP_ANGLE)))


def _cap_length(radius: float) -> float:
    polar = CAP_ANGLE - np.arange(SPACING / 2.0, CAP_ANGLE * radius, SPACING) / radius
    return float((2.0 * np.pi * radius * np.sin(polar)).sum())


def _tube_area(radius: float) -> float:
    return 2.0 * np.pi * radius * TUBE_LENGTH


def _tube_length(radius: float) -> float:
    return _tube_area(radius) / SPACING


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
