"""What is planned on, at its bounds: sides, loads and arms refused through a job, fineness, and where a seed may lie.

Only reading and refining run here, on small plates.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of, packaged_cell_text
from geoprint.errors import FieldError, InputError, UsageError
from geoprint.model import Surface
from geoprint.pipeline import workpiece
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.workpiece import (
    _body,  # pyright: ignore[reportPrivateUsage]
    _refined,  # pyright: ignore[reportPrivateUsage]
    _wanted_spacing,  # pyright: ignore[reportPrivateUsage]
    prepare_workpiece,
    printed_side,
)
from geoprint.results import Workpiece
from geoprint.surfaces import face_normals, united
from geoprint.surfaces.files import save_ply
from tests.meshes import plate, spherical_cap
from tests.motion.arms import offset_wrist, other_conventions
from tests.motion.placements import block

SMALL = plate((20.0, 16.0), (10, 8))
CELL = packaged_cell_text("irb120-bent45")


def prepared(tmp_path: Path, surface: Surface = SMALL, **values: object) -> Workpiece:
    part = tmp_path / f"{surface.name}.ply"
    save_ply(surface, part)
    settings: dict[str, object] = {"spacing": 2.0, "robot": False, **values}
    job = job_of(surface=part, unit="mm", **settings)
    return prepare_workpiece(job, Stages(lambda _: None), backends=["heat"])


def cell(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "cell.toml"
    path.write_text(text, encoding="utf-8")
    return path


def refusal(tmp_path: Path, text: str) -> str:
    with pytest.raises(UsageError) as caught:
        prepared(tmp_path, robot=True, place="demo", cell=cell(tmp_path, text))
    return str(caught.value)


def test_flip_turns_the_side_that_is_printed(tmp_path: Path) -> None:
    for flip, up in ((False, 1.0), (True, -1.0)):
        found = prepared(tmp_path, flip=flip)
        np.testing.assert_allclose(face_normals(found.part)[:, 2], up)
        np.testing.assert_allclose(face_normals(found.surface)[:, 2], up)
        assert found.side.turned == flip


def test_a_tool_that_is_heavier_than_the_arm_may_carry_is_refused(tmp_path: Path) -> None:
    assert "its mass is 3.01 kg" in refusal(tmp_path, CELL.replace("mass_kg = 0.6", "mass_kg = 3.01"))
    light = prepared(tmp_path, robot=True, place="demo", cell=cell(tmp_path, CELL))
    assert light.placement is not None


@pytest.mark.parametrize("kind", ["other conventions", "no spherical wrist"])
def test_an_arm_for_which_a_program_would_mean_something_else_is_refused(tmp_path: Path, kind: str) -> None:
    arm = offset_wrist()
    if kind == "other conventions":
        arm = other_conventions(
            offsets=np.zeros(6), signs=np.array([1.0, -1, 1, 1, 1, 1]), T_base_foot=np.eye(4), seed=2
        )
    assert arm.urdf is not None
    (tmp_path / "own.urdf").write_text(arm.urdf.replace('velocity="3"', 'velocity="100"'), encoding="utf-8")

    said = refusal(
        tmp_path, CELL.replace('model = "irb120"', 'urdf = "own.urdf"', 1).replace("[-400, 400]", "[-350, 350]")
    )

    assert said.startswith("no RAPID program can be written for the arm own.urdf")


def test_rounds_are_refined_for_as_the_spacing_that_they_come_to(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workpiece, "TRIANGLES_ACROSS", 20)
    job = job_of(surface=Path("plate.ply"), unit="mm", rounds=8, robot=False, backend="heat")

    # The middle of the plate is 8 mm from its nearest sides.
    assert _wanted_spacing(job, SMALL) == pytest.approx(1.0, rel=0.03)
    with pytest.raises(UsageError, match=r"10 rounds are about 0\.(79|8|81) mm, 20 about 0\.(39|4|41)\d* mm") as caught:
        _wanted_spacing(job.model_copy(update={"rounds": None}), SMALL)
    assert caught.value.details["depth_mm"] == pytest.approx(8.0, rel=0.03)


def test_each_piece_is_as_fine_as_it_needs_and_the_finest_is_told() -> None:
    far = Surface(vertices=SMALL.vertices + [100.0, 0.0, 0.0], faces=SMALL.faces, name="far")  # noqa: RUF005

    class Wanting:
        @staticmethod
        def edge_length(part: Surface, *, spacing: float) -> float:
            return spacing / (4.0 if part.vertices[:, 0].min() > 50.0 else 1.0)

    for parts in ((SMALL, far), (far, SMALL)):
        surface, edge_length = _refined(united(list(parts)), [Wanting], spacing=2.0)  # type: ignore[list-item]
        assert edge_length == 0.5
        triangles = surface.vertices[surface.faces].mean(axis=1)[:, 0] > 50.0
        assert triangles.sum() > 4 * (~triangles).sum()


@pytest.mark.parametrize(("above", "taken"), [(0.0, True), (0.99, True), (-0.99, True), (1.01, False), (-1.01, False)])
def test_a_seed_may_miss_the_surface_by_a_millimetre(tmp_path: Path, above: float, *, taken: bool) -> None:
    if taken:
        assert prepared(tmp_path, seed=(10.0, 8.0, above)).seed is not None
    else:
        with pytest.raises((UsageError, InputError, FieldError), match="seed"):
            prepared(tmp_path, seed=(10.0, 8.0, above))


def test_a_body_may_lie_as_far_away_as_the_part_is_large() -> None:
    size = float(np.hypot(20.0, 16.0))
    for gap, taken in ((0.99 * size, True), (1.01 * size, False)):
        body = block((0.0, 0.0, -gap - 5.0), (20.0, 16.0, -gap), name="slab")
        if taken:
            assert _body(SMALL, body) is body
        else:
            with pytest.raises(InputError, match=r"slab is 25.9 mm away from plate, which is 25.6 mm large"):
                _body(SMALL, body)


@pytest.mark.parametrize(("across", "taken"), [(25.5, True), (25.7, False)])
def test_a_spacing_is_at_most_as_large_as_the_part(tmp_path: Path, across: float, *, taken: bool) -> None:
    if taken:
        prepared(tmp_path, spacing=across)
    else:
        with pytest.raises(FieldError, match=r"the whole part is only 25\.6 mm across"):
            prepared(tmp_path, spacing=across)


def test_a_body_tells_the_side_where_nine_tenths_of_the_part_agree() -> None:
    """A plate on a slab, of which a strip at one end faces down."""
    slab = block((-5.0, -5.0, -4.0), (105.0, 15.0, -1.0), name="slab")

    def turned(columns: int) -> Surface:
        flat = plate((100.0, 10.0), (100, 2))
        down = flat.vertices[flat.faces].mean(axis=1)[:, 0] < columns
        faces = flat.faces.copy()
        faces[down] = faces[down][:, ::-1]
        return Surface(vertices=flat.vertices, faces=faces, name="plate")

    told: Callable[[int], str] = lambda columns: printed_side(turned(columns), slab, flip=False)[1].source  # noqa: E731
    assert [told(columns) for columns in (0, 9, 11, 50, 89, 91, 100)] == [
        "body", "body", "winding", "winding", "winding", "body", "body",
    ]  # fmt: skip
    sides = [printed_side(turned(columns), slab, flip=False)[1].turned for columns in (9, 91)]
    assert sides == [False, True]
    # Who asks for a side gets it, whatever the body tells.
    assert printed_side(turned(91), slab, flip=True)[1].source == "flip"


def test_how_a_part_stands_is_its_placement_or_its_mean_normal_up(tmp_path: Path) -> None:
    tilted = spherical_cap(radius=30.0, angle=0.4, rings=6)
    turned = Surface(vertices=tilted.vertices @ np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]]).T, faces=tilted.faces,
                     name="side")  # fmt: skip
    alone = prepared(tmp_path, turned)
    np.testing.assert_allclose(alone.upright @ [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], atol=1e-6)
    placed = prepared(tmp_path, SMALL, robot=True, place="demo", cell=cell(tmp_path, CELL.replace(
        "demo_rpy_deg = [0, 0, 0]", "demo_rpy_deg = [0, 0, 90]", 1)))  # fmt: skip
    np.testing.assert_allclose(placed.upright @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-6)
