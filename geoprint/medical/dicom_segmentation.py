"""Reading segmentations in DICOM files (.dcm): which frame is which slice of which segment [DICOM, PS3.3 C.8.20].

A frame says by itself where it lies and which segment it shows; frames come in any order, and those without a voxel
may be left out. Positions are left, posterior, superior in DICOM and become right, anterior, superior, as those of
NIfTI. A frame holds a bit for each voxel, and the next one goes on with the very next bit.
"""

from __future__ import annotations

import warnings
from io import BytesIO
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from geoprint.errors import InputError, UsageError, how_many
from geoprint.geometry.files.labelling import LabelVolume
from geoprint.geometry.files.mesh_file import LONGEST_NAME, Choice, printable
from geoprint.geometry.native import missing
from geoprint.medical.nifti_files import checked_shape
from geoprint.model import FloatArray, IntArray

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from pydicom.dataset import Dataset


SEGMENTATION = "1.2.840.10008.5.1.4.1.1.66.4"
# Transfer syntaxes that pack nothing: implicit and explicit, little endian.
PLAIN = ("1.2.840.10008.1.2", "1.2.840.10008.1.2.1")
# The file's mark, and where it stands.
MARK, MARK_AT = b"DICM", 128
# Slices may lie off their even places, and directions of frames differ, by this share of the distance or of 1:
# positions are written with few digits.
PLACE_TOLERANCE = 0.02
# Frames that are nearer than this share of a pixel lie in the same slice.
SAME_SLICE = 0.01


class _Frames(NamedTuple):
    """Where the frames of a file lie, and what they show.

    Attributes:
        segments: (f,) number of the segment of each.
        places: (f, 3) centre of the first voxel of each, left, posterior, superior [mm].
        rows: (3,) from one row to the next [mm].
        columns: (3,) from one column to the next [mm].
        step: distance between neighbouring slices that the file states [mm], or None.
    """

    segments: IntArray
    places: FloatArray
    rows: FloatArray
    columns: FloatArray
    step: float | None


def dicom_labels(data: bytes, /, *, name: str, choice: Choice) -> LabelVolume:
    """Read the segments of a DICOM file as labels.

    Raises:
        UsageError: a threshold is given; or as `read_dicom`.
        InputError: as `read_dicom`.
    """
    if choice.threshold is not None:
        raise UsageError(f"`{name}` holds segments of yes and no, no shares; leave `threshold` out.")
    return read_dicom(data, label=choice.label, name=name)


def read_dicom(data: bytes, *, label: int | None, name: str) -> LabelVolume:
    """Read a binary segmentation.

    Args:
        data: content of the file.
        label: segment that is meant, which wins where segments overlap; or None.
        name: of the file.

    Raises:
        InputError: it is no DICOM file or another one than a binary segmentation, is compressed or cut off, takes more
            than LARGEST_VOLUME, or its frames do not lie in one stack.
        UsageError: pydicom is not installed.
    """
    try:
        from pydicom import dcmread  # pyright: ignore[reportUnknownVariableType]
    except ImportError as error:
        raise missing("pydicom", extra="medical", work="reading DICOM files") from error
    if data[MARK_AT : MARK_AT + len(MARK)] != MARK:
        raise InputError(f"`{name}` does not begin as a DICOM file; export the segmentation again as DICOM.")
    with warnings.catch_warnings():
        # What pydicom warns of in a damaged file is found by the checks here.
        warnings.simplefilter("ignore")
        _check_syntax(data, name=name)
        content = dcmread(BytesIO(data))
        _check_kind(content, name=name)
        frames = _frames(content, name=name)
        return _volume(content, frames, label=label, name=name)


def _check_syntax(data: bytes, *, name: str) -> None:
    """Refuse packed files by the name of their packing, before anything is unpacked."""
    from pydicom.filereader import read_dataset
    from pydicom.uid import UID

    header = read_dataset(
        BytesIO(data[MARK_AT + len(MARK) :]),
        is_implicit_VR=False,
        is_little_endian=True,
        stop_when=lambda tag, _vr, _length: tag.group != 2,
    )
    syntax = UID(str(header.get("TransferSyntaxUID", "")))
    if syntax not in PLAIN:
        raise InputError(
            f"`{name}` is stored as {_shown(syntax.name) or 'an unknown transfer syntax'}, only uncompressed "
            "little endian files are read; export it so, or convert it with `dcmconv +te` or `gdcmconv --raw`."
        )


def _check_kind(content: Dataset, *, name: str) -> None:
    """Refuse what is no binary segmentation."""
    from pydicom.uid import UID

    kind = UID(str(content.get("SOPClassUID", "")))
    if kind != SEGMENTATION:
        raise InputError(
            f"`{name}` is a DICOM file of the kind {_shown(kind.name) or 'unknown'}, only segmentations "
            "(Segmentation Storage) hold labels; export the segmentation, not the images."
        )
    segmentation = str(content.get("SegmentationType", "unknown"))
    if segmentation != "BINARY" or int(content.get("BitsAllocated", 0)) != 1:
        raise InputError(
            f"`{name}` is a segmentation of type {_shown(segmentation)}, whose voxels are not binary: export it as "
            "BINARY, or as NIfTI with a border of your choice."
        )


def _frames(content: Dataset, *, name: str) -> _Frames:
    """Return where all frames lie."""
    groups, shared = content.PerFrameFunctionalGroupsSequence, content.get("SharedFunctionalGroupsSequence", [])
    count = int(content.NumberOfFrames)
    if count != len(groups) or count < 1:
        raise InputError(
            f"`{name}` announces {how_many(count, 'frame')} and gives positions for {len(groups)}. It is damaged: "
            "export it again."
        )

    def stated(sequence: str, key: str, group: Dataset) -> list[float]:
        for place in (group, *shared):
            if sequence in place and key in place[sequence][0]:
                return np.atleast_1d(np.asarray(place[sequence][0][key].value, dtype=np.float64)).tolist()
        return []

    def of_all(sequence: str, key: str, size: int) -> FloatArray:
        found = [stated(sequence, key, group) for group in groups]
        if any(len(values) != size for values in found):
            raise InputError(f"`{name}` has frames without `{key}`; export it again with its position in space.")
        return np.array(found)

    directions = of_all("PlaneOrientationSequence", "ImageOrientationPatient", 6)
    spacings = of_all("PixelMeasuresSequence", "PixelSpacing", 2)
    uneven = max(float(np.ptp(directions, axis=0).max()), float((np.ptp(spacings, axis=0) / spacings.max()).max()))
    if not uneven <= PLACE_TOLERANCE:
        raise InputError(f"`{name}` has frames of several directions or pixel sizes; export one stack of slices.")
    steps = stated("PixelMeasuresSequence", "SpacingBetweenSlices", groups[0])
    return _Frames(
        segments=of_all("SegmentIdentificationSequence", "ReferencedSegmentNumber", 1)[:, 0].astype(np.int64),
        places=of_all("PlanePositionSequence", "ImagePositionPatient", 3),
        rows=directions[0, 3:] * spacings[0, 0],
        columns=directions[0, :3] * spacings[0, 1],
        step=abs(steps[0]) if steps and steps[0] != 0.0 else None,
    )


def _stack(frames: _Frames, *, name: str) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the slice of each frame, the place of the first, and the shift from one slice to the next."""
    normal = np.cross(frames.columns, frames.rows)
    normal /= np.linalg.norm(normal)
    heights = frames.places @ normal
    pixel = float(np.linalg.norm(frames.columns))
    levels = np.sort(heights)
    gaps = np.diff(levels)
    gaps = gaps[gaps > SAME_SLICE * pixel]
    step = frames.step or (float(gaps.min()) if gaps.size else None)
    if step is None:
        raise InputError(f"`{name}` has a single slice and does not say how thick it is; export the whole volume.")
    numbers = np.rint((heights - levels[0]) / step)
    first, last = frames.places[np.argmin(heights)], frames.places[np.argmax(heights)]
    # Slices need not be shifted along their normal: oblique stacks are sheared.
    shift: FloatArray = (last - first) / numbers.max() if numbers.max() > 0 else normal * step
    missed = np.linalg.norm(frames.places - first - numbers[:, None] * shift, axis=1)
    if not missed.max() <= PLACE_TOLERANCE * max(step, pixel):
        worst = int(np.argmax(missed))
        raise InputError(
            f"`{name}`: slices {step:.4g} mm apart are not evenly stacked. Frame {worst + 1} is {missed[worst]:.3g} "
            f"mm off its place, at most {PLACE_TOLERANCE * max(step, pixel):.2g} mm are allowed: export evenly spaced "
            "slices.",
            missed=float(missed[worst]),
        )
    return numbers.astype(np.int64), first, shift


def _volume(content: Dataset, frames: _Frames, *, label: int | None, name: str) -> LabelVolume:
    """Return the labels of all frames on one grid."""
    numbers, first, shift = _stack(frames, name=name)
    affine = np.eye(4)
    affine[:3] = np.column_stack([frames.columns, frames.rows, shift, first])
    # Left, posterior, superior becomes right, anterior, superior.
    affine[:2] *= -1.0
    rows, columns = int(content.Rows), int(content.Columns)
    stored = np.dtype(np.uint16)
    shape = checked_shape((columns, rows, int(numbers.max()) + 1), affine, stored=stored, name=name)
    packed = bytes(content.PixelData)
    if 8 * len(packed) < numbers.size * rows * columns:
        raise InputError(
            f"`{name}` promises {how_many(numbers.size, 'frame')} of {columns} x {rows} voxels "
            f"({-(-numbers.size * rows * columns // 8)} bytes), but holds {len(packed)}. It is cut off: copy or "
            "export it again.",
            found=len(packed),
        )
    lowest, highest = int(frames.segments.min()), int(frames.segments.max())
    if lowest < 1 or highest > np.iinfo(stored).max:
        raise InputError(f"`{name}` has segments {lowest} to {highest}; they count from 1 to 65535: export it again.")
    labels = np.zeros(shape, dtype=stored)
    # The segment that is meant comes last and wins where several overlap.
    for frame in np.argsort(frames.segments == label, kind="stable").tolist():
        inside = _frame(packed, frame, size=rows * columns).reshape(rows, columns)
        labels[:, :, numbers[frame]][inside.T] = frames.segments[frame]
    present = tuple(sorted({int(number) for number in frames.segments}))
    return LabelVolume(labels, affine, "mm", _names(content), present)


def _frame(packed: bytes, frame: int, *, size: int) -> NDArray[np.bool_]:
    """Return the voxels of a frame, whose first bit need not begin a byte."""
    start, stop = frame * size, (frame + 1) * size
    content = np.frombuffer(packed, dtype=np.uint8, count=-(-stop // 8) - start // 8, offset=start // 8)
    return np.unpackbits(content, bitorder="little")[start % 8 :][:size].astype(np.bool_)


def _names(content: Dataset) -> dict[int, str]:
    """Return what the segments are called."""
    return {
        int(segment.SegmentNumber): _shown(str(segment.get("SegmentLabel", "")))
        for segment in content.get("SegmentSequence", [])
    }


def _shown(text: str) -> str:
    """Return what messages show of a text from the file."""
    return printable(text)[:LONGEST_NAME]
