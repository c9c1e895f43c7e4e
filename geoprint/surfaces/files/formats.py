"""Which reader reads a file: the registry by suffix, archives, and what no reader of a good file may return."""

from __future__ import annotations

import stat
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Protocol

from geoprint.errors import GeoprintError, InputError, UsageError
from geoprint.surfaces.files.archives import only_mesh
from geoprint.surfaces.files.mesh_file import MeshFile, check_mesh
from geoprint.surfaces.files.optional_readers import (
    read_cad,
    read_cloud,
    read_dicom_label,
    read_nifti_label,
    read_nrrd_label,
)
from geoprint.surfaces.files.text_formats import read_obj, read_off
from geoprint.surfaces.files.three_mf import read_3mf
from geoprint.surfaces.files.triangle_formats import read_ply, read_stl

# Largest file that is read [bytes]: 40 million triangles of a binary STL.
LARGEST_FILE = 1 << 31


class Reader(Protocol):
    """A function that reads a format."""

    def __call__(self, data: bytes, /, *, name: str) -> MeshFile:
        """Make a mesh of the content of a file; the name is what messages call it."""
        ...


class LabelReader(Protocol):
    """A function that reads a format of volumes."""

    def __call__(self, data: bytes, /, *, name: str, label: int | None, thin: bool) -> MeshFile:
        """Make a mesh of one label, None where nobody has chosen one; thin ones may be asked for with terraces."""
        ...


# Formats of meshes, which may be zipped, and those of exact geometry and points.
MESHES: Mapping[str, Reader] = {
    ".stl": read_stl,
    ".ply": read_ply,
    ".obj": read_obj,
    ".off": read_off,
    ".3mf": read_3mf,
}
FORMATS: Mapping[str, Reader] = {
    **MESHES,
    ".step": partial(read_cad, kind="step"),
    ".stp": partial(read_cad, kind="step"),
    ".iges": partial(read_cad, kind="iges"),
    ".igs": partial(read_cad, kind="iges"),
    ".xyz": read_cloud,
    ".pwn": read_cloud,
}
VOLUMES: Mapping[str, LabelReader] = {
    ".nii": read_nifti_label,
    ".nii.gz": read_nifti_label,
    ".nrrd": read_nrrd_label,
    ".dcm": read_dicom_label,
}
SUFFIXES = (*FORMATS, ".zip", *VOLUMES)


def read_mesh(path: Path, *, label: int | None = None, thin: bool = False) -> MeshFile:
    """Read a mesh file by its suffix, or make a mesh of what else it holds.

    Args:
        path: of a file with one of the SUFFIXES; a .zip file holds one of the MESHES.
        label: of a label volume, which one is meant.
        thin: whether a label as thin as its voxels is taken with their terraces.

    Returns:
        What the file holds.

    Raises:
        InputError: the file is missing, unreadable, of another kind, damaged, or its length disagrees with what it
            promises; it holds no faces, a coordinate that is not finite, or a face that refers to a vertex that is
            not there; an archive holds no mesh, several, or one that is packed too tightly.
        UsageError: a label is given for a file that has none or is missing, or an optional package is not installed.
    """
    suffix = ".nii.gz" if path.name.lower().endswith(".nii.gz") else path.suffix.lower()
    if suffix not in SUFFIXES and not path.is_dir():
        raise InputError(
            f"`{path.name}` has the suffix `{path.suffix}`, but geoprint reads {', '.join(SUFFIXES)}; "
            "export the mesh as one of these."
        )
    # A mesh that geoprint stored may be of a label.
    if suffix not in VOLUMES and (thin or (label is not None and suffix != ".ply")):
        raise _without_labels(path.name, option="--thin" if label is None else "--label")
    data = content_of(path)
    digest = sha256(data).hexdigest()
    if suffix == ".zip":
        suffix, data = only_mesh(data, suffixes=MESHES, name=path.name)
    try:
        if suffix in VOLUMES:
            file = VOLUMES[suffix](data, name=path.name, label=label, thin=thin)
        else:
            file = FORMATS[suffix](data, name=path.name)
    except (GeoprintError, MemoryError):
        raise
    except Exception as error:  # a reader may raise anything on a damaged file
        # Of other kinds the words are a name or a number without its place.
        found = f" ({str(error)[:200]!r})" if isinstance(error, ValueError | ImportError) else ""
        raise InputError(
            f"`{path.name}` cannot be read as {suffix}{found}; it is damaged or not what its suffix says, so export "
            "it again."
        ) from error
    check_mesh(file, name=path.name)
    if not file.digest:
        file = replace(file, name=path.name, digest=digest, label=label if suffix in VOLUMES else None)
    _check_label(file, label, name=path.name)
    return file


def content_of(path: Path) -> bytes:
    """Return the bytes of a file, or say why there are none.

    Raises:
        InputError: it is missing, cannot be read, is no plain file, is empty or too large, or only points to the mesh.
    """
    if path.is_dir():
        raise InputError(f"`{path}` is a directory; give the mesh file in it.")
    try:
        found = path.stat()
        # Reading a pipe or a device might never end.
        plain = stat.S_ISREG(found.st_mode)
        data = path.read_bytes() if plain and found.st_size <= LARGEST_FILE else None
    except FileNotFoundError as error:
        raise InputError(f"`{path}` does not exist; check the name and the folder.") from error
    except (OSError, ValueError) as error:
        raise InputError(f"`{path}` cannot be read ({error}); check its permissions and its name.") from error
    if data is None:
        what = f"{found.st_size} bytes large" if plain else "a pipe or a device"
        raise InputError(
            f"`{path.name}` is {what}; plain files of up to {LARGEST_FILE >> 30} GiB are read, so copy or decimate it "
            "first.",
            bytes=found.st_size,
        )
    if not data:
        raise InputError(f"`{path.name}` is empty (0 bytes); copy or export it again.")
    if data.startswith(b"version https://git-lfs"):
        raise InputError(f"`{path.name}` is a git-LFS pointer, not the mesh itself; fetch it with `git lfs pull`.")
    if data[:4] in {b"ply\n", b"ply\r"} and path.suffix.lower() != ".ply":
        raise InputError(f"`{path.name}` is a PLY file by its content; rename it to `{path.stem}.ply`.")
    return data


def _check_label(file: MeshFile, label: int | None, *, name: str) -> None:
    """Refuse another label than the one that a mesh was made of."""
    if label not in {None, file.label}:
        if file.label is None:
            raise _without_labels(name, option="--label")
        raise UsageError(f"`{name}` holds label {file.label} of {file.name}, not {label}; leave `--label` out.")


def _without_labels(name: str, *, option: str) -> UsageError:
    return UsageError(f"`{name}` has no labels, only {', '.join(VOLUMES)} have; leave `{option}` out.")
