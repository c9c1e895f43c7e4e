"""Tables that a person fills in at the robot: what is read, and what is refused by row and column."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geoprint import transforms
from geoprint.config import load_cell
from geoprint.errors import InputError
from geoprint.robot.arm import Arm
from geoprint.workflow.number_tables import read_flange_poses, read_points


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_points_are_read_with_comments_spaces_and_another_order_of_rows(tmp_path: Path) -> None:
    path = written(tmp_path, "p.csv", "# read off the pendant\nName, X, Y, Z\n\nb , 1, 2.5, -3e0\n a,0,0,0\n")
    found = read_points(path)
    assert found.names == ("b", "a")
    np.testing.assert_array_equal(found.places, [[1.0, 2.5, -3.0], [0.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "p.csv is empty"),
        ("x,y,z\n1,2,3\n", "first row must name the columns name,x,y,z, found 'x,y,z'"),
        ("name,x,y,z\na,1,2\n", "line 2: found 3 cells separated by commas, but the header names 4 columns"),
        ("name,x,y,z\na,1,2,3\n\nb,1,two,3\n", "line 4, column y: found 'two'"),
        ("name,x,y,z\na,1,2,nan\n", "line 2, column z: found 'nan'"),
        ("name,x,y,z\na,1,2,1e9\n", "line 2, column z: found '1e9'"),
        ("name,x,y,z\n,1,2,3\n", "line 2, column name: found ''"),
        ("name,x,y,z\n\x1b[2J,1,2,3\n", "line 2, column name"),
        ('name,x,y,z\n"a,1,2,3\n', "line 2 cannot be read as a row of a table .* check its quotes"),
        ("name,x,y,z\n" + 10_001 * "a,1,2,3\n", "more than 10000 rows, which is the most"),
        (1_000_001 * " ", "p.csv has 1,000,001 bytes, a table of points has at most 1,000,000"),
    ],
)
def test_a_wrong_table_is_refused_by_row_and_column(tmp_path: Path, text: str, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        read_points(written(tmp_path, "p.csv", text))


def test_a_table_that_is_absent_or_binary_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"absent\.csv` cannot be read"):
        read_points(tmp_path / "absent.csv")
    (tmp_path / "b.csv").write_bytes(b"name,x,y,z\x00\xff")
    with pytest.raises(InputError, match=r"b\.csv, line 1: it holds a zero byte"):
        read_points(tmp_path / "b.csv")


def test_flange_poses_are_read_as_quaternions_or_as_joint_angles(tmp_path: Path) -> None:
    robot = load_cell(None).robot
    joints = np.array([[0.0, 10.0, 20.0, 5.0, 60.0, 30.0], [15.0, 20.0, 10.0, -5.0, 50.0, 80.0]])
    wanted = Arm(robot, T_flange_tool=np.eye(4)).flange_poses(np.radians(joints))
    rows = "".join(",".join(map(str, row)) + "\n" for row in joints.tolist())
    found = read_flange_poses(written(tmp_path, "j.csv", f"j1,j2,j3,j4,j5,j6\n{rows}"), robot=robot)
    np.testing.assert_allclose(found, wanted)
    numbers = np.column_stack([wanted[:, :3, 3], transforms.quaternion_of(wanted[:, :3, :3])]).tolist()
    rows = "".join(",".join(f"{value:.8f}" for value in row) + "\n" for row in numbers)
    found = read_flange_poses(written(tmp_path, "q.csv", f"x,y,z,q1,q2,q3,q4\n{rows}"), robot=robot)
    np.testing.assert_allclose(found, wanted, atol=1e-6)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("x,y,z,q1,q2,q3,q4\n0,0,0,1,0,0,0.1\n", r"line 2, column q1 to q4: the quaternion has length 1\.0050"),
        ("x,y,z,q1,q2,q3,q4\n0,0,0,0,0,0,0\n", r"length 0\.0000"),
        ("x,y,z\n1,2,3\n", "x,y,z,q1,q2,q3,q4 or j1,j2,j3,j4,j5,j6"),
        ("j1,j2,j3,j4,j5,j6\n1,2,3,4,5\n", "line 2: found 5 cells separated by commas, but the header names 6 columns"),
    ],
)
def test_a_wrong_table_of_poses_is_refused_by_row(tmp_path: Path, text: str, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        read_flange_poses(written(tmp_path, "p.csv", text), robot=load_cell(None).robot)
