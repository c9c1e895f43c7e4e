"""Real clouds of points open, and register to themselves moved."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.appraisal.scanned import read_scan, registered
from geoprint.surfaces.files import load
from tests.appraisal.scanned.prints import needs_open3d
from tests.shared_data import shared

CLOUDS = ("cgal_blobby.xyz", "cgal_fin90_with_PCA_normals.xyz", "cgal_kitten.xyz", "cgal_oni.pwn",
          "trimesh_points_cloudcompare.xyz")  # fmt: skip
needs_lagrange = pytest.mark.skipif(importlib.util.find_spec("lagrange") is None, reason="lagrange is not installed")


@pytest.mark.parametrize("name", CLOUDS)
def test_every_cloud_opens(name: str) -> None:
    scan = read_scan(shared(f"clouds/{name}"), unit="mm", least=12)
    assert len(scan.points) == scan.held
    assert np.isfinite(scan.points).all()


@needs_open3d
@needs_lagrange
@pytest.mark.dear
@pytest.mark.parametrize("name", ["cgal_blobby.xyz", "cgal_kitten.xyz", "cgal_oni.pwn"])
def test_a_cloud_registers_to_itself_moved(name: str, tmp_path: Path) -> None:
    points = read_scan(shared(f"clouds/{name}"), unit="mm", least=12).points
    # Their units are nobody's: as large as a part.
    points = 60.0 * (points - points.mean(axis=0)) / np.ptp(points, axis=0).max()
    np.savetxt(tmp_path / "part.xyz", points)
    surface = load(tmp_path / "part.xyz", unit="mm")
    T_work_scan = transforms.rigid(Rotation.from_rotvec([0.05, -0.04, 0.05]).as_matrix(), np.array([4.0, -5.0, 3.0]))
    moved = transforms.apply(transforms.inverse(T_work_scan), points)
    found = registered(moved, surface, None, start=np.eye(4))
    assert np.abs(transforms.apply(found.T_work_scan, moved) - points).max() < 0.2
    assert found.used > 0.8
