"""What is refused before a path is timed is refused of every motion past it, and most of what is refused then is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import ClearanceError
from geoprint.model import Box, FloatArray, PoseStream
from geoprint.robot.collision import ClearanceCheck
from tests.meshes import plate
from tests.robot.collision.test_clearance import CELL, LINE, STANDOFF, T_BASE_WORK, printed_line, stream_of

PATH, ARM, POSES = printed_line()
KEPT = CELL.process.clearance
# The barrel, 20 mm wide, 60 mm above the tip on a line along y at x = 20 of the part.
SIDE = 20.0 + 10.0


def check(post: float | None = None) -> ClearanceCheck:
    """Return the check of a plate, with a post so far from the side of the barrel [mm]."""
    boxes: tuple[Box, ...] = ()
    if post is not None:
        low, high = np.array([SIDE + post, 10.0, 70.0]), np.array([SIDE + post + 4.0, 14.0, 90.0])
        boxes = (Box("post", (low + high) / 2.0 + T_BASE_WORK[:3, 3], high - low),)
    return ClearanceCheck(
        ARM, tool=CELL.tool, process=CELL.process, T_base_work=T_BASE_WORK, part=plate(), body=None, obstacles=boxes
    )


def proven(post: float | None, poses: PoseStream = POSES) -> bool:
    """Say whether the proof of the motion refuses it."""
    try:
        check(post)(PATH, poses=poses)
    except ClearanceError:
        return True
    return False


def ahead(post: float | None, poses: PoseStream = POSES) -> bool:
    """Say whether the look ahead refuses the poses."""
    try:
        check(post).refuse_poses(poses)
    except ClearanceError:
        return True
    return False


def test_poses_that_are_clear_pass() -> None:
    assert not ahead(None)
    assert not proven(None)


@pytest.mark.parametrize("gap", [-2.0, 0.0, KEPT - 0.6, KEPT - 0.4])
def test_what_is_far_too_close_is_refused_by_both(gap: float) -> None:
    assert ahead(gap)
    assert proven(gap)


@pytest.mark.parametrize("gap", [KEPT - 0.2, KEPT - 0.05, KEPT - 0.01, KEPT + 0.05])
def test_what_a_motion_a_little_off_may_pass_is_left_to_the_proof(gap: float) -> None:
    # 0.15 degrees move the barrel by 0.2 mm where the post ends, 90 mm above the tip.
    assert not ahead(gap)


def test_the_refusal_names_solid_place_and_depth_and_counts_poses() -> None:
    with pytest.raises(
        ClearanceError, match=r"in run 1 at tip \(20\.00, 1\d\.\d\d, .*barrel reaches 1\.00 mm"
    ) as caught:
        check(-1.0).refuse_poses(POSES)
    details = caught.value.details
    assert (details["solid"], details["against"], details["travelling"]) == ("barrel", "obstacle post", False)
    assert details["placements"] == POSES.count


def lowered(by: float, *, ends: bool) -> PoseStream:
    """Return the printed line with its tip lower, or that of the travel before and behind it [mm]."""
    tips: FloatArray = POSES.tips.copy()
    tips[POSES.tips[:, 2] > 1.0, 2] -= by if ends else 0.0
    tips[POSES.tips[:, 2] < 1.0, 2] -= 0.0 if ends else by
    return replace(stream_of(tips), standoff=STANDOFF)


@pytest.mark.parametrize(
    ("by", "refused"), [(STANDOFF - 0.1, False), (STANDOFF - 0.002, False), (STANDOFF + 0.05, True)]
)
def test_a_rim_without_room_is_refused_where_no_motion_has_any(by: float, refused: bool) -> None:  # noqa: FBT001
    assert ahead(None, lowered(by, ends=False)) is refused


def test_a_tip_in_the_part_on_travel_alone_is_said_to_be_on_travel() -> None:
    poses = lowered(5.0 + STANDOFF + 0.5, ends=True)
    with pytest.raises(ClearanceError, match="needle's tip") as caught:
        check().refuse_poses(poses)
    assert caught.value.details["travelling"] is True
    assert LINE[0, 2] == STANDOFF
