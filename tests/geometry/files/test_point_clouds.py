"""Point clouds: the surface lies where the points were sampled, ends where they end, and says its residual."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from geoprint.errors import InputError, UsageError
from geoprint.geometry import closest, describe, face_areas, face_normals, prepare
from geoprint.geometry.files import load, load_file, point_clouds
from geoprint.geometry.files.point_clouds import estimated_normals, read_point_text
from geoprint.model import FloatArray, Surface
from geoprint.reporting import inspection_text
from geoprint.workflow import inspect_file
from tests.geometry.files.lasting_worker import LastingWorker
from tests.meshes import sphere, spherical_cap
from tests.shared_data import shared

NOISE = 0.05


def sampled(surface: Surface, count: int, *, noise: float = NOISE) -> FloatArray:
    """Return points at random on a surface, each moved at random in every direction."""
    random = np.random.default_rng(0)
    areas = face_areas(surface)
    faces = random.choice(len(areas), count, p=areas / areas.sum())
    weights = random.dirichlet([1.0, 1.0, 1.0], count)
    return np.einsum("kc,kcx->kx", weights, surface.vertices[surface.faces[faces]]) + random.normal(
        0.0, noise, (count, 3)
    )


def saved(path: Path, table: FloatArray) -> Path:
    np.savetxt(path, table, fmt="%.6f")
    return path


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
def test_a_noisy_cap_becomes_the_cap(tmp_path: Path) -> None:
    cap = spherical_cap(radius=30.0, angle=0.5, rings=40)
    loaded = load_file(saved(tmp_path / "cap.xyz", sampled(cap, 2000)), unit="mm")
    surface, report = prepare(loaded.surface)
    assert report.topology == "disc"
    assert closest(cap, surface.vertices)[1].mean() < NOISE / 2
    assert report.area == pytest.approx(float(face_areas(cap).sum()), rel=0.05)
    out = np.einsum("mx,mx->m", face_normals(surface), surface.vertices[surface.faces].mean(axis=1))
    assert (out > 0.0).all()
    notes = dict(loaded.notes)
    assert notes["reconstructed_from_points"] == 2000
    assert notes["normals"] == "estimated"
    assert 0.5 * NOISE < float(notes["residual_mean"]) < 1.2 * NOISE


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
@pytest.mark.parametrize("kind", ["xyz", "pwn", "ascii.ply", "binary.ply"])
def test_normals_are_taken_from_every_kind_of_file_and_closed_scans_are_closed(tmp_path: Path, kind: str) -> None:
    points = sampled(sphere(radius=20.0, subdivisions=4), 3000, noise=0.01)
    table = np.column_stack([points, points / np.linalg.norm(points, axis=1, keepdims=True)])
    path = tmp_path / f"ball.{kind}"
    if kind.endswith("ply"):
        names = "".join(f"property double {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
        form = "ascii" if kind.startswith("ascii") else "binary_little_endian"
        header = f"ply\nformat {form} 1.0\nelement vertex {len(table)}\n{names}end_header\n".encode()
        text = "".join(" ".join(f"{value:.9f}" for value in row) + "\n" for row in table.tolist()).encode()
        path.write_bytes(header + (text if form == "ascii" else table.astype("<f8").tobytes()))
    else:
        saved(path, table)
        if kind == "pwn":
            path.write_text(f"{len(table)}\n" + path.read_text())
    loaded = load_file(path, unit="mm")
    assert dict(loaded.notes)["normals"] == "from the file"
    surface, report = prepare(loaded.surface)
    assert report.topology == "closed, genus 0"
    assert np.abs(np.linalg.norm(surface.vertices, axis=1) - 20.0).max() < 0.2


@pytest.mark.needs("open3d")
def test_colours_are_not_taken_for_normals_and_the_same_file_gives_the_same_surface(
    tmp_path: Path, worker: LastingWorker, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = sampled(spherical_cap(radius=30.0, angle=0.4, rings=20), 1000)
    path = saved(tmp_path / "cap.xyz", np.column_stack([points, np.full((len(points), 3), 200.0)]))
    # In a process of its own, as every file is read.
    one = load_file(path, unit="mm")
    monkeypatch.setattr(point_clouds, "run_worker", worker.run)
    other = load_file(path, unit="mm")
    assert dict(one.notes)["normals"] == "estimated"
    assert np.array_equal(one.surface.vertices, other.surface.vertices)
    assert np.array_equal(one.surface.faces, other.surface.faces)


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
def test_a_hole_in_the_scan_stays_a_hole(tmp_path: Path) -> None:
    cap = spherical_cap(radius=30.0, angle=0.5, rings=40)
    points = sampled(cap, 2000)
    around = points[np.linalg.norm(points - cap.vertices[0], axis=1) > 6.0]
    assert describe(prepare(load(saved(tmp_path / "ring.xyz", around), unit="mm"))[0]) == "annulus"


@pytest.mark.needs("open3d")
@pytest.mark.parametrize("count", [300, 1000, 3000])
def test_points_that_fill_a_block_are_refused(tmp_path: Path, count: int) -> None:
    points = np.random.default_rng(1).uniform(0.0, 40.0, (count, 3))
    with pytest.raises(InputError, match="they are too sparse or no surface"):
        load(saved(tmp_path / "block.xyz", points), unit="mm")


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
def test_a_scan_whose_noise_is_as_large_as_its_spacing_is_read(tmp_path: Path) -> None:
    cap = spherical_cap(radius=30.0, angle=0.5, rings=40)
    loaded = load_file(saved(tmp_path / "cap.xyz", sampled(cap, 2000, noise=0.4)), unit="mm")
    assert closest(cap, loaded.surface.vertices)[1].mean() < 0.2


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
def test_a_sheet_with_a_cloud_about_it_is_refused(tmp_path: Path) -> None:
    random = np.random.default_rng(3)
    sheet = random.uniform(0.0, 40.0, (2000, 3)) * [1.0, 1.0, 0.0]
    dust = random.uniform(5.0, 45.0, (300, 3))
    with pytest.raises(InputError, match=r"lie more than .* too sparse or no surface"):
        load(saved(tmp_path / "dusty.xyz", np.vstack([sheet, dust])), unit="mm")


def test_estimated_normals_are_those_of_the_sphere_and_all_on_one_side() -> None:
    points = sampled(sphere(radius=20.0, subdivisions=4), 2000, noise=0.0)
    normals = estimated_normals(points, KDTree(points))
    along = np.einsum("kx,kx->k", normals, points / np.linalg.norm(points, axis=1, keepdims=True))
    assert along.min() > np.cos(np.radians(12.0))


@pytest.mark.needs("open3d")
@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("1 2\n" * 300, "has 2 numbers a line"),
        ("1 2 3\n" * 300, "has 1 distinct point"),
        ("1 2 nan\n" * 300, "NaN or infinite"),
        ("1 2 3\n4 5\n", "line 2: found 2 cells"),
        ("what is this", "has the columns what, is, this; points need one each of x, y and z"),
    ],
)
def test_a_file_without_enough_points_is_refused(tmp_path: Path, content: str, sentence: str) -> None:
    (tmp_path / "a.xyz").write_text(content)
    with pytest.raises(InputError, match=sentence):
        load(tmp_path / "a.xyz", unit="mm")


@pytest.mark.needs("open3d")
@pytest.mark.parametrize(
    ("header", "sentence"),
    [
        (
            "element vertex 900\nproperty float x\nproperty float y\nproperty float z\n",
            "promises 900 of `vertex` in its header, at least 10800 bytes",
        ),
        ("element vertex 3\nproperty float x\nproperty float y\n", "has no vertices with x, y and z"),
        ("element edge 1\nproperty int a\nelement vertex 5\nproperty float x\n", "has no vertices with x, y and z"),
    ],
)
def test_a_ply_of_points_that_lies_is_refused(tmp_path: Path, header: str, sentence: str) -> None:
    text = f"ply\nformat binary_little_endian 1.0\n{header}end_header\n"
    (tmp_path / "a.ply").write_bytes(text.encode() + bytes(24))
    with pytest.raises(InputError, match=sentence):
        load(tmp_path / "a.ply", unit="mm")


def test_a_missing_package_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(name: str) -> None:
        assert name == "open3d"

    path = saved(tmp_path / "a.xyz", sampled(sphere(radius=20.0), 300))
    monkeypatch.setattr(importlib.util, "find_spec", nothing)
    with pytest.raises(UsageError, match=r"pip install -e '.*\[scan\]'"):
        load(path, unit="mm")


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
def test_a_sampled_heart_patch_lies_within_a_twentieth_of_a_millimetre(tmp_path: Path) -> None:
    patch = load(shared("patches/lv_lateral_disc_r15.ply"), unit="mm")
    surface = load(saved(tmp_path / "patch.xyz", sampled(patch, 3000)), unit="mm")
    assert closest(patch, surface.vertices)[1].mean() < 0.05


# Clouds as text: any separator, header and count; what stands in a line that is no point is refused with it.


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
        (lines(" ", head="//X Y Z\n"), {"lines without a point": 1}),
        (lines(" ", head="# a scan\n\n"), {"lines without a point": 2}),
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
        (lines(" ", head="5\n"), "announces 5 points, but holds 4"),
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
