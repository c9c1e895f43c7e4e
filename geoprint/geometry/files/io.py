"""Loading a surface from a file by its suffix, with its unit, and writing one."""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

from geoprint import features
from geoprint.errors import ExportError, GeoprintError, InputError, UsageError, reason_of
from geoprint.geometry.files.mesh_file import (
    UNITS,
    Check,
    Choice,
    LabelFound,
    MeshFile,
    check_mesh,
    ply_content,
    resolves,
    single_step,
)
from geoprint.geometry.files.optional_readers import found_labels, read_cloud, volume_mesh
from geoprint.geometry.files.ply import read_ply
from geoprint.geometry.files.text_formats import read_obj, read_off, read_stl
from geoprint.geometry.files.three_mf import only_mesh, read_3mf
from geoprint.geometry.topology import used_vertices
from geoprint.model import FloatArray, Reading, Surface, reading

if TYPE_CHECKING:
    from geoprint.geometry.files.labelling import LabelVolume


# Which reader reads a file: formats by suffix, those of features and installed packages among them, archives, and what
# no reader of a good file may return.


_T = TypeVar("_T")
# Largest file that is read [bytes]: 40 million triangles of a binary STL.
LARGEST_FILE = 1 << 31


class Reader(Protocol):
    """A function that reads a format."""

    def __call__(self, data: bytes, /, *, name: str) -> MeshFile:
        """Make a mesh of the content of a file; the name is what messages call it."""
        ...


class VolumeReader(Protocol):
    """A function that reads a format of volumes."""

    def __call__(self, data: bytes, /, *, name: str, choice: Choice) -> LabelVolume:
        """Return the labels of a file, where it says they lie; what is asked of them may rule where they overlap."""
        ...


# Points as lines of text.
CLOUDS = (".xyz", ".pwn", ".pts", ".asc", ".txt", ".csv")
# Formats of meshes, which may be zipped. Features and installed packages name the readers of others, by suffix.
MESHES: Mapping[str, Reader] = {
    ".stl": read_stl,
    ".ply": read_ply,
    ".obj": read_obj,
    ".off": read_off,
    ".3mf": read_3mf,
}
OWN = (*MESHES, *CLOUDS, ".zip")


def suffixes() -> tuple[str, ...]:
    """Return all suffixes of files that are read."""
    return tuple(dict.fromkeys([*OWN, *_named(features.READERS), *_named(features.VOLUMES)]))


def is_read(name: str) -> bool:
    """Return whether files of such a name are read."""
    suffix = _suffix_of(name)
    return suffix in OWN or suffix in suffixes()


def _named(*groups: str) -> tuple[str, ...]:
    return tuple(f".{point.name.lower()}" for group in groups for point in features.named_points(group))


def _reader_of(suffix: str) -> Any:
    """Return what a feature or an installed package reads a suffix by.

    Raises:
        UsageError: two do, or it cannot be loaded; the sentence names both, or package and entry point.
    """
    groups = (features.READERS, features.VOLUMES)
    points = [each for group in groups for each in features.named_points(group) if f".{each.name.lower()}" == suffix]
    if len(points) > 1:
        both = " and ".join(features.origin_of(point) for point in points)
        raise UsageError(f"files of `{suffix}` are read by {both}: keep one.")
    return features.loaded(points[0], "reader")


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
        path: of a file with one of the `suffixes`; a .zip file holds one of the MESHES.
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
    suffix = _suffix(path)
    is_volume = suffix not in OWN and suffix in _named(features.VOLUMES)
    # A mesh that geoprint stored may be of a label.
    asked = {"--thin": thin, "--threshold": threshold is not None, "--label": label is not None and suffix != ".ply"}
    if not is_volume and any(asked.values()):
        raise _without_labels(path.name, option=next(option for option, given in asked.items() if given))
    data = content_of(path)
    digest = sha256(data).hexdigest()
    if suffix == ".zip":
        suffix, data = only_mesh(data, suffixes=MESHES, name=path.name)
    if is_volume:
        reader: Reader = partial(_read_label, choice=Choice(label, thin=thin, threshold=threshold, check=check))
    else:
        reader = _checking(suffix, check)
    file = _read(reader, data, suffix=suffix, name=path.name)
    check_mesh(file, name=path.name)
    if not file.digest:
        file = replace(file, name=path.name, digest=digest, label=label if is_volume else None)
    _check_label(file, label, name=path.name)
    return file


def _suffix(path: Path) -> str:
    """Return the suffix that tells the format of a file."""
    if not is_read(path.name) and not path.is_dir():
        raise InputError(
            f"`{path.name}` has the suffix `{path.suffix}`, but geoprint reads {', '.join(suffixes())}; "
            "export the mesh as one of these."
        )
    return _suffix_of(path.name)


def _suffix_of(name: str) -> str:
    """Return the suffix of a name: both where a reader has two, such as .nii.gz."""
    path = Path(name.lower())
    both = "".join(path.suffixes[-2:])
    double = path.suffix not in OWN and both in _named(features.READERS, features.VOLUMES)
    return both if double else path.suffix


def _read_label(data: bytes, /, *, name: str, choice: Choice) -> MeshFile:
    """Make a mesh of one label of a volume."""
    return volume_mesh(_volume(data, choice, name=name), choice, name=name)


def _volume(data: bytes, choice: Choice, *, name: str) -> LabelVolume:
    """Return the labels of a volume, by the suffix of its name, where it says they lie."""
    suffix, known = _suffix_of(name), _named(features.VOLUMES)
    if suffix not in known:
        ends = f"its name must end in {', '.join(known)}" if known else "this geoprint lacks readers of such"
        raise UsageError(f"`{name}` is not a label volume: {ends}.")
    reader: VolumeReader = _reader_of(suffix)
    return _read(partial(reader, choice=choice), data, suffix=suffix, name=name)


def _read(reader: Callable[..., _T], data: bytes, *, suffix: str, name: str) -> _T:
    """Read a file; whatever its reader raises names it."""
    try:
        return reader(data, name=name)
    except (GeoprintError, MemoryError):
        raise
    except Exception as error:  # a reader may raise anything on a damaged file
        # Of other kinds the words are a name or a number without its place.
        found = f" ({str(error)[:200]!r})" if isinstance(error, ValueError | ImportError) else ""
        raise InputError(
            f"`{name}` cannot be read as {suffix}{found}; it is damaged or not what its suffix says, so export it "
            "again."
        ) from error


def _checking(suffix: str, check: Check | None) -> Reader:
    """Return the reader of a format that asks whether unit and size can be right where it has much to do."""
    if suffix == ".ply":
        return partial(read_ply, check=check)
    if suffix in CLOUDS:
        return partial(read_cloud, check=check)
    return MESHES[suffix] if suffix in MESHES else _reader_of(suffix)


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
        raise InputError(
            f"`{path}` cannot be read ({reason_of(error)}); check its permissions and its name."
        ) from error
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
    known = ", ".join(_named(features.VOLUMES))
    return UsageError(f"`{name}` has no labels{f', only {known} have' if known else ''}; leave `{option}` out.")


# Loading a surface from a file, with its unit, and writing one.


# Largest extent of a part that fits a desktop robot [mm]: beyond, the unit is taken to be wrong.
PLAUSIBLE_SIZE = (1.0, 2000.0)
# Largest extent of most parts [mm]: among plausible units the one that gives it is suggested.
USUAL_SIZE = (10.0, 500.0)


def load(path: Path | str, *, unit: str | None) -> Surface:
    """Read the surface of a mesh file, unrepaired; `prepare` repairs it.

    Args:
        path: of the file; `load_file` says which formats there are.
        unit: of its coordinates: mm, cm, m, um or in; None if the file states it.

    Returns:
        The surface in mm.

    Raises:
        UsageError: the unit is missing, unknown, or contradicts the file.
        InputError: the file cannot be read, or its size is implausible in that unit.
    """
    return load_file(path, unit=unit).surface


def load_file(
    path: Path | str,
    *,
    unit: str | None,
    label: int | None = None,
    thin: bool = False,
    threshold: float | None = None,
) -> MeshFile:
    """Read a mesh file, or make a mesh of what it holds, of known unit and believable size.

    The mesh is taken as the file has it: corners of STL triangles are not joined, nothing is repaired; `prepare` does
    that. A unit that cannot be right is refused before points or voxels are made a mesh.

    Args:
        path: of one of the `suffixes`.
        unit: of the file's coordinates, a key of UNITS; None where the file says it, as 3MF does, or where its format
            has one by custom. Of the others, None is answered by an error that shows what the size would be in each.
        label: of a label volume, which one is meant.
        thin: whether a label as thin as its voxels is taken with their terraces.
        threshold: of a volume of shares or probabilities, from which on a voxel belongs to a label.

    Returns:
        What the file holds, with its unit.

    Raises:
        UsageError: the unit is missing, unknown, or another one than the file says.
        InputError: the file's name is not printable, it cannot be read (see `formats.read_mesh`), the size is
            implausible, or the part lies so far from the origin that the file's numbers do not resolve it.
    """
    path = _printable(path)
    if unit is not None and unit not in UNITS:
        raise UsageError(f"the unit `{unit}` is not known; choose one of {', '.join(UNITS)}.")

    def check(places: FloatArray, carried: str, usual: str = "") -> None:
        _check_unit(path.name, places, unit, carried=carried, usual=usual)

    file = read_mesh(path, label=label, thin=thin, threshold=threshold, check=check)
    # Vertices that no face uses do not belong to the part.
    used = file.vertices[used_vertices(file.faces)]
    check(used, file.unit, file.usual)
    return _in_unit(file, unit or file.unit or file.usual, used)


def load_likely(
    path: Path | str, *, unit: str | None = None, label: int | None = None, threshold: float | None = None
) -> tuple[MeshFile, bool]:
    """Read a file as `load_file`; without a unit in the one it says or the likely one, and return whether in this.

    Raises:
        InputError: as `load_file`.
    """
    if unit is not None:
        return load_file(path, unit=unit, label=label, threshold=threshold), False
    path = _printable(path)
    file = read_mesh(path, label=label, threshold=threshold)
    used = file.vertices[used_vertices(file.faces)]
    unit = file.unit or file.usual or likely_unit(float(np.ptp(used, axis=0).max())) or "mm"
    _check_size(path.name, np.ptp(used, axis=0) * UNITS[unit], unit=unit, carried=bool(file.unit))
    return _in_unit(file, unit, used), not (file.unit or file.usual)


def labels_of(
    path: Path | str, *, unit: str | None, threshold: float | None = None
) -> tuple[tuple[LabelFound, ...], Reading, LabelVolume] | None:
    """Return all labels of a volume, what was used of it, skipped and assumed, and it in mm; None for other files.

    Raises:
        InputError: it cannot be read.
        UsageError: as `read_volume`.
    """
    path = _printable(path)
    if _suffix_of(path.name) not in _named(features.VOLUMES):
        return None
    volume = read_volume(content_of(path), name=path.name, unit=unit, threshold=threshold)
    found = found_labels(volume)
    used = {"labels": len(found), "voxels of them": sum(one.voxels for one in found)}
    return found, reading(used=used, skipped=volume.skipped, assumed=volume.assumed), volume


def read_volume(data: bytes, /, *, name: str, unit: str | None = None, threshold: float | None = None) -> LabelVolume:
    """Return the labels of a volume and where they lie [mm]; where it says no unit it is the given one, or mm.

    Args:
        data: content of the file.
        name: of the file; its suffix tells the format.
        unit: of its positions, where it states none.
        threshold: the share or probability from which on a voxel belongs to a label; None for the usual one.

    Raises:
        UsageError: its suffix is that of no volume; or as its reader.
        InputError: as its reader.
    """
    volume = _volume(data, Choice(threshold=threshold), name=name)
    affine = volume.affine.copy()
    affine[:3] *= UNITS[volume.unit or unit or "mm"]
    return replace(volume, affine=affine, unit="mm")


def _printable(path: Path | str) -> Path:
    path = Path(path)
    if not path.name.isprintable():
        raise InputError(f"the file name {path.name!r} holds characters that cannot be printed; rename the file.")
    return path


def _check_unit(name: str, places: FloatArray, unit: str | None, *, carried: str, usual: str) -> None:
    """Refuse a unit that is missing, another than the file says, or by which the part is too small or large."""
    if carried and unit not in {None, carried}:
        raise UsageError(f"`{name}` says that its unit is {carried}, not {unit}; leave `--unit` out.")
    extents = places.max(axis=0) - places.min(axis=0)
    found = unit or carried or usual
    if not found:
        raise UsageError(_missing_unit(name, extents))
    _check_size(name, extents * UNITS[found], unit=found, carried=bool(carried))


def _in_unit(file: MeshFile, unit: str, used: FloatArray) -> MeshFile:
    """Return a file with its unit, if its numbers resolve it; how far points lie from a surface is said in mm."""
    _check_resolution(file.name, used * UNITS[unit], step=file.step * UNITS[unit])
    file = replace(file, unit=unit)
    said = rebuilt_in_words(file)
    return file if said is None else replace(file, reading=replace(file.reading, assumed=(said, *file.reading.assumed)))


def ply_bytes(surface: Surface) -> bytes:
    """Return a surface as a binary little-endian PLY file with double coordinates [mm]; equal surfaces, equal bytes."""
    return ply_content(surface.vertices, surface.faces)


def save_ply(surface: Surface, path: Path | str) -> None:
    """Write a surface as `ply_bytes`, whole or not at all.

    Raises:
        ExportError: the file cannot be written.
    """
    write_whole(path, ply_bytes(surface))


def write_whole(path: Path | str, content: bytes) -> None:
    """Write a file that appears with all of its content, or not at all; one of that name is replaced then.

    Raises:
        ExportError: it cannot be written.
    """
    try:
        place = Path(path).resolve()
    except RuntimeError as error:  # Links lead to one another; from Python 3.13 on they are replaced.
        raise ExportError(f"`{path}` cannot be written ({error}); choose another place.") from error
    trial = place.with_name(f".{place.name}.tmp-{os.getpid()}-{secrets.token_hex(4)}")
    if place.exists() and not place.is_file():
        # A pipe or a device is not to be replaced by a file.
        trial = place
    try:
        trial.write_bytes(content)
        trial.replace(place)
    except OSError as error:
        if trial != place and trial.is_file():
            trial.unlink()
        raise ExportError(f"`{path}` cannot be written ({error.strerror}); choose another place.") from error


def likely_unit(size: float) -> str | None:
    """Return the unit in which a largest extent would be that of a part, or None where none is.

    Args:
        size: largest extent in the file's unit.

    Examples:
        >>> likely_unit(62.0), likely_unit(0.062), likely_unit(2.4), likely_unit(1e9)
        ('mm', 'm', 'in', None)
    """
    for smallest, largest in (USUAL_SIZE, PLAUSIBLE_SIZE):
        for unit, scale in UNITS.items():
            if smallest <= size * scale <= largest:
                return unit
    return None


def suggested_unit(path: Path | str, *, label: int | None = None) -> tuple[str, bool]:
    """Return the unit in which a file is, and whether it is only the likely one because the file carries none.

    Raises:
        InputError: as `load`.
    """
    file = read_mesh(Path(path), label=label)
    used = file.vertices[used_vertices(file.faces)]
    said = file.unit or file.usual
    return said or likely_unit(float(np.ptp(used, axis=0).max())) or "mm", not said


def unit_hint(surface: Surface, *, unit: str) -> str | None:
    """Return a sentence where a part is so small or large that its unit may be wrong, else None.

    Args:
        surface: in mm.
        unit: that its file was read in.
    """
    size = float(np.ptp(surface.vertices, axis=0).max())
    likely = likely_unit(size / UNITS[unit])
    smallest, largest = USUAL_SIZE
    if smallest <= size <= largest or likely in {None, unit}:
        return None
    return (
        f"{surface.name} is {_in_words(size)} large in {unit}, most parts have {smallest:g} to {largest:g} mm; "
        f"with `--unit {likely}` it would be {_in_words(size / UNITS[unit] * UNITS[str(likely)])}: check the unit."
    )


def rebuilt_in_words(file: MeshFile) -> str | None:
    """Return how far the points of a cloud lie from the surface that was put through them; None for other files."""
    notes = dict(file.notes)
    if "residual_mean" not in notes:
        return None
    mean, most = (_in_words(float(notes[key]) * UNITS[file.unit]) for key in ("residual_mean", "residual_max"))
    return f"a surface rebuilt from the points, which lie {mean} from it on average and {most} at most"


def unit_readings(name: str, extents: FloatArray) -> str:
    """Return in words how large a part is in each unit.

    Args:
        name: of its file, which carries no unit.
        extents: (3,) of the part, as numbers of the file.
    """
    spans = " x ".join(f"{extent:.3g}" for extent in extents)
    readings = ", ".join(f"{_in_words(float(extents.max()) * scale)} as {key}" for key, scale in UNITS.items())
    return f"`{name}` has no unit; it spans {spans}: {readings}"


def _missing_unit(name: str, extents: FloatArray) -> str:
    unit = likely_unit(float(extents.max()))
    advice = f"run again with `--unit {unit or 'mm'}`" + ("" if unit else " once it has the size of a part")
    return f"{unit_readings(name, extents)}; {advice}."


def _check_size(name: str, extents: FloatArray, *, unit: str, carried: bool) -> None:
    size = float(extents.max())
    smallest, largest = PLAUSIBLE_SIZE
    if smallest <= size <= largest:
        return
    likely = None if carried else likely_unit(size / UNITS[unit])
    advice = f"it would be {_in_words(size / UNITS[unit] * UNITS[likely])} with `--unit {likely}`" if likely else ""
    raise InputError(
        f"`{name}` is {_in_words(size)} large in {unit}, a part has {smallest:g} mm to {largest / 1000:g} m; "
        f"{advice or 'scale it where it was made'}.",
        size=size,
    )


def _check_resolution(name: str, used: FloatArray, *, step: float) -> None:
    size = float((used.max(axis=0) - used.min(axis=0)).max())
    farthest = float(np.abs(used).max())
    # A vertex that no face uses may lie farther out than all that count.
    step = max(min(step, single_step(used)), float(np.spacing(farthest)))
    if not resolves(step, used):
        raise InputError(
            f"`{name}` is {_in_words(size)} large but lies {_in_words(farthest)} from the origin, where its numbers "
            f"have steps of {step:.2g} mm. Move it to the origin, or export more digits.",
            distance=farthest,
            step=step,
        )


def _in_words(length: float) -> str:
    """Return a length [mm] with the unit that suits it."""
    if length < 0.1:
        return f"{length * 1000:.3g} um"
    if length < 1000:
        return f"{length:.3g} mm"
    return f"{length / 1000:.3g} m" if length < 1e6 else f"{length / 1e6:,.3g} km"
