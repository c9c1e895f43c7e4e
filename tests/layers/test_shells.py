"""Shells whose layers have a formula: their area, the length of their paths and the volume that is laid."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import numpy as np
import pytest

from geoprint.config import job_of
from geoprint.errors import InputError
from geoprint.geometry import closest, face_areas, turned_over
from geoprint.geometry.files import save_ply
from geoprint.layers import layer_level, middle_planes, sliced, sliced_layer, whole_layers
from geoprint.model import Surface
from geoprint.workflow import plan
from tests import meshes
from tests.distance.bands import band
from tests.meshes import cylinder_patch, plate, spherical_cap
from tests.metrics.deposits import deposited, straight_line

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


# Thickness in whole layers, and the levels between them.


@pytest.mark.parametrize(
    ("thickness", "height", "count"), [(3.2, 0.4, 8), (3.0, 0.4, 8), (0.1, 0.4, 1), (0.5, 0.5, 1), (1.0, 0.3, 3)]
)
def test_layers_come_out_whole(thickness: float, height: float, count: int) -> None:
    found, adapted = whole_layers(thickness, height=height)
    assert found == count
    assert found * adapted == pytest.approx(thickness)


@pytest.mark.parametrize(("thickness", "height"), [(0.0, 0.4), (3.0, -0.4), (float("nan"), 0.4), (3.0, float("inf"))])
def test_what_is_no_thickness_is_refused(thickness: float, height: float) -> None:
    with pytest.raises(InputError, match="must be a positive number of mm"):
        whole_layers(thickness, height=height)


def test_more_layers_than_anybody_prints_are_refused() -> None:
    with pytest.raises(InputError, match=r"need 7,500 of them, but 500 is the limit"):
        whole_layers(3000.0, height=0.4)


def test_layers_between_levels_fill_a_shell() -> None:
    part = meshes.spherical_cap(radius=6.0, angle=0.7, rings=20)
    count, height = whole_layers(1.9, height=0.5)
    volume = 0.0
    for number in range(count):
        level = layer_level(part, (number + 0.5) * height, height=height)
        _, distances = closest(part, level.vertices)
        np.testing.assert_allclose(distances, (number + 0.5) * height, atol=1e-6)
        volume += float(face_areas(level).sum()) * height
    # A shell of a sphere: the mean of the squared radius over its thickness.
    share = (7.9**3 - 6.0**3) / (3.0 * 6.0**2)
    assert volume == pytest.approx(share * float(face_areas(part).sum()), rel=0.005)


# Layers sliced open: the line and the beads that a plane cuts lie where geometry says.


HEIGHT = 0.5


def test_the_first_plane_cuts_across_the_longest_way_and_both_stand_upright_in_the_middle() -> None:
    across, along = middle_planes(plate((40.0, 30.0)), np.eye(3))
    for plane, length in ((across, 30.0), (along, 40.0)):
        np.testing.assert_allclose(plane.R_plane_work @ plane.R_plane_work.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(plane.R_plane_work[1], [0.0, 0.0, 1.0])
        np.testing.assert_allclose(plane.origin, [20.0, 15.0, 0.0], atol=1e-3)
        line, offsets = sliced(plate((40.0, 30.0)), plane)
        assert offsets.size == 2
        assert np.ptp(line[:, 0]) == pytest.approx(length)


def test_a_cylinder_cut_across_is_an_arc() -> None:
    tube = cylinder_patch(radius=30.0, angle=1.2, length=50.0, divisions=(60, 20))
    across, _ = middle_planes(tube, np.eye(3))
    line, _ = sliced(tube, across)
    height = 30.0 * (1.0 + np.cos(0.6)) / 2.0
    np.testing.assert_allclose(np.hypot(line[:, 0], line[:, 1] + height), 30.0, atol=0.005)


def test_beads_lie_where_paths_cross_and_are_as_wide_as_their_flow_makes_them() -> None:
    part = plate((40.0, 30.0), (40, 30), jitter_seed=2)
    lines = [straight_line((0.0, y), (40.0, y)) for y in (5.0, 15.0, 25.0)]
    stream = deposited([*lines, straight_line((19.0, 1.0), (21.0, 2.0))], range(4))
    stream = replace(stream, flow=np.where(stream.runs == 1, 1.0, 0.5))
    across, _ = middle_planes(part, np.eye(3))
    found = sliced_layer(part, stream, across, height=HEIGHT)
    places = across.origin + found.beads @ across.R_plane_work[:2]
    order = np.argsort(places[:, 1])
    np.testing.assert_allclose(places[order, 1], [1.5, 5.0, 15.0, 25.0], atol=0.01)
    # The first one crosses obliquely.
    np.testing.assert_allclose(found.widths[order], [np.sqrt(5.0) / 2.0, 1.0, 2.0, 1.0], rtol=0.003)
    np.testing.assert_allclose(np.abs(found.along), np.tile([1.0, 0.0], (4, 1)), atol=1e-12)


def test_a_path_along_the_plane_is_cut_lengthwise_where_the_plane_is_within_its_bead() -> None:
    part = plate((40.0, 30.0), (40, 30))
    across, _ = middle_planes(part, np.eye(3))
    # Beads 2 mm wide: the plane at 20 mm lies within the first one, and beside the second.
    stream = deposited([straight_line((19.5, 2.0), (20.5, 28.0)), straight_line((21.5, 2.0), (21.5, 28.0))], [0, 1])
    found = sliced_layer(part, stream, across, height=HEIGHT)
    assert found.widths.sum() == pytest.approx(26.0)
    assert found.widths.max() < 3.5 * 1.0 / HEIGHT
    ends = np.sort(np.concatenate([found.beads[:, 0] - found.widths / 2.0, found.beads[:, 0] + found.widths / 2.0]))
    np.testing.assert_allclose(ends[1:-1:2], ends[2::2], atol=1e-9)


def test_what_the_plane_passes_is_not_cut() -> None:
    part = plate((40.0, 30.0), (40, 30))
    across, _ = middle_planes(part, np.eye(3))
    away = Surface(part.vertices + np.array([60.0, 0.0, 0.0]), part.faces, "away")
    stream = deposited([straight_line((61.0, 2.0), (99.0, 2.0))], [0])
    found = sliced_layer(away, stream, across, height=HEIGHT)
    assert (found.line.size, found.beads.size, found.widths.size) == (0, 0, 0)
