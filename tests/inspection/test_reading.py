"""Scans are read from clouds and meshes; what is no scan is refused in one sentence, before it takes memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import InputError, UsageError
from geoprint.geometry.files import save_ply
from geoprint.inspection import scan as reading
from geoprint.inspection.scan import is_scan, read_scan
from tests.meshes import plate

POINTS = np.random.default_rng(1).uniform(0.0, 30.0, (300, 3))


def cloud(path: Path, *, binary: bool = True, count: int | None = None) -> Path:
    header = f"ply\nformat {'binary_little_endian' if binary else 'ascii'} 1.0\nelement vertex {count or len(POINTS)}\n"
    header += "property float x\nproperty float y\nproperty float z\nend_header\n"
    body = POINTS.astype("<f4").tobytes() if binary else "\n".join(" ".join(map(str, p)) for p in POINTS).encode()
    path.write_bytes(header.encode("ascii") + body)
    return path


@pytest.mark.parametrize("kind", ["binary.ply", "ascii.ply", "lines.xyz", "commas.csv"])
def test_the_points_of_a_cloud_are_read_in_their_unit(tmp_path: Path, kind: str) -> None:
    path = tmp_path / kind
    if path.suffix == ".ply":
        cloud(path, binary=kind == "binary.ply")
    else:
        np.savetxt(path, POINTS, fmt="%.6f", delimiter="," if path.suffix == ".csv" else " ")
    scan = read_scan(path, unit="cm", least=200)
    assert scan.points == pytest.approx(10.0 * POINTS, abs=1e-4)
    assert (scan.name, scan.held, scan.of_mesh, len(scan.digest)) == (kind, 300, False, 64)


def test_points_of_a_mesh_are_spread_over_it(tmp_path: Path) -> None:
    save_ply(plate((40.0, 30.0), (2, 2)), tmp_path / "mesh.ply")
    scan = read_scan(tmp_path / "mesh.ply", unit="mm", least=4)
    assert scan.of_mesh
    assert scan.points.mean(axis=0) == pytest.approx([20.0, 15.0, 0.0], abs=0.1)
    assert len(scan.points) == reading.LEAST_OF_MESH


def test_of_a_large_cloud_some_points_are_kept_the_same_each_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reading, "MOST_POINTS", 100)
    one, other = (read_scan(cloud(tmp_path / "a.ply"), unit="mm", least=12) for _ in range(2))
    assert (len(one.points), one.held) == (100, 300)
    assert np.array_equal(one.points, other.points)


def hostile(folder: Path, kind: str) -> Path:
    path = folder / f"{kind}.ply"
    if kind == "empty":
        path.write_bytes(b"")
    elif kind == "nan":
        path = path.with_suffix(".xyz")
        path.write_text("\n".join(["1 2 3"] * 250 + ["nan 0 0"]), encoding="ascii")
    elif kind == "words":
        path = path.with_suffix(".xyz")
        path.write_text("these are no points\n" * 300, encoding="ascii")
    elif kind == "truncated":
        path.write_bytes(cloud(path).read_bytes()[:-40])
    elif kind == "lying":
        cloud(path, count=4_000_000_000)
    elif kind == "few":
        path = path.with_suffix(".xyz")
        path.write_text("1 2 3\n4 5 6\n", encoding="ascii")
    else:
        path.mkdir()
    return path


@pytest.mark.parametrize(
    ("kind", "complaint"),
    [
        ("empty", "is empty"),
        ("nan", "1 points with NaN or infinite coordinates, the first is point 250"),
        ("words", "has the columns these, are, no, points"),
        ("truncated", "promises 300 of `vertex` in its header"),
        ("lying", "promises 4000000000 of `vertex` in its header"),
        ("few", "holds 2 points, at least 200 are needed"),
        ("folder", "is a directory"),
    ],
)
def test_hostile_files_are_refused(tmp_path: Path, kind: str, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        read_scan(hostile(tmp_path, kind), unit="mm", least=200)


@pytest.mark.parametrize(("suffix", "size"), [(".xyz", reading.LARGEST_TEXT), (".ply", reading.LARGEST_SCAN)])
def test_a_huge_file_is_refused_before_it_is_read(tmp_path: Path, suffix: str, size: int) -> None:
    path = tmp_path / f"huge{suffix}"
    with path.open("wb") as file:
        file.truncate(size + 1)
    with pytest.raises(InputError, match="thin it out"):
        read_scan(path, unit="mm", least=200)


def test_other_files_and_units_are_refused(tmp_path: Path) -> None:
    assert is_scan("a.PLY")
    assert not is_scan("a.png")
    with pytest.raises(InputError, match=r"has the suffix `\.png`"):
        read_scan(tmp_path / "a.png", unit="mm", least=1)
    with pytest.raises(InputError, match="does not exist"):
        read_scan(tmp_path / "gone.xyz", unit="mm", least=1)
    with pytest.raises(UsageError, match="the unit `ell` is not known"):
        read_scan(tmp_path / "a.xyz", unit="ell", least=1)
