"""Shells by formula: layers over caps, cylinders and plates, whose area, paths and volume are known."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import numpy as np

from geoprint.config import job_of
from geoprint.layers import layer_level
from geoprint.model import Surface
from geoprint.pipeline import plan
from geoprint.surfaces import face_areas, turned_over
from geoprint.surfaces.files import save_ply
from tests.backends.bands import band
from tests.meshes import cylinder_patch, plate, spherical_cap

# Of caps and cylinders [mm], and the opening angles of both [rad].
RADIUS, CAP_ANGLE, CYLINDER_ANGLE = 12.0, 0.8, 1.4
# Lengths of the cylinder and of the tube [mm].
LENGTH, TUBE_LENGTH = 10.0, 6.0
# Edges over the radius: from a part of a few triangles to that of a good scan.
EDGES = (0.2, 0.1, 0.05, 0.025)
# The triangles of an irregular part are moved by this seed.
JITTER_SEED = 3
SPACING = 1.0


@final
@dataclass(frozen=True, slots=True, eq=False)
class Shell:
    """A part whose layers have a formula.

    Attributes:
        name: as the table has it.
        part: on its printed side.
        curvature: of the printed side [1/mm], above 0 where that bulges, in `bends` directions.
        bends: in how many.
    """

    name: str
    part: Surface
    curvature: float
    bends: int

    def area(self, over: float) -> float:
        """Return the area at a height over the part [mm2]."""
        return float(face_areas(self.part).sum()) * (1.0 + over * self.curvature) ** self.bends

    def off(self, over: float, *, height: float) -> float:
        """Return the deviation of a level's area from its formula, over that."""
        return float(face_areas(layer_level(self.part, over, height=height)).sum()) / self.area(over) - 1.0


def shells(edge: float, *, jitter_seed: int | None = None) -> Iterator[Shell]:
    """Yield the cap and the cylinder, outside and inside, with edges of a share of their radius."""
    rings, around, along = (
        max(round(extent / edge), 2) for extent in (CAP_ANGLE, CYLINDER_ANGLE, LENGTH / RADIUS)
    )  # fmt: skip
    cap = spherical_cap(radius=RADIUS, angle=CAP_ANGLE, rings=rings, jitter_seed=jitter_seed)
    tube = cylinder_patch(
        radius=RADIUS, angle=CYLINDER_ANGLE, length=LENGTH, divisions=(around, along), jitter_seed=jitter_seed
    )
    for sign, side in ((1.0, "outside"), (-1.0, "inside")):
        for name, part, bends in (("cap", cap, 2), ("cylinder", tube, 1)):
            yield Shell(f"{name}, {side}", part if sign > 0.0 else turned_over(part), sign / RADIUS, bends)


def flat_shell() -> Shell:
    """Return the plate."""
    return Shell("plate", plate((20.0, 15.0)), 0.0, 1)


@final
@dataclass(frozen=True, slots=True, eq=False)
class PathShell:
    """A part over which contours from its rim have a length by formula.

    Attributes:
        name: as the table has it.
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
        length, volume = float(steps[poses.laid].sum()), float((steps * poses.flow[:-1])[poses.laid].sum())
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
