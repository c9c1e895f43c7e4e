"""Planted obstacles: where the benchmark says they are, found where they collide, and not reported where they miss."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from benchmarks.motion.collisions import (
    BEYOND,
    SOLIDS,
    Scene,
    collisions,
    layers_beside,
    layers_in_the_way,
    near_misses,
    scene_of,
)
from benchmarks.motion.planted import KINDS, Spot
from geoprint.config import UR_CELL
from geoprint.geometry.files import save_ply
from geoprint.model import Surface
from geoprint.robot.collision.clearance import check_placements
from tests.meshes import plate, spherical_cap
from tests.robot.cells import straight_cell
from tests.robot.placements import block, line, pointing_down, run_of

CELL = straight_cell()


@pytest.fixture(scope="module")
def cap(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file of a cap of 6 mm radius, on which one run is printed."""
    file = tmp_path_factory.mktemp("part") / "cap.ply"
    save_ply(spherical_cap(radius=30.0, angle=0.2, rings=3, jitter_seed=1), file)
    return file


@pytest.fixture(scope="module")
def scene(cap: Path) -> Scene:
    return scene_of(cap, spacing=6.0)


def test_collisions_from_grazing_to_deep_are_found(scene: Scene):
    planted = list(collisions(scene, count=4, random=np.random.default_rng(160)))

    # With this seed nothing else that moves comes nearer to the first than the needle that grazes it.
    assert scene.sweep.distance(planted[0][1]) > 0.3
    assert [name for name, body in planted if not scene.is_refused(body)] == []


def test_hall_around_everything_is_found(scene: Scene):
    *_, (name, body) = collisions(scene, count=20, random=np.random.default_rng(3))

    assert name == "hall around everything"
    assert scene.is_refused(body)


def test_near_misses_two_tenths_of_a_millimetre_beyond_the_clearance_are_not_reported(scene: Scene):
    planted = list(near_misses(scene, count=2, random=np.random.default_rng(5)))

    wanted = scene.cell.process.clearance + BEYOND
    assert [scene.sweep.distance(body) for _, body in planted] == [pytest.approx(wanted, abs=0.006)] * 2
    assert [name for name, body in planted if scene.is_refused(body)] == []


@pytest.fixture(scope="module")
def around_a_ur5e(cap: Path) -> Scene:
    return scene_of(cap, spacing=6.0, cell=Path(UR_CELL))


def test_collisions_with_tool_and_links_of_a_ur5e_are_found(around_a_ur5e: Scene):
    planted = list(collisions(around_a_ur5e, count=len(SOLIDS), random=np.random.default_rng(9)))

    assert len({name.partition("from the ")[2] for name, _ in planted}) == len(SOLIDS)
    assert [name for name, body in planted if not around_a_ur5e.is_refused(body)] == []


def test_near_misses_of_a_ur5e_are_not_reported(around_a_ur5e: Scene):
    planted = list(near_misses(around_a_ur5e, count=3, random=np.random.default_rng(6)))

    assert [name for name, body in planted if around_a_ur5e.is_refused(body)] == []


@pytest.fixture(scope="module")
def layer(cap: Path) -> Scene:
    return scene_of(cap, spacing=6.0, thickness=1.0, layer=2)


def test_printed_layers_alone_in_the_way_are_found(layer: Scene):
    planted = list(layers_in_the_way(layer, count=5, random=np.random.default_rng(27)))

    assert [name for name, ground in planted if not layer.is_refused_by(ground)] == []
    assert planted[4][0] == "tip 0.05 mm within"
    # Nothing but them is in the way: over the bare part the same path is clear.
    layer.check_without_layers()


def test_printed_layers_that_are_missed_are_not_reported(layer: Scene):
    planted = list(layers_beside(layer, count=5, random=np.random.default_rng(5)))

    assert planted[4][0] == "layers +0.05 mm higher"
    # Beside the needle, beside the barrel, and all of the layers.
    assert [name for name, ground in planted[::2] if layer.is_refused_by(ground)] == []


def test_of_a_layer_those_below_are_named_as_checked_and_its_own_runs_as_not(layer: Scene):
    (robot,) = layer.planned.robot

    below = "part cap.ply with the layers below"
    assert any(text.endswith(f"against {below}") for text in robot.clearance.checked)
    assert "material already deposited in this layer" in robot.clearance.not_checked
    assert "material already deposited" not in robot.clearance.not_checked


def test_tip_that_is_a_twentieth_of_a_millimetre_too_low_raises_no_alarm(scene: Scene):
    scene.check_lowered()


@pytest.mark.parametrize("kind", KINDS)
def test_planted_obstacle_faces_its_spot_from_its_distance(kind: str):
    spot = Spot("cone", np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))

    found = spot.obstacle(kind, distance=0.7)

    assert found.vertices[:, 2].min() == pytest.approx(3.7)
    np.testing.assert_allclose(found.vertices[:, :2].mean(axis=0), [1.0, 2.0])


@pytest.mark.parametrize("name", SOLIDS[::4])
def test_obstacle_at_any_spot_is_no_farther_than_its_distance_from_what_moves(scene: Scene, name: str):
    spot = scene.sweep.spot(name, np.random.default_rng(1))

    assert np.linalg.norm(spot.outward) == pytest.approx(1.0)
    assert spot.outward @ spot.along == pytest.approx(0.0, abs=1e-9)
    # A quarter of a row's movement beside the sampled moments.
    assert scene.sweep.distance(spot.obstacle("post", distance=1.0)) <= 1.0 + 0.15


@settings(max_examples=3, deadline=None)
@given(near=st.floats(0.7, 12.0), farther=st.floats(0.05, 8.0))
def test_moving_a_body_farther_away_never_lowers_the_clearance(near: float, farther: float):
    def smallest(gap: float) -> float:
        post: Surface = block((30.0 + gap, 10.0, 30.0), (40.0 + gap, 14.0, 110.0), name="post")
        return check_placements(
            run_of(pointing_down(line((20.0, 5.0, 0.3), (20.0, 25.0, 0.3)))), tool=CELL.tool, process=CELL.process,
            standoff=0.3, part=plate(), body=post, obstacles=(), T_work_base=np.eye(4),
        ).smallest  # fmt: skip

    assert smallest(near + farther) >= smallest(near) - 0.005
