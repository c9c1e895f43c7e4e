"""Makers of label volumes: a ball in voxels, where and however the grid lies, as NIfTI, NRRD or DICOM files."""

from __future__ import annotations

import gzip
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from geoprint.model import FloatArray

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

RADIUS = 12.0
CENTRE = np.array([30.0, -20.0, 50.0])


def affine(sides: tuple[float, float, float], *, angle: float = 0.0, mirrored: bool = False) -> FloatArray:
    """Return a grid of voxels with these sides [mm] about the ball, turned about z and x, and mirrored on request."""
    turn_z = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    turn_x = np.array([[1.0, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    result = np.eye(4)
    result[:3, :3] = turn_z @ turn_x @ np.diag(sides) @ np.diag([-1.0 if mirrored else 1.0, 1.0, 1.0])
    result[:3, 3] = CENTRE - result[:3, :3] @ (np.array(shape(sides)) / 2.0)
    return result


def shape(sides: tuple[float, float, float]) -> tuple[int, ...]:
    """Return how many voxels hold the ball."""
    return tuple(int(2.6 * RADIUS / side) + 2 for side in sides)


def ball_labels(grid: FloatArray, sides: tuple[float, float, float], *, label: int = 7) -> NDArray[np.uint8]:
    """Return the voxels whose centres lie in the ball, and one voxel of label 3 in a corner."""
    index = np.stack(np.meshgrid(*(np.arange(count) for count in shape(sides)), indexing="ij"), axis=-1)
    centres = index @ grid[:3, :3].T + grid[:3, 3]
    labels = np.where(np.linalg.norm(centres - CENTRE, axis=-1) <= RADIUS, label, 0).astype(np.uint8)
    labels[0, 0, 0] = 3
    return labels


def save_nifti(path: Path, labels: NDArray[np.generic], grid: FloatArray, *, unit: int = 2) -> bytes:
    """Write a NIfTI file, gzipped where its name ends so, and return it unpacked; unit 2 is mm, 0 unknown."""
    import nibabel

    image = nibabel.Nifti1Image(labels, grid)
    content = bytearray(image.to_bytes())
    content[123] = unit
    path.write_bytes(gzip.compress(bytes(content)) if path.suffix == ".gz" else bytes(content))
    return bytes(content)


def segmentation(labels: NDArray[np.uint8], grid: FloatArray, *, step: bool = True) -> Dataset:
    """Return a binary DICOM segmentation: a frame for each slice and label that has voxels, in a shuffled order.

    Args:
        labels: (i, j, k), its values the numbers of the segments.
        grid: affine of it, right, anterior, superior.
        step: whether the file says how far apart slices are.
    """
    patient = np.diag([-1.0, -1.0, 1.0, 1.0]) @ grid
    sides = np.linalg.norm(grid[:3, :3], axis=0)
    names = [int(label) for label in np.unique(labels)[1:]]
    pairs = [(k, label) for label in names for k in range(labels.shape[2]) if bool(np.isin(label, labels[..., k]))]
    shown: list[tuple[int, int]] = [pairs[place] for place in np.random.default_rng(4).permutation(len(pairs))]
    frames = [
        item(
            PlanePositionSequence=[item(ImagePositionPatient=digits(patient[:3, 3] + k * patient[:3, 2]))],
            SegmentIdentificationSequence=[item(ReferencedSegmentNumber=label)],
        )
        for k, label in shown
    ]
    cosines = np.concatenate([patient[:3, 0] / sides[0], patient[:3, 1] / sides[1]])
    measures = item(PixelSpacing=digits(sides[[1, 0]]))
    if step:
        measures.SpacingBetweenSlices = digits(sides[2:])[0]
    bits = np.concatenate([np.equal(labels[..., k], label).ravel(order="F") for k, label in shown])
    packed = np.packbits(bits, bitorder="little").tobytes()
    return item(
        SOPClassUID="1.2.840.10008.5.1.4.1.1.66.4", SOPInstanceUID="1.2.3.4", Modality="SEG",
        SegmentationType="BINARY", Rows=labels.shape[1], Columns=labels.shape[0], NumberOfFrames=len(shown),
        SamplesPerPixel=1, BitsAllocated=1, BitsStored=1, HighBit=0, PixelRepresentation=0,
        PhotometricInterpretation="MONOCHROME2", PerFrameFunctionalGroupsSequence=frames,
        SharedFunctionalGroupsSequence=[
            item(
                PlaneOrientationSequence=[item(ImageOrientationPatient=digits(cosines))],
                PixelMeasuresSequence=[measures],
            )
        ],
        SegmentSequence=[item(SegmentNumber=label, SegmentLabel=f"part {label}") for label in names],
        PixelData=packed + bytes(len(packed) % 2),
    )  # fmt: skip


def item(**values: object) -> Dataset:
    """Return a data set with these elements."""
    from pydicom.dataset import Dataset

    made = Dataset()
    for key, value in values.items():
        setattr(made, key, value)
    return made


def digits(values: FloatArray) -> list[str]:
    """Return numbers as DICOM writes them: 16 characters at most."""
    return [f"{value:.9g}" for value in values.tolist()]


def dicom_bytes(made: Dataset, *, syntax: str = "1.2.840.10008.1.2.1") -> bytes:
    """Return a DICOM file."""
    from pydicom import dcmwrite  # pyright: ignore[reportUnknownVariableType]
    from pydicom.dataset import FileMetaDataset
    from pydicom.uid import UID

    made.file_meta = FileMetaDataset()
    made.file_meta.TransferSyntaxUID = UID(syntax)
    made["PixelData"].VR = "OB"
    buffer = BytesIO()
    dcmwrite(buffer, made, enforce_file_format=True)
    return buffer.getvalue()
