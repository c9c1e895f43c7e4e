"""Label volumes: what one is, and reading it from NIfTI (.nii, .nii.gz) and NRRD (.nrrd).

Neither reader takes more memory than the header explains; DICOM is read by `dicom_segmentation`.
"""

from __future__ import annotations

import gzip
import math
import zlib
from dataclasses import dataclass, field
from io import BytesIO
from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray
from geoprint.surfaces.conversion import missing

if TYPE_CHECKING:
    from collections.abc import Mapping

    from nibabel import Nifti1Header
    from numpy.typing import NDArray

# Largest volume that is unpacked [bytes]: 1024 x 1024 x 1024 labels of one byte.
LARGEST_VOLUME = 1 << 30
# Thickest slices, in sides of a voxel within them; beyond, nobody knows the shape between them.
LONGEST_VOXEL = 20
# NIfTI-1 headers are 348 bytes long, NIfTI-2 headers 540; either number is the first of the file.
NIFTI1_HEADER, NIFTI2_HEADER = 348, 540
# Codes of the types in a NIfTI header that are whole or floating numbers of up to eight bytes.
NIFTI_TYPES = (2, 4, 8, 16, 64, 256, 512, 768, 1024, 1280)
# Headers of NRRD files are lines of text that end with an empty one.
LONGEST_NRRD_HEADER = 1 << 16
# The unit codes of a NIfTI header, in the bits that are for lengths, and the words of NRRD files.
NIFTI_LENGTHS = 7
UNITS_BY_CODE = {1: "m", 2: "mm", 3: "um"}
UNITS_BY_NAME = {"mm": "mm", "meter": "m", "micron": "um", "m": "m", "um": "um", "cm": "cm"}
NRRD_TYPES = {
    "signed char": "i1", "int8": "i1", "int8_t": "i1", "uchar": "u1", "unsigned char": "u1", "uint8": "u1",
    "uint8_t": "u1", "short": "i2", "short int": "i2", "signed short": "i2", "int16": "i2", "int16_t": "i2",
    "ushort": "u2", "unsigned short": "u2", "uint16": "u2", "uint16_t": "u2", "int": "i4", "signed int": "i4",
    "int32": "i4", "int32_t": "i4", "uint": "u4", "unsigned int": "u4", "uint32": "u4", "uint32_t": "u4",
    "float": "f4", "double": "f8",
}  # fmt: skip


@final
@dataclass(frozen=True, slots=True, eq=False)
class LabelVolume:
    """Labels on a grid, and where the grid lies.

    Attributes:
        labels: (i, j, k) whole numbers, 0 outside of all.
        affine: (4, 4) turns (i, j, k, 1) of a voxel's centre into its position in the file's unit.
        unit: of the positions, or None where the file does not say it.
        names: of labels, where the file has them; nothing in them steers a terminal.
    """

    labels: NDArray[np.generic]
    affine: FloatArray
    unit: str | None
    names: Mapping[int, str] = field(default_factory=dict[int, str])


def read_nifti(data: bytes, *, name: str) -> LabelVolume:
    """Read a NIfTI file, gzipped or not; coordinates are those of its affine (right, anterior, superior).

    Raises:
        InputError: it is not one, is cut off, unpacks to more than LARGEST_VOLUME, has several volumes, or its affine
            is not invertible.
        UsageError: nibabel is not installed.
    """
    try:
        import nibabel
        from nibabel.spatialimages import HeaderDataError
    except ImportError as error:
        raise missing("nibabel", extra="medical", work="reading NIfTI files") from error
    packed = data[:2] == b"\x1f\x8b"
    start = _unpacked(data, NIFTI2_HEADER, name=name) if packed else data[:NIFTI2_HEADER]
    size = {int.from_bytes(start[:4], order) for order in ("little", "big")}
    if len(start) < NIFTI1_HEADER or not size & {NIFTI1_HEADER, NIFTI2_HEADER}:
        raise InputError(f"`{name}` does not begin with a NIfTI header; export the segmentation again as NIfTI.")
    kind = nibabel.Nifti1Header if NIFTI1_HEADER in size else nibabel.Nifti2Header
    header = kind.from_fileobj(BytesIO(start), check=False)
    _check_nifti(header, name=name)
    shape = tuple(int(extent) for extent in header.get_data_shape())
    try:
        affine = np.asarray(header.get_best_affine(), dtype=np.float64)
        slope, shift = header.get_slope_inter()
    except (ValueError, HeaderDataError) as error:
        raise InputError(f"`{name}` has a damaged NIfTI header ({error}); export the segmentation again.") from error
    stored = header.get_data_dtype()
    offset = int(max(header["vox_offset"], min(size & {NIFTI1_HEADER, NIFTI2_HEADER})))
    shape = checked_shape(shape, affine, stored=stored, name=name)
    needed = offset + math.prod(shape) * stored.itemsize
    content = _unpacked(data, needed, name=name) if packed else data
    labels = _grid(content, shape, stored=stored, offset=offset, name=name)
    if slope not in {None, 1.0} or shift not in {None, 0.0}:
        labels = np.rint(labels.astype(np.float64) * (slope or 1.0) + (shift or 0.0)).astype(np.int64)
    return LabelVolume(labels, affine, UNITS_BY_CODE.get(int(header["xyzt_units"]) & NIFTI_LENGTHS))


def _check_nifti(header: Nifti1Header, *, name: str) -> None:
    """Refuse a header with another magic, with a type that no label has, or without place and size of the voxels."""
    magic, code, sides = header["magic"].tobytes().rstrip(b"\0"), int(header["datatype"]), header["pixdim"][1:4]
    if magic[:3] == b"ni1":
        raise InputError(f"`{name}` is half a NIfTI file, its voxels lie in another; export it as one .nii file.")
    if magic[:3] not in {b"n+1", b"n+2"}:
        raise InputError(
            f"`{name}` has the magic {magic[:8]!r} at the end of its header, a NIfTI file has b'n+1' or b'n+2'; it is "
            "damaged or another format, so export the segmentation again as NIfTI."
        )
    if code not in NIFTI_TYPES:
        raise InputError(
            f"`{name}` states the data type {code}, labels have one of {', '.join(map(str, NIFTI_TYPES))}; export the "
            "segmentation as whole numbers of 8 or 16 bits.",
            datatype=code,
        )
    if not (np.isfinite(sides).all() and (sides > 0).all() and np.isfinite(header["vox_offset"])):
        raise InputError(
            f"`{name}` states voxels of {' x '.join(f'{side:g}' for side in sides.tolist())} from byte "
            f"{header['vox_offset']:g} on; sides are above 0 and both are finite, so export the segmentation again."
        )


def read_nrrd(data: bytes, *, name: str) -> LabelVolume:
    """Read a NRRD file with its data inside; coordinates become right, anterior, superior, as those of NIfTI.

    Raises:
        InputError: as `read_nifti`; or the data stand in another file, or are packed as is not read here.
        UsageError: pynrrd is not installed.
    """
    try:
        import nrrd
    except ImportError as error:
        raise missing("pynrrd", extra="medical", work="reading NRRD files") from error
    end = max(data.find(b"\n\n", 0, LONGEST_NRRD_HEADER) + 2, data.find(b"\r\n\r\n", 0, LONGEST_NRRD_HEADER) + 4)
    if data[:4] != b"NRRD" or end < 4:
        raise InputError(f"`{name}` does not begin with a NRRD header; export the segmentation again as NRRD.")
    header = nrrd.read_header(BytesIO(data[:end]))
    if "data file" in header or "datafile" in header:
        raise InputError(f"`{name}` keeps its data in another file, which is not read; export it as one .nrrd file.")
    encoding, kind = str(header["encoding"]).lower(), str(header["type"]).lower()
    if encoding not in {"raw", "gzip", "gz"} or kind not in NRRD_TYPES:
        raise InputError(f"`{name}` is packed as {encoding} of {kind}; export it as raw or gzip, of whole numbers.")
    order = ">" if header.get("endian") == "big" else "<"
    stored = np.dtype(order + NRRD_TYPES[kind])
    affine = _nrrd_affine(header, name=name)
    shape = checked_shape(tuple(np.asarray(header["sizes"], dtype=np.int64).tolist()), affine, stored=stored, name=name)
    needed = math.prod(shape) * stored.itemsize
    content = data[end:] if encoding == "raw" else _unpacked(data[end:], needed, name=name)
    units = {str(unit) for unit in np.asarray(header.get("space units", [])).ravel().tolist()}
    unit = UNITS_BY_NAME.get(units.pop()) if len(units) == 1 else None
    return LabelVolume(_grid(content, shape, stored=stored, offset=0, name=name), affine, unit)


def _nrrd_affine(header: Mapping[str, object], *, name: str) -> FloatArray:
    """Return the affine of a NRRD header, turned from its space into right, anterior, superior."""
    directions = np.asarray(header.get("space directions", np.zeros(0)), dtype=np.float64)
    if directions.shape != (3, 3):
        raise InputError(f"`{name}` has no `space directions` of three axes; export it with its position in space.")
    affine = np.eye(4)
    affine[:3, :3] = directions.T
    affine[:3, 3] = np.asarray(header.get("space origin", np.zeros(3)), dtype=np.float64)
    space = str(header.get("space", "right-anterior-superior")).lower()
    words = dict(zip("ras", ("right", "anterior", "superior"), strict=True))
    letters = [word[:1] for word in space.split("-")] if "-" in space else list(space)
    opposite = {"l": "r", "p": "a", "i": "s"}
    if [opposite.get(letter, letter) for letter in letters] != list(words):
        raise InputError(f"`{name}` lies in the space `{space}`; export it in left-posterior-superior or the like.")
    affine[:3] *= np.array([-1.0 if letter in opposite else 1.0 for letter in letters])[:, None]
    return affine


def checked_shape(
    shape: tuple[int, ...], affine: FloatArray, *, stored: np.dtype[np.generic], name: str
) -> tuple[int, ...]:
    """Return the three extents that a header announces, if they can be believed.

    Args:
        shape: extents along all axes.
        affine: (4, 4) as in `LabelVolume`.
        stored: type of a label.
        name: of the file.

    Raises:
        InputError: there are more than three axes, too many voxels, voxels too long or flat, or values that are no
            numbers.
    """
    grid = shape[:3]
    if len(grid) != 3 or any(extent != 1 for extent in shape[3:]) or min(grid) < 1:
        words = " x ".join(str(extent) for extent in shape)
        raise InputError(f"`{name}` is a volume of {words}; one volume with three axes is read, so export it alone.")
    if stored.kind not in "iuf":
        raise InputError(f"`{name}` holds values of type {stored}; labels are whole numbers, so export it as such.")
    needed = math.prod(grid) * stored.itemsize
    if needed > LARGEST_VOLUME:
        raise InputError(
            f"`{name}` would unpack to {needed >> 20} MiB, at most {LARGEST_VOLUME >> 20} MiB are read; crop it to the "
            "part, or store the labels as bytes.",
            bytes=needed,
        )
    sides = np.linalg.norm(affine[:3, :3], axis=0)
    if np.isfinite(sides).all() and sides.max() > LONGEST_VOXEL * sides.min() > 0.0:
        words = " x ".join(f"{side:.3g}" for side in sides)
        raise InputError(
            f"`{name}` has voxels of {words}; one side may be {LONGEST_VOXEL} times another at most: check the affine."
        )
    if not np.isfinite(affine).all() or abs(np.linalg.det(affine[:3, :3])) <= 1e-6 * sides.prod():
        raise InputError(f"`{name}` has an affine that squeezes its voxels flat or is not finite; export it again.")
    return grid


def _grid(
    content: bytes, shape: tuple[int, ...], *, stored: np.dtype[np.generic], offset: int, name: str
) -> NDArray[np.generic]:
    """Return the voxels behind an offset, first axis fastest as both formats have it."""
    count = math.prod(shape)
    if len(content) < offset + count * stored.itemsize:
        raise InputError(
            f"`{name}` promises {' x '.join(map(str, shape))} voxels, which take {count * stored.itemsize} bytes, but "
            f"holds {max(len(content) - offset, 0)}; it is cut off, so copy or export it again.",
            promised=count * stored.itemsize,
            found=max(len(content) - offset, 0),
        )
    return np.frombuffer(content, dtype=stored, count=count, offset=offset).reshape(shape, order="F")


def _unpacked(data: bytes, size: int, *, name: str) -> bytes:
    """Return up to so many bytes of a gzip stream, and unpack no more than these."""
    try:
        with gzip.GzipFile(fileobj=BytesIO(data)) as stream:
            return stream.read(size)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(
            f"`{name}` cannot be unpacked ({error}); it is damaged, so copy or export it again."
        ) from error
