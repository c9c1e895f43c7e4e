"""The rim of the needle where the controller rounds one corner: wider there and beside it, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import ClearanceError
from geoprint.model import Clearance
from geoprint.robot.collision.clearance import check_placements
from tests.meshes import plate
from tests.robot.cells import straight_cell
from tests.robot.placements import block, line, pointing_down, run_of

CELL = straight_cell()
LINE = line((20.0, 5.0, 0.3), (20.0, 25.0, 0.3))
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
    with pytest.raises(ClearanceError, match="rim of the needle has") as caught:
        beside(y)
    # What the rounding may lower is taken off too.
    assert caught.value.details["room"] == pytest.approx(0.3 - 0.35 - 1.01 * ROUNDING, abs=1e-6)
