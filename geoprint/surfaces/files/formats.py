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
from geoprint.surfaces.files.mesh_file import Check, Choice, MeshFile, check_mesh
from geoprint.surfaces.files.optional_readers import (
    read_cad,
    read_cloud,
    read_dicom_label,
    read_nifti_label,
    read_nrrd_label,
)
from geoprint.surfaces.files.ply import read_ply
from geoprint.surfaces.files.stl import read_stl
from geoprint.surfaces.files.text_formats import read_obj, read_off
from geoprint.surfaces.files.three_mf import read_3mf

# Largest file that is read [bytes]: 40 million triangles of a binary STL.
LARGEST_FILE = 1 << 31


class Reader(Protocol):
    """A function that reads a format."""

    def __call__(self, data: bytes, /, *, name: str) -> MeshFile:
        """Make a mesh of the content of a file; the name is what messages call it."""
        ...


class LabelReader(Protocol):
    """A function that reads a format of volumes."""

    def __call__(self, data: bytes, /, *, name: str, choice: Choice) -> MeshFile:
        """Make a mesh of one label."""
        ...


# Points as lines of text.
CLOUDS = (".xyz", ".pwn", ".pts", ".asc", ".txt", ".csv")
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
    **dict.fromkeys(CLOUDS, read_cloud),
}
VOLUMES: Mapping[str, LabelReader] = {
    ".nii": read_nifti_label,
    ".nii.gz": read_nifti_label,
    ".nrrd": read_nrrd_label,
    ".dcm": read_dicom_label,
}
SUFFIXES = (*FORMATS, ".zip", *VOLUMES)


def read_mesh(
    path: Path,
    *,
    label: int | None = None,
    thin: bool = False,
    threshold: float | None = None,
    check: Check | None = None,
) -> MeshFile:
    """Read a mesh file by its suffix, or make a mesh of what else it holds.

    Args:
        path: of a file with one of the SUFFIXES; a .zip file holds one of the MESHES.
        label: of a label volume, which one is meant.
        thin: whether a label as thin as its voxels is taken with their terraces.
        threshold: of a volume of shares or probabilities, from which on a voxel belongs to a label.
        check: is asked whether unit and size can be right, before points or voxels are made a mesh.

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
    asked = {"--thin": thin, "--threshold": threshold is not None, "--label": label is not None and suffix != ".ply"}
    if suffix not in VOLUMES and any(asked.values()):
        raise _without_labels(path.name, option=next(option for option, given in asked.items() if given))
    data = content_of(path)
    digest = sha256(data).hexdigest()
    if suffix == ".zip":
        suffix, data = only_mesh(data, suffixes=MESHES, name=path.name)
    try:
        if suffix in VOLUMES:
            choice = Choice(label, thin=thin, threshold=threshold, check=check)
            file = VOLUMES[suffix](data, name=path.name, choice=choice)
        else:
            file = _checking(suffix, check)(data, name=path.name)
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


def _checking(suffix: str, check: Check | None) -> Reader:
    """Return the reader of a format that asks whether unit and size can be right where it has much to do."""
    if suffix == ".ply":
        return partial(read_ply, check=check)
    return partial(read_cloud, check=check) if suffix in CLOUDS else FORMATS[suffix]


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
