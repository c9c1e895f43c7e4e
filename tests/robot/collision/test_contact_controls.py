"""What the collision check asks of its library and its models before it trusts them, and what it measures."""

from __future__ import annotations

import fcl
import numpy as np
import pytest

from geoprint import transforms
from geoprint.errors import InputError, UsageError, VerificationError
from geoprint.model import Box, FloatArray, Surface
from geoprint.robot.arm.urdf import read_urdf
from geoprint.robot.collision.closest import shapes_of, worst_hit
from geoprint.robot.collision.contact import CollisionWorld, InflatedSolids
from geoprint.robot.collision.surroundings import box_target, mesh_target, solid_target
from geoprint.robot.collision.sweep import Hits
from geoprint.robot.collision.tip_zone import TipZone
from geoprint.robot.collision.tool_solids import Solid, link_solids, tool_solids
from tests.meshes import plate
from tests.robot.cells import straight_cell
from tests.robot.placements import always, block, pointing_down

SOLIDS = tool_solids(straight_cell().tool)
NEEDLE = Solid("needle", np.zeros(3), np.array([0.0, 0.0, -20.0]), 0.5, 0.5)
INFLATED = InflatedSolids((NEEDLE,), kept=(0.5,))
POST = mesh_target(block((-1.0, -1.0, 0.0), (1.0, 1.0, 5.0)), role="body")


@pytest.mark.parametrize(("answer", "message"), [(0, "a known hit"), (1, "a known miss")])
def test_each_target_is_asked_by_itself_although_the_solids_were_found_right(
    monkeypatch: pytest.MonkeyPatch, answer: int, message: str
) -> None:
    monkeypatch.setattr(fcl, "collide", always(answer))
    with pytest.raises(VerificationError, match=message):
        CollisionWorld(INFLATED, targets=(POST,))


def test_each_inflated_solid_is_put_on_every_target_and_well_beside_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """The solid is 20 mm long, of radius 0.5 mm, and inflated by 0.5 mm and up to 12 more; its centre is 10 mm down."""
    wall = mesh_target(block((-400.0, -400.0, -400.0), (30.0, 40.0, 50.0)), role="body")
    collide = fcl.collide
    places: list[FloatArray] = []

    def record(
        solid: fcl.CollisionObject,
        model: fcl.CollisionObject,
        request: fcl.CollisionRequest,
        result: fcl.CollisionResult,
    ) -> int:
        places.append(solid.getTranslation() - [0.0, 0.0, 10.0])
        return collide(solid, model, request, result)

    monkeypatch.setattr(fcl, "collide", record)
    CollisionWorld(INFLATED, targets=(POST, wall))

    assert len(places) == 20 * 2 * 2
    found = np.array(places).reshape(20, 2, 2, 3)
    for column, (target, highest) in enumerate(((POST, (1.0, 1.0, 5.0)), (wall, (30.0, 40.0, 50.0)))):
        onto, beside = found[:, column, 0], found[:, column, 1]
        middles = target.triangles.mean(axis=1)
        assert np.linalg.norm(onto[:, None] - middles, axis=2).min(axis=1).max() < 1e-9
        # From corner to corner the most inflated one is 20 mm and two of 13 mm long.
        assert (beside[-1] - highest >= 46.0).all()
        assert (beside - highest >= 20.0 + 2.0).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_library_is_asked_only_where_boxes_overlap_along_every_axis(
    monkeypatch: pytest.MonkeyPatch, axis: int, side: float
) -> None:
    """The solid of radius 1 mm reaches from its tip at (0, 0, 0) to 20 mm above it, the cube from -50 to 50."""
    cube = mesh_target(block((-50.0, -50.0, -50.0), (50.0, 50.0, 50.0)), role="body")
    world = CollisionWorld(INFLATED, targets=(cube,))
    # What lies beyond the box on that side: the length of the solid counts above the tip only.
    beyond = 70.0 if (axis, side) == (2, -1.0) else 50.0
    asked: list[int] = []
    collide = fcl.collide

    def record(
        solid: fcl.CollisionObject,
        model: fcl.CollisionObject,
        request: fcl.CollisionRequest,
        result: fcl.CollisionResult,
    ) -> int:
        asked.append(1)
        return collide(solid, model, request, result)

    monkeypatch.setattr(fcl, "collide", record)
    for gap, count in ((0.9, 1), (1.2, 0)):
        asked.clear()
        tip = np.zeros((1, 3))
        tip[0, axis] = side * (beyond + gap)
        world.touches(pointing_down(tip), reaches=np.zeros((1, 1)))
        assert len(asked) == count


@pytest.mark.parametrize("row", [0, 1])
def test_a_reach_beyond_12_mm_is_refused_wherever_it_stands(row: int) -> None:
    world = CollisionWorld(INFLATED, targets=(POST,))
    poses = pointing_down(np.array([[0.0, 0.0, 90.0], [1.0, 0.0, 90.0]]))
    reaches = np.full((2, 1), 12.0)
    assert not world.touches(poses, reaches=reaches).any()
    for reach in (12.001, np.nan):
        reaches[row] = reach
        with pytest.raises(InputError, match=r"grow by (12\.0|nan) mm"):
            world.touches(poses, reaches=reaches)


def test_cone_and_barrel_are_one_shape_and_the_others_stay_alone() -> None:
    assert [tuple(solid.name for solid in shape.solids) for shape in shapes_of(SOLIDS)] == [
        ("needle's tip",), ("needle",), ("cone", "barrel"), ("bracket",),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("start", "end", "radius"),
    [
        ((0.0, 0.0, -20.0), (0.0, 0.0, -30.0), 0.4),  # a step in the radius
        ((0.0, 0.0, -21.0), (0.0, 0.0, -30.0), 0.5),  # a gap
        ((0.0, 0.0, -20.0), (0.0, 1.0, -30.0), 0.5),  # a bend
    ],
)
def test_solids_that_do_not_go_on_as_one_convex_shape_are_measured_alone(
    start: tuple[float, ...], end: tuple[float, ...], radius: float
) -> None:
    other = Solid("other", np.array(start), np.array(end), radius, radius)
    assert len(shapes_of((NEEDLE, other))) == 2
    straight = Solid("other", np.array([0.0, 0.0, -20.0]), np.array([0.0, 0.0, -30.0]), 0.5, 0.5)
    assert len(shapes_of((NEEDLE, straight))) == 1


@pytest.mark.parametrize("deepest", [96, 98, 103, 301])
def test_the_worst_of_400_hits_is_found_on_either_side_of_those_that_are_measured_first(deepest: int) -> None:
    rows = np.arange(400)
    tips = np.column_stack([0.51 + 0.001 * np.abs(rows - deepest), np.zeros(400), np.full(400, 1.0)])
    tips[:, 0] += 1.0
    world = CollisionWorld(INFLATED, targets=(POST,))
    hits = Hits(pointing_down(tips), rows, np.ones((400, 1, 1), dtype=np.bool_))
    worst = worst_hit(hits, world)
    assert worst.row == deepest
    assert worst.distance == pytest.approx(0.01, abs=0.006)


def test_an_obstacle_lies_half_its_size_to_either_side_of_its_centre() -> None:
    T_work_base = transforms.rigid(np.eye(3), np.array([100.0, 0.0, 0.0]))
    target = box_target(Box("post", np.array([1.0, 2.0, 3.0]), np.array([4.0, 6.0, 8.0])), T_work_base=T_work_base)
    low, high = target.bounds
    np.testing.assert_allclose(low, [99.0, -1.0, -1.0])
    np.testing.assert_allclose(high, [103.0, 5.0, 7.0])
    a, b, c = np.moveaxis(target.triangles - target.triangles.mean(axis=(0, 1)), 1, 0)
    assert (a * np.cross(b, c)).sum() / 6.0 == pytest.approx(4.0 * 6.0 * 8.0)
    # FCL takes boxes and convex solids as solid: only surfaces are asked for their inside.
    assert not target.closed
    assert not solid_target(NEEDLE).closed
    assert POST.closed
    assert not mesh_target(plate(), role="part").closed


@pytest.mark.parametrize(("radius", "length", "refused"), [
    ("0.0005", "0.0005", False), ("0", "0.016", True), ("0.025", "0", True), ("0.025", "inf", True),
    ("inf", "0.016", True), ("0.025", "-0.016", True),
])  # fmt: skip
def test_a_link_may_be_half_a_millimetre_small_but_not_nothing(radius: str, length: str, *, refused: bool) -> None:
    old = '<cylinder radius="0.025" length="0.016"/>'
    text = read_urdf("irb120")
    assert old in text
    text = text.replace(old, f'<cylinder radius="{radius}" length="{length}"/>')
    if refused:
        with pytest.raises(UsageError, match="link_6 has a cylinder of radius"):
            link_solids("irb120", urdf=text)
    else:
        assert link_solids("irb120", urdf=text)[6].solids[0].length == pytest.approx(0.5)


def room_over(triangle: FloatArray) -> float:
    surface = Surface(vertices=triangle, faces=np.array([[0, 1, 2]]))
    return float(TipZone(surface.vertices[surface.faces]).rooms(pointing_down(np.zeros((1, 3))), radius=0.65,
                           standoff=0.3)[0])  # fmt: skip


@pytest.mark.parametrize(("height", "room"), [(0.99, -0.99), (1.01, np.inf), (-0.49, 0.49), (-0.51, np.inf)])
def test_the_room_ends_one_millimetre_above_the_tip_and_a_fifth_below_the_stand_off(height: float, room: float) -> None:
    flat = np.array([[0.0, 0.0, height], [0.1, 0.0, height], [0.0, 0.1, height]])
    assert room_over(flat) == pytest.approx(room)


def test_a_steep_face_counts_where_only_its_top_is_within_the_room() -> None:
    assert room_over(np.array([[0.0, 0.0, -0.2], [0.1, 0.0, -0.8], [0.0, 0.1, -0.8]])) == pytest.approx(0.2)
