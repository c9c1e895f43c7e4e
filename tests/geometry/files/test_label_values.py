"""Numbers of volumes: labels, shares of them, probabilities and images are told apart; what is left out is counted."""

from __future__ import annotations

import bz2
import gzip
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from geoprint import cli
from geoprint.config import job_of
from geoprint.errors import GeoprintError, InputError, UsageError
from geoprint.geometry import signed_volume
from geoprint.geometry.files import LabelFound, load_file, read_volume
from geoprint.model import FloatArray
from geoprint.reporting import inspection_summary, inspection_text
from geoprint.results import FileInspection
from geoprint.workflow import inspect_file
from geoprint.workflow.workpiece import read_part
from tests.geometry.files.volumes import save_nifti
from tests.shared_data import shared

pytestmark = pytest.mark.needs("nibabel", "skimage")
SIDE = 40


def away(middle: tuple[float, float, float], count: int = SIDE) -> FloatArray:
    """Return how far each voxel lies from a place [voxels]."""
    index = np.stack(np.meshgrid(*[np.arange(count, dtype=np.float64)] * 3, indexing="ij"), axis=-1)
    return np.linalg.norm(index - np.array(middle), axis=-1)


def two_balls() -> NDArray[np.uint8]:
    """Return a ball of label 1 and one of label 2, of 9 and 7 voxels."""
    labels = np.zeros((SIDE, SIDE, SIDE), dtype=np.uint8)
    labels[away((12.0, 20.0, 20.0)) <= 9.0] = 1
    labels[away((30.0, 20.0, 20.0)) <= 7.0] = 2
    return labels


def volume_of(path: Path, label: int | None = None, threshold: float | None = None) -> float:
    return signed_volume(load_file(path, unit=None, label=label, threshold=threshold).surface)


def test_a_number_within_a_thousandth_of_a_label_is_that_label(tmp_path: Path) -> None:
    labels = two_balls().astype(np.float32)
    labels += np.random.default_rng(0).uniform(-9e-4, 9e-4, labels.shape).astype(np.float32)
    save_nifti(tmp_path / "near.nii", labels, np.eye(4))
    volume = read_volume((tmp_path / "near.nii").read_bytes(), name="near.nii")
    assert np.array_equal(volume.labels, two_balls())
    assert volume.numbers == (1, 2)


@pytest.mark.parametrize("finer", [1.6, 2.0, 0.8])
def test_resampled_labels_keep_their_volume_and_no_label_lies_between_two(tmp_path: Path, finer: float) -> None:
    labels = two_balls()
    count = round(SIDE * finer)
    # Centres of the new voxels in the old grid.
    at = (np.arange(count) + 0.5) / finer - 0.5
    resampled = ndimage.map_coordinates(labels.astype(np.float32), np.meshgrid(at, at, at, indexing="ij"), order=1)
    save_nifti(tmp_path / "a.nii", resampled, np.diag([1 / finer, 1 / finer, 1 / finer, 1.0]))
    for label in (1, 2):
        true = float((labels == label).sum())
        assert volume_of(tmp_path / "a.nii", label) == pytest.approx(true, rel=0.01), label
    record = load_file(tmp_path / "a.nii", unit=None, label=1).reading.assumed
    assert record == ("resampled labels: a voxel between two has the one of which it holds 0.5 or more",)


def test_probabilities_are_taken_from_the_threshold_on(tmp_path: Path) -> None:
    shares = 1.0 / (1.0 + np.exp((away((20.0, 20.0, 20.0)) - 12.0) / 2.0))
    save_nifti(tmp_path / "p.nii", shares.astype(np.float32), np.eye(4))
    for threshold, radius in ((None, 12.0), (0.5, 12.0), (0.8, 12.0 - 2.0 * np.log(4.0))):
        assert volume_of(tmp_path / "p.nii", threshold=threshold) == pytest.approx(4 / 3 * np.pi * radius**3, rel=0.02)
    record = load_file(tmp_path / "p.nii", unit=None, threshold=0.8).reading.assumed
    assert record == ("probabilities of one label, 1, from 0.8 on",)


@pytest.mark.parametrize("kind", ["small", "scaled", "even"])
def test_intensities_from_0_to_1_are_probabilities_only_where_somebody_says_so(tmp_path: Path, kind: str) -> None:
    bump = np.exp(-((away((20.0, 20.0, 20.0)) / 12.0) ** 2))
    even = np.random.default_rng(1).uniform(size=bump.shape)
    values = {"small": 0.03 * bump, "scaled": bump, "even": even}[kind]
    save_nifti(tmp_path / "p.nii", values.astype(np.float32), np.eye(4))
    with pytest.raises(InputError, match=r"If they are probabilities .* with `threshold = 0\.5`"):
        load_file(tmp_path / "p.nii", unit=None)
    if kind == "scaled":
        # exp(-(r / 12)^2) is a half at 12 sqrt(ln 2) = 9.991.
        assert volume_of(tmp_path / "p.nii", threshold=0.5) == pytest.approx(4 / 3 * np.pi * 9.991**3, rel=0.02)


@pytest.mark.parametrize("kind", ["noise", "ramp", "shorts", "floats"])
def test_intensities_are_called_an_image(tmp_path: Path, kind: str) -> None:
    random = np.random.default_rng(1)
    ramp = np.broadcast_to(np.arange(SIDE, dtype=np.int16)[:, None, None], (SIDE,) * 3)
    smooth = 1000.0 * np.exp(-((away((20.0, 20.0, 20.0)) / 12.0) ** 2))
    values = {
        "noise": random.integers(0, 256, (SIDE,) * 3).astype(np.uint8),
        "ramp": ramp.copy(),
        "shorts": (smooth - 500.0).astype(np.int16),
        "floats": smooth.astype(np.float32),
    }[kind]
    save_nifti(tmp_path / "image.nii", values, np.eye(4))
    with pytest.raises(InputError, match=r"is an image of intensities from .*, not a volume of labels"):
        load_file(tmp_path / "image.nii", unit=None)


@pytest.mark.parametrize(
    ("threshold", "sentence"), [(0.5, "holds whole numbers, no shares"), (1.0, "`threshold = 1` is not a share")]
)
def test_a_threshold_that_nothing_takes_is_refused(tmp_path: Path, threshold: float, sentence: str) -> None:
    save_nifti(tmp_path / "a.nii", two_balls(), np.eye(4))
    with pytest.raises(UsageError, match=sentence):
        load_file(tmp_path / "a.nii", unit=None, label=1, threshold=threshold)


def test_inspecting_a_volume_lists_all_labels_and_succeeds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    labels = np.zeros((24, 24, 24), dtype=np.int16)
    blocks = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) * 6
    for number, (i, j, k) in enumerate(blocks.tolist(), start=1):
        labels[i : i + 4, j : j + 4, k : k + 4] = number
    grid = np.diag([-2.0, 1.0, 0.5, 1.0])
    grid[:3, 3] = [100.0, -7.0, 3.0]
    save_nifti(tmp_path / "many.nii", labels, grid)
    seen = inspect_file(tmp_path / "many.nii")
    assert [one.label for one in seen.labels] == list(range(1, 65))
    # Voxels 0 to 3 of each axis: half a voxel more at either end.
    first = seen.labels[0]
    assert (first.voxels, first.volume) == (64, 64.0)
    assert (first.low, first.high) == ((93.0, -7.5, 2.75), (101.0, -3.5, 4.75))
    assert list(inspection_summary(seen)) == ["name", "labels", "refusal", "reading"]
    monkeypatch.setattr("sys.argv", ["geoprint", "inspect", str(tmp_path / "many.nii")])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code
    assert "label 64: 64 voxels, 0.064 cm3, 8 x 4 x 2 mm from" in capsys.readouterr().out
    # A label without a surface is listed with the reason.
    thin = inspection_text(inspect_file(tmp_path / "many.nii", label=5))
    assert "about as thin as its voxels" in thin or "read: 64 voxels of label 5" in thin


def test_islands_and_pinholes_that_no_surface_shows_are_counted_and_take_no_volume(tmp_path: Path) -> None:
    labels = (away((20.0, 20.0, 20.0)) <= 12.0).astype(np.uint8)
    whole = int(labels.sum())
    labels[2:38:5, 2, 2] = 1
    labels[20, 20, 14:27:4] = 0
    save_nifti(tmp_path / "a.nii", labels, np.diag([0.5, 0.5, 0.5, 1.0]))
    loaded = load_file(tmp_path / "a.nii", unit=None)
    assert dict(loaded.reading.skipped) == {
        "islands too small for a surface (8 voxels, 1 mm3)": 8,
        "pinholes closed (4 voxels, 0.5 mm3)": 4,
    }
    assert signed_volume(loaded.surface) == pytest.approx(whole / 8.0, rel=2e-3)


FIELDS = {
    "type": "short", "dimension": "3", "sizes": "12 12 12", "encoding": "raw", "endian": "little",
    "space": "left-posterior-superior", "space directions": "(1,0,0) (0,1,0) (0,0,1)", "space origin": "(0,0,0)",
}  # fmt: skip


def nrrd_file(body: bytes | None = None, keys: str = "", **changed: str | None) -> bytes:
    """Return a cube of 6 voxels in a NRRD file whose fields, with blanks for underlines, are changed or left out."""
    labels = np.zeros((12, 12, 12), dtype="<i2")
    labels[3:9, 3:9, 3:9] = 1
    fields = FIELDS | {field.replace("_", " "): value for field, value in changed.items()}
    lines = "".join(f"{field}: {value}\n" for field, value in fields.items() if value is not None)
    return f"NRRD0005\n{lines}{keys}\n".encode() + (labels.tobytes() if body is None else body)


CUBE = nrrd_file().partition(b"\n\n")[2]
WORDS = " ".join(map(str, np.frombuffer(CUBE, dtype="<i2").tolist())).encode()


@pytest.mark.parametrize(
    "data",
    [
        nrrd_file(),
        nrrd_file(b"junk!!" + CUBE, byte_skip="6"),
        nrrd_file(b"any junk" + CUBE, byte_skip="-1"),
        nrrd_file(b"one\ntwo\n" + CUBE, line_skip="2"),
        nrrd_file(b"one\nsix..." + CUBE, lineskip="1", byteskip="6"),
        nrrd_file(gzip.compress(b"six..." + CUBE), encoding="gzip", byte_skip="6"),
        nrrd_file(b"line\n" + gzip.compress(CUBE), encoding="gz", line_skip="1"),
        nrrd_file(bz2.compress(b"six..." + CUBE), encoding="bzip2", byte_skip="6"),
        nrrd_file(b"line\n" + WORDS, encoding="ascii", endian=None, line_skip="1"),
        nrrd_file(WORDS.replace(b"1", b"1.0"), encoding="text", type="float", endian=None),
        nrrd_file(CUBE.hex("\n", 40).encode(), encoding="hex"),
        nrrd_file(
            np.frombuffer(CUBE, "<i2").astype(">i2").tobytes().hex().upper().encode(), encoding="hex", endian="big"
        ),
        nrrd_file(space_units='"mm" "mm" "mm"'),
        nrrd_file(space_units='"millimetres" "mm" "millimeters"'),
        nrrd_file(dimension="4", sizes="1 12 12 12", space_directions="none (1,0,0) (0,1,0) (0,0,1)"),
        nrrd_file(CUBE, dimension="4", sizes="12 12 12 1", space_directions="(1,0,0) (0,1,0) (0,0,1) none"),
    ],
)
def test_skips_list_axes_and_missing_units_of_nrrd_are_obeyed(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "a.nrrd").write_bytes(data)
    loaded = load_file(tmp_path / "a.nrrd", unit=None)
    assert loaded.unit == "mm"
    assert signed_volume(loaded.surface) == pytest.approx(216.0, rel=2e-3)
    low, high = loaded.vertices.min(axis=0), loaded.vertices.max(axis=0)
    np.testing.assert_allclose(0.5 * (low + high), [-5.5, -5.5, 5.5], atol=0.01)
    if b"space units" not in data:
        assert "mm (a patient's space without `space units`)" in loaded.reading.assumed


@pytest.mark.parametrize(
    ("data", "error", "sentence"),
    [
        (nrrd_file(CUBE + b"\0\0"), InputError, "holds more than the 12 x 12 x 12 voxels of 3456 bytes"),
        (nrrd_file(gzip.compress(CUBE + b"\0"), encoding="gzip"), InputError, "holds more than the 12 x 12 x 12"),
        (nrrd_file(CUBE[2:]), InputError, "it is cut off"),
        (nrrd_file(bz2.compress(CUBE)[:-9], encoding="bz2"), InputError, "cannot be unpacked"),
        (nrrd_file(gzip.compress(CUBE), encoding="bz2"), InputError, "cannot be unpacked"),
        (nrrd_file(WORDS[2:], encoding="ascii"), InputError, "it is cut off"),
        (nrrd_file(WORDS + b" 0", encoding="ascii"), InputError, "holds more than the 12 x 12 x 12"),
        (nrrd_file(b"x" + WORDS, encoding="ascii"), InputError, "promises .could not convert"),
        (nrrd_file(WORDS.replace(b"1", b"1_0"), encoding="ascii"), InputError, "promises .could not convert"),
        (nrrd_file(WORDS.replace(b"1", b"40000"), encoding="ascii"), InputError, "holds 40000, but its header"),
        (nrrd_file(WORDS, encoding="ascii", byte_skip="2"), InputError, "line 10: `byte skip` is '2'; text has no"),
        (nrrd_file(CUBE.hex()[1:].encode(), encoding="hex"), InputError, "hex, promises"),
        (nrrd_file(CUBE.hex()[2:].encode(), encoding="hex"), InputError, "it is cut off"),
        (nrrd_file(byte_skip="many"), InputError, "line 10: `byte skip` is 'many'"),
        (nrrd_file(endian=None), InputError, "does not say the order of its bytes"),
        (nrrd_file(turned="yes"), InputError, "line 10: 'turned: yes' is no field of NRRD"),
        (nrrd_file(spacings="1 2 1"), InputError, "it contradicts `space directions`"),
        (nrrd_file(space_units='"mm" "mm" "ms"'), InputError, "line 10: `space units` is"),
        (nrrd_file(space="right-superior-anterior"), InputError, "line 7: `space` is 'right-superior-anterior'"),
        (nrrd_file(dimension="4"), InputError, "has the dimension 4 and 3 sizes"),
        (nrrd_file(space_directions="(1,0,0) (0,1,0) none"), InputError, "`space directions` is .* three lie in space"),
        (nrrd_file(data_file="a.raw"), InputError, "keeps its data in another file"),
        (nrrd_file(old_min="0"), InputError, "holds quantised numbers"),
        (nrrd_file(CUBE * 2, dimension="4", sizes="12 12 12 2",
                   space_directions="(1,0,0) (0,1,0) (0,0,1) none"), InputError, "holds 2 values for each voxel"),
    ],
)  # fmt: skip
def test_a_field_of_nrrd_that_lies_or_is_unknown_is_refused(
    tmp_path: Path, data: bytes, error: type[GeoprintError], sentence: str
) -> None:
    (tmp_path / "a.nrrd").write_bytes(data)
    with pytest.raises(error, match=sentence):
        load_file(tmp_path / "a.nrrd", unit=None)


def test_overlapping_segments_are_chosen_by_number_and_shown_by_name(tmp_path: Path) -> None:
    wall, scar = np.zeros((2, 12, 12, 12), dtype="<i2")
    wall[2:10, 2:10, 2:10], scar[3:9, 3:9, 4:10] = 1, 1
    keys = "Segment0_Name:=LV wall\nSegment0_LabelValue:=1\nSegment0_Layer:=0\nSegment1_Name:=scar\n"
    keys += "Segment1_LabelValue:=1\nSegment1_Layer:=1\n"
    body = np.stack([wall, scar]).tobytes(order="F")
    directions = "none (1,0,0) (0,1,0) (0,0,1)"
    data = nrrd_file(body, keys, dimension="4", sizes="2 12 12 12", space_directions=directions)
    (tmp_path / "a.seg.nrrd").write_bytes(data)
    text = inspection_text(inspect_file(tmp_path / "a.seg.nrrd"))
    assert "label 1 'LV wall': 512 voxels" in text
    assert "label 2 'scar': 216 voxels" in text
    assert volume_of(tmp_path / "a.seg.nrrd", 1) == pytest.approx(512.0, rel=2e-3)
    assert volume_of(tmp_path / "a.seg.nrrd", 2) == pytest.approx(216.0, rel=2e-3)


def test_the_volumes_of_the_field_are_right() -> None:
    assert volume_of(shared("field/k6_resampled.nii.gz"), 1) == pytest.approx(6190.0, rel=0.01)
    cubes = [load_file(shared(f"field/{name}.nrrd"), unit=None) for name in ("ok", "bs_shift")]
    assert np.array_equal(cubes[0].vertices, cubes[1].vertices)
    np.testing.assert_allclose(np.ptp(cubes[0].vertices, axis=0), 6.2, atol=0.01)
    assert "label 2 'scar': 2176 voxels" in inspection_text(inspect_file(shared("field/k7_layers.seg.nrrd")))
    many = inspection_text(inspect_file(shared("field/k8_59_labels.nii.gz")))
    assert sum(line.startswith("label ") for line in many.splitlines()) == 59
    skipped = load_file(shared("field/k8_islands.nii.gz"), unit=None).reading.skipped
    assert skipped["islands too small for a surface (424 voxels, 217 mm3)"] == 418


def shares(one: LabelFound) -> tuple[tuple[int, float], ...]:
    return tuple((other.label, other.share) for other in one.touches)


def test_a_cavity_is_said_to_lie_inside_its_wall_and_who_touches_whom_over_how_much(tmp_path: Path) -> None:
    """A cup of label 1 about a cavity of label 5, open above, and a slab of label 3 on one side of the cup."""
    labels = np.zeros((24, 24, 24), dtype=np.uint8)
    labels[4:20, 4:20, 4:20] = 1
    labels[8:16, 8:16, 8:20] = 5
    labels[20:22, 4:20, 4:20] = 3
    save_nifti(tmp_path / "cup.nii", labels, np.diag([1.0, 1.0, 2.0, 1.0]))
    cup, slab, cavity = inspect_file(tmp_path / "cup.nii").labels
    # The cavity: four sides of 8 x 24 mm and a floor of 8 x 8 mm touch the cup; its lid of 8 x 8 mm touches nothing.
    assert shares(cavity) == ((1, pytest.approx((4 * 8 * 24 + 64) / (4 * 8 * 24 + 128))),)
    assert (cup.inside, slab.inside, cavity.inside) == (None, None, 1)
    # The slab touches the cup over one of its two sides of 16 x 32 mm, and never lies in it.
    assert shares(slab) == ((1, pytest.approx(512 / (2 * 512 + 2 * 64 + 2 * 32))),)
    # The cup: 4 x 512 outside, 256 below, a rim of 256 - 64, and the cavity.
    whole = 4 * 512 + 256 + 192 + 832
    assert shares(cup) == ((5, pytest.approx(832 / whole)), (3, pytest.approx(512 / whole)))
    text = inspection_text(inspect_file(tmp_path / "cup.nii"))
    assert "lies inside label 1; touches label 1 over 93 % of its surface, no label over 7 %" in text
    # Its surface has a place on each side, from which one is chosen.
    seen = inspect_file(tmp_path / "cup.nii", label=1)
    assert isinstance(seen, FileInspection)
    facing = {one.name.rsplit(",", 1)[0]: one for one in seen.landmarks if one.name.startswith("facing")}
    assert list(facing) == ["facing no label", "facing label 5", "facing label 3"]
    assert facing["facing label 3"].place[0] == pytest.approx(19.5, abs=0.2)
    assert facing["facing label 3"].normal == pytest.approx((1.0, 0.0, 0.0), abs=0.05)
    at, normal = (np.array(each) for each in (facing["facing label 5"].place, facing["facing label 5"].normal))
    assert labels[tuple(np.rint((at + normal) / [1.0, 1.0, 2.0]).astype(int))] == 5


def test_a_job_says_the_threshold_for_whoever_plans_and_measures(tmp_path: Path) -> None:
    shares = 1.0 / (1.0 + np.exp((away((20.0, 20.0, 20.0)) - 12.0) / 2.0))
    save_nifti(tmp_path / "p.nii", shares.astype(np.float32), np.eye(4))
    job = job_of(surface=tmp_path / "p.nii", threshold=0.8)
    spans = np.ptp(read_part(job).part.vertices, axis=0)
    # 0.8 lies where (r - 12) / 2 is -ln 4, and 0.5 at 12: within a voxel.
    assert spans == pytest.approx(np.full(3, 2.0 * (12.0 - 2.0 * np.log(4.0))), abs=1.0)
