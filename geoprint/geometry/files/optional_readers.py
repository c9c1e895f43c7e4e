"""What makes meshes of points and of labels, imported when such a file is met: nobody else needs it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from geoprint.geometry.files.mesh_file import Check, Choice, LabelFound, MeshFile

if TYPE_CHECKING:
    from geoprint.geometry.files.labelling import LabelVolume


def read_cloud(data: bytes, /, *, name: str, check: Check | None = None) -> MeshFile:
    """Put a surface through the points of a text file, as `point_clouds.read_cloud` does."""
    from geoprint.geometry.files import point_clouds

    return point_clouds.read_cloud(data, name=name, check=check)


def read_cloud_ply(data: bytes, /, *, name: str, check: Check | None = None) -> MeshFile:
    """Put a surface through the points of a PLY file without faces."""
    from geoprint.geometry.files import point_clouds

    return point_clouds.reconstruct(point_clouds.read_point_ply(data, name=name), name=name, check=check)


def volume_mesh(volume: LabelVolume, choice: Choice, *, name: str) -> MeshFile:
    """Return the surface of one label of a volume, as `label_volumes.volume_mesh` does."""
    from geoprint.geometry.files import label_volumes

    return label_volumes.volume_mesh(volume, choice, name=name)


def found_labels(volume: LabelVolume) -> tuple[LabelFound, ...]:
    """Return all labels of a volume in mm, as `labelling.found_labels` does."""
    from geoprint.geometry.files import labelling

    return tuple(labelling.found_labels(volume))
