"""What is planned on: its side, source, body and mesh as the job asks, and cells from which no program may come."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint.config import Job, job_of, packaged_cell_text
from geoprint.errors import ClearanceError, FieldError, InputError, UsageError
from geoprint.geometry import edge_lengths, mean_normal
from geoprint.geometry.files import save_ply
from geoprint.model import FloatArray, Surface
from geoprint.results import Workpiece
from geoprint.workflow import plan, workpiece
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import prepare_workpiece, read_part
from tests import meshes
from tests.robot.arms import other_conventions

# 40 mm by 30 mm, so 50 mm across; 15 mm from the rim to the middle.
PLATE = meshes.plate((40.0, 30.0), (20, 15))


def saved(folder: Path, surface: Surface, name: str = "part") -> Path:
    path = folder / f"{name}.ply"
    save_ply(surface, path)
    return path


@pytest.fixture(scope="module")
def part(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return saved(tmp_path_factory.mktemp("part"), PLATE)


def asked(path: Path, **values: object) -> Job:
    return job_of(surface=path, unit="mm", **({"spacing": 6.0, "robot": False} | values))


def prepared(path: Path, *, backends: tuple[str, ...] = ("heat",), **values: object) -> Workpiece:
    return prepare_workpiece(asked(path, **values), Stages(lambda _: None), backends=backends)


def cell(folder: Path, *changes: tuple[str, str]) -> Path:
    text = packaged_cell_text("irb120-bent45")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "cell.toml").write_text(text, encoding="utf-8")
    return folder / "cell.toml"


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_a_flipped_job_prints_the_other_side(part: Path, up: float) -> None:
    planned = plan(asked(part, flip=up < 0.0))
    assert planned.workpiece.side.turned is (up < 0.0)
    deposited = planned.poses.deposit
    np.testing.assert_allclose(
        planned.poses.normals[deposited], np.tile([0.0, 0.0, up], (int(deposited.sum()), 1)), atol=1e-9
    )
    # The packaged cell holds the tip 0.3 mm off the printed side.
    np.testing.assert_allclose(planned.poses.tips[deposited, 2], 0.3 * up, atol=1e-6)


def test_a_source_may_miss_the_surface_by_a_millimetre(part: Path) -> None:
    (place,) = prepared(part, source="point:20,15,0.98").source.curves.points.weights
    assert place.sum() == pytest.approx(1.0)
    with pytest.raises(InputError, match=r"1\.02 mm"):
        prepared(part, source="point:20,15,1.02")


def beside(gap: float) -> Surface:
    """Return a plate that begins so far beyond the end of the part [mm]."""
    return Surface(PLATE.vertices + np.array([40.0 + gap, 0.0, 0.0]), PLATE.faces, name="body")


def test_a_body_may_lie_as_far_away_as_the_part_is_large(part: Path, tmp_path: Path) -> None:
    near = read_part(asked(part, body=saved(tmp_path, beside(49.0), "near"))).body
    assert near is not None
    assert near.vertices[:, 0].min() == 89.0
    with pytest.raises(InputError, match=r"is 51 mm away from part\.ply, which is 50 mm large") as caught:
        read_part(asked(part, body=saved(tmp_path, beside(51.0), "far")))
    assert caught.value.details["distance"] == pytest.approx(51.0)
    assert "Mirrored" not in str(caught.value)


@pytest.mark.parametrize(
    ("off", "end"),
    [(2.4, "Mirrored in x, it lies on it: one file is left-handed, so export it again."), (2.6, "unit.")],
)
def test_a_body_is_called_mirrored_where_the_mirrored_part_lies_within_a_twentieth_of_its_size(
    tmp_path: Path, off: float, end: str
) -> None:
    far = Surface(PLATE.vertices + np.array([100.0, 0.0, 0.0]), PLATE.faces)
    mirrored = Surface(far.vertices * [-1.0, 1.0, 1.0] + np.array([0.0, 0.0, off]), PLATE.faces[:, ::-1])
    body = saved(tmp_path, mirrored, "body")
    with pytest.raises(InputError, match="mm away from far") as caught:
        read_part(asked(saved(tmp_path, far, "far"), body=body))
    assert str(caught.value).endswith(end)


def test_the_mesh_is_as_fine_for_rounds_as_for_the_spacing_that_they_mean(part: Path) -> None:
    # 15 mm in 5 rounds are 3 mm, of which heat wants four edges.
    by_rounds = prepared(part, spacing=None, rounds=5)
    assert by_rounds.edge_length == pytest.approx(0.75, rel=0.01)
    assert float(edge_lengths(by_rounds.surface).mean()) <= 0.9


def test_a_depth_estimated_on_triangles_twice_as_large_changes_nothing_that_counts(
    part: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(workpiece, "TRIANGLES_ACROSS", 30)
    assert prepared(part, spacing=None, rounds=5).edge_length == pytest.approx(0.75, rel=0.02)


def test_the_edge_length_told_is_the_shortest_of_all_patches(tmp_path: Path) -> None:
    coarse = saved(tmp_path, meshes.plate((400.0, 200.0), (8, 4)), "coarse")
    large, small = ({"box": [*low, -1.0, *high, 1.0]} for low, high in (((5, 5), (195, 195)), ((300, 5), (330, 35))))
    alone = [prepared(coarse, spacing=16.0, backends=("fast-marching",), patches=[one]) for one in (large, small)]
    both = prepared(coarse, spacing=16.0, backends=("fast-marching",), patches=[large, small])
    assert alone[1].edge_length == pytest.approx(4.0)
    assert alone[0].edge_length > 5.0
    # Of several backends the finest counts: heat wants four edges a spacing.
    finest = prepared(coarse, spacing=16.0, backends=("fast-marching", "heat", "fast-marching"), patches=[large])
    assert finest.edge_length == 4.0
    assert both.edge_length == alone[1].edge_length
    assert len(both.surface.faces) == sum(len(one.surface.faces) for one in alone)


def test_a_spacing_may_be_as_large_as_the_part_and_no_larger(part: Path) -> None:
    assert prepared(part, spacing=49.9).edge_length == pytest.approx(49.9 / 4)
    with pytest.raises(FieldError, match=r"spacing is 50\.1 mm, but the part is only 50 mm across"):
        prepared(part, spacing=50.1)


def test_neither_spacing_nor_rounds_tells_the_depth_of_the_part(part: Path) -> None:
    with pytest.raises(UsageError, match=r"10 rounds are about 1\.5 mm, 20 about 0\.75 mm") as caught:
        prepared(part, spacing=None)
    assert caught.value.details["depth_mm"] == pytest.approx(15.0, rel=0.01)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("mass_kg = 0.6", "mass_kg = 3.01", r"its mass is 3\.01 kg .* the irb120 allows 3 kg"),
        (
            "cog_mm = [25, 0, 65]",
            "cog_mm = [25, 0, 480]",
            r"moment of inertia about axis 5 is .* allows 0\.175 kg m2",
        ),
        (
            "cog_mm = [25, 0, 65]",
            "cog_mm = [380, 0, 65]",
            r"moment of inertia about axis 6 is .* allows 0\.085 kg m2",
        ),
        ('mode = "io"', 'mode = "io"\nvacuum = "geoVacuum"', "is a word of RAPID"),
    ],
)
def test_what_the_arm_may_not_carry_and_what_no_program_can_say_is_refused_while_reading(
    part: Path, tmp_path: Path, old: str, new: str, reason: str
) -> None:
    stages: list[str] = []
    with pytest.raises(UsageError, match=reason):
        plan(asked(part, robot=True, place="demo", cell=cell(tmp_path, (old, new))), observe=stages.append)
    assert stages == ["reading"]
    # Nobody asks it of a path alone.
    assert prepared(part, cell=tmp_path / "cell.toml").placement is None


def test_the_heaviest_tool_that_the_arm_may_carry_is_taken(part: Path, tmp_path: Path) -> None:
    heavy = cell(tmp_path, ("mass_kg = 0.6", "mass_kg = 2.99"))
    assert prepared(part, robot=True, place="demo", cell=heavy).placement is not None


def test_an_arm_that_counts_otherwise_than_abb_is_refused_while_reading(part: Path, tmp_path: Path) -> None:
    arm = other_conventions(offsets=np.zeros(6), signs=np.array([-1.0, 1, 1, 1, 1, 1]), T_base_foot=np.eye(4), seed=1)
    assert arm.urdf is not None
    (tmp_path / "own.urdf").write_text(arm.urdf.replace('velocity="3"', 'velocity="10"'), encoding="utf-8")
    named = ('arm = "irb120"', f'urdf = "own.urdf"\nflange = "{arm.flange}"')
    own = cell(tmp_path, named, ("[-400, 400]", "[-350, 350]"))
    stages: list[str] = []
    with pytest.raises(UsageError, match=r"a RAPID program is impossible for the arm own\.urdf: joint 1 counts down"):
        plan(asked(part, robot=True, place="demo", cell=own), observe=stages.append)
    assert stages == ["reading"]


def test_a_part_stands_as_it_is_placed_else_with_its_mean_normal_up(tmp_path: Path) -> None:
    lean = rotation_about(0, 0.5)
    tilted = saved(tmp_path, Surface(PLATE.vertices @ lean.T, PLATE.faces))
    free = prepared(tilted).upright
    np.testing.assert_allclose(free, lean.T, atol=1e-9)
    turned = cell(tmp_path, ("# demo_rpy_deg = [0, 0, 0]", "demo_rpy_deg = [0, 0, 30]"))
    placed = prepared(tilted, robot=True, place="demo", cell=turned)
    np.testing.assert_allclose(placed.upright, rotation_about(2, np.pi / 6.0) @ free, atol=1e-9)


def rotation_about(axis: int, angle: float) -> FloatArray:
    return Rotation.from_rotvec(angle * np.eye(3)[axis]).as_matrix()


def test_a_closed_part_stands_on_its_own_axis_whatever_rounding_says_of_its_mean_normal(tmp_path: Path) -> None:
    ball = meshes.sphere(radius=15.0, subdivisions=3, jitter_seed=1)
    whole = prepared(saved(tmp_path, ball), source="point:0,0,15")
    np.testing.assert_array_equal(whole.upright, np.eye(3))


# Four touches of a fixture whose middle stands at (300, 0, 30), lying and turned up 3 on 4 about the x axis.
LYING = "[[250, 50, 30], [350, 50, 30], [350, -50, 30], [250, -50, 30]]"
TILTED = "[[250, 40, 60], [350, 40, 60], [350, -40, 0], [250, -40, 0]]"


def calibrated(
    folder: Path, *, touched: str = LYING, noise: float = 0.02, part_mm: str = "part_mm = [-20, -15, 20]"
) -> Path:
    model = "[[-50, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]]"
    words = f'source = "calibrated"\nmodel_mm = {model}\ntouched_mm = {touched}\nnoise_mm = {noise}\n{part_mm}\n'
    return cell(folder, ('source = "demo"', words))


@pytest.mark.parametrize(("touched", "origin"), [(LYING, [280.0, -15.0, 50.0]), (TILTED, [280.0, -24.0, 37.0])])
def test_a_calibrated_part_stands_where_it_was_touched_and_is_known_as_well_as_its_touches(
    part: Path, tmp_path: Path, touched: str, origin: list[float]
) -> None:
    found = prepared(part, robot=True, cell=calibrated(tmp_path, touched=touched))
    assert found.placement is not None
    assert found.placement.calibrated
    assert not found.turnable, "it stands where it was touched, whatever a search would like better"
    np.testing.assert_allclose(found.placement.T_base_work[:3, 3], origin, atol=1e-9)
    # Four touches of 0.02 mm a corner of 50 mm from the middle: at the corners of the plate, (20, 15) mm off it, the
    # height is known with a deviation of 0.02 / 2 * sqrt(1 + (20 / 50)^2 + (15 / 50)^2) mm.
    assert found.uncertainty is not None
    assert found.surface_within == pytest.approx(1.96 * 0.01 * np.sqrt(1.25), rel=0.01)


def test_a_calibrated_part_that_nobody_stated_has_no_uncertainty(part: Path, tmp_path: Path) -> None:
    unstated = prepared(part, robot=True, cell=calibrated(tmp_path, part_mm=""))
    assert unstated.placement is not None
    assert unstated.placement.missing
    assert unstated.uncertainty is None
    assert unstated.surface_within is None


def test_place_demo_leaves_the_touched_points_of_a_calibrated_cell_alone(part: Path, tmp_path: Path) -> None:
    demo = prepared(part, robot=True, place="demo", cell=calibrated(tmp_path))
    assert demo.placement is not None
    assert not demo.placement.calibrated
    assert demo.turnable
    assert demo.uncertainty is None
    assert not prepared(part, place="demo", cell=calibrated(tmp_path)).turnable, "no robot was asked for"


def test_a_part_known_worse_than_the_stand_off_is_refused_while_reading(part: Path, tmp_path: Path) -> None:
    # 1.96 * sqrt(1.25) / 2 times the noise: 0.296 mm and 0.307, of 0.3.
    assert prepared(part, robot=True, cell=calibrated(tmp_path, noise=0.27)).surface_within == pytest.approx(
        0.296, abs=0.001
    )
    with pytest.raises(ClearanceError, match=r"leave part\.ply uncertain: 0\.31 mm .* allowed are 0\.3 mm"):
        prepared(part, robot=True, cell=calibrated(tmp_path, noise=0.28))


def test_a_cell_that_nobody_calibrated_is_refused_before_the_part_is_prepared(part: Path) -> None:
    with pytest.raises(UsageError, match=r"the cell irb120-bent45\.toml is not calibrated.*--place demo.*--no-robot"):
        prepared(part, robot=True)


def test_the_cell_gives_the_rounds_where_the_job_names_neither_rounds_nor_spacing(part: Path, tmp_path: Path) -> None:
    five = cell(tmp_path, ("layer_height_mm = 0.5", "layer_height_mm = 0.5\nrounds = 5"))
    assert prepared(part, spacing=None, cell=five).edge_length == pytest.approx(15.0 / 5 / 4, rel=0.01)
    assert prepared(part, spacing=None, rounds=3, cell=five).edge_length == pytest.approx(15.0 / 3 / 4, rel=0.01)
    assert prepared(part, cell=five).edge_length == 1.5


def test_what_was_read_and_prepared_is_kept_in_order(part: Path, tmp_path: Path) -> None:
    body = saved(tmp_path, beside(0.0), "body")
    found = prepared(part, body=body, cell=cell(tmp_path))
    assert [file.name for file in found.files] == ["part.ply", "body.ply"]
    assert found.cell_text == packaged_cell_text("irb120-bent45")
    assert found.patches == ()
    assert len(found.preparations) == 1
    assert prepared(part).cell_text is None
    assert [file.name for file in prepared(part).files] == ["part.ply"]
    assert prepared(part).body is None


def test_the_spacing_is_asked_for_before_the_placement_and_the_placement_before_the_body(
    part: Path, tmp_path: Path
) -> None:
    with pytest.raises(FieldError, match="the part is only 50 mm across"):
        prepared(part, spacing=60.0, robot=True, place="demo")
    with pytest.raises(UsageError, match="give `--spacing` or `--rounds`"):
        prepared(part, spacing=None, robot=True)
    with pytest.raises(UsageError, match="is not calibrated"):
        prepared(part, robot=True, body=saved(tmp_path, beside(60.0), "far"))


def test_a_body_that_its_file_winds_inward_is_told_and_the_part_faces_out_of_it(tmp_path: Path) -> None:
    cap, ball = meshes.spherical_cap(radius=30.0, angle=0.6), meshes.sphere(radius=30.0, subdivisions=4)
    inward = saved(tmp_path, Surface(ball.vertices, ball.faces[:, ::-1]), "ball")
    for patch, turned in ((cap, False), (Surface(cap.vertices, cap.faces[:, ::-1]), True)):
        found = read_part(asked(saved(tmp_path, patch, "cap"), body=inward))
        assert (found.side.source, found.side.turned, found.side.agreeing) == ("body", turned, 1.0)
        assert "But the volume of ball.ply is -113 cm3: either all faces are flipped" in found.side.sentence
        np.testing.assert_allclose(mean_normal(found.part), mean_normal(cap), atol=1e-9)
    kept = read_part(asked(saved(tmp_path, cap, "cap"), body=inward, flip=True))
    assert (kept.side.source, kept.side.turned, kept.side.agreeing) == ("flip", True, 0.0)
    np.testing.assert_allclose(mean_normal(kept.part), -mean_normal(cap), atol=1e-9)
