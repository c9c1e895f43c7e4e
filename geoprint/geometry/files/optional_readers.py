"""Readers of CAD files, point clouds and label volumes, imported when such a file is met: nobody else needs them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from geoprint.geometry.files.mesh_file import Check, Choice, LabelFound, MeshFile
from geoprint.model import Reading

if TYPE_CHECKING:
    from geoprint.geometry.files.labelling import LabelVolume


def read_cad(data: bytes, /, *, kind: str, name: str) -> MeshFile:
    """Tessellate a STEP or IGES file, as `cad.read_cad` does."""
    from geoprint.geometry.files import cad

    return cad.read_cad(data, kind=kind, name=name)


def read_cloud(data: bytes, /, *, name: str, check: Check | None = None) -> MeshFile:
    """Put a surface through the points of a text file, as `point_clouds.read_cloud` does."""
    from geoprint.geometry.files import point_clouds

    return point_clouds.read_cloud(data, name=name, check=check)


def read_cloud_ply(data: bytes, /, *, name: str, check: Check | None = None) -> MeshFile:
    """Put a surface through the points of a PLY file without faces."""
    from geoprint.geometry.files import point_clouds

    return point_clouds.reconstruct(point_clouds.read_point_ply(data, name=name), name=name, check=check)


def read_nifti_label(data: bytes, /, *, name: str, choice: Choice) -> MeshFile:
    """Read one label of a NIfTI file, as `label_volumes.read_nifti_label` does."""
    from geoprint.geometry.files import label_volumes

    return label_volumes.read_nifti_label(data, name=name, choice=choice)


def read_nrrd_label(data: bytes, /, *, name: str, choice: Choice) -> MeshFile:
    """Read one label of an NRRD file, as `label_volumes.read_nrrd_label` does."""
    from geoprint.geometry.files import label_volumes

    return label_volumes.read_nrrd_label(data, name=name, choice=choice)


def read_dicom_label(data: bytes, /, *, name: str, choice: Choice) -> MeshFile:
    """Read one label of a DICOM segmentation, as `label_volumes.read_dicom_label` does."""
    from geoprint.geometry.files import label_volumes

    return label_volumes.read_dicom_label(data, name=name, choice=choice)


def read_volume(data: bytes, /, *, name: str) -> LabelVolume:
    """Read the labels of a volume, as `label_volumes.read_volume` does."""
    from geoprint.geometry.files import label_volumes

    return label_volumes.read_volume(data, name=name)


def read_labels(
    data: bytes, /, *, name: str, unit: str | None, threshold: float | None
) -> tuple[tuple[LabelFound, ...], Reading, LabelVolume]:
    """Read which labels a volume has, as `label_volumes.read_labels` does."""
    from geoprint.geometry.files import label_volumes

    return label_volumes.read_labels(data, name=name, unit=unit, threshold=threshold)
