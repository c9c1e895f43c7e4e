"""A cell that is written from a URDF: what it takes from the file, what it assumes, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geoprint.config import load_cell
from geoprint.errors import UsageError
from geoprint.geometry.files import save_ply
from geoprint.model import Cell
from geoprint.robot.arm import Arm, check_load, read_urdf
from geoprint.robot.collision import link_solids
from geoprint.workflow.arm_cell import arm_cell
from tests.reporting.report_cases import box
from tests.robot.arms import offset_wrist


def written(folder: Path, text: str, *, flange: str = "tool0") -> tuple[Cell, tuple[str, ...]]:
    """Write a URDF and the files of its cell; return the cell, and what was said."""
    source = folder / "own.urdf"
    source.write_text(text, encoding="utf-8")
    found = arm_cell(source, flange=flange)
    for name, content in found.files.items():
        (folder / name).write_text(content, encoding="utf-8")
    assert list(found.files) == ["own.toml", "own-cylinders.urdf"]
    return load_cell(folder / "own.toml"), found.notes


@pytest.mark.parametrize("name", ["irb120", "ur5e"])
def test_limits_speeds_and_solids_are_those_of_the_urdf(tmp_path: Path, name: str) -> None:
    text = read_urdf(name)
    cell, notes = written(tmp_path, text.replace('"tool0"', '"hand"'), flange="hand")
    arm, own = Arm(cell.robot, T_flange_tool=np.eye(4)), load_cell("ur5e" if name == "ur5e" else None)

    joints = np.random.default_rng(2).uniform(-2.0, 2.0, (20, 6))
    np.testing.assert_allclose(
        arm.flange_poses(joints), Arm(own.robot, T_flange_tool=np.eye(4)).flange_poses(joints), atol=1e-9
    )
    if name == "irb120":
        np.testing.assert_allclose(cell.robot.limits, own.robot.limits)
    np.testing.assert_allclose(cell.robot.speeds, own.robot.speeds)
    for found, wanted in zip(link_solids("own", urdf=cell.robot.urdf, flange="hand"), link_solids(name), strict=True):
        np.testing.assert_allclose(
            [each.start for each in found.solids], [each.start for each in wanted.solids], atol=1e-6
        )
        assert [each.end_radius for each in found.solids] == pytest.approx([each.end_radius for each in wanted.solids])
    assert notes[0] == "inverse kinematics: in closed form."


def test_at_home_the_nozzle_points_down_over_the_part_with_the_links_above_the_foot(tmp_path: Path) -> None:
    cell, _ = written(tmp_path, read_urdf("ur5e"))
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    tip, frames = arm.tool_poses(cell.robot.home[None])[0], arm.link_poses(cell.robot.home[None])[0]

    assert tip[2, 2] == pytest.approx(-1.0, abs=1e-4)
    np.testing.assert_allclose(tip[:2, 3], cell.demo_position[:2], atol=2.0)
    assert tip[2, 3] == pytest.approx(cell.demo_position[2] + 150.0, abs=2.0)
    assert frames[2:7, 2, 3].min() > 100.0


def test_what_no_urdf_says_is_assumed_or_asked_for_before_a_plan(tmp_path: Path) -> None:
    cell, notes = written(tmp_path, read_urdf("ur5e"))

    np.testing.assert_allclose(cell.robot.accelerations, cell.robot.speeds / 0.4, rtol=1e-3)
    assert "an ASSUMPTION" in (tmp_path / "own.toml").read_text(encoding="utf-8")
    assert "payload_kg and wrist_inertia_kg_m2" in notes[-1]
    with pytest.raises(UsageError, match=r"the flange load of the own-cylinders\.urdf is unknown"):
        check_load(cell.tool, Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool))


MESH = """<collision><origin xyz="0 0 0.1"/>
  <geometry><mesh filename="package://own/meshes/{file}" {scale}/></geometry></collision>"""


def with_mesh(file: str, *, scale: str = 'scale="0.001 0.001 0.001"') -> str:
    text = read_urdf("irb120")
    first, last = text.index('<link name="link_1">'), text.index("<!-- Both sides of the lower arm")
    return f'{text[:first]}<link name="link_1">{MESH.format(file=file, scale=scale)}</link>{text[last:]}'


def test_a_mesh_is_contained_by_the_smaller_of_the_cylinders_around_it(tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    save_ply(box([0.0, -30.0, -20.0], [240.0, 30.0, 20.0]), tmp_path / "meshes" / "one.ply")
    cell, notes = written(tmp_path, with_mesh("one.ply"))

    (solid,) = link_solids("own", urdf=cell.robot.urdf)[1].solids
    # Half the diagonal of 60 x 40 mm, along the 240 mm, 100 mm up.
    assert solid.start_radius == pytest.approx(np.hypot(30.0, 20.0), rel=0.01)
    assert solid.start_radius >= np.hypot(30.0, 20.0)
    assert solid.length == pytest.approx(240.0, abs=1e-3)
    np.testing.assert_allclose(np.abs(solid.axis), [1.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(solid.centre, [120.0, 0.0, 100.0], atol=0.5)
    assert notes[1] == "link_1: 1 collision mesh contained by cylinders, the widest 72 mm wide and 240 mm long."


def test_all_shapes_that_cannot_be_read_are_listed(tmp_path: Path) -> None:
    text = (
        with_mesh("none.stl")
        .replace('<link name="link_6">', '<link name="link_6"><!--')
        .replace('</link>\n  <link name="tool0"/>', '--></link>\n  <link name="tool0"/>')
    )
    with pytest.raises(
        UsageError, match=r"2 reasons\. \(1\) .*link_1: the mesh .*none\.stl is not .*\(2\) .*link_6 has no"
    ):
        written(tmp_path, text)


def test_an_arm_without_a_closed_form_is_served_by_iteration_which_is_said(tmp_path: Path) -> None:
    shape = '<link name="{}"><collision><geometry><sphere radius="0.03"/></geometry></collision></link>'
    text = offset_wrist().urdf or ""
    for link in ("foot", *(f"piece_{joint}" for joint in range(1, 7))):
        text = text.replace(f'<link name="{link}"/>', shape.format(link))
    cell, notes = written(tmp_path, text)

    assert notes[0].startswith(
        "inverse kinematics: by iteration, which may miss solutions: axes 4, 5 and 6 do not meet"
    )
    assert Arm(cell.robot, T_flange_tool=np.eye(4)).closed_form is None


def test_an_arm_that_cannot_hold_its_nozzle_down_is_refused(tmp_path: Path) -> None:
    text = read_urdf("irb120").replace('upper="2.0943951023931953"', 'upper="-2.0"')
    with pytest.raises(UsageError, match="holds its nozzle down nowhere ahead of it"):
        written(tmp_path, text)
