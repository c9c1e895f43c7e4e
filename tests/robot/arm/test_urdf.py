"""URDF files that somebody gives: what is read, and every refusal with the file and the defect."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of, load_cell, packaged_cell_text
from geoprint.errors import UsageError
from geoprint.robot.arm.kinematics import Arm
from geoprint.robot.arm.urdf import LARGEST_FILE, chain_of, read_urdf, read_urdf_file
from geoprint.robot.collision.tool_solids import link_solids
from geoprint.workflow import plan
from tests.robot.arms import offset_wrist
from tests.shared_data import shared

JAW = '<joint name="jaw" type="prismatic"><parent link="tool0"/><child link="grip"/></joint>'


def cell_with(tmp_path: Path, text: str, *, keys: str = "") -> Path:
    """Write a URDF and, in the folder beside it, a cell that names it; return the cell."""
    (tmp_path / "arms").mkdir()
    (tmp_path / "arms" / "own.urdf").write_text(text, encoding="utf-8")
    cell = tmp_path / "cells" / "cell.toml"
    cell.parent.mkdir()
    named = f'urdf = "../arms/own.urdf"\n{keys}'
    cell.write_text(packaged_cell_text("irb120-bent45").replace('arm = "irb120"', named, 1), encoding="utf-8")
    return cell


def test_the_cell_names_the_urdf_of_its_arm_from_where_it_lies_itself(tmp_path: Path) -> None:
    text = read_urdf("irb120").replace('xyz="0.302 0 0"', 'xyz="0.402 0 0"').replace("tool0", "hand")
    cell = load_cell(cell_with(tmp_path, text, keys='flange = "hand"'))
    arm = Arm(cell.robot, T_flange_tool=np.eye(4))
    np.testing.assert_allclose(arm.flange_poses(np.zeros((1, 6)))[0, :3, 3], [474.0, 0.0, 630.0], atol=1e-9)
    assert cell.robot.model == "own.urdf"
    assert cell.robot.load is not None
    assert cell.robot.load.mass_kg == 3.0


def test_a_cell_may_not_allow_more_than_its_urdf(tmp_path: Path) -> None:
    text = read_urdf("irb120").replace('upper="2.0943951023931953"', 'upper="2.0"')
    cell = load_cell(cell_with(tmp_path, text))
    with pytest.raises(UsageError, match=r"allows the own\.urdf more than its maker: joint 5"):
        Arm(cell.robot, T_flange_tool=np.eye(4))


def test_a_chain_is_found_whatever_the_order_of_its_joints() -> None:
    text = read_urdf("irb120")
    first = text.index('  <joint name="joint_1"')
    last = text.index('  <joint name="joint_6" ')
    turned = text[:first] + text[last:].replace("</robot>", text[first:last] + "</robot>")
    found, wanted = (chain_of(each, name="turned", flange="tool0") for each in (turned, text))
    assert (found.base, found.links) == (wanted.base, wanted.links)
    for field in ("origins", "axes", "T_link_flange", "limits", "speeds"):
        np.testing.assert_array_equal(getattr(found, field), getattr(wanted, field))
    given, known = link_solids("turned", urdf=turned), link_solids("irb120")
    assert [link.name for link in given] == [link.name for link in known]
    assert [len(link.solids) for link in given] == [len(link.solids) for link in known]


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('<?xml version="1.0"?>', '<!DOCTYPE robot [<!ENTITY a "b">]>', "holds '<!DOCTYPE'"),
        ("</robot>", "<!-- <!entity x --></robot>", "holds '<!ENTITY'"),
        ("</robot>", "", "not valid XML"),
        ('<robot name="irb120">', "<sdf>", "not valid XML"),
        ('<child link="link_2"/>', "", "joint 'joint_2' names no child"),
        ('<child link="link_2"/>', '<child link="link_1"/>', "'link_1' hangs on two joints"),
        ('name="joint_4" type="revolute"', 'name="joint_4" type="continuous"', r"joint_4 \(continuous\).*six"),
        ('name="joint_4" type="revolute"', 'name="joint_4" type="fixed"', "by 5 joints"),
        ("</robot>", f'<link name="grip"/>{JAW}</robot>', "joint 'jaw' of type prismatic beside"),
        ('upper="2.792526803190927"', 'upper="-3"', "joint 'joint_4' needs a <limit>.*upper -3"),
        ('velocity="7.330382858376184"', 'velocity="fast"', "joint 'joint_6' needs a <limit>"),
        ('velocity="7.330382858376184"', "", "joint 'joint_6' needs a <limit>"),
        (
            '<parent link="base_link"/>',
            '<parent link="link_6"/>',
            "leads from 'tool0' to 'link_6', which is not a base",
        ),
        ('<link name="base_link">', '<link name="ground">', "to 'base_link', which is not a base"),
        ('xyz="0.302 0 0"', 'xyz="0.302 0"', "joint 'joint_5' has xyz '0.302 0', which is not three finite"),
        ('xyz="0.302 0 0"', 'xyz="far 0 0"', "joint 'joint_5' has xyz 'far 0 0', which is not three finite"),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>', "joint 'joint_1' has an axis of length 0"),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 nan 0"/>', "joint 'joint_1' has xyz '0 nan 0', which is not three"),
    ],
)
def test_a_damaged_urdf_is_refused_by_file_and_defect(tmp_path: Path, old: str, new: str, reason: str) -> None:
    text = read_urdf("irb120")
    assert old in text
    with pytest.raises(UsageError, match=rf"cell\.toml: .*own\.urdf.*(?:{reason})"):
        load_cell(cell_with(tmp_path, text.replace(old, new)))


def test_another_root_is_no_urdf() -> None:
    with pytest.raises(UsageError, match="starts with <sdf>"):
        chain_of("<sdf/>", name="own.sdf", flange="tool0")


def test_a_missing_flange_is_named_with_the_links_there_are() -> None:
    with pytest.raises(UsageError, match=r"no link 'hand' .*link_6, tool0.*robot\.flange"):
        chain_of(read_urdf("irb120"), name="irb120", flange="hand")


def test_a_file_too_long_or_of_another_encoding_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "own.urdf"
    path.write_bytes(b" " * (LARGEST_FILE + 1))
    with pytest.raises(UsageError, match=r"own\.urdf is longer than"):
        read_urdf_file(path, flange="tool0")
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(UsageError, match=r"own\.urdf cannot be read"):
        read_urdf_file(path, flange="tool0")


def test_all_that_cannot_be_served_is_listed_at_once(tmp_path: Path) -> None:
    text = read_urdf("irb120").replace('name="joint_4" type="revolute"', 'name="joint_4" type="prismatic"')
    text = text.replace('velocity="7.330382858376184"', "").replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>')
    found = r"for 3 reasons\. \(1\) .*no link 'hand'.*\(2\) .*joint_1.*axis of length 0.*\(3\) .*joint_6.*<limit>"
    with pytest.raises(UsageError, match=found):
        load_cell(cell_with(tmp_path, text, keys='flange = "hand"'))


def test_joints_of_other_kinds_and_missing_limits_are_listed_together() -> None:
    text = read_urdf("irb120").replace('name="joint_4" type="revolute"', 'name="joint_4" type="prismatic"')
    text = text.replace('velocity="7.330382858376184"', "")
    with pytest.raises(UsageError, match=r"for 2 reasons\. \(1\) .*joint_4 \(prismatic\).*\(2\) .*'joint_6' needs a"):
        chain_of(text, name="own.urdf", flange="tool0")


def test_no_program_is_planned_for_an_arm_that_rapid_does_not_know(tmp_path: Path) -> None:
    text = offset_wrist().urdf
    assert text is not None
    cell = cell_with(tmp_path, text.replace('velocity="3"', 'velocity="9"').replace("6.28", "9.28"))
    part = Path(__file__).parents[3] / "data" / "plate.ply"
    job = job_of(surface=part, unit="mm", spacing=5.0, cell=cell, place="demo")
    with pytest.raises(
        UsageError, match=r"a RAPID program .*own\.urdf: axes 4, 5 and 6 do not meet.*axes 3 and 4.*--no-robot"
    ):
        plan(job)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("arm.urdf.xacro", "<robot name='a'/>"),
        ("arm.urdf", "<robot name='a' xmlns:xacro='http://ros.org/wiki/xacro'><xacro:arm prefix=''/></robot>"),
        ("arm.xml", "<robot name='a'><link name='${prefix}base'/></robot>"),
    ],
)
def test_macros_are_named_with_the_command_that_expands_them(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    command = re.escape(f"`xacro {name} > arm_expanded.urdf`")
    with pytest.raises(UsageError, match=rf"robot\.urdf: {re.escape(name)} is xacro, .* expand it with {command}"):
        read_urdf_file(tmp_path / name, flange="tool0")


def test_a_file_that_xacro_has_expanded_is_read(tmp_path: Path) -> None:
    # It keeps the name space and tells of xacro in a comment.
    text = read_urdf("irb120").replace(
        "<robot ", '<!-- made by xacro --><robot xmlns:xacro="http://ros.org/wiki/xacro" '
    )
    assert "xmlns:xacro" in text
    (tmp_path / "arm.urdf").write_text(text)
    assert read_urdf_file(tmp_path / "arm.urdf", flange="tool0") == text


def test_the_macro_of_the_field_is_named_as_xacro() -> None:
    with pytest.raises(UsageError, match=r"k16_macro\.xacro is xacro"):
        read_urdf_file(shared("field/k16_macro.xacro"), flange="tool0")
