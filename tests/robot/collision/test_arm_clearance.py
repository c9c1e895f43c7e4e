from __future__ import annotations

from dataclasses import replace
from typing import Any

import coal
import numpy as np
import pinocchio
import pytest

from geoprint import transforms
from geoprint.errors import ClearanceError, InputError
from geoprint.model import Box, Cell, Clearance, ControllerPath, FloatArray, Lamp, Surface
from geoprint.robot.arm import MILLIMETRES_PER_METRE
from geoprint.robot.arm.urdf import read_urdf
from geoprint.robot.collision.arm_clearance import ArmCheck, ArmMotion, arm_control, arm_motion
from geoprint.robot.collision.clearance import check_placements, clearance
from geoprint.robot.collision.closest import ranking_trees
from geoprint.robot.collision.surroundings import mesh_target
from geoprint.robot.collision.tool_solids import link_solids, tool_solids
from tests.meshes import plate, sphere
from tests.robot.cells import straight_cell
from tests.robot.collision.test_clearance import T_BASE_WORK, printed_line
from tests.robot.joint_paths import arm_of
from tests.robot.placements import block, line, pointing_down, run_of

CELL = straight_cell()
LINKS = link_solids("irb120")
PATH, ARM, POSES = printed_line()
TABLE = Box("table", np.array([300.0, 0.0, -10.0]), np.array([800.0, 1200.0, 20.0]))
# A box over the forearm, higher than any of it on the motion from and to the plate.
ABOVE = Box("lid", np.array([150.0, 0.0, 900.0]), np.array([60.0, 200.0, 40.0]))


def check_cell(
    *, obstacles: tuple[Box, ...] = (), body: Surface | None = None, kept: float = 0.5, cell: Cell = CELL
) -> Clearance:
    return clearance(
        PATH,
        ARM,
        tool=cell.tool,
        process=replace(cell.process, clearance=kept),
        T_base_work=T_BASE_WORK,
        poses=POSES,
        part=plate(),
        body=body,
        obstacles=obstacles,
    )


def by_coal(box: Box, joints: FloatArray) -> float:
    """Return the distance of the links from a box as Pinocchio and Coal see them [mm], from the same URDF."""
    text = read_urdf("irb120")
    model = pinocchio.buildModelFromXML(text)
    shapes = pinocchio.buildGeomFromUrdfString(model, text, pinocchio.GeometryType.COLLISION).geometryObjects
    data = model.createData()
    solid = coal.Box(*(box.size / MILLIMETRES_PER_METRE).tolist())
    place = coal.Transform3s(np.eye(3), box.centre / MILLIMETRES_PER_METRE)
    least = np.inf
    for angles in joints:
        pinocchio.framesForwardKinematics(model, data, np.ascontiguousarray(angles))
        for shape in shapes:
            frame = np.eye(4) if shape.parentJoint == 0 else data.oMi[shape.parentJoint].homogeneous
            pose = frame @ shape.placement.homogeneous
            found = coal.distance(
                shape.geometry,
                coal.Transform3s(pose[:3, :3], pose[:3, 3]),
                solid,
                place,
                coal.DistanceRequest(),
                coal.DistanceResult(),
            )
            least = min(least, found)
    return least * MILLIMETRES_PER_METRE


@pytest.fixture(scope="module")
def over_the_arm() -> Box:
    """Return a lid 0.9 mm from the arm at its closest, by Coal."""
    gap = 0.9
    lid = ABOVE
    for _ in range(4):
        lid = replace(lid, centre=lid.centre - np.array([0.0, 0.0, by_coal(lid, PATH.joints) - gap]))
    assert by_coal(lid, PATH.joints) == pytest.approx(gap, abs=0.01)
    return lid


def test_near_miss_of_the_forearm_is_not_reported_and_has_its_known_distance(over_the_arm: Box):
    found = check_cell(obstacles=(over_the_arm,), kept=0.8)

    assert found.arm_smallest == pytest.approx(0.9, abs=0.03)
    assert found.arm_at is not None
    assert "arm's link 3 to obstacle lid" in found.arm_at


def test_forearm_nearer_than_the_clearance_is_refused_by_link_obstacle_place_and_distance(over_the_arm: Box):
    with pytest.raises(ClearanceError, match=r"the arm's link 3 comes within 0\.9\d mm of the obstacle lid") as caught:
        check_cell(obstacles=(over_the_arm,), kept=0.95)

    details = caught.value.details
    assert (details["solid"], details["against"]) == ("arm's link 3", "obstacle lid")
    assert isinstance(details["place"], tuple)
    assert details["distance"] == pytest.approx(0.9, abs=0.04)


def test_box_that_blocks_the_forearm_is_refused_by_its_depth(over_the_arm: Box):
    box = replace(over_the_arm, centre=over_the_arm.centre - np.array([0.0, 0.0, 5.9]))

    with pytest.raises(ClearanceError, match=r"the arm's link 3 reaches \d\.\d\d mm into the obstacle lid") as caught:
        check_cell(obstacles=(box,))

    assert isinstance(caught.value.details["distance"], float)
    assert -5.1 < caught.value.details["distance"] < -1.0


def test_body_that_the_elbow_touches_is_refused():
    elbow = ARM.link_poses(PATH.joints)[len(PATH.joints) // 2, 3, :3, 3]
    ball = sphere(radius=30.0)
    vertices = transforms.apply(
        transforms.inverse(T_BASE_WORK), ball.vertices - ball.vertices.mean(axis=0) + elbow + [-130.0, 0.0, 0.0]
    )

    with pytest.raises(ClearanceError, match=r"the arm's link [23] reaches .* into the body heart"):
        check_cell(body=Surface(vertices=vertices, faces=ball.faces, name="heart"))


def test_links_inside_a_closed_body_are_refused_although_no_surface_is_near():
    hall = mesh_target(block((-2e3, -2e3, -2e3), (2e3, 2e3, 2e3), name="hall"), role="body")
    solids = tool_solids(CELL.tool)

    with pytest.raises(ClearanceError, match="the arm's base is inside the closed body hall"):
        ArmCheck(LINKS, tool=solids, kept=0.5, targets=(hall,), base_targets=(hall,), trees=ranking_trees((hall,)))(
            arm_motion(PATH, ARM, tool=solids, links=LINKS, T_work_base=np.eye(4))
        )


@pytest.fixture(scope="module")
def on_its_table() -> Clearance:
    return check_cell(obstacles=(TABLE,))


def test_arm_stands_on_its_table_but_not_in_a_box(on_its_table: Clearance):
    found = on_its_table
    step = Box("step", np.array([0.0, 0.0, 5.0]), np.array([100.0, 100.0, 20.0]))

    assert "arm's base and link 1, likewise, against part plate" in found.checked
    assert not any("base and link 1" in pair and "table" in pair for pair in found.checked)
    with pytest.raises(ClearanceError, match=r"in every pose the arm's base reaches .* into the obstacle step"):
        check_cell(obstacles=(TABLE, step))


def test_checked_and_not_checked_name_the_arm_and_the_lamp(on_its_table: Clearance):
    without = on_its_table
    lamp = Lamp(transforms.rigid(np.eye(3), np.array([0.0, 30.0, 5.0])), length=40.0, diameter=20.0)
    with_lamp = check_cell(cell=replace(CELL, tool=replace(CELL.tool, lamp=lamp)))

    assert "arm links" not in without.not_checked
    assert "UV lamp" in without.not_checked
    assert any("link 1 against links 3 to 6" in sentence for sentence in without.not_checked)
    assert "UV lamp" not in with_lamp.not_checked
    assert "needle, cone, barrel, bracket, UV lamp against part plate" in with_lamp.checked
    assert with_lamp.checked[-2] == "needle, cone, barrel, bracket, UV lamp against the arm's base and links 1 to 4"


def test_lamp_that_reaches_back_into_the_forearm_is_refused():
    lamp = Lamp(transforms.rigid(np.eye(3), np.array([0.0, 0.0, -120.0])), length=100.0, diameter=20.0)

    with pytest.raises(ClearanceError, match=r"the UV lamp reaches .* into the arm's link 4"):
        check_cell(cell=replace(CELL, tool=replace(CELL.tool, lamp=lamp)))


@pytest.mark.parametrize(("gap", "hit"), [(0.4, True), (0.6, False)])
def test_lamp_that_grazes_a_post_is_refused_within_the_clearance_only(gap: float, hit: bool):  # noqa: FBT001
    lamp = Lamp(transforms.rigid(np.eye(3), np.array([40.0, 0.0, 20.0])), length=50.0, diameter=30.0)
    # Straight down along y, at x = 20: the side of the lamp is at x = 75, from 90 to 140 mm above the tip.
    placements = run_of(pointing_down(line((20.0, 5.0, 0.3), (20.0, 25.0, 0.3))))
    post = block((75.0 + gap, 12.0, 100.0), (80.0, 14.0, 110.0), name="post")

    def check() -> Clearance:
        return check_placements(
            placements,
            tool=replace(CELL.tool, lamp=lamp),
            process=CELL.process,
            standoff=0.3,
            part=plate(),
            body=post,
            obstacles=(),
            T_work_base=np.eye(4),
        )

    if not hit:
        found = check()
        assert found.smallest == pytest.approx(gap, abs=0.01)
        assert "UV lamp to body post" in found.at
        return
    with pytest.raises(ClearanceError, match=r"the UV lamp comes within 0.40 mm of the body post"):
        check()


@pytest.mark.parametrize("size", [{"length": 0.0}, {"diameter": -1.0}])
def test_impossible_lamp_is_refused(size: dict[str, Any]):
    lamp = replace(Lamp(np.eye(4), length=10.0, diameter=10.0), **size)

    with pytest.raises(InputError, match="lamp: its length"):
        tool_solids(replace(CELL.tool, lamp=lamp))


def coarse_turn() -> ControllerPath:
    """Return a path of two rows that are a degree of every joint apart."""
    joints = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0]) + np.radians(1.0) * np.arange(2)[:, None] * np.ones(6)
    still = np.zeros(2, dtype=np.bool_)
    return ControllerPath(joints, runs=np.full(2, -1), deposit=still, rounding=np.zeros_like(joints), step=5.0)


def test_rows_far_apart_are_cut_until_links_move_as_between_straight_lines():
    solids = tool_solids(CELL.tool)
    path = coarse_turn()
    motion: ArmMotion = arm_motion(path, arm_of(CELL), tool=solids, links=LINKS, T_work_base=np.eye(4))
    count = motion.tool.count
    shares = np.linspace(0.0, 1.0, 2 * count - 1)[:, None]
    joints = path.joints[0] + shares * (path.joints[-1] - path.joints[0])
    middles = arm_of(CELL).link_poses(joints)[1::2, 1:-1]

    assert count > path.runs.size
    for joint in range(6):
        poses = motion.Ts_work_link[:, joint + 1]
        between = transforms.interpolate_poses(poses[:-1], poses[1:], np.full(count - 1, 0.5))
        reach = np.array([0.0, 0.0, 300.0, 1.0])
        assert np.abs((between - middles[:, joint]) @ reach).max() < 0.02


@pytest.mark.parametrize(
    ("angles_deg", "hit", "struck"),
    [
        ((-99, 107, 26, -45, 34, -95), "arm's link 4", "arm's base"),
        ((108, -96, -93, 148, 61, -130), "arm's link 3", "arm's base"),
        ((0, 28, 20, 0, 87, 180), None, None),
    ],
)
def test_links_that_run_into_one_another_are_refused(
    angles_deg: tuple[float, ...], hit: str | None, struck: str | None
):
    joints = np.radians([angles_deg, angles_deg]) + np.array([[0.0], [1e-4]])
    still = np.zeros(2, dtype=np.bool_)
    path = ControllerPath(joints, runs=np.full(2, -1), deposit=still, rounding=np.zeros_like(joints), step=5.0)
    solids = tool_solids(CELL.tool)
    far = mesh_target(block((5000.0, 0.0, 0.0), (5010.0, 10.0, 10.0)), role="part")

    def check() -> tuple[float, str, tuple[str, ...]]:
        prepared = ArmCheck(
            LINKS, tool=solids, kept=0.5, targets=(far,), base_targets=(far,), trees=ranking_trees((far,))
        )
        return prepared(arm_motion(path, ARM, tool=solids, links=LINKS, T_work_base=np.eye(4)))

    if hit is None:
        assert any("three joints on" in pair for pair in check()[2])
        return
    with pytest.raises(ClearanceError, match=f"the {hit} reaches .* into the {struck}"):
        check()


def test_control_says_what_it_found():
    solids = sum(len(link.solids) for link in LINKS)

    assert f"links of the irb120: known hits and misses found right: {28 * solids}" in arm_control("irb120")
