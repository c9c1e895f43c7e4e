"""The tables: their columns, that they read back equal, and that damage is named."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import InputError, VerificationError
from geoprint.model import Trajectory
from geoprint.postprocessor.tables import (
    poses_table,
    read_poses_table,
    read_trajectory_table,
    trajectory_table,
    verify_poses_table,
    verify_trajectory_table,
)
from tests.postprocessor.export_cases import orders, stream


def trajectory(rows: int = 50) -> Trajectory:
    times = np.arange(rows, dtype=np.float64) * 0.001
    return Trajectory(
        times=times,
        joints=np.sin(times[:, None] * 7 + np.arange(6)),
        runs=np.where(np.arange(rows) < 5, -1, np.arange(rows) // 20),
        deposit=np.arange(rows) % 7 > 2,
        pose_times=times[::5],
        stretched=0,
        slowest_deposit=20.0,
        slowdowns=(),
        share_at_speed=1.0,
        share_on_ramps=0.0,
    )


def test_poses_have_the_columns_and_decimals_of_the_design() -> None:
    lines = poses_table(stream()).decode("ascii").split("\n")
    assert lines[0] == "run,layer,level,deposit,x,y,z,qw,qx,qy,qz,nx,ny,nz,s,flow"
    assert lines[1] == (
        "0,0,-1,0,10.000000,0.000000,5.300000,0.000000000,0.995004165,0.000000000,0.099833417,"
        "-0.198669331,0.000000000,0.980066578,0.000000,0.000000000"
    )
    assert lines[-1] == ""


def test_the_trajectory_has_the_columns_and_decimals_of_the_design() -> None:
    lines = trajectory_table(trajectory()).decode("ascii").split("\n")
    assert lines[0] == "t,q1,q2,q3,q4,q5,q6,deposit,run"
    assert lines[1] == "0.000,0.000000000,0.841470985,0.909297427,0.141120008,-0.756802495,-0.958924275,0,-1"
    assert lines[50].startswith("0.049,")


def test_deposit_rows_hold_the_point_on_the_surface_and_travel_rows_the_tip(tmp_path: Path) -> None:
    poses = stream()
    path = tmp_path / "poses.csv"
    path.write_bytes(poses_table(poses))
    table = read_poses_table(path)
    tips = table.points + np.where(table.deposit, 0.3, 0.0)[:, None] * table.normals
    np.testing.assert_allclose(tips, poses.tips, atol=1e-6)
    assert not np.allclose(table.points[table.deposit], poses.tips[poses.deposit])


def test_a_closed_run_repeats_its_first_point_at_its_end(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_bytes(poses_table(stream()))
    table = read_poses_table(path)
    run = table.points[table.deposit & (table.runs == 1)]
    np.testing.assert_array_equal(run[0], run[-1])


def test_poses_read_back_equal_to_the_last_decimal(tmp_path: Path) -> None:
    poses = stream(runs=3, points=3000)
    path = tmp_path / "poses.csv"
    path.write_bytes(poses_table(poses))
    table = read_poses_table(path)
    for found, planned in [
        (table.runs, poses.runs), (table.layers, poses.layers), (table.levels, poses.levels),
        (table.deposit, poses.deposit),
    ]:  # fmt: skip
        np.testing.assert_array_equal(found, planned)
    np.testing.assert_allclose(table.quaternions, poses.quaternions, atol=5.1e-10)
    np.testing.assert_allclose(table.arcs, poses.arcs, atol=5.1e-7)
    np.testing.assert_allclose(table.flow, poses.flow, atol=5.1e-10)
    verify_poses_table(path, poses)


def test_a_trajectory_reads_back_equal_to_the_last_decimal(tmp_path: Path) -> None:
    planned = trajectory(20_000)
    path = tmp_path / "trajectory.csv"
    path.write_bytes(trajectory_table(planned))
    table = read_trajectory_table(path)
    np.testing.assert_allclose(table.times, planned.times, atol=1e-9)
    np.testing.assert_allclose(table.joints, planned.joints, atol=5.1e-10)
    np.testing.assert_array_equal(table.deposit, planned.deposit)
    np.testing.assert_array_equal(table.runs, planned.runs)
    verify_trajectory_table(path, planned)


def test_no_minus_zero_is_written() -> None:
    poses = stream()
    tips = poses.tips.copy()
    tips[0, 1] = -1e-12
    assert b"-0.000000," not in poses_table(replace(poses, tips=tips))


def test_times_between_milliseconds_are_refused() -> None:
    with pytest.raises(InputError, match="whole milliseconds"):
        trajectory_table(replace(trajectory(), times=np.arange(50) * 0.0015))


@given(st.lists(st.floats(-1e4, 1e4), min_size=18 * 3, max_size=18 * 3))
@settings(max_examples=30, deadline=None)
def test_any_tips_are_verified_as_written(tmp_path_factory: pytest.TempPathFactory, numbers: list[float]) -> None:
    poses = replace(stream(), tips=np.array(numbers).reshape(18, 3))
    path = tmp_path_factory.mktemp("tables") / "poses.csv"
    path.write_bytes(poses_table(poses))
    verify_poses_table(path, poses)


def edit(row: int, column: int, text: str) -> Callable[[str], str]:
    def change(table: str) -> str:
        lines = table.split("\n")
        cells = lines[row].split(",")
        cells[column] = text
        lines[row] = ",".join(cells)
        return "\n".join(lines)

    return change


def swap(pattern: str, by: str) -> Callable[[str], str]:
    return lambda table: re.sub(pattern, by, table)


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (swap("qw", "w"), "the columns are"),
        (swap("\n", "\r\n"), "the columns are"),
        (swap(r"\n\Z", ""), "cut off"),
        (swap(r"(?<=flow\n)(.|\n)*", ""), "cut off"),
        (swap(r"(?<=\n).*\n\Z", ""), "has 17 rows, the plan has 18"),
        (swap("\n", "\n\n"), "in 37 rows"),
        (edit(4, 5, "nan"), "row 4: y is not finite"),
        (edit(4, 5, "inf"), "row 4: y is not finite"),
        (edit(4, 5, "eight"), "eight"),
        (edit(4, 5, "1,2"), "number of columns"),
        (edit(4, 3, "2"), "row 4: deposit is 2.0"),
        (edit(4, 0, "0.5"), "row 4: run is 0.5"),
        (edit(4, 0, "1"), "row 4: run is 1.0, the plan has 0.0"),
        (edit(4, 4, "-5.062001"), "row 4: x is"),
        (edit(4, 8, "0.5"), "row 4: qx is"),
        (edit(4, 15, "0.500000001"), "row 4: flow is"),
    ],
)  # fmt: skip
def test_a_damaged_table_is_refused_with_row_and_column(
    tmp_path: Path, damage: Callable[[str], str], reason: str
) -> None:
    poses = stream()
    text = poses_table(poses).decode("ascii")
    path = tmp_path / "poses.csv"
    path.write_bytes(damage(text).encode())
    assert damage(text) != text
    with pytest.raises(VerificationError, match=r"poses\.csv") as caught:
        verify_poses_table(path, poses)
    assert reason in str(caught.value)


def test_a_trajectory_that_lost_a_row_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "trajectory.csv"
    path.write_bytes(trajectory_table(trajectory(49)))
    with pytest.raises(VerificationError, match="49 rows, the plan has 50"):
        verify_trajectory_table(path, trajectory(50))


def test_a_missing_table_is_named(tmp_path: Path) -> None:
    with pytest.raises(VerificationError, match="cannot be read"):
        read_poses_table(tmp_path / "poses.csv")


# What a path orders of the arm and the dispenser, target by target.


RADIUS = 20.0


@pytest.mark.parametrize("bulging", [True, False])
def test_a_flow_is_by_the_length_that_the_tip_moves_and_lays_what_is_planned_by_that_of_the_surface(
    *, bulging: bool
) -> None:
    poses = stream(points=40)
    angles = np.linspace(0.0, 1.5, poses.count)
    normals = np.column_stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)])
    away = RADIUS + poses.standoff if bulging else RADIUS - poses.standoff
    outward = normals if bulging else -normals
    round_a_cylinder = replace(poses, tips=away * normals, normals=outward)
    found = orders(round_a_cylinder)
    assert found.deposited.any()
    np.testing.assert_allclose(found.flow[found.deposited], 0.5 * RADIUS / away, rtol=1e-9)
    assert not found.flow[~found.deposited].any()
