from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import ClearanceError, InputError
from geoprint.model import Clearance
from geoprint.robot.collision.clearance import check_placements
from geoprint.robot.collision.contact import CollisionWorld, InflatedSolids
from geoprint.robot.collision.surroundings import mesh_target
from geoprint.robot.collision.sweep import ALLOWANCE, Placements, find_hits
from geoprint.robot.collision.tool_solids import tool_solids
from tests.meshes import plate
from tests.robot.cells import straight_cell
from tests.robot.placements import block, line, pointing_down, run_of

CELL = straight_cell()
KEPT = CELL.process.clearance
LINE = line((20.0, 5.0, 0.3), (20.0, 25.0, 0.3))


@pytest.mark.parametrize(("gap", "hit"), [(KEPT - 0.1, True), (KEPT + 0.1, False)])
def test_needle_that_grazes_a_thin_post_between_two_placements_is_found(gap: float, hit: bool):  # noqa: FBT001
    poses = pointing_down(np.array([[20.0, 15.0, 5.0], [21.8, 15.0, 5.0], [23.6, 15.0, 5.0]]))
    placements = run_of(poses, deposit=np.zeros(3, dtype=np.bool_))
    needle_side = 15.0 + CELL.tool.needle_diameter / 2
    post = block((20.88, needle_side + gap, 8.0), (20.92, needle_side + gap + 0.02, 20.0))
    solids = tool_solids(CELL.tool)
    world = CollisionWorld(
        InflatedSolids(solids, kept=(0.0, KEPT, KEPT, KEPT, KEPT)), targets=(mesh_target(post, role="body"),)
    )

    hits = find_hits(world, placements)

    assert not world.touches(poses, reaches=np.zeros((3, len(solids)))).any()
    assert (hits is not None) == hit
    if hits is not None:
        assert set(hits.rows.tolist()) == {0}
        assert hits.pairs[:, :, 0].any(axis=0).tolist() == [False, True, False, False, False]
        np.testing.assert_allclose(hits.poses[:, 0, 3], 20.9, atol=0.5)


def test_single_placement_is_no_motion():
    with pytest.raises(InputError, match="at least two placements"):
        run_of(pointing_down(LINE[:1]))


def test_promised_allowance_is_below_a_tenth_of_a_millimetre():
    assert 0.0 < ALLOWANCE < 0.1


def test_stretch_names_the_joint_moves_at_both_ends():
    poses = pointing_down(LINE[:5])
    placements = Placements(poses, runs=np.array([-1, 0, 0, 1, -1]), deposit=np.zeros(5, dtype=np.bool_), corners=poses)

    names = [placements.stretch(row) for row in range(5)]

    assert names == ["on the way from home", "in run 1", "in run 1", "in run 2", "on the way to home"]


# The rim of the needle where the controller rounds one corner: wider there and beside it, and nowhere else.


ROUNDED = 20
ROUNDING = 0.2


def beside(y: float) -> Clearance:
    """Check a line whose corner at y = 15 mm may be 0.2 mm to either side, past a ledge 0.8 mm beside it at y.

    The needle is 1.3 mm wide and the ledge 0.05 mm higher than its tip.
    """
    placements = run_of(pointing_down(LINE))
    corners = placements.poses.copy()
    corners[ROUNDED, 0, 3] += ROUNDING
    ledge = block((20.8, y - 0.2, -1.0), (23.0, y + 0.2, 0.35), name="ledge")
    return check_placements(
        replace(placements, corners=corners), tool=CELL.tool, process=CELL.process, standoff=0.3, part=plate(),
        body=ledge, obstacles=(), T_work_base=np.eye(4),
    )  # fmt: skip


def test_line_is_where_the_test_says() -> None:
    assert LINE[ROUNDED, 1] == 15.0
    assert LINE[1, 1] - LINE[0, 1] == 0.5


@pytest.mark.parametrize("y", [7.0, 13.0, 17.0, 23.0])
def test_rim_is_as_wide_as_the_needle_away_from_the_rounded_corner(y: float) -> None:
    # The ledge is outside of the circle; at the corner the rim may be lower by the rounding.
    assert beside(y).tip_margin == pytest.approx(0.3 - 1.01 * ROUNDING, abs=1e-6)


@pytest.mark.parametrize("y", [14.6, 15.0, 15.4])
def test_rim_is_wider_by_the_rounding_anywhere_in_the_steps_beside_it(y: float) -> None:
    with pytest.raises(ClearanceError, match="needle's rim is") as caught:
        beside(y)
    # What the rounding may lower is taken off too.
    assert caught.value.details["room"] == pytest.approx(0.3 - 0.35 - 1.01 * ROUNDING, abs=1e-6)
