"""Clouds as text: any separator, header and count; what stands in a line that is no point is refused with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import InputError, UsageError
from geoprint.geometry import face_areas
from geoprint.geometry.files import load_file
from geoprint.geometry.files.point_clouds import read_point_text
from geoprint.model import FloatArray
from geoprint.reporting import inspection_text
from geoprint.workflow import inspect_file
from tests.shared_data import shared

ROWS = np.array([[1.5, -2.25, 3.0], [4.0, 5.5, -6.125], [7.0, 8.0, 9.5], [0.5, 0.25, 0.125]])
WORDS = [[f"{value:g}" for value in row] for row in ROWS.tolist()]


def lines(separator: str, *, comma: bool = False, more: str = "", head: str = "") -> str:
    text = "".join(separator.join([*row, *([more] if more else [])]) + "\n" for row in WORDS)
    return head + (text.replace(".", ",") if comma else text)


@pytest.mark.parametrize(
    ("text", "skipped"),
    [
        (lines(" "), {}),
        (lines("\t"), {}),
        (lines(","), {}),
        (lines(", "), {}),
        (lines(";"), {}),
        (lines(";", comma=True), {}),
        (lines("  ", comma=True), {}),
        (lines("\t", comma=True), {}),
        (lines(" ", head="x y z\n"), {}),
        (lines(",", head="X,Y,Z\n"), {}),
        (lines(" ", head="//X Y Z\n"), {"comments and empty lines": 1}),
        (lines(" ", head="# a scan\n\n"), {"comments and empty lines": 2}),
        (lines(" ", head="4\n"), {}),
        (lines(" ", more="17 200 200 200", head="4\n"), {"unused columns": 4}),
        (lines(",", more="9", head='x,y,z,"intensity"\n'), {"unused columns (intensity)": 1}),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_the_same_points_are_read_in_whatever_way_they_are_written(
    text: str, skipped: dict[str, int], encoding: str
) -> None:
    for end in ("\n", "\r\n"):
        cloud = read_point_text(text.replace("\n", end).encode(encoding), name="a.xyz")
        np.testing.assert_array_equal(cloud.points, ROWS)
        assert {kind: count for kind, count in cloud.skipped.items() if count} == skipped
        assert cloud.assumed == (
            ("decimal commas",) if (",5" in text and ";" in text) or ",5 " in text or ",5\t" in text else ()
        )


def test_a_header_names_columns_in_any_order_with_normals_and_unit() -> None:
    text = "nz;ny;nx;z [cm];label;y [cm];x [cm]\n" + "".join(f"1;0;0;{z:g};a;{y:g};{x:g}\n" for x, y, z in ROWS)
    with pytest.raises(InputError, match="line 2, column 5: found 'a'"):
        read_point_text(text.encode(), name="a.csv")
    cloud = read_point_text(text.replace(";a;", ";7;").encode(), name="a.csv")
    np.testing.assert_array_equal(cloud.points, ROWS)
    assert cloud.unit == "cm"
    assert cloud.normals is not None
    assert cloud.normals.tolist() == [[0.0, 0.0, 1.0]] * 4


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (lines(" ", head="5\n"), "says that 5 points follow, and 4 do"),
        (lines(" ", head="a b c\n"), "has the columns a, b, c; points need one each of x, y and z"),
        (lines(" ") + "1 2\n", "line 5: found 2 cells"),
        (lines(" ") + "1 2 3x\n", "line 5, column 3: found '3x'"),
        (lines(" ", head="x_mm y_mm z_m\n"), "points need one each of x, y and z in one unit"),
    ],
)
def test_a_line_that_is_no_point_is_refused(text: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        read_point_text(text.encode(), name="a.xyz")


def cap(step: float, across: float) -> FloatArray:
    """Return points of a cap of a sphere of 30 mm, in lines across y with a step along x [mm]."""
    x, y = np.meshgrid(np.arange(-22.0, 22.01, step), np.arange(-22.0, 22.01, across), indexing="xy")
    points = np.column_stack([x.ravel(), y.ravel()])
    points = points[np.linalg.norm(points, axis=1) <= 22.0]
    return np.column_stack([points, np.sqrt(900.0 - (points**2).sum(axis=1))])


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
def test_lines_of_a_scanner_become_the_surface_they_cross_and_the_file_says_it_was_rebuilt(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "lines.pts", cap(0.1, 1.5), fmt="%.4f")
    seen = inspect_file(tmp_path / "lines.pts", unit="mm")
    text = inspection_text(seen)
    assert "lines of a scanner, gathered to" in text
    assert "assumed: a surface rebuilt from the points, which lie" in text
    surface = load_file(tmp_path / "lines.pts", unit="mm").surface
    off = np.abs(np.linalg.norm(surface.vertices, axis=1) - 30.0)
    assert off.mean() < 0.05
    assert off.max() < 0.2
    # The cap within 22 mm of the axis.
    assert face_areas(surface).sum() == pytest.approx(2.0 * np.pi * 30.0 * (30.0 - np.sqrt(900.0 - 484.0)), rel=0.06)


@pytest.mark.parametrize("name", ["a.xyz", "a.ply"])
def test_a_wrong_or_missing_unit_is_named_before_anything_is_made_of_points(tmp_path: Path, name: str) -> None:
    # Points that fill a block would be refused as no surface, and too few for one.
    points = np.random.default_rng(0).uniform(0.0, 0.04, (150, 3))
    if name.endswith("ply"):
        axes = "".join(f"property float {axis}\n" for axis in "xyz")
        header = f"ply\nformat ascii 1.0\nelement vertex 150\n{axes}end_header\n"
        (tmp_path / name).write_text(header + "\n".join(" ".join(map(str, row)) for row in points.tolist()) + "\n")
    else:
        np.savetxt(tmp_path / name, points)
    with pytest.raises(InputError, match=r"large in mm, .*it would be .* mm with `--unit m`"):
        load_file(tmp_path / name, unit="mm")
    with pytest.raises(UsageError, match=r"has no unit; .* run again with `--unit m`"):
        load_file(tmp_path / name, unit=None)


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
@pytest.mark.parametrize("name", ["k13_header.xyz", "k13_linescan.xyz"])
def test_the_clouds_of_the_field_lie_on_their_sphere(name: str) -> None:
    surface = load_file(shared(f"field/{name}"), unit="mm").surface
    assert np.abs(np.linalg.norm(surface.vertices, axis=1) - 30.0).mean() < 0.05
