"""What the last check asks of obstacles, insides and rims: cases planted just on either side of each bound."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import ClearanceError
from geoprint.model import Box, Clearance, FloatArray, Surface
from geoprint.robot.collision.clearance import CheckedWorld, check_placements, rounding_on_travel
from geoprint.robot.collision.sweep import Placements
from geoprint.robot.collision.tool_solids import tool_solids
from tests.meshes import plate
from tests.robot.cells import straight_cell
from tests.robot.placements import block, line, pointing_down, run_of

CELL = straight_cell()
TIP = tool_solids(CELL.tool)[0]
LINE = line((20.0, 5.0, 0.3), (20.0, 25.0, 0.3))


def check(placements: Placements, body: Surface) -> Clearance:
    return check_placements(
        placements, tool=CELL.tool, process=CELL.process, standoff=0.3, part=plate(), body=body, obstacles=(),
        T_work_base=np.eye(4),
    )  # fmt: skip


def shifted(placements: Placements, rows: list[int], by: tuple[float, float, float]) -> Placements:
    """Return placements that stand for corners elsewhere in some rows."""
    corners: FloatArray = placements.poses.copy()
    corners[rows, :3, 3] += by
    return replace(placements, corners=corners)


def test_the_arm_keeps_clear_of_all_obstacles_but_what_it_stands_on() -> None:
    tops = {"floor": -50.0, "foot": 0.0, "sheet": 0.5, "ledge": 10.0, "wall": 400.0}
    size = np.array([40.0, 40.0, 60.0])
    boxes = tuple(Box(name, np.array([500.0, 0.0, top - 30.0]), size) for name, top in tops.items())

    scene = CheckedWorld(
        CELL.tool, process=CELL.process, part=plate(), body=None, obstacles=boxes, T_work_base=np.eye(4)
    )

    assert [target.name.split()[-1] for target in scene.targets[1:]] == list(tops)
    assert [target.name.split()[-1] for target in scene.base_targets[1:]] == ["sheet", "ledge", "wall"]


@pytest.mark.parametrize("y", [5.0, 10.0, 15.0, 20.0, 25.0])
def test_the_largest_solid_is_outside_of_closed_bodies_all_along_the_path(y: float) -> None:
    """The middle of the bracket, 140 mm up, is inside a small box for a moment; its surface is met by other solids."""
    bracket = max(tool_solids(CELL.tool), key=lambda solid: solid.length * solid.end_radius**2)
    assert bracket.name == "bracket"
    x, height = 20.0, 0.3 - float(bracket.centre[2])
    box = block((x - 2.0, y - 2.0, height - 2.0), (x + 2.0, y + 2.0, height + 2.0), name="box")

    with pytest.raises(ClearanceError, match=r"the bracket is inside the closed body box") as caught:
        check(run_of(pointing_down(LINE)), box)
    assert caught.value.details["place"] == pytest.approx((20.0, y, 0.3))


def test_the_room_under_the_rim_counts_what_a_rounded_corner_may_bring_the_rim_over() -> None:
    placements = run_of(pointing_down(LINE))
    radius, rounding = 0.65, 0.1
    for aside, room in ((radius + 0.5 * rounding, 0.3 - 0.1 - rounding), (radius + 2.0 * rounding, 0.3 - rounding)):
        ridge = block((20.0 + aside, 0.0, -5.0), (28.0, 30.0, 0.1), name="ridge")
        rounded = shifted(placements, [20], (rounding, 0.0, 0.0))
        found = check(rounded, ridge)
        assert found.tip_margin == pytest.approx(room, abs=3e-3)
        assert re.fullmatch(r"tool where the controller rounds .* at most 0\.10\d mm off its way", found.checked[-1])
    beside = block((20.0 + radius + 0.5 * rounding, 0.0, -5.0), (28.0, 30.0, 0.1), name="ridge")
    assert check(placements, beside).tip_margin == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize(("row", "counts"), [(0, False), (4, False), (5, True), (8, True), (9, True), (10, False)])
def test_the_tip_zone_is_lengthened_by_corners_where_travel_begins_goes_on_and_ends(*, row: int, counts: bool) -> None:
    depositing = np.ones(20, dtype=np.bool_)
    depositing[5:9] = False
    placements = shifted(run_of(pointing_down(LINE[:20]), deposit=depositing), [row], (0.0, 0.0, 0.2))

    found = rounding_on_travel(placements, TIP)

    assert found == pytest.approx(0.2 if counts else 0.0, abs=3e-3)
    scene = CheckedWorld(CELL.tool, process=CELL.process, part=plate(), body=None, obstacles=(), T_work_base=np.eye(4))
    tip, *_ = scene.world(placements).solids
    # The nozzle is the tool's z axis, and nothing of it lies before the origin.
    np.testing.assert_allclose(tip.start, [0.0, 0.0, found], atol=1e-9)
    np.testing.assert_allclose(tip.end, TIP.end)


def test_a_rim_without_room_is_refused_at_its_place() -> None:
    ridge = block((12.0, 14.5, -5.0), (28.0, 15.5, 0.295), name="ridge")

    with pytest.raises(ClearanceError, match=r"the needle's rim is 0\.0\d mm above the body ridge") as caught:
        check(run_of(pointing_down(LINE)), ridge)

    details = caught.value.details
    assert isinstance(details["place"], tuple)
    x, y, z = details["place"]
    assert (x, z) == pytest.approx((20.0, 0.3))
    assert 13.5 <= y <= 16.5
    # Tips every half millimetre whose rim, 0.65 mm wide, is over the ridge: from 13.85 to 16.15 mm.
    assert details["placements"] == 5
    assert (details["against"], details["run"], details["solid"]) == ("body ridge", 0, "needle's tip")


def test_nothing_is_inside_of_what_is_open() -> None:
    hall = block((-900.0, -900.0, -900.0), (900.0, 900.0, 900.0), name="hall")
    with pytest.raises(ClearanceError, match="is inside the closed body hall"):
        check(run_of(pointing_down(LINE)), hall)

    roofless = Surface(vertices=hall.vertices, faces=hall.faces[:-2], name="hall")

    assert check(run_of(pointing_down(LINE)), roofless).tip_margin == pytest.approx(0.3, abs=1e-6)


def test_no_distance_at_all_may_be_asked_for() -> None:
    found = check_placements(
        run_of(pointing_down(LINE)), tool=CELL.tool, process=replace(CELL.process, clearance=0.0), standoff=0.3,
        part=plate(), body=None, obstacles=(), T_work_base=np.eye(4),
    )  # fmt: skip
    assert found.kept == 0.0
