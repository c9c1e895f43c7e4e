"""Fibres of a ventricle's wall by its labels: planned, planned again; and a real wall, checked independently."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import geoprint
from geoprint.config import job_of, packaged_cell_text, read_field
from geoprint.errors import FieldError, UsageError, VerificationError
from geoprint.fibers import DirectionField, WallVoxels
from geoprint.fibers.pattern import lines_of
from geoprint.geometry import face_areas, face_normals, remesh
from geoprint.geometry.files import load_file, read_volume, save_ply
from geoprint.layers.stacking import plan_stack
from geoprint.model import FloatArray, Surface
from geoprint.reporting.plan import record_plan
from geoprint.workflow import plan, save_plan
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import prepare_workpiece
from tests.fibers.hollow_ball import ball_voxels, skin
from tests.fibers.tetrahedra import solved
from tests.geometry.files.volumes import save_nifti
from tests.shared_data import shared

pytestmark = pytest.mark.needs("nibabel", "skimage")
LABELS = "labels/rodero01_labels_1mm_ras.nii.gz"
WALL, CAVITY, BASE = [1, 7], [11], [3, 5]
EPICARDIAL, ENDOCARDIAL = -60.0, 60.0
# Of the cavity's surface, on the free wall, where the wall is 10 mm thick.
MIDDLE, RADIUS = [115.8, 69.1, 21.2], 6.0
# From the apex to the base; and from how far on in that direction the ventricle is taken for base [mm].
AXIS, SHORT, BEYOND = np.array([-0.511, 0.539, 0.670]), 14.0, 18.0
LAYERS = (1, 4, 8)


def _field(folder: Path, volume: str, *, wall: list[int], cavity: list[int], base: list[int]) -> Path:
    path = folder / "own.toml"
    path.write_text(
        f'[wall]\nvolume = "{volume}"\nlabels = {wall}\ncavity = {cavity}\nbase = {base}\n'
        f"epicardial_deg = {EPICARDIAL}\nendocardial_deg = {ENDOCARDIAL}\n"
    )
    return path


def _written(voxels: WallVoxels, path: Path) -> None:
    """Write a wall, its cavity and what is beyond its base as the labels 1, 2 and 3."""
    labels = np.where(voxels.wall, 1, np.where(voxels.cavity, 2, np.where(voxels.base, 3, 0)))
    save_nifti(path, labels.astype(np.uint8), voxels.affine)


def test_fibres_in_a_wall_are_planned_again_to_the_same_bytes_without_the_volume(tmp_path: Path) -> None:
    _written(ball_voxels(), tmp_path / "ball.nii.gz")
    save_ply(skin(18.0, top=-10.0), tmp_path / "skin.ply")
    job = job_of(
        surface=tmp_path / "skin.ply", unit="mm", spacing=3.0, pattern="fibres", robot=False,
        field=_field(tmp_path, "ball.nii.gz", wall=[1], cavity=[2], base=[3]),
    )  # fmt: skip
    planned = plan(job)
    record = record_plan(planned).paths.fibres
    assert record is not None
    # At 18 mm of the 15 to 25 of the ball: 0.583 of the way, by the harmonic depth.
    assert record.helix_mean_deg == pytest.approx(10.0, abs=2.0)
    save_plan(planned, tmp_path / "out")
    (tmp_path / "ball.nii.gz").unlink()
    save_plan(plan(geoprint.job_from(tmp_path / "out")), tmp_path / "again")
    assert 'volume = "field/ball.nii.gz"' in (tmp_path / "out" / "field.toml").read_text()
    assert (tmp_path / "out" / "manifest.json").read_bytes() == (tmp_path / "again" / "manifest.json").read_bytes()
    (tmp_path / "out" / "field" / "ball.nii.gz").write_bytes(b"another")
    with pytest.raises(VerificationError, match=r"ball.nii.gz: the file was changed after it was written"):
        geoprint.job_from(tmp_path / "out")


def test_a_part_off_the_wall_and_what_is_no_volume_are_refused(tmp_path: Path) -> None:
    _written(ball_voxels(), tmp_path / "ball.nii")
    lines = lines_of(read_field(_field(tmp_path, "ball.nii", wall=[1], cavity=[2], base=[3])))
    with pytest.raises(FieldError, match=r"lies off the wall of ball.nii, by more than 2.5 voxels\. Plan within"):
        lines(skin(30.0))
    (tmp_path / "ball.ply").write_bytes(b"")
    other = lines_of(read_field(_field(tmp_path, "ball.ply", wall=[1], cavity=[2], base=[3])))
    with pytest.raises(UsageError, match=r"`ball.ply` is not a label volume: its name must end in .nii"):
        other(skin(18.0))


def test_a_stack_off_the_wall_is_refused_before_a_layer_is_planned(tmp_path: Path) -> None:
    _written(ball_voxels(), tmp_path / "ball.nii.gz")
    save_ply(skin(28.0, top=-12.0), tmp_path / "skin.ply")
    job = job_of(
        surface=tmp_path / "skin.ply", unit="mm", spacing=3.0, pattern="fibres", robot=False, thickness=1.0,
        field=_field(tmp_path, "ball.nii.gz", wall=[1], cavity=[2], base=[3]),
    )  # fmt: skip
    seen = list[str]()
    with pytest.raises(FieldError, match=r"^layer 2: .* lies off the wall of ball.nii.gz"):
        plan_stack(job, tmp_path / "out", observe=seen.append)
    assert seen == ["layers"]
    assert not (tmp_path / "out").exists()


def _cut_short(path: Path) -> None:
    """Write the labels of the ventricle as if its base began not far beyond the patch: solving for less is cheaper."""
    volume = read_volume(shared(LABELS).read_bytes(), name=LABELS)
    labels, affine = volume.labels.astype(np.uint8), volume.affine.copy()
    places = np.indices(labels.shape).transpose(1, 2, 3, 0) @ affine[:3, :3].T + affine[:3, 3]
    along = (places - MIDDLE) @ AXIS
    labels[(labels > 0) & (along > SHORT)] = BASE[0]
    labels[along > BEYOND] = 0
    used = np.argwhere(np.isin(labels, WALL + CAVITY))
    low, high = np.maximum(used.min(axis=0) - 5, 0), used.max(axis=0) + 6
    affine[:3, 3] += affine[:3, :3] @ low
    save_nifti(path, np.ascontiguousarray(labels[tuple(map(slice, low, high))]), affine)


@pytest.fixture(scope="module")
def ventricle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ventricle") / "labels.nii.gz"
    _cut_short(path)
    return path


@pytest.fixture(scope="module")
def layers(ventricle: Path) -> list[tuple[Surface, DirectionField]]:
    """Return layers over a patch of the cavity through the whole wall, and the fibres on each."""
    path, folder = ventricle, ventricle.parent
    for name, label, edge_length in (("cavity", 11, 1.5), ("wall", 1, 1.8)):
        found = remesh(load_file(path, unit="mm", label=label).surface, edge_length=edge_length)
        save_ply(found, folder / f"{name}.ply")
    cell = packaged_cell_text("irb120-bent45").replace("layer_height_mm = 0.5", "layer_height_mm = 1.3")
    (folder / "cell.toml").write_text(re.sub(r"(?m)^standoff_mm = .*", "standoff_mm = 1.3", cell))
    field = _field(folder, str(path), wall=WALL, cavity=CAVITY, base=BASE)
    made: list[tuple[Surface, DirectionField]] = []
    for layer in LAYERS:
        job = job_of(
            surface=folder / "cavity.ply", unit="mm", patches=[{"at": MIDDLE, "radius": RADIUS}], spacing=2.0,
            target=folder / "wall.ply", layer=layer, cell=folder / "cell.toml", pattern="fibres", field=field,
            robot=False,
        )  # fmt: skip
        workpiece = prepare_workpiece(job, Stages(lambda _: None), backends=["heat"])
        assert workpiece.place is not None
        assert workpiece.place.count == 8
        made.append((workpiece.surface, lines_of(read_field(field), place=workpiece.place)(workpiece.surface)))
    return made


def test_layers_through_a_real_wall_have_the_fibres_of_the_rule(
    ventricle: Path, layers: list[tuple[Surface, DirectionField]]
) -> None:
    own = solved(ventricle, wall=WALL, cavity=CAVITY, base=BASE)
    off, within, areas, helix = list[FloatArray](), list[FloatArray](), list[FloatArray](), list[float]()
    for surface, field in layers:
        wanted, angles = own.fibres(
            surface.vertices[surface.faces].mean(axis=1),
            epicardial=np.radians(EPICARDIAL),
            endocardial=np.radians(ENDOCARDIAL),
        )
        normals, along = face_normals(surface), field.directions()[:, 0]
        tangent = wanted - np.einsum("mx,mx->m", wanted, normals)[:, None] * normals
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        areas.append(face_areas(surface))
        helix.append(float(np.average(np.degrees(angles), weights=areas[-1])))
        for found, line in ((off, wanted), (within, tangent)):
            found.append(np.degrees(np.arccos(np.clip(np.abs(np.einsum("mx,mx->m", along, line)), 0.0, 1.0))))
        assert field.singularities().vertices.size == 0
        assert np.average(within[-1], weights=areas[-1]) < 1.0
    # From 60 degrees at the cavity to -60 outside, layer after layer.
    assert (np.diff(helix) < -8.0 * np.diff(LAYERS)).all()
    assert helix[0] > 45.0
    assert helix[-1] < -55.0
    weights = np.concatenate(areas)
    # The rule's fibres leave the layers where the wall grows thicker: that is the most of what they are off.
    assert np.average(np.concatenate(off), weights=weights) < 2.5
    assert np.average(np.concatenate(within), weights=weights) < 0.75


def test_labels_lie_where_the_file_says_they_do() -> None:
    path = shared(LABELS)
    volume = read_volume(path.read_bytes(), name=path.name)
    assert volume.unit == "mm"
    np.testing.assert_allclose(volume.affine[:3, 3], [-6.01241112, -6.0147624, -5.93428326])
