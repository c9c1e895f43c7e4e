"""The sweep where the tool turns: a post that only the turn between two placements brings it near."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import FloatArray
from geoprint.robot.collision.contact import CollisionWorld, InflatedSolids
from geoprint.robot.collision.surroundings import mesh_target
from geoprint.robot.collision.sweep import find_hits
from geoprint.robot.collision.tool_solids import Solid, movements
from tests.robot.placements import block, run_of

RADIUS, KEPT, HALF = 0.15, 0.1, 0.01
NEARER, FARTHER = 0.02, 0.12
NEEDLE = Solid("needle", start=np.zeros(3), end=np.array([0.0, 0.0, 20.0]), start_radius=RADIUS, end_radius=RADIUS)
ASIDE = Solid("lamp", start=np.array([10.0, 0.0, 0.0]), end=np.array([10.0, 0.0, 20.0]), start_radius=RADIUS,
              end_radius=RADIUS)  # fmt: skip
INFLATED = {solid.name: InflatedSolids((solid,), kept=(KEPT,)) for solid in (NEEDLE, ASIDE)}


def turned(axis: str, angles: FloatArray) -> FloatArray:
    """Return poses about the origin that are turned by (k,) angles [rad]."""
    return transforms.rigid(Rotation.from_euler(axis, angles[:, None]).as_matrix(), np.zeros((len(angles), 3)))


def is_hit(solid: str, poses: FloatArray, place: FloatArray, *, corners: FloatArray | None = None) -> bool:
    low, high = place - HALF, place + HALF
    post = block((low[0], low[1], low[2]), (high[0], high[1], high[2]), name="post")
    world = CollisionWorld(INFLATED[solid], targets=(mesh_target(post, role="body"),))
    placements = run_of(poses)
    return find_hits(world, placements if corners is None else replace(placements, corners=corners)) is not None


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("height", [12.0, 19.0])
def test_a_needle_that_turns_about_its_tip_finds_what_lies_within_the_turn(height: float, share: float) -> None:
    """The needle leans by 0.09 rad from one placement to the next; the post lies beside the plane of the turn."""
    poses = turned("y", np.array([0.0, 0.09]))
    for gap, found in ((KEPT - NEARER, True), (KEPT + FARTHER, False)):
        place = height * np.array([np.sin(0.09 * share), 0.0, np.cos(0.09 * share)])
        place[1] = RADIUS + HALF + gap
        assert is_hit("needle", poses, place) == found
        # Neither placement alone comes near.
        for pose in poses:
            assert not is_hit("needle", np.stack([pose, pose]), place)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7])
def test_what_is_beside_the_axis_finds_what_lies_within_a_turn_about_it(share: float) -> None:
    """The lamp is 10 mm beside the axis about which the tool turns by 0.15 rad at once."""
    poses = turned("z", np.array([0.0, 0.15]))
    for gap, found in ((KEPT - NEARER, True), (KEPT + FARTHER, False)):
        out = 10.0 + RADIUS + HALF + gap
        place = np.array([out * np.cos(0.15 * share), out * np.sin(0.15 * share), 10.0])
        assert is_hit("lamp", poses, place) == found
        assert not is_hit("needle", poses, place)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_corner_that_is_rounded_in_attitude_alone_is_found_on_both_sides(side: float) -> None:
    corners = turned("y", np.array([0.0, 0.1]))
    poses = turned("y", np.zeros(2))
    for gap, found in ((KEPT - NEARER, True), (KEPT + FARTHER, False)):
        out = RADIUS + HALF + gap
        place = np.array([side * (19.0 * np.sin(0.1) + out * np.cos(0.1)), 0.0, 19.0 * np.cos(0.1) - out * np.sin(0.1)])
        assert is_hit("needle", poses, place, corners=corners) == found
        assert not is_hit("needle", poses, place)


@pytest.mark.parametrize("about_the_end", [False, True])
def test_a_turn_about_one_end_moves_the_other_by_length_and_radius(*, about_the_end: bool) -> None:
    """A cylinder of 20 mm with a radius of 10 mm at the end that moves and of 2 mm where it stays."""
    at = np.array([0.0, 0.0, 20.0])
    radii = (10.0, 2.0) if about_the_end else (2.0, 10.0)
    solid = Solid("cone", start=np.zeros(3), end=at, start_radius=radii[0], end_radius=radii[1])
    poses = turned("y", np.array([0.0, 0.1]))
    if about_the_end:
        poses[1, :3, 3] = at - poses[1, :3, :3] @ at
    assert movements((solid,), poses)[0, 0] == pytest.approx(1.01 * (20.0 + 10.0) * 2.0 * np.sin(0.05))
