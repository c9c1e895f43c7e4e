from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import ClearanceError, InputError, VerificationError
from geoprint.model import Box, Clearance, ControllerPath, FloatArray, PoseStream, Surface
from geoprint.robot.arm.kinematics import Arm
from geoprint.robot.collision.clearance import check_placements, clearance
from geoprint.robot.collision.contact import CollisionWorld, InflatedSolids
from geoprint.robot.collision.surroundings import mesh_target
from geoprint.robot.collision.sweep import Placements, find_hits
from geoprint.robot.collision.tool_solids import tool_solids
from tests.meshes import plate, spherical_cap
from tests.robot.cells import straight_cell
from tests.robot.placements import DOWN, block, line, pointing_down, run_of

CELL = straight_cell()
STANDOFF = CELL.process.standoff
KEPT = CELL.process.clearance
# Over the middle of the plate, along y.
LINE = line((20.0, 5.0, STANDOFF), (20.0, 25.0, STANDOFF))


def check(
    placements: Placements,
    *,
    part: Surface | None = None,
    body: Surface | None = None,
    obstacles: tuple[Box, ...] = (),
    T_base_work: FloatArray | None = None,
    kept: float = KEPT,
) -> Clearance:
    return check_placements(
        placements,
        tool=CELL.tool,
        process=replace(CELL.process, clearance=kept),
        standoff=STANDOFF,
        part=plate() if part is None else part,
        body=body,
        obstacles=obstacles,
        T_work_base=np.eye(4) if T_base_work is None else transforms.inverse(T_base_work),
    )


def over_plate(lean: float = 0.0) -> Placements:
    return run_of(pointing_down(LINE, lean=lean))


def post_beside_barrel(gap: float) -> Surface:
    """Return a post whose flat side is a gap away from the side of the barrel [mm]; it begins above the plate."""
    return block((20.0 + 10.0 + gap, 10.0, 5.0), (40.0, 14.0, 110.0), name="post")


def test_plain_plate_is_clear_by_what_the_tip_zone_leaves():
    found = check(over_plate())

    assert found.smallest == pytest.approx(1.0 + STANDOFF, abs=0.01)
    assert found.at.startswith("in run 1 at (20.00, ")
    assert found.at.endswith("needle to part plate")
    assert found.tip_margin == pytest.approx(STANDOFF, abs=1e-9)
    assert (found.kept, found.checks) == (KEPT, len(LINE))
    assert found.checked == (
        "needle, cone, barrel, bracket against part plate",
        "needle's tip on travel and its rim on deposit against part plate",
        "tool where the controller rounds targets, at most 0.000 mm off its way",
    )
    assert set(found.not_checked) >= {"arm links", "UV lamp", "cables", "material already deposited", "surroundings"}
    assert any("the way to home" in sentence for sentence in found.not_checked)


def test_body_is_checked_and_surroundings_are_then_not_missing():
    body = block((-50.0, -50.0, -30.0), (90.0, 80.0, 0.0), name="slab")

    found = check(over_plate(), body=body)

    assert "surroundings" not in found.not_checked
    assert "tool outside the closed body slab" in found.checked


def test_barrel_that_enters_a_post_is_refused_by_its_depth():
    with pytest.raises(ClearanceError, match=r"in run 1 at tip \(20.00, .* the barrel reaches 1.00 mm into") as caught:
        check(over_plate(), body=post_beside_barrel(-1.0))

    details = caught.value.details
    assert details["distance"] == pytest.approx(-1.0, abs=0.05)
    assert (details["solid"], details["against"], details["run"]) == ("barrel", "body post", 0)
    assert isinstance(details["place"], tuple)
    assert 10.0 <= details["place"][1] <= 14.0
    assert isinstance(details["hits"], int)
    assert 9 <= details["hits"] < len(LINE)
    assert details["placements"] == len(LINE)


def test_post_nearer_than_the_clearance_is_refused_by_its_distance():
    with pytest.raises(
        ClearanceError, match=r"barrel comes within 0.40 mm of the body post; at least 0.50 mm"
    ) as caught:
        check(over_plate(), body=post_beside_barrel(KEPT - 0.1))

    assert caught.value.details["distance"] == pytest.approx(KEPT - 0.1, abs=0.01)


def test_post_just_beyond_the_clearance_is_not_refused():
    found = check(over_plate(), body=post_beside_barrel(KEPT + 0.1))

    assert found.smallest == pytest.approx(KEPT + 0.1, abs=0.01)
    assert found.at.endswith("barrel to body post")


def test_tool_inside_a_closed_body_is_refused_although_no_surface_is_near():
    hall = block((-900.0, -900.0, -900.0), (900.0, 900.0, 900.0), name="hall")
    world = CollisionWorld(
        InflatedSolids(tool_solids(CELL.tool), kept=(0.0,) * 5), targets=(mesh_target(hall, role="body"),)
    )

    assert find_hits(world, over_plate()) is None
    with pytest.raises(ClearanceError, match="inside the closed body hall"):
        check(over_plate(), body=hall)


def test_body_wound_inside_out_hides_nothing():
    hall = block((-900.0, -900.0, -900.0), (900.0, 900.0, 900.0), name="hall")

    with pytest.raises(ClearanceError, match="inside the closed body hall"):
        check(over_plate(), body=Surface(vertices=hall.vertices, faces=hall.faces[:, ::-1], name="hall"))


def test_needle_in_the_part_is_refused():
    poses = pointing_down(LINE - np.array([0.0, 0.0, STANDOFF + 4.0]))

    with pytest.raises(ClearanceError, match=r"needle reaches 0.65 mm into the part plate; .* 41 of 41 placements"):
        check(run_of(poses))


def test_lean_that_brings_the_rim_down_is_refused():
    with pytest.raises(
        ClearanceError,
        match=r"in run 1 .* needle's rim is -0.0. mm above the part.* wrong side .* `--flip` turns it",
    ) as caught:
        check(over_plate(lean=np.radians(29.0)))

    widened = np.hypot(CELL.tool.needle_diameter / 2, 0.25)
    known = (STANDOFF - widened * np.sin(np.radians(29.0))) / np.cos(np.radians(29.0))
    assert caught.value.details["room"] == pytest.approx(known, abs=1e-9)


def test_lean_that_leaves_room_passes_with_its_known_margin():
    found = check(over_plate(lean=np.radians(15.0)))

    widened = np.hypot(CELL.tool.needle_diameter / 2, 0.25)
    known = (STANDOFF - widened * np.sin(np.radians(15.0))) / np.cos(np.radians(15.0))
    assert found.tip_margin == pytest.approx(known, abs=1e-9)


def test_rim_that_just_touches_is_neither_below_the_part_nor_on_its_wrong_side():
    with pytest.raises(ClearanceError, match=r"needle's rim is 0\.00 mm above the part plate") as caught:
        check(run_of(pointing_down(LINE - np.array([0.0, 0.0, STANDOFF + 0.002]))))

    room = caught.value.details["room"]
    assert isinstance(room, float)
    assert room < 0.0
    assert "--flip" not in str(caught.value)


def test_standoff_of_almost_nothing_is_refused():
    with pytest.raises(ClearanceError, match=r"is 0.00 mm above the part plate"):
        check(run_of(pointing_down(LINE - np.array([0.0, 0.0, STANDOFF - 0.003]))))


@pytest.mark.parametrize(("top", "hit"), [(STANDOFF + 0.2, True), (STANDOFF - 0.05, False)])
def test_tip_on_travel_must_not_touch_a_bump(top: float, hit: bool):  # noqa: FBT001
    deposit = np.arange(len(LINE)) < len(LINE) // 2
    bump = block((19.9, 19.9, 0.0), (20.1, 20.1, top), name="bump")
    placements = run_of(pointing_down(LINE), deposit=deposit)

    if not hit:
        assert check(placements, body=bump).tip_margin == pytest.approx(STANDOFF, abs=1e-9)
        return
    with pytest.raises(ClearanceError, match=r"the needle's tip reaches 0.20 mm into the body bump; at least 0.00 mm"):
        check(placements, body=bump)


def test_retract_from_the_surface_raises_no_alarm():
    bowl = spherical_cap(radius=15.0, angle=0.8, rings=30)
    bowl = Surface(vertices=bowl.vertices * [1.0, 1.0, -1.0], faces=bowl.faces[:, ::-1], name="bowl")
    lowest = -15.0 + STANDOFF
    tips = np.concatenate(
        [line((0.0, 0.0, lowest + 5.0), (0.0, 0.0, lowest)), line((0.0, 0.0, lowest), (0.0, 0.0, 0.0))]
    )
    deposit = np.arange(len(tips)) == 10

    found = check(run_of(pointing_down(tips), deposit=deposit), part=bowl)

    assert 0.2 < found.tip_margin < STANDOFF


def test_needle_in_a_narrow_groove_is_refused():
    left = block((-30.0, -30.0, -10.0), (19.0, 60.0, 20.0), name="left")
    right = block((21.0, -30.0, -10.0), (60.0, 60.0, 20.0), name="right")
    groove = Surface(
        vertices=np.concatenate([left.vertices, right.vertices]),
        faces=np.concatenate([left.faces, right.faces + 8]),
        name="groove",
    )

    with pytest.raises(ClearanceError, match=r"comes within 0.35 mm of the body groove"):
        check(over_plate(), body=groove)


def test_clearance_larger_than_the_tip_zone_does_not_alarm_on_a_plate():
    assert check(over_plate(), kept=3.0).kept == 3.0


def test_obstacle_in_the_base_frame_gives_the_same_distance_wherever_the_part_stands():
    box = Box("wall", np.array([35.0, 12.0, 60.0]), np.array([8.0, 4.0, 60.0]))
    T_base_work = transforms.rigid(
        Rotation.from_euler("z", 30, degrees=True).as_matrix(), np.array([300.0, 40.0, 20.0])
    )
    moved = Surface(
        vertices=transforms.apply(transforms.inverse(T_base_work), plate().vertices), faces=plate().faces, name="plate"
    )
    poses = transforms.inverse(T_base_work) @ pointing_down(LINE)

    here = check(over_plate(), obstacles=(box,))
    there = check(run_of(poses), part=moved, obstacles=(box,), T_base_work=T_base_work)

    assert here.smallest == pytest.approx(1.0, abs=0.01)
    assert there.smallest == pytest.approx(here.smallest, abs=0.01)
    assert "barrel to obstacle wall" in there.at


def test_path_without_deposit_is_refused():
    with pytest.raises(InputError, match="the path has no deposit"):
        check(run_of(pointing_down(LINE), deposit=np.zeros(len(LINE), dtype=np.bool_)))


def test_part_that_is_nowhere_near_the_path_is_refused():
    with pytest.raises(VerificationError, match="no surface lies below the tip"):
        check(run_of(pointing_down(LINE + np.array([0.0, 0.0, 50.0]))))


@pytest.mark.parametrize("kept", [-0.01, np.inf, np.nan])
def test_impossible_clearance_is_refused(kept: float):
    with pytest.raises(InputError, match="the clearance is"):
        check(over_plate(), kept=kept)


def test_pose_without_numbers_is_refused():
    poses = pointing_down(LINE).copy()
    poses[3, 0, 3] = np.nan

    with pytest.raises(InputError, match="NaN"):
        check(run_of(poses))


def test_pose_that_is_no_rotation_is_refused():
    with pytest.raises(InputError, match="pose 0 of 41 is not a rigid transform"):
        check(run_of(1.01 * pointing_down(LINE)))


def test_placements_too_far_apart_are_refused():
    with pytest.raises(InputError, match="sample the path more finely"):
        check(run_of(pointing_down(line((20.0, 5.0, 5.0), (20.0, 25.0, 5.0), step=5.0))))


T_BASE_WORK = transforms.rigid(np.eye(3), np.array([330.0, -15.0, 60.0]))


def printed_line() -> tuple[ControllerPath, Arm, PoseStream]:
    """Return a path from home to a line over the plate and back: coarse joint moves, and a row each 0.5 mm between."""
    arm = Arm(CELL.robot, T_flange_tool=CELL.tool.T_flange_tool)
    lift = np.array([0.0, 0.0, 5.0])
    tips = np.concatenate([LINE[:1] + lift, LINE, LINE[-1:] + lift])
    solutions = arm.solutions(T_BASE_WORK @ pointing_down(tips))
    distance = np.abs(solutions - CELL.robot.home).max(axis=2)
    branch = int(np.nanargmin(distance[0]))
    joints = solutions[:, branch]
    home = CELL.robot.home
    count = int(np.ceil(np.degrees(np.abs(joints[0] - home)).max()))
    outward = home + np.linspace(0.0, 1.0, count, endpoint=False)[:, None] * (joints[0] - home)
    back = joints[-1] + np.linspace(0.0, 1.0, count + 1)[1:, None] * (home - joints[-1])
    deposit = np.zeros(2 * count + len(tips), dtype=np.bool_)
    deposit[count + 1 : count + len(tips) - 2] = True
    runs = np.full(len(deposit), -1)
    runs[count : count + len(tips)] = 0
    rows = np.concatenate([outward, joints, back])
    path = ControllerPath(rows, runs=runs, deposit=deposit, rounding=np.zeros_like(rows), step=0.5)
    return path, arm, stream_of(tips)


def stream_of(tips: FloatArray) -> PoseStream:
    count = len(tips)
    depositing = (np.arange(count) > 0) & (np.arange(count) < count - 2)
    quaternions = np.tile(transforms.quaternion_of(DOWN), (count, 1))
    return PoseStream(
        tips=tips,
        quaternions=quaternions,
        normals=np.tile([0.0, 0.0, 1.0], (count, 1)),
        runs=np.zeros(count, dtype=np.int64),
        levels=np.where(depositing, 0, -1),
        layers=np.zeros(count, dtype=np.int64),
        deposit=depositing,
        stops=~depositing,
        arcs=np.zeros(count),
        flow=np.zeros(count),
        standoff=STANDOFF,
    )


def check_path(obstacles: tuple[Box, ...] = ()) -> Clearance:
    path, arm, poses = printed_line()
    return clearance(
        path,
        arm,
        tool=CELL.tool,
        process=CELL.process,
        T_base_work=T_BASE_WORK,
        poses=poses,
        part=plate(),
        body=None,
        obstacles=obstacles,
    )


def test_whole_path_is_checked_from_home_to_home():
    path, _, _ = printed_line()

    found = check_path()

    assert found.checks > path.runs.size
    assert found.tip_margin == pytest.approx(STANDOFF, abs=1e-6)
    assert found.smallest == pytest.approx(1.0 + STANDOFF, abs=0.01)


@pytest.mark.parametrize(("share", "name"), [(0.4, "on the way from home"), (-0.4, "on the way to home")])
def test_obstacle_on_a_joint_move_is_found(share: float, name: str):
    path, arm, _ = printed_line()
    travel = np.flatnonzero(path.runs < 0)
    ahead, back = np.split(travel, [int((travel < path.runs.argmax()).sum())])
    row = int(ahead[int(share * len(ahead))] if share > 0 else back[int(share * len(back))])
    tip = arm.tool_poses(path.joints[row][None])[0, :3, 3]
    post = Box("post", tip, np.array([2.0, 2.0, 2.0]))

    with pytest.raises(ClearanceError, match="into the obstacle post") as caught:
        check_path(obstacles=(post,))

    assert name in str(caught.value)


def test_part_placed_by_a_transform_that_is_not_rigid_is_refused():
    path, arm, poses = printed_line()

    with pytest.raises(InputError, match="not a rigid transform"):
        clearance(
            path, arm, tool=CELL.tool, process=CELL.process, T_base_work=np.diag([2.0, 2.0, 2.0, 1.0]), poses=poses,
            part=plate(), body=None, obstacles=(),
        )  # fmt: skip
