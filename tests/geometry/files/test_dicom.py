"""DICOM segmentations: the same surface as that of the same NIfTI volume, whatever the order of the frames."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.spatial import KDTree

from geoprint.errors import InputError, UsageError
from geoprint.geometry import describe, prepare, signed_volume
from geoprint.geometry.files import load_file
from geoprint.medical.dicom_segmentation import read_dicom
from geoprint.medical.nifti_files import read_nifti
from tests.geometry.files.volumes import affine, ball_labels, dicom_bytes, item, save_nifti, segmentation
from tests.shared_data import shared

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

pytestmark = pytest.mark.needs("nibabel", "pydicom", "skimage")
# Odd numbers of voxels, so that frames do not begin with a byte.
CUBES, SLABS = (1.1, 1.1, 1.1), (0.9, 0.9, 3.0)


def write(path: Path, made: Dataset) -> Path:
    path.write_bytes(dicom_bytes(made))
    return path


def small() -> Dataset:
    labels = np.zeros((9, 7, 8), dtype=np.uint8)
    labels[2:7, 1:6, 1:7] = 1
    labels[4, 3, 3] = 2
    return segmentation(labels, np.diag([2.0, 2.0, 2.0, 1.0]))


@pytest.mark.parametrize("step", [True, False])
@pytest.mark.parametrize(
    ("sides", "angle", "hand"),
    [(CUBES, 0.0, "right"), (CUBES, 0.4, "left"), (SLABS, 0.4, "right"), (SLABS, 0.3, "left")],
)
def test_a_segmentation_gives_the_surface_of_the_same_nifti(
    tmp_path: Path, sides: tuple[float, float, float], angle: float, hand: str, *, step: bool
) -> None:
    grid = affine(sides, angle=angle, mirrored=hand == "left")
    labels = ball_labels(grid, sides)
    save_nifti(tmp_path / "ball.nii", labels, grid)
    write(tmp_path / "ball.dcm", segmentation(labels, grid, step=step))
    one, other = (load_file(tmp_path / name, unit=None, label=7).surface for name in ("ball.nii", "ball.dcm"))
    # The grid begins with the first slice that has voxels, and may run the other way: other vertices, same surface.
    assert signed_volume(one) == pytest.approx(signed_volume(other), rel=2e-3)
    assert len(one.vertices) == len(other.vertices)
    middle = (one.vertices.mean(axis=0), other.vertices.mean(axis=0))
    assert middle[0] == pytest.approx(middle[1], abs=1e-3)
    assert np.max(KDTree(other.vertices).query(one.vertices)[0]) < 1e-2
    assert describe(prepare(other)[0]) == "closed, genus 0"


def test_labels_are_listed_by_name_and_the_unit_is_that_of_the_format(tmp_path: Path) -> None:
    path = write(tmp_path / "two.dcm", small())
    with pytest.raises(UsageError, match=r"holds the labels 1 \(part 1, 149 voxels\), 2 \(part 2, 1 voxels\)"):
        load_file(path, unit=None)
    assert load_file(path, unit=None, label=1).unit == "mm"


def test_the_segment_that_is_meant_wins_where_several_overlap() -> None:
    made = small()
    for frame in made.PerFrameFunctionalGroupsSequence:
        frame.PlanePositionSequence[0].ImagePositionPatient = [0.0, 0.0, 2.0]
    data = dicom_bytes(made)
    one, two = (read_dicom(data, label=label, name="a.dcm").labels for label in (1, 2))
    assert (int((one == 2).sum()), int((two == 2).sum())) == (0, 1)


def test_a_slice_without_voxels_is_empty() -> None:
    labels = np.zeros((9, 7, 12), dtype=np.uint8)
    labels[2:7, 1:6, 1:4] = 1
    labels[2:7, 1:6, 8:11] = 1
    found = read_dicom(dicom_bytes(segmentation(labels, np.eye(4))), label=1, name="a.dcm").labels
    assert found.shape == (9, 7, 10)
    assert [bool(found[..., k].any()) for k in range(10)] == [True] * 3 + [False] * 4 + [True] * 3


def fractional(made: Dataset) -> None:
    made.SegmentationType = "FRACTIONAL"
    made.BitsAllocated = made.BitsStored = 8


def image(made: Dataset) -> None:
    made.SOPClassUID = "1.2.840.10008.5.1.4.1.1.2"


def short(made: Dataset) -> None:
    made.PixelData = made.PixelData[:10]


def turned(made: Dataset) -> None:
    frame = made.PerFrameFunctionalGroupsSequence[3]
    frame.PlaneOrientationSequence = [item(ImageOrientationPatient=[0, 1, 0, 0, 0, 1])]


def uneven(made: Dataset) -> None:
    place = made.PerFrameFunctionalGroupsSequence[2].PlanePositionSequence[0]
    place.ImagePositionPatient = [0, 0, float(place.ImagePositionPatient[2]) + 0.7]


def lost(made: Dataset) -> None:
    del made.PerFrameFunctionalGroupsSequence[1].PlanePositionSequence


def miscounted(made: Dataset) -> None:
    made.NumberOfFrames = 2_000_000_000


def huge(made: Dataset) -> None:
    made.Rows = made.Columns = 60_000


def alone(made: Dataset) -> None:
    made.PerFrameFunctionalGroupsSequence = made.PerFrameFunctionalGroupsSequence[:1]
    made.NumberOfFrames = 1
    del made.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0].SpacingBetweenSlices


def nought(made: Dataset) -> None:
    made.PerFrameFunctionalGroupsSequence[0].SegmentIdentificationSequence[0].ReferencedSegmentNumber = 0


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (fractional, "of type FRACTIONAL, whose voxels are not binary"),
        (image, "of the kind CT Image Storage, only segmentations"),
        (short, r"promises \d+ frames of 9 x 7 voxels \(\d+ bytes\), but holds 10"),
        (turned, "frames of several directions or pixel sizes"),
        (uneven, r"are not evenly stacked\. Frame \d+ is"),
        (lost, "has frames without `ImagePositionPatient`"),
        (miscounted, "announces 2000000000 frames and gives positions for"),
        (huge, "would unpack to"),
        (alone, "has a single slice and does not say how thick"),
        (nought, "has segments 0 to"),
    ],
)
def test_what_is_no_plain_stack_is_refused_by_name(
    tmp_path: Path, change: Callable[[Dataset], None], sentence: str
) -> None:
    made = small()
    change(made)
    with pytest.raises(InputError, match=sentence):
        load_file(write(tmp_path / "a.dcm", made), unit=None, label=1)


@pytest.mark.parametrize(
    ("syntax", "sentence"),
    [
        ("1.2.840.10008.1.2.5", "is stored as RLE Lossless, only uncompressed"),
        ("1.2.840.10008.1.2.1.99", "is stored as Deflated Explicit VR Little Endian, only uncompressed"),
        ("1.2.3", "is stored as 1.2.3, only uncompressed"),
    ],
)
def test_a_packed_file_is_refused_by_the_name_of_its_packing(tmp_path: Path, syntax: str, sentence: str) -> None:
    data = dicom_bytes(small(), syntax="1.2.840.10008.1.2.1")
    plain = b"1.2.840.10008.1.2.1\0"
    # The element before it tells the length of the group, the one itself its own.
    changed = syntax.encode() + b"\0" * (len(syntax) % 2)
    start = data.index(plain)
    data = data[: start - 2] + len(changed).to_bytes(2, "little") + changed + data[start + len(plain) :]
    (tmp_path / "a.dcm").write_bytes(data)
    with pytest.raises(InputError, match=sentence):
        load_file(tmp_path / "a.dcm", unit=None, label=1)


def test_what_is_no_dicom_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.dcm").write_bytes(b"not DICOM at all" * 20)
    with pytest.raises(InputError, match="does not begin as a DICOM file"):
        load_file(tmp_path / "a.dcm", unit=None)


def test_the_blood_pool_of_a_heart_has_the_volume_of_its_mesh(tmp_path: Path) -> None:
    content = shared("labels/rodero01_labels_sax_oblique_1.25x1.25x6mm.nii.gz").read_bytes()
    volume = read_nifti(content, name="heart.nii.gz")
    path = write(tmp_path / "heart.dcm", segmentation(volume.layers[0].astype(np.uint8), volume.affine))
    assert signed_volume(load_file(path, unit=None, label=11).surface) == pytest.approx(120_616.0, rel=0.015)
