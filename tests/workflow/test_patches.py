"""Choosing the patch on a body: by point and radius, box and cone; told or refused in one sentence."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from geoprint.cli.application import app
from geoprint.config import job_of
from geoprint.errors import FieldError, GeoprintError, InputError, UsageError
from geoprint.geometry import boundary_loops, face_areas, face_normals
from geoprint.geometry.files import load, save_ply
from geoprint.model import FloatArray, Surface
from geoprint.reporting import patch_text, summary
from geoprint.results import Patch
from geoprint.workflow import PatchChoice, check_bundle, cut_patch, plan
from tests.meshes import plate, sphere
from tests.shared_data import shared

RADIUS = 20.0


def chosen(
    at: tuple[float, float, float] | None = None,
    *,
    radius: float | None = None,
    box: FloatArray | None = None,
    cone: float | None = None,
) -> PatchChoice:
    return PatchChoice(at=None if at is None else np.array(at), radius=radius, box=box, cone=cone)


def ball() -> Surface:
    return sphere(radius=RADIUS, subdivisions=4, jitter_seed=1)


def outward(patch: Patch) -> bool:
    middles = patch.surface.vertices[patch.surface.faces].mean(axis=1)
    return bool(np.einsum("mx,mx->m", face_normals(patch.surface), middles).min() > 0.0)


def test_a_disc_of_a_sphere_has_the_area_of_its_cap_and_a_round_rim() -> None:
    patch = cut_patch(ball(), chosen((0.0, 0.0, RADIUS), radius=12.0))
    assert face_areas(patch.surface).sum() == pytest.approx(2 * np.pi * RADIUS**2 * (1 - np.cos(0.6)), rel=5e-3)
    rim = patch.surface.vertices[boundary_loops(patch.surface)[0]]
    along = RADIUS * np.arccos(rim[:, 2] / np.linalg.norm(rim, axis=1))
    assert np.abs(along - 12.0).max() < 0.05
    assert patch.preparation.topology == "disc"
    assert outward(patch)


def test_a_coarse_body_is_refined_only_where_the_patch_lies() -> None:
    patch = cut_patch(plate(size=(400.0, 300.0), divisions=(2, 2)), chosen((150.0, 140.0, 0.0), radius=30.0))
    assert face_areas(patch.surface).sum() == pytest.approx(np.pi * 30.0**2, rel=5e-3)
    assert len(patch.body.faces) == 8


def test_a_body_wound_inward_still_gives_a_patch_that_faces_out() -> None:
    inward = replace(ball(), faces=ball().faces[:, ::-1])
    patch = cut_patch(inward, chosen((0.0, 0.0, RADIUS), radius=8.0))
    assert outward(patch)
    assert "against the file's winding" in patch_text(patch)


def test_an_open_body_faces_as_the_file_winds_it() -> None:
    said = patch_text(cut_patch(plate(), chosen((20.0, 15.0, 0.0), radius=8.0)))
    assert "as the file winds it" in said
    assert ", rim " in said


def test_a_box_cuts_straight() -> None:
    patch = cut_patch(plate(), chosen(box=np.array([[5.0, 5.0, -1.0], [25.0, 15.0, 1.0]])))
    assert face_areas(patch.surface).sum() == pytest.approx(200.0, rel=1e-9)
    assert patch.missed is None


def test_a_cone_cuts_where_the_normal_has_turned_as_far() -> None:
    patch = cut_patch(ball(), chosen((0.0, 0.0, RADIUS), cone=0.5))
    assert face_areas(patch.surface).sum() == pytest.approx(2 * np.pi * RADIUS**2 * (1 - np.cos(0.5)), rel=2e-2)


def test_a_box_with_a_point_keeps_the_side_of_the_point() -> None:
    slab = np.array([[-5.0, -5.0, -30.0], [5.0, 5.0, 30.0]])
    patch = cut_patch(ball(), chosen((0.0, 0.0, -RADIUS), box=slab))
    assert patch.surface.vertices[:, 2].max() < 0.0


def test_a_defect_elsewhere_on_the_body_does_no_harm() -> None:
    body = ball()
    far = int(np.argmin(body.vertices[:, 2]))
    fin = np.array([[far, body.faces[0, 0], len(body.vertices)]])
    broken = replace(body, vertices=np.vstack([body.vertices, [0.0, 0.0, -40.0]]), faces=np.vstack([body.faces, fin]))
    assert cut_patch(broken, chosen((0.0, 0.0, RADIUS), radius=8.0)).preparation.topology == "disc"


@pytest.mark.parametrize(
    ("choice", "error", "sentence"),
    [
        (chosen((0.0, 0.0, 30.0), radius=8.0), InputError, "lies 10 mm off sphere, at most 2 mm is allowed"),
        (chosen((0.0, 0.0, RADIUS), radius=90.0), FieldError, "all of sphere lies within 90 mm of the point"),
        (chosen(box=np.array([[50.0] * 3, [60.0] * 3])), InputError, "has no part within the given bounds"),
    ],
)
def test_what_cannot_be_cut_is_refused(choice: PatchChoice, error: type[GeoprintError], sentence: str) -> None:
    with pytest.raises(error, match=sentence):
        cut_patch(ball(), choice)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"patch": {"radius": 5.0}}, "needs its point"),
        ({"patch": {"cone_deg": 5.0}}, "needs its point"),
        ({"patch": {"at": [0.0, 0.0, 0.0]}}, "a patch needs a bound"),
        ({"patch": {"box": [1.0, 0.0, 0.0, 0.0, 1.0, 1.0]}}, "lowest x y z, then its highest"),
        ({"label": 0}, "label"),
    ],
)
def test_a_job_whose_patch_is_unclear_is_refused(values: dict[str, object], sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence):
        job_of(surface=Path("a.ply"), unit="mm", spacing=1.0, **values)


def test_a_patch_is_planned_from_its_body_with_one_command_and_the_body_stays_in_the_way(tmp_path: Path) -> None:
    save_ply(ball(), tmp_path / "ball.ply")
    job = job_of(
        surface=tmp_path / "ball.ply",
        unit="mm",
        patch={"at": [0.0, 0.0, RADIUS], "radius": 10.0},
        spacing=2.0,
        robot=False,
    )
    planned = plan(job)
    assert planned.workpiece.body is not None
    assert len(planned.workpiece.body.faces) == len(ball().faces)
    assert planned.workpiece.side.source == "body"
    said = json.loads(json.dumps(summary(planned)))
    assert said["settings"]["patches"][0]["radius"] == 10.0
    assert said["patches"][0]["topology"] == "disc"


def test_the_command_writes_the_patch_in_mm_and_replaces_nothing_unasked(tmp_path: Path) -> None:
    save_ply(ball(), tmp_path / "ball.ply")
    out = tmp_path / "patch.ply"
    command = ["patch", str(tmp_path / "ball.ply"), "--unit", "cm", "--at", "0", "0", "200", "--radius", "80"]
    done = CliRunner().invoke(app, [*command, "--out", str(out), "--json"], catch_exceptions=False)
    assert done.exit_code == 0
    assert json.loads(done.stdout)["topology"] == "disc"
    assert face_areas(load(out, unit="mm")).sum() == pytest.approx(2 * np.pi * 200.0**2 * (1 - np.cos(0.4)), rel=1e-2)
    for wrong, sentence in (
        (["--out", str(out)], "exists"),
        (["--out", str(tmp_path / "patch.stl")], "written as PLY"),
    ):
        again = CliRunner().invoke(app, [*command, *wrong])
        assert isinstance(again.exception, UsageError)
        assert sentence in str(again.exception)
    whole = CliRunner().invoke(app, [*command[:4], "--out", str(tmp_path / "other.ply")])
    assert "say where the patch lies" in str(whole.exception)


@pytest.mark.parametrize("place", [(122.4, 20.5, 10.2), (130.1, 72.8, 57.5)])
def test_a_disc_of_a_heart_is_a_disc(place: tuple[float, float, float]) -> None:
    body = load(shared("hearts/rodero01_heart_walls_closed.ply"), unit="mm")
    patch = cut_patch(body, chosen(place, radius=15.0))
    assert patch.preparation.topology == "disc"
    assert patch.preparation.area == pytest.approx(np.pi * 15.0**2, rel=0.15)


@pytest.mark.parametrize(
    ("heart", "place", "radius"),
    [
        ("rodero01_aorta_wall", (28.929, 43.87, 100.357), 16.4),
        ("rodero01_outer_skin_closed", (72.19, 97.737, 85.568), 19.6),
    ],
)
def test_a_disc_of_a_heart_lies_on_the_heart_for_whoever_checks_its_bundle(
    heart: str, place: tuple[float, float, float], radius: float, tmp_path: Path
) -> None:
    patch = {"at": list(place), "radius": radius}
    surface = shared(f"hearts/{heart}.ply")
    plan(job_of(surface=surface, unit="mm", patch=patch, spacing=4.0, robot=False)).save(tmp_path / "out")
    assert check_bundle(tmp_path / "out").findings == ()
