from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pinocchio
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.config import load_cell
from geoprint.errors import InputError, UsageError
from geoprint.model import FloatArray, Surface
from geoprint.robot.arm import MILLIMETRES_PER_METRE
from geoprint.robot.arm.urdf import read_urdf
from geoprint.robot.collision.contact import inflated_solids
from geoprint.robot.collision.tip_zone import TipZone
from geoprint.robot.collision.tool_solids import (
    ARC_ALLOWANCE,
    EXCESS,
    TIP_ZONE,
    Solid,
    link_solids,
    movements,
    polytope,
    quarter,
    revolution,
    signed_distances,
    tool_solids,
)
from tests.meshes import plate, spherical_cap
from tests.robot.cells import bent_cell, straight_cell
from tests.robot.placements import pointing_down

SOLIDS = tool_solids(straight_cell().tool)
SEEDS = st.integers(0, 2**32 - 1)


def random_points_of(index: int, generator: np.random.Generator, *, count: int) -> FloatArray:
    """Return points inside one of the straight tool's solids, many of them on its rims."""
    solid = SOLIDS[index]
    share = generator.choice([0.0, 1.0, 0.5, float(generator.random())], count)
    radius = solid.start_radius + share * (solid.end_radius - solid.start_radius)
    radius = radius * generator.choice([0.0, 1.0, 1.0], count)
    turn = generator.uniform(0.0, 2 * np.pi, count)
    flat = radius[:, None] * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(count)])
    return solid.start + share[:, None] * (solid.end - solid.start) + flat


def unit_vectors(generator: np.random.Generator, *, count: int) -> FloatArray:
    directions = generator.normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def test_solids_stack_from_the_tip_to_the_top_of_the_barrel():
    tip, needle, cone, barrel, bracket = SOLIDS

    cone_top = 25.4 + 9.35 / np.tan(np.radians(10.0))
    assert [solid.name for solid in SOLIDS] == ["needle's tip", "needle", "cone", "barrel", "bracket"]
    np.testing.assert_allclose(
        [-tip.start[2], -needle.start[2], -cone.start[2], -barrel.start[2], -barrel.end[2]],
        [0.0, TIP_ZONE, 25.4, cone_top, 120.0],
    )
    assert (cone.start_radius, cone.end_radius, barrel.end_radius, bracket.end_radius) == (0.65, 10.0, 10.0, 15.0)


def test_bracket_of_a_bent_tool_lies_along_the_flange_axis():
    tool = bent_cell().tool
    bracket = tool_solids(tool)[-1]

    ends = transforms.apply(tool.T_flange_tool, np.array([bracket.end, bracket.start]))

    np.testing.assert_allclose(ends, [[0.0, 0.0, 0.0], [0.0, 0.0, 40.0]], atol=1e-12)


@pytest.mark.parametrize("index", range(1, 5))
@settings(max_examples=15, deadline=None)
@given(seed=SEEDS, by=st.floats(0.01, 0.75))
def test_polytope_holds_every_point_within_the_distance(index: int, seed: int, by: float):
    generator = np.random.default_rng(seed)
    points = random_points_of(index, generator, count=40) + by * unit_vectors(generator, count=40)
    corners, triangles = polytope(SOLIDS[index], by=by)
    a, b, c = (corners[triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)

    outside = ((points[:, None] - a) * normals).sum(axis=2).max()

    assert outside < 1e-9


@pytest.mark.parametrize("index", range(1, 5))
@pytest.mark.parametrize("by", [0.0, 0.1, 0.5])
def test_polytope_adds_no_more_than_its_excess(index: int, by: float):
    corners, _ = polytope(SOLIDS[index], by=by)

    assert signed_distances(revolution((SOLIDS[index],)), corners).max() < by + EXCESS


@pytest.mark.parametrize(("start", "end"), [(5.0, 40.0), (40.0, 5.0)])
def test_polytope_of_a_cone_as_wide_as_a_hand_adds_less_than_half_a_tenth_of_a_millimetre(start: float, end: float):
    wide = Solid("cone", np.zeros(3), np.array([0.0, 0.0, 200.0]), start, end)

    corners, _ = polytope(wide, by=0.5)

    assert signed_distances(revolution((wide,)), corners).max() < 0.5 + 0.045


def test_polytope_of_a_cylinder_has_its_volume_and_is_wound_outwards():
    corners, triangles = polytope(SOLIDS[3], by=0.0)
    a, b, c = (corners[triangles[:, i]] for i in range(3))

    volume = (a * np.cross(b, c)).sum() / 6

    assert volume == pytest.approx(np.pi * 10.0**2 * SOLIDS[3].length, rel=5e-3)


@pytest.mark.parametrize(("index", "by", "lowest"), [(0, 0.7, 0.0), (1, 0.75, 0.25), (1, 1.0, 0.0), (1, 2.5, 0.0)])
def test_needle_and_tip_are_not_inflated_below_the_tip_plane(index: int, by: float, lowest: float):
    corners, _ = polytope(SOLIDS[index], by=by)

    assert -corners[:, 2].max() == pytest.approx(lowest, abs=1e-12)


def test_shift_moves_every_solid_by_its_length():
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, :3, 3] = [0.3, 0.0, 0.4]

    np.testing.assert_allclose(movements(SOLIDS, poses), ARC_ALLOWANCE * np.full((1, 5), 0.5))


def test_turn_about_its_own_axis_does_not_move_a_solid_of_revolution():
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, :3, :3] = Rotation.from_euler("z", 1.3).as_matrix()

    np.testing.assert_allclose(movements(SOLIDS, poses), 0.0, atol=1e-12)


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, angle=st.floats(0.0, 0.5), index=st.integers(0, 4))
def test_no_point_leaves_a_solid_by_more_than_its_movement(seed: int, angle: float, index: int):
    generator = np.random.default_rng(seed)
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, :3, :3] = Rotation.from_rotvec(angle * unit_vectors(generator, count=1)[0]).as_matrix()
    poses[1, :3, 3] = generator.normal(size=3)
    bound = movements(SOLIDS, poses)[0, index]

    moved = transforms.apply(poses[1], random_points_of(index, generator, count=60))

    assert signed_distances(revolution((SOLIDS[index],)), moved).max() <= bound + 1e-9


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"needle_length": 0.8}, "needle_length is 0.8 mm"),
        ({"bracket_length": 0.0}, "bracket_length is 0.0 mm"),
        ({"needle_diameter": -1.0}, "needle_diameter is -1.0 mm"),
        ({"barrel_diameter": float("nan")}, "barrel_diameter is nan mm"),
        ({"needle_diameter": 21.0}, "the cone widens from 21.0 to 20.0 mm"),
        ({"cone_half_angle": 0.0}, "at 0.0 degrees"),
        ({"barrel_top": 60.0}, "the cone ends 78.4 mm from the tip and barrel_top is 60.0 mm"),
    ],
)
def test_impossible_tool_is_refused(change: dict[str, float], message: str):
    with pytest.raises(InputError, match=message):
        tool_solids(replace(straight_cell().tool, **change))


def test_links_are_the_cylinders_that_pinocchio_reads():
    text = read_urdf("irb120")
    model = pinocchio.buildModelFromXML(text)
    shapes = pinocchio.buildGeomFromUrdfString(model, text, pinocchio.GeometryType.COLLISION).geometryObjects

    found = [(link.joint, solid.centre, solid.axis) for link in link_solids("irb120") for solid in link.solids]

    assert len(found) == len(shapes)
    known = [(shape.parentJoint, shape.placement.homogeneous) for shape in shapes]
    for (joint, centre, axis), (parent, pose) in zip(found, known, strict=True):
        assert joint == parent
        np.testing.assert_allclose(centre, pose[:3, 3] * MILLIMETRES_PER_METRE, atol=1e-9)
        np.testing.assert_allclose(axis, pose[:3, 2], atol=1e-9)


def holds(joint: int, point: tuple[float, float, float]) -> bool:
    solids = link_solids("irb120")[joint].solids
    offsets = [(np.array(point) - solid.start, solid) for solid in solids]
    return any(
        0.0 <= offset @ solid.axis <= solid.length
        and np.linalg.norm(offset - (offset @ solid.axis) * solid.axis) <= solid.start_radius
        for offset, solid in offsets
    )


@pytest.mark.parametrize(
    ("joint", "point"),
    [
        (0, (90.0, 90.0, 1.0)),  # corner of the foot of 180 x 180 mm
        (1, (0.0, 0.0, 290.0)),  # crossing of axes 1 and 2
        (2, (0.0, 0.0, 270.0)),  # axis 3
        (3, (0.0, 0.0, 140.0)),  # the arm's height of 700 mm
        (4, (302.0, 0.0, 0.0)),  # wrist centre
        (4, (250.0, 70.0, 0.0)),  # turning radius of axis 4
        (5, (58.0, 0.0, 0.0)),  # where the flange begins
        (6, (0.0, 20.0, 0.0)),  # rim of the flange
    ],
)
def test_links_hold_what_is_published(joint: int, point: tuple[float, float, float]):
    assert holds(joint, point)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('<cylinder radius="0.025" length="0.016"/>', '<mesh filename="a.stl"/>', "link_6 has a .* no cylinder.*mesh"),
        ('radius="0.025"', 'radius="-0.025"', "link_6 has a cylinder of radius -25 mm"),
        ("collision>", "visual>", "base_link has no collision shape"),
    ],
)
def test_shape_that_no_cylinder_stands_for_is_refused(old: str, new: str, message: str):
    with pytest.raises(UsageError, match=message):
        link_solids("irb120", urdf=read_urdf("irb120").replace(old, new))


def test_all_shapes_that_are_refused_are_listed():
    text = read_urdf("irb120").replace('radius="0.025"', 'radius="-0.025"').replace('radius="0.048"', 'radius="0"')
    with pytest.raises(UsageError, match=r"for 2 reasons\. \(1\) .*link_5 has .* \(2\) .*link_6 has"):
        link_solids("irb120", urdf=text)


@pytest.mark.parametrize(
    ("shape", "radius", "length", "axis"),
    [
        ('<sphere radius="0.03"/>', 30.0, 60.0, (0.0, 0.0, 1.0)),
        ('<box size="0.03 0.2 0.04"/>', 25.0, 200.0, (0.0, 1.0, 0.0)),
        ('<box size="0.3 0.08 0.06"/>', 50.0, 300.0, (1.0, 0.0, 0.0)),
    ],
)
def test_boxes_and_spheres_are_held_by_a_cylinder(
    shape: str, radius: float, length: float, axis: tuple[float, float, float]
):
    text = read_urdf("irb120").replace('<cylinder radius="0.025" length="0.016"/>', shape)
    (solid,) = link_solids("irb120", urdf=text.replace('-0.008 0 0" rpy="0 1.5707963267948966 0"', '0 0 0"'))[6].solids
    assert (solid.start_radius, solid.length) == (pytest.approx(radius), pytest.approx(length))
    np.testing.assert_allclose(solid.axis, axis, atol=1e-12)


def test_what_is_fixed_to_a_link_moves_with_it():
    added = """<link name="camera"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
      <joint name="holder" type="fixed"><parent link="link_3"/><child link="camera"/>
      <origin xyz="0 0.1 0.2"/></joint></robot>"""
    solids = link_solids("irb120", urdf=read_urdf("irb120").replace("</robot>", added))[3].solids
    assert len(solids) == 3
    np.testing.assert_allclose(solids[-1].centre, [0.0, 100.0, 200.0])


def test_a_shape_without_an_origin_is_in_the_middle_and_one_without_an_attitude_stands_upright():
    text = read_urdf("irb120")
    place = re.compile(r'(<collision>\s*)<origin [^>]*/>(\s*<geometry>\s*<cylinder radius="0.025" length="0.016"/>)')
    assert len(place.findall(text)) == 1
    (middle,) = link_solids("irb120", urdf=place.sub(r"\1\2", text))[6].solids
    np.testing.assert_allclose([middle.start, middle.end], [[0.0, 0.0, -8.0], [0.0, 0.0, 8.0]])
    with pytest.raises(UsageError, match=r"link 'link_6' has xyz '1 2', which is not three finite numbers"):
        link_solids("irb120", urdf=place.sub(r'\1<origin xyz="1 2"/>\2', text))
    (upright,) = link_solids("irb120", urdf=place.sub(r'\1<origin xyz="0.001 0.002 0.003"/>\2', text))[6].solids
    np.testing.assert_allclose(upright.start, [1.0, 2.0, -5.0])
    np.testing.assert_allclose(upright.end, [1.0, 2.0, 11.0])
    (turned,) = link_solids("irb120", urdf=place.sub(r'\1<origin rpy="0 1.5707963267948966 0"/>\2', text))[6].solids
    np.testing.assert_allclose(turned.start, [-8.0, 0.0, 0.0], atol=1e-9)


RADIUS = 0.65
STANDOFF = 0.3
MIDDLE = np.array([[20.3, 15.1, STANDOFF]])


def rooms(poses: FloatArray, surface: Surface, *, radius: float = RADIUS) -> FloatArray:
    return TipZone(surface.vertices[surface.faces]).rooms(poses, radius=radius, standoff=STANDOFF)


@pytest.mark.parametrize("divisions", [(1, 1), (8, 6), (120, 90)])
def test_room_over_a_plate_is_the_standoff(divisions: tuple[int, int]):
    found = rooms(pointing_down(MIDDLE), plate(divisions=divisions))

    np.testing.assert_allclose(found, STANDOFF, atol=1e-12)


@pytest.mark.parametrize("lean_deg", [-25.0, 5.0, 15.0, 40.0])
@pytest.mark.parametrize("divisions", [(1, 1), (80, 60)])
def test_lean_takes_the_known_room(lean_deg: float, divisions: tuple[int, int]):
    lean = np.radians(lean_deg)

    found = rooms(pointing_down(MIDDLE, lean=lean), plate(divisions=divisions))

    np.testing.assert_allclose(found, (STANDOFF - RADIUS * abs(np.sin(lean))) / np.cos(lean), atol=1e-12)


@pytest.mark.parametrize("bowl_radius", [3.0, 10.0])
def test_bowl_takes_the_height_of_its_wall_at_the_rim(bowl_radius: float):
    bowl = spherical_cap(radius=bowl_radius, angle=0.5, rings=60)
    bottom = transforms.rigid(np.eye(3), np.array([[0.0, 0.0, bowl_radius - STANDOFF]]))

    found = rooms(bottom, bowl)

    known = STANDOFF - (bowl_radius - np.sqrt(bowl_radius**2 - RADIUS**2))
    np.testing.assert_allclose(found, known, atol=1e-3)


def test_dome_leaves_the_whole_standoff():
    found = rooms(pointing_down(np.array([[0.0, 0.0, 30.0 + STANDOFF]])), spherical_cap(radius=30.0))

    np.testing.assert_allclose(found, STANDOFF, atol=1e-12)


@pytest.mark.parametrize(("aside", "room"), [(0.6, -0.2), (0.649, -0.2), (0.7, STANDOFF)])
def test_spike_counts_only_within_the_circle(aside: float, room: float):
    ground = plate()
    x, y, _ = MIDDLE[0]
    spike = np.array([[x + aside, y, STANDOFF + 0.2], [x + aside, y, -3.0], [x + aside, y + 1e-3, -3.0]])
    surface = Surface(
        vertices=np.concatenate([ground.vertices, spike]),
        faces=np.concatenate([ground.faces, len(ground.vertices) + np.array([[0, 1, 2]])]),
    )

    np.testing.assert_allclose(rooms(pointing_down(MIDDLE), surface), room, atol=1e-9)


def test_surface_far_below_or_above_is_not_seen():
    poses = pointing_down(np.array([[20.0, 15.0, 3.0], [20.0, 15.0, -2.0], [100.0, 15.0, STANDOFF]]))

    assert (rooms(poses, plate()) == np.inf).all()


def test_far_surface_is_infinite_everywhere():
    assert (rooms(pointing_down(np.array([[0.0, 0.0, 500.0]])), plate()) == np.inf).all()


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_room_is_that_of_the_highest_sample(seed: int):
    generator = np.random.default_rng(seed)
    triangles = generator.uniform([-1.2, -1.2, -0.4], [1.2, 1.2, 0.6], (3, 3, 3))
    samples = triangles
    for _ in range(6):
        samples = quarter(samples)
    points = samples.reshape(-1, 3)
    # The highest point lies in a sample triangle, one of whose corners is at least as high and at most a side away.
    side = np.linalg.norm(samples - np.roll(samples, 1, axis=1), axis=2).max()
    out = np.hypot(points[:, 0], points[:, 1])

    found = TipZone(triangles).rooms(pointing_down(np.zeros((1, 3))), radius=RADIUS, standoff=STANDOFF)[0]

    highest, highest_nearby = (points[out <= reach, 2].max(initial=-np.inf) for reach in (RADIUS, RADIUS + side))
    assert highest - 1e-9 <= -found <= highest_nearby + 1e-9


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_rigid_motion_and_finer_triangles_do_not_change_the_room(seed: int):
    generator = np.random.default_rng(seed)
    cap = spherical_cap(radius=8.0, angle=0.6, rings=5, jitter_seed=3)
    tips = np.array([0.0, 0.0, 8.0 + STANDOFF]) + 0.2 * generator.normal(size=(4, 3))
    poses = pointing_down(tips, lean=0.1)
    motion = transforms.rigid(Rotation.random(random_state=generator).as_matrix(), 100 * generator.normal(size=3))
    triangles = cap.vertices[cap.faces]

    known = TipZone(triangles).rooms(poses, radius=RADIUS, standoff=STANDOFF)
    moved = transforms.apply(motion, quarter(triangles).reshape(-1, 3)).reshape(-1, 3, 3)
    found = TipZone(moved).rooms(motion @ poses, radius=RADIUS, standoff=STANDOFF)

    np.testing.assert_allclose(found, known, atol=1e-9)


def test_each_placement_has_a_circle_of_its_own() -> None:
    """Two placements beside a step of 0.2 mm, each 1 mm away from it: only the wide circle reaches it."""
    step = plate((40.0, 30.0), (1, 1))
    raised = step.vertices + np.array([21.3, 0.0, 0.2])
    triangles = np.concatenate([step.vertices[step.faces], raised[step.faces]])
    poses = pointing_down(np.repeat(MIDDLE, 2, axis=0))

    found = TipZone(triangles).rooms(poses, radius=np.array([0.9, 1.1]), standoff=STANDOFF)

    np.testing.assert_allclose(found, [STANDOFF, STANDOFF - 0.2], atol=1e-12)


def test_what_is_worked_out_for_a_cell_serves_whoever_reads_it_again() -> None:
    once, again = (tool_solids(load_cell(None).tool) for _ in range(2))
    assert once is not again
    assert inflated_solids(once, (0.0,) * len(once)) is inflated_solids(again, (0.0,) * len(again))
    longer = replace(once[1], end=once[1].end + np.array([0.0, 0.0, 1e-9]))
    assert longer != once[1]
    assert len({*once, *again, longer}) == len(once) + 1
