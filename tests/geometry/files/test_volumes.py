"""Label volumes: the surface has the volume, place and smoothness that were meant, and files may not lie."""

from __future__ import annotations

import builtins
import gzip
from pathlib import Path

import numpy as np
import pytest

from geoprint import cli
from geoprint.errors import GeoprintError, InputError, UsageError
from geoprint.geometry import describe, face_normals, prepare, signed_volume, terrace_height
from geoprint.geometry.files import load, load_file, read_volume, save_ply
from geoprint.model import Surface
from geoprint.reporting import inspection_text
from geoprint.workflow import inspect_file
from tests import meshes
from tests.geometry.files.volumes import CENTRE, RADIUS, affine, ball_labels, save_nifti
from tests.shared_data import shared

pytestmark = pytest.mark.needs("nibabel", "nrrd", "skimage")
BALL = 4 / 3 * np.pi * RADIUS**3
CUBES, SLABS = (1.0, 1.0, 1.0), (0.8, 0.8, 3.0)


def lean(surface: Surface) -> float:
    """Return the 90th percentile of the angle between faces and the ball below them [degrees]."""
    out = surface.vertices[surface.faces].mean(axis=1) - CENTRE
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    return float(np.degrees(np.quantile(np.arccos(np.einsum("mx,mx->m", out, face_normals(surface))), 0.9)))


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize(
    ("sides", "angle", "hand"),
    [(CUBES, 0.0, "right"), (CUBES, 0.4, "left"), (SLABS, 0.4, "right"), (SLABS, 0.3, "left")],
)
def test_a_ball_is_a_ball_however_its_grid_lies(
    tmp_path: Path, suffix: str, sides: tuple[float, float, float], angle: float, hand: str
) -> None:
    grid = affine(sides, angle=angle, mirrored=hand == "left")
    labels = ball_labels(grid, sides)
    save_nifti(tmp_path / f"ball{suffix}", labels, grid)
    loaded = load_file(tmp_path / f"ball{suffix}", unit=None, label=7)
    voxels = float((labels == 7).sum() * abs(np.linalg.det(grid[:3, :3])))
    assert signed_volume(loaded.surface) == pytest.approx(voxels, rel=2e-3)
    assert voxels == pytest.approx(BALL, rel=2e-2)
    off = np.linalg.norm(loaded.surface.vertices - CENTRE, axis=1) - RADIUS
    assert np.abs(off).max() < 0.5 * max(sides)
    assert lean(loaded.surface) < (8.0 if sides == CUBES else 18.0)
    assert describe(prepare(loaded.surface)[0]) == "closed, genus 0"
    assert loaded.unit == "mm"
    assert dict(loaded.notes)["label"] == 7


def test_the_terraces_of_the_voxels_are_gone(tmp_path: Path) -> None:
    grid = affine(CUBES)
    save_nifti(tmp_path / "ball.nii", ball_labels(grid, CUBES), grid)
    # Faces of voxels lean up to 55 degrees from a ball; marching cubes of them still a fifth of a right angle.
    assert lean(load_file(tmp_path / "ball.nii", unit="mm", label=7).surface) < 7.0


@pytest.mark.parametrize(("unit", "length"), [(1, 1000.0), (2, 1.0), (0, 1.0)])
def test_labels_alone_are_read_with_their_places_in_mm(tmp_path: Path, unit: int, length: float) -> None:
    grid = affine(SLABS, angle=0.3, mirrored=True)
    save_nifti(tmp_path / "ball.nii.gz", ball_labels(grid, SLABS), grid, unit=unit)
    volume = read_volume((tmp_path / "ball.nii.gz").read_bytes(), name="ball.nii.gz")
    np.testing.assert_array_equal(volume.labels, ball_labels(grid, SLABS))
    np.testing.assert_allclose(volume.affine[:3], length * grid[:3], rtol=1e-6)
    assert volume.unit == "mm"
    with pytest.raises(
        UsageError, match=r"`ball.stl` is not a label volume: its name must end in .nii, .nii.gz, .nrrd"
    ):
        read_volume(b"", name="ball.stl")


def test_a_label_that_touches_the_end_of_its_volume_is_closed(tmp_path: Path) -> None:
    labels = np.ones((12, 14, 16), dtype=np.int16)
    save_nifti(tmp_path / "block.nii", labels, np.eye(4))
    surface = load_file(tmp_path / "block.nii", unit=None).surface
    assert describe(prepare(surface)[0]) == "closed, genus 0"
    assert signed_volume(surface) == pytest.approx(12 * 14 * 16, rel=2e-3)


def test_a_volume_without_a_unit_asks_for_it(tmp_path: Path) -> None:
    grid = affine(CUBES)
    save_nifti(tmp_path / "ball.nii", ball_labels(grid, CUBES), grid, unit=0)
    with pytest.raises(UsageError, match="has no unit"):
        load_file(tmp_path / "ball.nii", unit=None, label=7)
    assert load_file(tmp_path / "ball.nii", unit="mm", label=7).unit == "mm"


@pytest.mark.parametrize("encoding", ["raw", "gzip"])
@pytest.mark.parametrize("space", ["left-posterior-superior", "RAS"])
def test_nrrd_gives_the_surface_of_the_same_nifti(tmp_path: Path, encoding: str, space: str) -> None:
    grid = affine(SLABS, angle=0.3)
    labels = ball_labels(grid, SLABS)
    save_nifti(tmp_path / "ball.nii", labels, grid)
    flip = np.array([-1.0, -1.0, 1.0]) if space.startswith("left") else np.ones(3)
    header = {
        "space": space,
        "space directions": (grid[:3, :3] * flip[:, None]).T,
        "space origin": grid[:3, 3] * flip,
        "space units": ["mm", "mm", "mm"],
        "encoding": encoding,
    }
    import nrrd

    nrrd.write(str(tmp_path / "ball.nrrd"), labels, header)
    one, other = (load_file(tmp_path / name, unit=None, label=7).surface for name in ("ball.nii", "ball.nrrd"))
    volume = read_volume((tmp_path / "ball.nrrd").read_bytes(), name="ball.nrrd")
    np.testing.assert_array_equal(volume.labels, labels)
    # NIfTI keeps its affine in single precision.
    assert np.abs(one.vertices - other.vertices).max() < 1e-3


@pytest.mark.parametrize(
    ("label", "error", "sentence"),
    [
        (None, UsageError, r"holds the labels 3 \(1 voxels\), 7 \(\d+ voxels\); choose one with `--label N`"),
        (5, UsageError, "has no label 5; it holds 3"),
        (3, InputError, "about as thin as its voxels"),
    ],
)
def test_a_label_is_chosen_among_those_there(
    tmp_path: Path, label: int | None, error: type[GeoprintError], sentence: str
) -> None:
    grid = affine(CUBES)
    save_nifti(tmp_path / "ball.nii", ball_labels(grid, CUBES), grid)
    with pytest.raises(error, match=sentence):
        load_file(tmp_path / "ball.nii", unit=None, label=label)


def test_a_label_is_inspected_in_the_unit_that_the_volume_says(tmp_path: Path) -> None:
    grid = affine(CUBES)
    save_nifti(tmp_path / "ball.nii", ball_labels(grid, CUBES), grid)
    text = inspection_text(inspect_file(tmp_path / "ball.nii", label=7))
    assert "read in mm\n" in text
    assert "border: none" in text
    listed = inspection_text(inspect_file(tmp_path / "ball.nii"))
    assert "label 3: 1 voxel," in listed
    assert "`geoprint inspect ball.nii --label N` examines" in listed


def test_an_empty_volume_and_a_wall_thinner_than_voxels_are_refused(tmp_path: Path) -> None:
    labels = np.zeros((20, 20, 20), dtype=np.uint8)
    save_nifti(tmp_path / "empty.nii", labels, np.eye(4))
    with pytest.raises(InputError, match="holds no label"):
        load_file(tmp_path / "empty.nii", unit=None)
    labels[3:17, 3:17, 9] = 1
    save_nifti(tmp_path / "sheet.nii", labels, np.eye(4))
    with pytest.raises(InputError, match="about as thin as its voxels of 1 x 1 x 1"):
        load_file(tmp_path / "sheet.nii", unit=None)


def test_a_label_of_two_voxels_is_refused_with_a_command_that_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # A wall of one to two voxels around a ball, open below.
    offsets = np.stack(np.meshgrid(*[np.arange(32) - 15.5] * 3, indexing="ij"), axis=-1)
    away = np.linalg.norm(offsets, axis=-1)
    wall = ((away >= 11.0) & (away < 12.2) & (offsets[..., 2] > 2.0)).astype(np.uint8)
    save_nifti(tmp_path / "wall.nii", wall, np.diag([1.5, 1.5, 1.5, 1.0]))
    with pytest.raises(InputError, match=r"about as thin as its voxels of 1.5 x 1.5 x 1.5") as caught:
        load_file(tmp_path / "wall.nii", unit=None)
    command = str(caught.value).split("`geoprint ")[1].split("`")[0].split()
    assert " ".join(command) == "remesh wall.nii --label 1 --thin --smooth 6 --max-deviation 0.75 --out part.ply"
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["geoprint", *command])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code, capsys.readouterr().err
    surface, report = prepare(load(tmp_path / "part.ply", unit="mm"))
    assert report.topology == "closed, genus 0"
    assert signed_volume(surface) == pytest.approx(1.5**3 * wall.sum(), rel=0.02)
    # Before it is smoothed it is a staircase, and inspecting says what takes it off.
    rough = load_file(tmp_path / "wall.nii", unit=None, thin=True)
    assert dict(rough.notes)["smoothing_voxels"] == 0.0
    assert terrace_height(rough.surface) == pytest.approx(1.5)
    assert terrace_height(surface) is None
    save_ply(rough.surface, tmp_path / "rough.ply")
    said = inspection_text(inspect_file(tmp_path / "rough.ply", unit="mm"))
    advice = "`geoprint remesh rough.ply --smooth 6 --max-deviation 0.75 --out part.ply` removes them"
    assert f"staircase: steps of 1.5 mm, as around voxels; {advice}" in said


def test_slices_too_thick_for_a_wall_are_refused_without_a_promise(tmp_path: Path) -> None:
    grid = np.diag([1.0, 1.0, 6.0, 1.0])
    offsets = np.stack(np.meshgrid(*[np.arange(34) - 16.5] * 2, np.arange(6) * 6.0, indexing="ij"), axis=-1)
    away = np.linalg.norm(offsets, axis=-1)
    save_nifti(tmp_path / "thick.nii", ((away >= 14.0) & (away < 15.0)).astype(np.uint8), grid)
    with pytest.raises(InputError, match="use a volume with thinner slices"):
        load_file(tmp_path / "thick.nii", unit=None)
    with pytest.raises(UsageError, match=r"`mesh.ply` has no labels, .* leave `--thin` out"):
        load_file(tmp_path / "mesh.ply", unit="mm", thin=True)


def test_a_staircase_is_seen_however_its_grid_lies_and_other_parts_are_none() -> None:
    from skimage.measure import marching_cubes

    for sides in (CUBES, SLABS):
        grid = affine(sides, angle=0.4)
        inside = (ball_labels(grid, sides) == 7).astype(np.float64)
        vertices, faces, _, _ = marching_cubes(inside, 0.5, allow_degenerate=False)
        stairs = Surface(vertices=vertices @ grid[:3, :3].T + grid[:3, 3], faces=faces.astype(np.int64))
        assert terrace_height(stairs) == pytest.approx(max(sides), rel=1e-4)
    assert terrace_height(meshes.sphere()) is None
    assert terrace_height(meshes.plate()) is None


def test_a_file_that_promises_more_than_it_holds_is_refused(tmp_path: Path) -> None:
    grid = affine(CUBES)
    content = save_nifti(tmp_path / "ball.nii", ball_labels(grid, CUBES), grid)
    for name, damaged in (("cut.nii", content[:-100]), ("cut.nii.gz", gzip.compress(content[:-100]))):
        (tmp_path / name).write_bytes(damaged)
        with pytest.raises(InputError, match="it is cut off"):
            load_file(tmp_path / name, unit=None, label=7)
    (tmp_path / "packed.nii.gz").write_bytes(gzip.compress(content)[:-200])
    with pytest.raises(InputError, match="cannot be unpacked"):
        load_file(tmp_path / "packed.nii.gz", unit=None, label=7)


def test_a_header_cannot_take_memory_that_the_file_does_not_explain(tmp_path: Path) -> None:
    grid = affine(CUBES)
    content = bytearray(save_nifti(tmp_path / "ball.nii", ball_labels(grid, CUBES), grid))
    content[42:48] = np.array([4000, 4000, 4000], dtype="<i2").tobytes()
    (tmp_path / "huge.nii").write_bytes(content)
    with pytest.raises(InputError, match="at most 1024 MiB are read"):
        load_file(tmp_path / "huge.nii", unit=None, label=7)
    content[42:48] = np.array([900, 900, 900], dtype="<i2").tobytes()
    (tmp_path / "short.nii").write_bytes(content)
    with pytest.raises(InputError, match="promises 900 x 900 x 900 voxels"):
        load_file(tmp_path / "short.nii", unit=None, label=7)


@pytest.mark.parametrize(
    ("content", "name", "sentence"),
    [
        (b"not a volume at all" * 40, "a.nii", "does not begin with a NIfTI header"),
        (gzip.compress(b"no" * 400, mtime=0), "a.nii.gz", "does not begin with a NIfTI header"),
        (b"not a volume", "a.nrrd", "does not begin with a NRRD header"),
        (b"NRRD0004\n" + b"# long\n" * 10_000, "a.nrrd", "without the empty line that ends it"),
        (b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: /etc/passwd\n\n", "a.nrrd",
         "keeps its data in another file"),
        (b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: zlib\n\n", "a.nrrd", "packed as zlib"),
        (b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\nabcdefgh", "a.nrrd", "no `space dir"),
    ],
)  # fmt: skip
def test_what_is_no_volume_is_refused_by_name(tmp_path: Path, content: bytes, name: str, sentence: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=sentence):
        load_file(tmp_path / name, unit="mm")


@pytest.mark.parametrize(
    ("place", "value", "sentence"),
    [
        (70, np.int16(9999), r"states the data type 9999, labels have one of 2, 4, 8"),
        (80, np.float32(np.nan), "states voxels of nan x 1 x 1"),
        (84, np.float32(0.0), "states voxels of 1 x 0 x 1 .* sides are above 0"),
        (108, np.float32(np.inf), "from byte inf on"),
        (116, np.float32(np.inf), "has a damaged NIfTI header"),
        (344, b"nope", r"has the magic b'nope' at the end of its header; NIfTI has b'n\+1'"),
        (344, bytes(4), r"has the magic b''"),
        (344, b"ni1\0", "is half a NIfTI file"),
    ],
)
def test_a_header_that_lies_is_refused_by_what_is_wrong(
    tmp_path: Path, place: int, value: np.generic | bytes, sentence: str
) -> None:
    grid = affine(CUBES)
    content = bytearray(save_nifti(tmp_path / "ball.nii", ball_labels(grid, CUBES), grid))
    damage = value if isinstance(value, bytes) else value.tobytes()
    content[place : place + len(damage)] = damage
    (tmp_path / "ball.nii").write_bytes(content)
    with pytest.raises(InputError, match=sentence):
        load_file(tmp_path / "ball.nii", unit=None, label=7)


def test_a_flat_affine_and_a_series_of_volumes_are_refused(tmp_path: Path) -> None:
    labels = np.ones((8, 8, 8), dtype=np.uint8)
    save_nifti(tmp_path / "flat.nii", labels, np.diag([1.0, 1.0, 1e-12, 1.0]))
    with pytest.raises(InputError, match="voxels of 1 x 1 x 1e-12; one side may be 20 times"):
        load_file(tmp_path / "flat.nii", unit="mm")
    squeezed = np.eye(4)
    squeezed[:3, 2] = squeezed[:3, 1]
    save_nifti(tmp_path / "squeezed.nii", labels, squeezed)
    with pytest.raises(InputError, match="squeezes its voxels flat"):
        load_file(tmp_path / "squeezed.nii", unit="mm")
    save_nifti(tmp_path / "series.nii", np.ones((8, 8, 8, 3), dtype=np.uint8), np.eye(4))
    with pytest.raises(InputError, match="volume of 8 x 8 x 8 x 3"):
        load_file(tmp_path / "series.nii", unit="mm")


def test_a_missing_package_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grid = affine(CUBES)
    save_nifti(tmp_path / "ball.nii", ball_labels(grid, CUBES), grid)
    real = builtins.__import__

    def without(name: str, *rest: object) -> object:
        if name == "nibabel":
            raise ImportError(name)
        return real(name, *rest)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(UsageError, match=r"pip install -e '.*\[medical\]'"):
        load_file(tmp_path / "ball.nii", unit=None, label=7)


def test_a_label_for_a_mesh_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="has no labels"):
        load_file(tmp_path / "a.stl", unit="mm", label=1)


@pytest.mark.parametrize("name", ["rodero01_labels_1mm_ras", "rodero01_labels_sax_oblique_1.25x1.25x6mm"])
def test_the_blood_pool_of_a_heart_has_the_volume_of_its_mesh(name: str) -> None:
    loaded = load_file(shared(f"labels/{name}.nii.gz"), unit=None, label=11)
    assert signed_volume(loaded.surface) == pytest.approx(120_616.0, rel=0.015)
