"""An arm of one's own looks as its URDF says; what cannot be read is drawn as its collision solids, and said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from geoprint.config import load_cell
from geoprint.geometry.files import save_ply
from geoprint.model import Robot
from geoprint.robot.arm import read_urdf
from geoprint.robot.arm.link_meshes import link_meshes
from tests.reporting.report_cases import box

VISUAL = """<link name="{link}">
    <visual><origin xyz="0 0 0.1" rpy="0 0 1.5707963267948966"/>
      <geometry><mesh filename="{file}" scale="{scale}"/></geometry></visual>"""


def with_visual(*, file: str, scale: str, link: str = "link_1") -> Robot:
    urdf = read_urdf("irb120").replace(f'<link name="{link}">', VISUAL.format(link=link, file=file, scale=scale), 1)
    return replace(load_cell(None).robot, model="own", urdf=urdf)


def cell_in(folder: Path, *, urdf: str) -> Path:
    cell = folder / "cell.toml"
    cell.write_text(f'[robot]\nurdf = "{urdf}"\n', encoding="utf-8")
    return cell


def test_a_mesh_in_millimetres_stands_where_its_origin_says_in_the_package_of_the_urdf(tmp_path: Path) -> None:
    (tmp_path / "arm" / "meshes").mkdir(parents=True)
    block = box([0.0, 0.0, 0.0], [200.0, 100.0, 50.0])
    save_ply(block, tmp_path / "arm" / "meshes" / "one.ply")
    (tmp_path / "arm" / "urdf").mkdir()
    robot = with_visual(file="package://arm/meshes/one.ply", scale="0.001 0.001 0.001")

    meshes, notes = link_meshes(robot, cell=cell_in(tmp_path, urdf="arm/urdf/own.urdf"))

    assert (list(meshes), notes) == ([1], [])
    # Turned by a quarter about z, then 100 mm up.
    np.testing.assert_allclose(meshes[1][0].vertices.min(axis=0), [-100.0, 0.0, 100.0], atol=1e-6)
    np.testing.assert_allclose(meshes[1][0].vertices.max(axis=0), [0.0, 200.0, 150.0], atol=1e-6)


def test_a_mesh_that_cannot_be_read_is_named_with_what_stands_in(tmp_path: Path) -> None:
    (tmp_path / "one.dae").write_text("<COLLADA/>", encoding="ascii")
    for file, scale, said in (("none.stl", "1", "is not there"), ("one.dae", "1", "dae"), ("a.stl", "1 2 1", "scale")):
        meshes, notes = link_meshes(with_visual(file=file, scale=scale), cell=cell_in(tmp_path, urdf="own.urdf"))
        assert meshes == {}
        assert len(notes) == 1
        assert notes[0].startswith("link_1 is drawn as its collision solids: ")
        assert said in notes[0]


def test_an_arm_without_meshes_says_nothing(tmp_path: Path) -> None:
    robot = replace(load_cell(None).robot, urdf=read_urdf("irb120"))
    assert link_meshes(robot, cell=cell_in(tmp_path, urdf="own.urdf")) == ({}, [])
