"""What the sweep only takes to save time changes no verdict: blocks, parts of a step, and steps of inflation."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.robot.collision import closest, contact, sweep
from geoprint.robot.collision.contact import CollisionWorld, InflatedSolids
from geoprint.robot.collision.surroundings import mesh_target
from geoprint.robot.collision.sweep import find_hits
from geoprint.robot.collision.tool_solids import Solid, nearest, revolution, signed_distances
from tests.robot.placements import block, pointing_down, run_of

NEEDLE = Solid("needle", np.zeros(3), np.array([0.0, 0.0, -20.0]), 0.5, 0.5)
LINE = np.column_stack([np.linspace(-30.0, 30.0, 121), np.zeros(121), np.full(121, 1.0)])
REACHES = contact.REACHES


def verdicts(*, reaches: tuple[float, ...] = REACHES) -> list[bool]:
    """Return what is found of posts near and far beside a line, by hand true where they are nearer than 0.5 mm."""
    found: list[bool] = []
    inflated = InflatedSolids((NEEDLE,), kept=(0.5,), reaches=reaches)
    for x in (-29.8, -0.2, 17.3):
        for gap in (0.45, 0.6, 3.0):
            post = block((x - 0.05, 0.5 + gap, 5.0), (x + 0.05, 0.7 + gap, 9.0))
            world = CollisionWorld(inflated, targets=(mesh_target(post, role="body"),))
            found.append(find_hits(world, run_of(pointing_down(LINE))) is not None)
    return found


@pytest.mark.parametrize("blocks", [(20, 4), (80, 16), (41, 8), (1,)])
def test_blocks_of_any_size_find_the_same(monkeypatch: pytest.MonkeyPatch, blocks: tuple[int, ...]) -> None:
    monkeypatch.setattr(sweep, "BLOCKS", blocks)
    assert verdicts() == [True, False, False] * 3


@pytest.mark.parametrize("parts", [3, 7, 12])
def test_steps_cut_into_any_number_of_parts_find_the_same(monkeypatch: pytest.MonkeyPatch, parts: int) -> None:
    monkeypatch.setattr(sweep, "PARTS", parts)
    assert verdicts() == [True, False, False] * 3


def test_other_large_inflations_find_the_same() -> None:
    assert verdicts(reaches=(*REACHES[:-2], 8.0, 24.0)) == [True, False, False] * 3
    assert verdicts(reaches=(*REACHES[:-2], 2.5)) == [True, False, False] * 3


@pytest.mark.parametrize("counts", [(300, 4), (601, 9), (1200, 16)])
def test_more_or_fewer_placements_that_are_ranked_find_the_same_distance(
    monkeypatch: pytest.MonkeyPatch, counts: tuple[int, int]
) -> None:
    monkeypatch.setattr(closest, "RANKED_PLACEMENTS", counts[0])
    monkeypatch.setattr(closest, "MEASURED_PLACEMENTS", counts[1])
    target = mesh_target(block((7.2, 2.5, 5.0), (7.3, 3.0, 9.0)), role="body")
    world = CollisionWorld(InflatedSolids((NEEDLE,), kept=(0.5,)), targets=(target,))
    found = closest.smallest_distance(run_of(pointing_down(LINE)), world, closest.ranking_trees((target,)))
    # The placements beside the post are those at 7.0 and 7.5 mm, each 0.2 mm from it along the line.
    assert found.distance == pytest.approx(np.hypot(2.5, 0.2) - 0.5, abs=0.006)


def test_the_nearest_point_of_large_triangles_is_right_to_five_micrometres() -> None:
    """No other of its points is nearer than that, and the point is as near as it is said to be."""
    shape = revolution((NEEDLE,))
    random = np.random.default_rng(5)
    shares = random.dirichlet(np.ones(3), 4000)
    for _ in range(20):
        corners = random.uniform([-8.0, -8.0, -24.0], [8.0, 8.0, 4.0], (3, 3))
        distance, point = nearest(shape, corners[None])
        assert distance <= signed_distances(shape, shares @ corners).min() + 0.005
        assert distance == pytest.approx(float(signed_distances(shape, point[None])[0]), abs=1e-9)
