"""A refusal comes with its proof, and with a change that was taken through the chain before it is named."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint.config import job_of, packaged_cell_text
from geoprint.errors import ClearanceError, PlanError, ReachError
from geoprint.geometry.files import save_ply
from geoprint.model import Placement
from geoprint.results import Plan
from geoprint.workflow import refusals
from geoprint.workflow.covering import cover
from geoprint.workflow.refusals import NEEDLE, Change, changes, printed
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import prepare_workpiece
from tests.meshes import spherical_cap

ADVICE = "use a longer needle"


@dataclass
class Chain:
    """A chain that refuses every plan but those of some changes, and notes what it was asked.

    Attributes:
        error: of a refused plan.
        prints: names of changes with which it plans.
        motions: that it plans each time.
        height: of the tip over the part from which on every needle prints [mm].
        asked: outer diameter of the needle and largest lean of each plan, in order.
        heights: of the tip over the part of each plan, in order [mm].
    """

    error: PlanError
    prints: tuple[float, ...] = ()
    motions: int = 1
    height: float = np.inf
    asked: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    heights: list[float] = field(default_factory=list[float])

    def __call__(self, paths: Plan, _: Placement, stage: Stages) -> Plan:
        for _motion in range(self.motions):
            with stage("reach"):
                pass
        width = paths.workpiece.cell.tool.needle_diameter
        self.asked.append((width, paths.job.max_tilt))
        self.heights.append(paths.poses.standoff)
        if width in self.prints or paths.poses.standoff >= self.height:
            return paths
        raise self.error


@pytest.fixture(scope="module")
def bowl(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """A hollow of 0.8 mm radius: the rim of a needle 1.3 mm wide has no room in it, that of a thin one has."""
    folder = tmp_path_factory.mktemp("bowl")
    path, cell = folder / "bowl.ply", folder / "cell.toml"
    cap = spherical_cap(radius=0.8, angle=1.0, rings=6)
    save_ply(cap, path)
    wide = re.sub(r"(?m)^outer_diameter_mm = .*", "outer_diameter_mm = 1.3", packaged_cell_text("irb120-bent45"))
    cell.write_text(re.sub(r"(?m)^inner_diameter_mm = .*", "inner_diameter_mm = 0.84", wide))
    job = job_of(surface=path, unit="mm", spacing=0.2, place="demo", flip=True, cell=cell)
    stage = Stages(lambda _: None)
    return cover(job, prepare_workpiece(job, stage, backends=["heat"]), stage)


@pytest.fixture(autouse=True)
def few_poses(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look at fewer poses than a real part needs."""
    for name, count in (("EVENLY", 4), ("UPRIGHT", 4), ("NARROWEST", 1), ("NEAREST", 1)):
        monkeypatch.setattr(f"geoprint.robot.reach.exhaustion.{name}", count)


@pytest.fixture
def few_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Offer the needles of the cell's length, and one change of each other kind."""

    def offered(paths: Plan) -> tuple[Change, ...]:
        every = changes(paths)
        first = {change.kind: change for change in reversed(every)}
        return tuple(
            change
            for change in every
            if change is first[change.kind] or (change.kind == NEEDLE and change.name.startswith("a 25.4 mm needle"))
        )

    monkeypatch.setattr(refusals, "changes", offered)


def rim(paths: Plan) -> ClearanceError:
    tip = paths.poses.tips[np.flatnonzero(paths.poses.deposit)[-1]]
    return ClearanceError(
        f"the rim has no room: {ADVICE}.", solid="needle's tip", against="part bowl.ply", room=-0.12, advice=ADVICE,
        place=tuple(tip.tolist()),
    )  # fmt: skip


def refusal(paths: Plan, chain: Chain, *, seen: list[str] | None = None) -> PlanError:
    assert paths.workpiece.placement is not None
    stage = Stages((seen if seen is not None else []).append)
    with pytest.raises(PlanError) as caught:
        printed(paths, paths.workpiece.placement, stage, chain=chain)
    return caught.value


def test_hollow_too_narrow_for_the_needle_is_proved_and_a_thinner_one_named_that_the_chain_takes(bowl: Plan) -> None:
    seen: list[str] = []
    chain = Chain(rim(bowl), prints=(0.91,))
    error = refusal(bowl, chain, seen=seen)
    assert isinstance(error, ClearanceError)
    message, details = str(error), error.details
    assert message.startswith(
        "the rim has no room; no nozzle direction within 15 degrees of the normal, turn or branch"
    )
    assert ADVICE not in message
    assert "the nozzle has no room. A 25.4 mm needle of 20 gauge prints it (tried: the whole program is checked): " in (
        message
    )
    assert message.endswith("[nozzle] outer_diameter_mm = 0.91, inner_diameter_mm = 0.6.")
    assert details["change"] == "a 25.4 mm needle of 20 gauge"
    assert details["change_keys"] == "[nozzle] outer_diameter_mm = 0.91, inner_diameter_mm = 0.6"
    assert isinstance(details["attitudes_tried"], int)
    assert details["attitudes_tried"] > 100_000
    assert (details["cone_deg"], details["lean_step_deg"], details["turn_step_deg"]) == (15.0, 1.0, 5.0)
    assert details["poses_blocked"]
    # What the error said before stays.
    assert details["room"] == -0.12
    assert chain.asked[0] == (1.3, 15.0)
    assert chain.asked[-1] == (0.91, 15.0)
    assert "exhaustive search" in seen
    assert "trying a 25.4 mm needle of 20 gauge: reach" in seen


@pytest.mark.usefixtures("few_changes")
def test_nothing_is_named_that_the_chain_refuses_and_no_more_motions_are_planned_than_the_plan_took(bowl: Plan) -> None:
    chain = Chain(rim(bowl), motions=7)
    error = refusal(bowl, chain)
    # The plan itself, and one change: a second would be the eighth motion.
    assert len(chain.asked) == 2
    assert error.details["change"] is None
    assert "prints it" not in str(error)
    assert "(the needle's rim has -0.12 mm of room)" in str(error)


def wide_cap(folder: Path, *, turned: bool) -> Plan:
    """Return the paths on a shallow part, of which the cell may say how it is turned, so that it stays as it stands."""
    save_ply(spherical_cap(radius=60.0, angle=0.1, rings=4), folder / "wide.ply")
    text = packaged_cell_text("irb120-bent45")
    cell = folder / "cell.toml"
    cell.write_text(text.replace("# demo_rpy_deg", "demo_rpy_deg") if turned else text)
    job = job_of(surface=folder / "wide.ply", unit="mm", spacing=3.0, place="demo", cell=cell)
    stage = Stages(lambda _: None)
    return cover(job, prepare_workpiece(job, stage, backends=["heat"]), stage)


def printing_at(*position: float) -> Callable[[Plan, Placement, Stages], Plan]:
    """Return a chain that prints what stands in one place of the base [mm]; anywhere but in the cell's without one."""

    def chain(paths: Plan, placement: Placement, _: Stages) -> Plan:
        at = tuple(placement.T_base_fixture[:3, 3].tolist())
        if at == (300.0, 0.0, 50.0) or (position and at != position):
            raise ReachError("joint 4 is at its limit.", lost=0.01)
        return replace(paths, workpiece=replace(paths.workpiece, placement=placement))

    return chain


@pytest.mark.parametrize("position", [(), (300.0, 0.0, 100.0), (350.0, 0.0, 50.0)])
def test_a_demonstration_that_prints_elsewhere_is_moved_there_and_says_why(
    position: tuple[float, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nothing(*_: object, **__: object) -> tuple[tuple[()], int]:
        return (), 77

    monkeypatch.setattr("geoprint.workflow.placement.search_orientation", nothing)
    paths = wide_cap(tmp_path, turned=False)
    assert paths.workpiece.placement is not None
    seen: list[str] = []
    found = printed(paths, paths.workpiece.placement, Stages(seen.append), chain=printing_at(*position))
    moved, placement = found.workpiece.moved, found.workpiece.placement
    assert moved is not None
    assert placement is not None
    assert tuple(moved.position.tolist()) == position or not position
    assert moved.start.startswith("joint 4 is at its limit. That holds with its mean normal up, and for 77 ")
    np.testing.assert_array_equal(placement.T_base_fixture[:3, 3], moved.position)
    np.testing.assert_array_equal(found.workpiece.cell.demo_position, moved.position)
    turned = Rotation.from_euler("xyz", moved.rpy).as_matrix()
    np.testing.assert_allclose(placement.T_base_fixture[:3, :3], turned, atol=1e-9)
    # What nobody has stated is as unknown there as before.
    assert placement.missing == paths.workpiece.placement.missing
    np.testing.assert_array_equal(found.poses.tips[found.poses.deposit], paths.poses.tips[paths.poses.deposit])
    assert ("looking for what would change it" in seen) == bool(position)


@pytest.mark.usefixtures("few_changes")
def test_what_no_place_mends_is_not_moved(tmp_path: Path) -> None:
    paths = wide_cap(tmp_path, turned=False)
    seen: list[str] = []
    error = ClearanceError("the needle hits.", solid="needle", against="part wide.ply", distance=-1.0, wanted=0.5)
    refusal(paths, Chain(error), seen=seen)
    assert "position" not in seen


def test_a_demonstration_of_which_the_cell_says_how_it_stands_is_not_moved_and_the_place_is_named(
    tmp_path: Path,
) -> None:
    paths = wide_cap(tmp_path, turned=True)
    assert paths.workpiece.placement is not None
    there = r"The part at \(300, 0, 100\) mm prints it .* demo_position_mm = \[300, 0, 100\]"
    with pytest.raises(ReachError, match=there):
        printed(paths, paths.workpiece.placement, Stages(lambda _: None), chain=printing_at(300.0, 0.0, 100.0))


@pytest.mark.usefixtures("few_changes")
def test_poses_that_are_free_one_by_one_are_said_to_be(tmp_path: Path) -> None:
    paths = wide_cap(tmp_path, turned=True)
    error = refusal(paths, Chain(ReachError("joint 4 is at its limit.", lost=0.01)))
    assert isinstance(error, ReachError)
    assert "of the worst poses" in str(error)
    assert "no continuous motion joins them" in str(error)
    assert error.details["poses_blocked"] == 0
    # The place counts before the needle where the nozzle has room.
    assert "needle" not in str(error.details["changes_tried"]).split(";")[0]


@pytest.mark.usefixtures("few_changes")
def test_needle_whose_rim_lacks_room_is_tried_again_higher_by_what_it_lacks(bowl: Plan) -> None:
    chain = Chain(rim(bowl), height=0.45)
    error = refusal(bowl, chain)
    # The rim is 0.12 mm into the part and needs 0.01 mm: 0.43 mm, told in tenths. Another needle comes first.
    assert chain.heights == [0.3, 0.3, 0.3, 0.5]
    assert chain.asked[3] == chain.asked[2]
    assert "gauge 0.5 mm above the part prints it (tried: the whole program is checked)" in str(error)
    assert str(error.details["change_keys"]).endswith("; [process] standoff_mm = 0.5")
    assert str(error.details["change_keys"]).startswith("[nozzle] outer_diameter_mm = ")


@pytest.mark.usefixtures("few_changes")
@pytest.mark.parametrize(("room", "highest"), [(-0.48, 0.8), (-0.52, 0.3)])
def test_no_needle_is_raised_by_more_than_half_a_millimetre(bowl: Plan, room: float, highest: float) -> None:
    error = rim(bowl)
    error.details["room"] = room
    chain = Chain(error, height=1.0)
    refusal(bowl, chain)
    assert max(chain.heights) == highest


def test_plan_that_prints_is_returned_as_it_is(bowl: Plan) -> None:
    assert bowl.workpiece.placement is not None
    chain = Chain(rim(bowl), prints=(1.3,))
    assert printed(bowl, bowl.workpiece.placement, Stages(lambda _: None), chain=chain) is bowl


def test_changes_never_touch_what_the_part_asks_for_or_the_clearance(bowl: Plan) -> None:
    for change in changes(bowl):
        assert change.cell.process is bowl.workpiece.cell.process or change.kind == "cell"
        assert change.cell.process.clearance == bowl.workpiece.cell.process.clearance
        assert change.job.spacing == 0.2
        assert change.cell.tool.needle_diameter <= 1.3
    assert {change.kind for change in changes(bowl)} == {"needle", "lean", "cell", "place"}
