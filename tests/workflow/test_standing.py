"""A demonstration that cannot be printed with its mean normal up is turned; nothing else is, and both are told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of, load_cell, packaged_cell_text
from geoprint.errors import ClearanceError, LimitError, PlanError, ReachError
from geoprint.geometry.files import save_ply
from geoprint.model import Placement
from geoprint.reporting import outcome_text, record_plan
from geoprint.results import Plan
from geoprint.robot.placing import FixturePose, Oriented, demo_placement
from geoprint.workflow import check_bundle, placement as standing, plan
from geoprint.workflow.covering import cover
from geoprint.workflow.placement import Chain, placed
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import prepare_workpiece
from tests.meshes import plate

STAGE = Stages(lambda _: None)
POSITION = np.array([350.0, 0.0, 200.0])
TILTED = FixturePose(POSITION, np.radians([0.0, 30.0, 0.0]))
TURNED = FixturePose(POSITION, np.radians([0.0, 0.0, 90.0]))
BRACKET = ClearanceError("the bracket reaches 2 mm into the table.", solid="bracket", against="obstacle table")
NEEDLE = ClearanceError("the needle reaches 1 mm into the part.", solid="needle", against="part plate.ply")
FAR = ReachError("run 1 is out of reach.", lost=0.25)


def cell_file(folder: Path, *, stated: str = "") -> Path:
    """Write the packaged cell of the straight nozzle with a joint 5 that cannot point it straight down."""
    text = packaged_cell_text("irb120-straight160")
    for old, new in (
        ("[-120, 120], [-400", "[-120, 40], [-400"),
        ("[0, 9, 9, 0, 72, 0]", "[0, 9, 9, 0, 35, 0]"),
        ("# demo_rpy_deg = [0, 0, 0]", stated or "# demo_rpy_deg = [0, 0, 0]"),
    ):
        assert old in text
        text = text.replace(old, new)
    path = folder / "cell.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def part(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("part") / "plate.ply"
    save_ply(plate((30.0, 20.0), (6, 4)), path)
    return path


@pytest.fixture(scope="module")
def planned(part: Path, tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Return the plan of a part that is turned, because with its mean normal up the arm does not reach it."""
    cell = cell_file(tmp_path_factory.mktemp("cell"))
    with pytest.MonkeyPatch.context() as patch:
        # Nothing here depends on how many yaws are tried.
        patch.setattr("geoprint.robot.placing.orientation_search.YAWS", 3)
        return plan(job_of(surface=part, unit="mm", spacing=10.0, cell=cell, place="demo"))


@pytest.fixture(scope="module")
def paths(part: Path) -> Plan:
    job = job_of(surface=part, unit="mm", spacing=10.0, place="demo")
    found = cover(job, prepare_workpiece(job, STAGE, backends=["heat"]), STAGE)
    # A flow that nothing but these paths has.
    return replace(found, poses=replace(found.poses, flow=np.where(found.poses.deposit, 0.125, 0.0)))


def serving(paths: Plan, _: Placement, __: Stages) -> Plan:
    return paths


def refusing(error: PlanError, *, until: FixturePose | None = None) -> Chain:
    """Return a chain that refuses every placement but that of a stand."""

    def chain(paths: Plan, placement: Placement, _: Stages) -> Plan:
        if until is None or not np.allclose(placement.T_base_fixture, until.T_base_fixture):
            raise error
        return paths

    return chain


@pytest.fixture
def searched(monkeypatch: pytest.MonkeyPatch) -> Callable[[FixturePose], None]:
    """Let the search find these places."""

    def use(*candidates: FixturePose) -> None:
        found = tuple(Oriented(pose, 0.2, 0.5) for pose in candidates)

        def search(*_: object, **__: object) -> tuple[tuple[Oriented, ...], int]:
            return found, 77

        monkeypatch.setattr(standing, "search_orientation", search)

    return use


def test_what_is_printed_with_its_mean_normal_up_stays_and_costs_nothing(
    paths: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(standing, "search_orientation")
    placement = paths.workpiece.placement
    assert placement is not None
    assert placed(paths, placement, STAGE, chain=serving) is paths
    assert paths.workpiece.orientation is None


@pytest.mark.parametrize("error", [FAR, BRACKET])
def test_the_first_orientation_that_serves_is_taken_and_says_why_those_before_were_not(
    paths: Plan, error: PlanError, searched: Callable[..., None]
) -> None:
    searched(TURNED, TILTED)
    placement = paths.workpiece.placement
    assert placement is not None
    found = placed(paths, placement, STAGE, chain=refusing(error, until=TILTED))
    orientation, turned = found.workpiece.orientation, found.workpiece.placement
    assert orientation is not None
    assert turned is not None
    np.testing.assert_allclose(np.degrees(orientation.rpy), [0.0, 30.0, 0.0], atol=1e-12)
    assert (orientation.start, orientation.refused, orientation.tried) == (str(error), (str(error),), 77)
    np.testing.assert_allclose(turned.T_base_fixture, TILTED.T_base_fixture, atol=1e-12)
    assert len(turned.missing) == 2
    # Where material is laid, and how much, does not depend on how the part stands; the nozzle's attitude does.
    deposited, before = found.poses.deposit, paths.poses.deposit
    np.testing.assert_allclose(found.poses.tips[deposited], paths.poses.tips[before], atol=1e-12)
    np.testing.assert_array_equal(found.poses.flow[deposited], 0.125)
    assert not found.poses.flow[~deposited].any()


@pytest.mark.parametrize("error", [NEEDLE, LimitError("a limit is broken.")])
def test_what_no_orientation_mends_is_refused_at_once(
    paths: Plan, error: PlanError, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(standing, "search_orientation")
    placement = paths.workpiece.placement
    assert placement is not None
    with pytest.raises(type(error)) as refused:
        placed(paths, placement, STAGE, chain=refusing(error))
    assert refused.value is error


def test_what_no_orientation_mends_once_it_is_turned_ends_the_search_and_is_named(
    paths: Plan, searched: Callable[..., None]
) -> None:
    searched(TILTED, TURNED)
    placement, tried = paths.workpiece.placement, list[Placement]()
    assert placement is not None

    def chain(_: Plan, at: Placement, __: Stages) -> Plan:
        tried.append(at)
        raise BRACKET if at is placement else NEEDLE

    with pytest.raises(ClearanceError, match=r"^the bracket .* Turned by \(0, 30, 0\) .* the needle reaches 1 mm"):
        placed(paths, placement, STAGE, chain=chain)
    assert len(tried) == 2


def test_where_none_serves_the_refusal_of_the_start_says_so(paths: Plan, searched: Callable[..., None]) -> None:
    searched(TILTED)
    placement = paths.workpiece.placement
    assert placement is not None
    with pytest.raises(ReachError, match=r"^run 1 is out of reach\. .* for 77 orientations ") as refused:
        placed(paths, placement, STAGE, chain=refusing(FAR))
    assert refused.value.details == {"lost": 0.25}


def walled_cell(folder: Path) -> Path:
    """Write the packaged cell with walls around the demonstration, so high and near that the cone hits them."""
    walls = [(14, 0, 10, 38), (-14, 0, 10, 38), (0, 14, 38, 10), (0, -14, 38, 10)]
    path = folder / "walled.toml"
    path.write_text(
        packaged_cell_text("irb120-bent45")
        + "".join(
            f'\n[[obstacles]]\nname = "wall {x} {y}"\ncentre_mm = [{300 + x}, {y}, 57.5]\nsize_mm = [{dx}, {dy}, 115]\n'
            for x, y, dx, dy in walls
        ),
        encoding="utf-8",
    )
    return path


def test_a_part_between_walls_is_moved_out_of_them_and_its_bundle_says_so(tmp_path: Path) -> None:
    path = tmp_path / "small.ply"
    save_ply(plate((6.0, 6.0), (3, 3)), path)
    cell = walled_cell(tmp_path)
    planned = plan(job_of(surface=path, unit="mm", spacing=2.0, cell=cell, place="demo"))
    (robot,), moved = planned.robot, planned.workpiece.moved
    assert moved is not None
    assert robot.program.dry_run
    assert robot.clearance.smallest >= 0.5
    np.testing.assert_allclose(robot.placement.T_base_fixture[:3, 3], moved.position, atol=1e-9)
    (note,) = [line for line in outcome_text(record_plan(planned)).splitlines() if "part moved to" in line]
    position, rpy = (", ".join(f"{value:g}" for value in each) for each in (moved.position, np.degrees(moved.rpy)))
    stated = f"demo_position_mm = [{position}]", f"demo_rpy_deg = [{rpy}]"
    assert note.startswith(f"note: part moved to {stated[0]}, {stated[1]}. Where the cell puts it, it is refused: ")
    assert "obstacle wall" in note

    planned.save(tmp_path / "out")
    assert check_bundle(tmp_path / "out").findings == ()
    # In the place that is told it is not moved.
    text = cell.read_text(encoding="utf-8").replace("demo_position_mm = [300, 0, 50]", stated[0])
    cell.write_text(text.replace("# demo_rpy_deg = [0, 0, 0]", stated[1]), encoding="utf-8")
    again = plan(job_of(surface=path, unit="mm", spacing=2.0, cell=cell, place="demo"))
    assert again.workpiece.moved is None
    np.testing.assert_array_equal(again.robot[0].trajectory.joints, robot.trajectory.joints)


@pytest.mark.usefixtures("brief_proofs")
def test_a_stated_turn_is_not_searched(part: Path, tmp_path: Path) -> None:
    cell = cell_file(tmp_path, stated="demo_rpy_deg = [0, 0, 0]")
    with pytest.raises(ReachError, match="joint 5") as refused:
        plan(job_of(surface=part, unit="mm", spacing=10.0, cell=cell, place="demo"))
    assert "orientations" not in str(refused.value)


def test_a_part_out_of_reach_as_it_stands_is_tilted_until_it_is_reached(planned: Plan, tmp_path: Path) -> None:
    orientation, (robot,) = planned.workpiece.orientation, planned.robot
    assert orientation is not None
    assert "joint 5" in orientation.start
    assert np.radians(10.0) < orientation.tilt < np.radians(80.0)
    assert robot.joint_path.joints[:, 4].max() <= np.radians(40.0)
    assert robot.program.dry_run
    # The turn that is told, written into the cell file, gives the same placement.
    record = record_plan(planned).robot[0].motion.placement_orientation
    assert record is not None
    stated = f"demo_rpy_deg = [{', '.join(f'{angle:g}' for angle in record.rpy_deg)}]"
    cell = load_cell(cell_file(tmp_path, stated=stated))
    again = demo_placement(planned.workpiece.part, position=cell.demo_position, rotation=cell.demo_turn)
    np.testing.assert_allclose(again.T_base_work, robot.placement.T_base_work, atol=1e-9)
    np.testing.assert_allclose(robot.placement.T_base_fixture[:3, 3], POSITION, atol=1e-9)
    assert f"note: part turned by {stated}" in outcome_text(record_plan(planned), verbose=True)
