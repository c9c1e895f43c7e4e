from __future__ import annotations

import time

import fcl
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError, VerificationError
from geoprint.geometry import vertex_normals
from geoprint.geometry.files import load
from geoprint.model import Box, FloatArray, Surface
from geoprint.robot.collision import contact as collision
from geoprint.robot.collision.closest import shapes_of
from geoprint.robot.collision.contact import NOT_TESTED, CollisionWorld, InflatedSolids
from geoprint.robot.collision.surroundings import Target, box_target, mesh_target, winding_numbers
from geoprint.robot.collision.tool_solids import EXCESS, RESOLUTION, nearest, revolution, tool_solids
from geoprint.threads import both
from tests.meshes import plate, sphere, spherical_cap
from tests.robot.cells import straight_cell
from tests.robot.placements import always, block, pointing_down
from tests.shared_data import shared

SOLIDS = tool_solids(straight_cell().tool)
KEPT = (0.0, 0.5, 0.5, 0.5, 0.5)
ALL_AT_REST = np.zeros((1, len(SOLIDS)))


def world_of(*targets: Target, kept: tuple[float, ...] = KEPT) -> CollisionWorld:
    return CollisionWorld(InflatedSolids(SOLIDS, kept=kept), targets=targets)


def standing(tip: tuple[float, float, float]) -> FloatArray:
    return pointing_down(np.array([tip]))


def touched_share(patch: Surface, *, body: Surface | None) -> float:
    """Return the share of the patch's vertices where a tool along the normal, at its stand-off, is too close."""
    normals = vertex_normals(patch)
    rotations = transforms.smallest_rotation(np.array([0.0, 0.0, 1.0]), -normals)
    poses = transforms.rigid(rotations, patch.vertices + 0.3 * normals)
    targets = [mesh_target(patch, role="part")] + ([] if body is None else [mesh_target(body, role="body")])
    reaches = np.zeros((len(poses), len(SOLIDS)))
    reaches[:, 0] = NOT_TESTED
    return float(world_of(*targets).touches(poses, reaches=reaches).any(axis=(1, 2)).mean())


def test_threads_that_ask_the_same_models_do_not_move_them_under_each_other(monkeypatch: pytest.MonkeyPatch):
    world = world_of(mesh_target(sphere(radius=10.0), role="part"))
    # One asker's needle is in the ball, the other's beside it within its box: whoever is moved in between is wrong.
    inside, beside = (np.repeat(standing(tip), 50, axis=0) for tip in ((0.0, 0.0, 8.0), (9.0, 9.0, 5.0)))
    reaches = np.zeros((50, len(SOLIDS)))
    collide = fcl.collide

    def asked_late(
        o1: fcl.CollisionObject, o2: fcl.CollisionObject, request: fcl.CollisionRequest, result: fcl.CollisionResult
    ) -> int:
        time.sleep(1e-4)
        return collide(o1, o2, request, result)

    monkeypatch.setattr(fcl, "collide", asked_late)
    found, none = both(lambda: world.touches(inside, reaches=reaches), lambda: world.touches(beside, reaches=reaches))
    assert found[:, 1].all()
    assert not none.any()


def test_control_says_what_it_found():
    assert "480 known hits and misses found right" in collision.collision_control()


@pytest.mark.parametrize(("answer", "message"), [(0, "a known hit"), (1, "a known miss")])
def test_control_notices_a_library_that_always_says_the_same(
    monkeypatch: pytest.MonkeyPatch, answer: int, message: str
):
    monkeypatch.setattr(fcl, "collide", always(answer))

    with pytest.raises(VerificationError, match=message):
        collision.collision_control()
    with pytest.raises(VerificationError, match=message):
        world_of(mesh_target(plate(), role="part"))


def test_control_notices_that_a_pose_without_numbers_passes(monkeypatch: pytest.MonkeyPatch):
    def accept(_: FloatArray) -> None: ...

    monkeypatch.setattr(collision, "check_rigid", accept)

    with pytest.raises(VerificationError, match="not a number"):
        collision.collision_control()


def not_finite() -> FloatArray:
    poses = standing((0.0, 0.0, 50.0)).copy()
    poses[0, 1, 3] = np.nan
    return poses


@pytest.mark.parametrize(
    "poses",
    [
        not_finite(),
        standing((0.0, 0.0, 50.0)) @ np.diag([1.0, 1.0, -1.0, 1.0]),
        standing((0.0, 0.0, 50.0)) @ np.diag([1.001, 1.0, 1.0, 1.0]),
        2.0 * standing((0.0, 0.0, 50.0)),
        np.empty((0, 4, 4)),
    ],
    ids=["NaN", "mirrored", "stretched", "scaled", "none"],
)
def test_pose_that_is_not_rigid_is_refused(poses: FloatArray):
    world = world_of(mesh_target(plate(), role="part"))

    with pytest.raises(InputError):
        world.touches(poses, reaches=np.zeros((len(poses), len(SOLIDS))))


@pytest.mark.parametrize(("gap", "hit"), [(0.40, True), (0.49, True), (0.57, False), (0.60, False)])
@pytest.mark.parametrize("index", [1, 3, 4])
def test_post_beside_a_cylinder_is_hit_within_the_clearance_only(index: int, gap: float, hit: bool):  # noqa: FBT001
    solid = SOLIDS[index]
    height, side = -float(solid.centre[2]), solid.end_radius + gap
    post = block((side, -1.0, height - 2.0), (side + 3.0, 1.0, height + 2.0))

    found = world_of(mesh_target(post, role="body")).touches(standing((0.0, 0.0, 0.0)), reaches=ALL_AT_REST)

    assert found[0, index, 0] == hit


def test_solid_that_is_not_tested_is_not_hit():
    world = world_of(mesh_target(plate(), role="part"))
    reaches = np.array([[NOT_TESTED, 0.0, 0.0, NOT_TESTED, 0.0]])

    found = world.touches(standing((20.0, 15.0, -5.0)), reaches=reaches)

    assert found[0, :, 0].tolist() == [False, True, False, False, False]


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_fcl_agrees_with_the_exact_distance(seed: int):
    generator = np.random.default_rng(seed)
    pose = transforms.rigid(
        Rotation.from_rotvec(generator.normal(scale=0.3, size=3)).as_matrix() @ np.diag([1.0, -1.0, -1.0]),
        np.array([0.0, 0.0, 30.0]) + generator.normal(scale=3.0, size=3),
    )

    found = WORLD.touches(pose[None], reaches=ALL_AT_REST)[0, :, 0]

    triangles = (WORLD.targets[0].triangles - pose[:3, 3]) @ pose[:3, :3]
    for solid, kept, hit in zip(SOLIDS[2:], KEPT[2:], found[2:], strict=True):
        distance = nearest(revolution((solid,)), triangles)[0]
        if hit:
            assert distance < kept + EXCESS + RESOLUTION
        else:
            assert distance > kept - RESOLUTION


WORLD = world_of(mesh_target(spherical_cap(radius=30.0, angle=1.4, rings=8, jitter_seed=1), role="part"))


def test_obstacle_is_solid_and_stands_in_the_base_frame():
    T_work_base = transforms.rigid(Rotation.from_euler("z", 90, degrees=True).as_matrix(), np.array([5.0, 0.0, 0.0]))
    box = box_target(
        Box("table", np.array([300.0, 0.0, 0.0]), np.array([400.0, 400.0, 400.0])), T_work_base=T_work_base
    )
    world = world_of(box)
    poses = np.concatenate([standing((5.0, 300.0, 0.0)), standing((300.0, 0.0, 0.0))])

    found = world.touches(poses, reaches=np.zeros((2, len(SOLIDS))))

    assert box.name == "obstacle table"
    assert found[0, :, 0].all()
    assert not found[1].any()
    np.testing.assert_allclose(winding_numbers(np.array([[5.0, 300.0, 0.0]]), box.triangles), 1.0)


def test_obstacle_without_size_is_refused():
    with pytest.raises(InputError, match="obstacle wall"):
        box_target(Box("wall", np.zeros(3), np.array([1.0, 0.0, 2.0])), T_work_base=np.eye(4))


def test_only_a_surface_without_rim_is_closed():
    closed = [mesh_target(surface, role="body").closed for surface in (plate(), spherical_cap(), sphere())]

    assert closed == [False, False, True]


def test_every_solid_of_the_tool_is_measured():
    assert tuple(solid for shape in shapes_of(SOLIDS) for solid in shape.solids) == SOLIDS


def test_no_false_alarm_on_a_real_patch():
    assert touched_share(load(shared("patches/lv_anterior_disc_r30.ply"), unit="mm"), body=None) == 0.0


def test_bands_inside_the_heart_cannot_be_printed():
    heart = load(shared("hearts/rodero01_heart_walls_closed.ply"), unit="mm")
    band = load(shared("patches/aortic_root_band_6mm.ply"), unit="mm")

    assert touched_share(band, body=None) == 0.0
    assert touched_share(band, body=heart) > 0.7
