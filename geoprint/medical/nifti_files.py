"""Reading numbers on a grid from NIfTI (.nii, .nii.gz), and what of it other formats share.

No reader takes more memory than the header explains.
"""

from __future__ import annotations

import bz2
import gzip
import math
import zlib
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from geoprint.errors import InputError, reason_of
from geoprint.geometry.files.labelling import GridFile, LabelVolume, labelled
from geoprint.geometry.files.mesh_file import Choice
from geoprint.geometry.native import missing
from geoprint.model import FloatArray

if TYPE_CHECKING:
    from nibabel import Nifti1Header
    from numpy.typing import NDArray


# Largest volume that is unpacked [bytes]: 1024 x 1024 x 1024 labels of one byte.
LARGEST_VOLUME = 1 << 30
# Thickest slices, in sides of a voxel within them; beyond, nobody knows the shape between them.
LONGEST_VOXEL = 20
# NIfTI-1 headers are 348 bytes long, NIfTI-2 headers 540; either number is the first of the file.
NIFTI1_HEADER, NIFTI2_HEADER = 348, 540
# Two affines of a header are the same within this share of their largest number.
SAME_PLACE = 1e-3
# Codes of the types in a NIfTI header that are whole or floating numbers of up to eight bytes.
NIFTI_TYPES = (2, 4, 8, 16, 64, 256, 512, 768, 1024, 1280)
# The unit codes of a NIfTI header, in the bits that are for lengths.
NIFTI_LENGTHS = 7
UNITS_BY_CODE = {1: "m", 2: "mm", 3: "um"}


def nifti_labels(data: bytes, /, *, name: str, choice: Choice) -> LabelVolume:
    """Read the labels of a NIfTI file; raises as `read_nifti` and `labelled`."""
    return labelled(read_nifti(data, name=name), choice, name=name)


def read_nifti(data: bytes, *, name: str) -> GridFile:
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
    start = unpacked(data, NIFTI2_HEADER, name=name) if packed else data[:NIFTI2_HEADER]
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
    content = unpacked(data, needed, name=name) if packed else data
    values = grid_of(content, shape, stored=stored, offset=offset, name=name)
    if slope not in {None, 1.0} or shift not in {None, 0.0}:
        values = values.astype(np.float64) * (slope or 1.0) + (shift or 0.0)
    unit = UNITS_BY_CODE.get(int(header["xyzt_units"]) & NIFTI_LENGTHS)
    return GridFile((values,), affine, unit, assumed=_two_places(header, affine))


def _two_places(header: Nifti1Header, affine: FloatArray) -> tuple[str, ...]:
    """Return what is assumed where a header places its grid in two ways that differ."""
    if not (int(header["sform_code"]) and int(header["qform_code"])):
        return ()
    other = np.asarray(header.get_qform(), dtype=np.float64)  # pyright: ignore[reportUnknownArgumentType, reportUnknownMemberType, reportAttributeAccessIssue]
    off = np.abs(other - affine).max()
    return (
        ("the place that `sform` says, from which `qform` differs",) if off > SAME_PLACE * np.abs(affine).max() else ()
    )


def _check_nifti(header: Nifti1Header, *, name: str) -> None:
    """Refuse a header with another magic, with a type that no label has, or without place and size of the voxels."""
    magic, code, sides = header["magic"].tobytes().rstrip(b"\0"), int(header["datatype"]), header["pixdim"][1:4]
    if magic[:3] == b"ni1":
        raise InputError(f"`{name}` is half a NIfTI file, its voxels lie in another; export it as one .nii file.")
    if magic[:3] not in {b"n+1", b"n+2"}:
        raise InputError(
            f"`{name}` has the magic {magic[:8]!r} at the end of its header; NIfTI has b'n+1' or b'n+2'. It is "
            "damaged or another format: export the segmentation again as NIfTI."
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


def checked_shape(
    shape: tuple[int, ...], affine: FloatArray, *, stored: np.dtype[np.generic], name: str, layers: int = 1
) -> tuple[int, ...]:
    """Return the three extents that a header announces, if they can be believed.

    Args:
        shape: extents along all axes.
        affine: (4, 4) as in `GridFile`.
        stored: type of a value.
        name: of the file.
        layers: values for each voxel.

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
    needed = layers * math.prod(grid) * stored.itemsize
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


def grid_of(
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
    if len(content) > offset + count * stored.itemsize:
        raise InputError(
            f"`{name}` holds more than the {' x '.join(map(str, shape))} voxels of {count * stored.itemsize} bytes "
            "that its header promises. The header does not match the data: export it again.",
            promised=count * stored.itemsize,
        )
    return np.frombuffer(content, dtype=stored, count=count, offset=offset).reshape(shape, order="F")


def unpacked(data: bytes, size: int, *, name: str, packing: str = "gzip") -> bytes:
    """Return up to so many bytes of a gzip or bzip2 stream and one more if there is one; no more are unpacked."""
    try:
        with bz2.open(BytesIO(data)) if packing == "bzip2" else gzip.open(BytesIO(data)) as stream:
            return stream.read(size + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(
            f"`{name}` cannot be unpacked ({reason_of(error)}); it is damaged, so copy or export it again."
        ) from error
