"""Planted tables: built as their kinematics have them, as far away as said, found where they collide and only there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from benchmarks.motion.attitudes import APEX, cell_with
from benchmarks.motion.planted import Patches, facing, table_cylinders
from benchmarks.motion.planted_scenes import (
    BEYOND,
    Scene,
    is_refused_in_motion,
    is_refused_over,
    scene_at,
    tables_at_home,
    tables_beside,
    tables_in_the_way,
)
from geoprint import job_of, plan, transforms
from geoprint.model import Cylinder, FloatArray, Hexapod, Surface, TiltTurn
from geoprint.positioner import table_machine
from tests.positioner.tables import hexapod_noun, tilt_turn_noun


@pytest.mark.parametrize("table", [hexapod_noun(pivot_mm=30.0), tilt_turn_noun(stand_height_mm=150.0)])
def test_solids_built_anew_are_those_of_the_kinematics(table: Hexapod | TiltTurn) -> None:
    machine = table_machine(table)
    up = np.array([0.15, -0.1, 1.0]) / np.linalg.norm([0.15, -0.1, 1.0])
    (pose,) = machine.plates(up[None])

    built, known = table_cylinders(table, pose), machine.solids(pose)

    assert [one.name for one in built] == [one.name for one in known]
    for one, other in zip(built, known, strict=True):
        np.testing.assert_allclose([one.start, one.end], [other.start, other.end], atol=1e-9)
        assert one.radius == pytest.approx(other.radius)


def a_cylinder() -> Cylinder:
    return Cylinder("table's leg 1", np.array([10.0, -5.0, 3.0]), np.array([40.0, 25.0, 15.0]), 12.0)


def test_patches_lie_on_the_cylinder_within_their_balls_and_become_no_fewer_places_when_they_are_split() -> None:
    cylinder, random = a_cylinder(), np.random.default_rng(0)
    patches = Patches.of([cylinder])
    for _ in range(3):
        centres, radii = patches.balls()
        off = np.array([from_surface(cylinder, place) for place in centres])
        assert np.abs(off).max() < 1e-9
        # Whatever place of the surface is taken, one of the balls holds it.
        for _ in range(50):
            outward = random.normal(size=3)
            place = facing(cylinder, outward / np.linalg.norm(outward), random)
            assert from_surface(cylinder, place) == pytest.approx(0.0, abs=1e-9)
            assert (np.linalg.norm(centres - place, axis=1) <= radii + 1e-9).any()
        patches = patches.split(np.ones(len(radii), dtype=bool))


def from_surface(cylinder: Cylinder, place: FloatArray) -> float:
    """The signed distance of a place from a cylinder, worked out in its own plane."""
    axis = cylinder.end - cylinder.start
    length = float(np.linalg.norm(axis))
    along = float((place - cylinder.start) @ axis) / length
    out = float(np.linalg.norm(place - cylinder.start - along * axis / length))
    beyond = np.array([out - cylinder.radius, -along, along - length])
    return float(beyond.max()) if beyond.max() <= 0.0 else float(np.linalg.norm(np.maximum(beyond, 0.0)))


def test_a_point_that_faces_a_direction_is_met_by_it_from_outside() -> None:
    cylinder, random = a_cylinder(), np.random.default_rng(1)
    for outward in Rotation.random(20, random_state=2).as_matrix()[:, 2]:
        point = facing(cylinder, outward, random)
        assert from_surface(cylinder, point - 0.1 * outward) > 0.05
        assert from_surface(cylinder, point + 0.01 * outward) < 0.0


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """A disc of the apex over a hexapod, on which one short run is printed."""
    cell = cell_with("hexapod", tmp_path_factory.mktemp("cell"))
    disc = {"at": [1.5, 0.0, -57.5], "radius": 3.0}
    job = job_of(
        surface=APEX, patch=disc, unit="mm", spacing=3.0, place="demo", backend="fast-marching", cell=cell
    )  # fmt: skip
    planned = plan(job)
    return scene_at(planned, planned.robot[0])


def test_distance_of_a_table_is_that_of_a_point_by_point_search(scene: Scene) -> None:
    spot = scene.sweep.spot("bracket", np.random.default_rng(8))
    T_base_work = scene.robot.placement.T_base_work
    for away, along in ((3.0, spot.outward), (6.0, spot.along)):
        ends = spot.place + away * spot.outward + np.outer([0.0, 4.0], along)
        in_base = transforms.apply(T_base_work, ends)
        searched = scene.sweep.distance(tube(ends, radius=1.5))

        found = scene.sweep.distance_from([Cylinder("post", in_base[0], in_base[1], 1.5)])

        assert found == pytest.approx(searched, abs=0.015)


def tube(ends: FloatArray, *, radius: float) -> Surface:
    """A cylinder of triangles around an axis, its corners on the round."""
    axis = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    turn = transforms.smallest_rotation(np.array([0.0, 0.0, 1.0]), axis[None])[0]
    angles = np.linspace(0.0, 2.0 * np.pi, 128, endpoint=False)
    circle = radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(128)]) @ turn.T
    corners = np.concatenate([end + circle for end in ends])
    return Surface(corners, ConvexHull(corners).simplices.astype(np.int64), name="tube")


def test_tables_in_the_way_are_found(scene: Scene) -> None:
    grazing, *_, deep = tables_in_the_way(scene, count=4, random=np.random.default_rng(3))

    assert [name for name, table in (grazing, deep) if not is_refused_over(scene, table)] == []


def test_a_table_two_tenths_of_a_millimetre_beyond_the_clearance_is_not_reported(scene: Scene) -> None:
    ((_, table),) = tables_beside(scene, count=1, random=np.random.default_rng(7))

    wanted = scene.cell.process.clearance + BEYOND
    assert scene.sweep.distance_from(scene.solids(table)) == pytest.approx(wanted, abs=0.006)
    assert not is_refused_over(scene, table)


def test_tables_that_come_near_the_arm_at_home_are_found_in_their_motion(scene: Scene) -> None:
    planted = list(tables_at_home(scene, count=8, random=np.random.default_rng(3)))

    assert [name for name, table in planted if not is_refused_in_motion(scene.over(table))] == []
    assert not is_refused_in_motion(scene)
