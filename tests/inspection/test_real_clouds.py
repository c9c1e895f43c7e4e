"""Real clouds of points open, and register to themselves moved."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError
from geoprint.geometry.files import load
from geoprint.inspection.scan import read_scan
from geoprint.inspection.scan_registration import registered
from tests.shared_data import shared

CLOUDS = ("cgal_blobby.xyz", "cgal_fin90_with_PCA_normals.xyz", "cgal_kitten.xyz", "cgal_oni.pwn",
          "trimesh_points_cloudcompare.xyz")  # fmt: skip


@pytest.mark.parametrize("name", CLOUDS)
def test_every_cloud_opens(name: str) -> None:
    scan = read_scan(shared(f"clouds/{name}"), unit="mm", least=12)
    assert len(scan.points) == scan.held
    assert np.isfinite(scan.points).all()


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
@pytest.mark.parametrize("name", ["cgal_fin90_with_PCA_normals.xyz", "cgal_oni.pwn"])
def test_a_cloud_registers_to_itself_moved(name: str) -> None:
    # Their unit is nobody's; in inches they are as large as a part.
    path = shared(f"clouds/{name}")
    points, surface = read_scan(path, unit="in", least=12).points, load(path, unit="in")
    middle = points.mean(axis=0)
    turn = Rotation.from_rotvec([0.05, -0.04, 0.05]).as_matrix()
    T_work_scan = transforms.rigid(turn, middle + np.array([1.5, -2.0, 1.0]) - turn @ middle)
    moved = transforms.apply(transforms.inverse(T_work_scan), points)
    found = registered(moved, surface, None, start=np.eye(4))
    off = np.linalg.norm(transforms.apply(found.T_work_scan, moved) - points, axis=1)
    # Two planes that meet in an edge are alike along it.
    assert off.mean() < (0.2 if not len(found.loose) else 2.5)
    assert found.used > 0.8


@pytest.mark.needs("open3d")
@pytest.mark.usefixtures("in_one_process")
@pytest.mark.parametrize(("name", "unit"), [("cgal_blobby.xyz", "in"), ("trimesh_points_cloudcompare.xyz", "mm")])
def test_a_cloud_that_is_no_surface_is_refused_as_a_part(name: str, unit: str) -> None:
    with pytest.raises(InputError, match=r"too sparse or no surface|distinct point"):
        load(shared(f"clouds/{name}"), unit=unit)
