"""Patches inside a closed curve drawn on the body: known areas and rims, and every refusal."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from geoprint.cli.application import app
from geoprint.config import job_of, read_curve
from geoprint.errors import FieldError, GeoprintError, InputError, UsageError
from geoprint.geometry import boundary_loops, face_areas, face_normals, pieces, turned_over, united
from geoprint.geometry.files import load, save_ply
from geoprint.model import FloatArray, Surface
from geoprint.reporting import outcome_text, patch_text, record_plan
from geoprint.results import Patch
from geoprint.workflow import PatchChoice, cut_patch, plan
from geoprint.workflow.sources import section_source, source_of
from tests.meshes import annulus, cylinder_patch, plate, sphere, spherical_cap, torus
from tests.shared_data import shared

RADIUS = 20.0
OCTANT = RADIUS * np.eye(3)
RECTANGLE = np.array([[5.0, 5, 0], [25, 5, 0], [25, 15, 0], [5, 15, 0]])


def inside(body: Surface, curve: FloatArray, *, at: tuple[float, float, float] | None = None) -> Patch:
    return cut_patch(body, PatchChoice(None if at is None else np.array(at), None, None, None, curve=curve))


def area(patch: Patch) -> float:
    return float(face_areas(patch.surface).sum())


def ball() -> Surface:
    return sphere(radius=RADIUS, subdivisions=4, jitter_seed=1)


def test_a_rectangle_on_a_plate_is_cut_out_exactly() -> None:
    patch = inside(plate(jitter_seed=2), RECTANGLE)
    assert area(patch) == pytest.approx(200.0, rel=1e-4)
    assert patch.preparation.boundary_lengths == pytest.approx((60.0,), rel=1e-4)
    rim = patch.surface.vertices[boundary_loops(patch.surface)[0]]
    for corner in RECTANGLE:
        assert np.linalg.norm(rim - corner, axis=1).min() < 1e-9


def test_points_in_either_order_and_a_repeated_first_one_enclose_the_same() -> None:
    for curve in (RECTANGLE[::-1], np.vstack([RECTANGLE, RECTANGLE[:1]]), np.repeat(RECTANGLE, 2, axis=0)):
        assert area(inside(plate(jitter_seed=2), curve)) == pytest.approx(200.0, rel=1e-4)


def test_great_circles_through_the_poles_enclose_an_eighth_of_a_sphere() -> None:
    patch = inside(ball(), OCTANT)
    assert area(patch) == pytest.approx(np.pi * RADIUS**2 / 2, rel=5e-3)
    assert patch.preparation.boundary_lengths[0] == pytest.approx(1.5 * np.pi * RADIUS, rel=2e-3)
    # Each side lies in a plane through the centre, but for the triangles.
    rim = patch.surface.vertices[boundary_loops(patch.surface)[0]]
    assert np.abs(rim).min(axis=1).max() < 0.15
    assert (
        np.einsum("mx,mx->m", face_normals(patch.surface), patch.surface.vertices[patch.surface.faces[:, 0]]).min() > 0
    )


def test_a_point_chooses_the_side_and_both_are_told() -> None:
    small, large = inside(ball(), OCTANT), inside(ball(), OCTANT, at=(-RADIUS, 0.0, 0.0))
    assert area(small) + area(large) == pytest.approx(float(face_areas(ball()).sum()), rel=1e-4)
    assert area(large) > 6 * area(small)
    assert "the smaller side, 13 % of the area: `--at X Y Z` chooses the other" in patch_text(small)
    assert "the side of the point, 87 % of the area" in patch_text(large)


def test_on_a_body_wound_inward_what_is_enclosed_faces_out_and_on_an_open_one_as_it_is_wound() -> None:
    inward = Surface(ball().vertices, ball().faces[:, ::-1])
    patch = inside(inward, OCTANT)
    assert "against the file's winding" in patch.outside
    assert face_normals(patch.surface).mean(axis=0).min() > 0.0
    assert inside(plate(), RECTANGLE).outside == "as the file winds it"


def test_what_else_is_given_holds_too() -> None:
    choice = PatchChoice(np.array([15.0, 10, 0]), 8.0, None, None, curve=RECTANGLE)
    band = cut_patch(plate(), choice)
    # A disc of 8 mm about the middle of a strip 10 mm wide.
    half = np.arcsin(5 / 8)
    assert area(band) == pytest.approx(64 * (2 * half + np.sin(2 * half)), rel=2e-3)


@pytest.mark.parametrize(
    ("body", "curve", "sentence"),
    [
        (plate(), RECTANGLE[:2], "needs at least three points, found 2 different points"),
        (plate(), RECTANGLE[[0, 2, 1, 3]], r"crosses itself at \(15.00, 10.00, 0.00\) mm"),
        (plate(), RECTANGLE[[0, 1, 2, 1, 3]], r"crosses itself at \(25.00, 5.00, 0.00\) mm"),
        (plate(), np.vstack([RECTANGLE, [[5.0, 3.0, 0.0]]]), r"crosses itself at \(5.00, 5.00, 0.00\) mm"),
        (plate(), RECTANGLE + np.array([0, 0, 3.0]), "lies 3 mm off plate, at most 1 mm is allowed"),
        (torus(), np.array([[28.0, 0, 0], [20, 0, 8], [12, 0, 0], [20, 0, -8]]), "does not divide torus into"),
    ],
)
def test_curves_that_enclose_nothing_are_refused_with_the_place(
    body: Surface, curve: FloatArray, sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        inside(body, curve)


@pytest.mark.parametrize("count", [2, 501])
def test_a_job_whose_curve_has_too_few_or_too_many_points_is_refused(count: int) -> None:
    with pytest.raises(UsageError, match=f"a curve has 3 to 500 points, found {count}"):
        job_of(surface=Path("a.ply"), unit="mm", spacing=1.0, patch={"curve": [[0.0, 0.0, 0.0]] * count})


def test_a_curve_on_a_body_is_cut_and_planned_with_one_command_each(tmp_path: Path) -> None:
    save_ply(ball(), tmp_path / "ball.ply")
    curve = tmp_path / "curve.csv"
    curve.write_text("# round the corner\nx,y,z\n" + "\n".join(",".join(map(str, point)) for point in OCTANT.tolist()))
    command = ["patch", str(tmp_path / "ball.ply"), "--unit", "mm", "--curve", str(curve), "--json"]
    done = CliRunner().invoke(app, [*command, "--out", str(tmp_path / "p.ply")], catch_exceptions=False)
    assert json.loads(done.stdout)["inside"].startswith("a curve of 3 points, 94.2")
    assert face_areas(load(tmp_path / "p.ply", unit="mm")).sum() == pytest.approx(np.pi * RADIUS**2 / 2, rel=5e-3)
    planned = plan(
        job_of(surface=tmp_path / "ball.ply", unit="mm", patch={"curve": read_curve(curve)}, spacing=3.0, robot=False)
    )
    assert "the patch lies inside a curve of 3 points" in outcome_text(record_plan(planned))
    assert planned.workpiece.side.source == "body"


def test_the_anterior_wall_and_the_apex_of_a_heart_are_enclosed_by_eight_points() -> None:
    body = load(shared("hearts/rodero01_lv_epicardium.ply"), unit="mm")
    points = [
        [129.9, 64.1, 59.0], [127.7, 46.3, 57.5], [126.5, 25.3, 38.2], [113.7, 14.6, 17.3],
        [110.6, 22.2, 5.3], [117.4, 30.7, 1.8], [131.3, 47.9, 17.5], [133.8, 65.4, 40.0],
    ]  # fmt: skip
    patch = inside(body, np.array(points))
    assert patch.preparation.topology == "disc"
    assert area(patch) == pytest.approx(2078.0, rel=1e-3)
    assert patch.missed is not None
    assert patch.missed < 0.05


def test_every_refusal_is_one_of_ours() -> None:
    with pytest.raises(GeoprintError):
        inside(plate(), np.full((3, 3), np.inf))


# Lines at an angle: sections of known shapes, of layers and of parts with holes, and rows beside them.


def _section(surface: Surface, angle: float, base: Surface | None = None) -> list[FloatArray]:
    curves = section_source(surface, angle_deg=angle, base=base or surface).curves
    return [curves.xyz(surface, curve) for curve in range(curves.count)]


def _slope(line: FloatArray) -> float:
    """Return the direction of a line as it is seen from above [degrees], from -90 to 90."""
    x, y, _ = line[-1] - line[0]
    return float(np.degrees(np.arctan2(y, x)) + 90.0) % 180.0 - 90.0


@pytest.mark.parametrize("angle", [0.0, 30.0, -45.0, 89.0])
def test_the_line_over_a_plate_is_straight_goes_through_its_middle_and_has_the_angle(angle: float) -> None:
    (line,) = _section(plate((20.0, 12.0), (20, 12), jitter_seed=1), angle)
    assert _slope(line) == pytest.approx(angle, abs=1e-9)
    direction = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
    off = np.cross(line - [10.0, 6.0, 0.0], direction)
    assert np.abs(off).max() < 1e-9
    # From rim to rim.
    assert (np.isclose(line[[0, -1]], 0.0) | np.isclose(line[[0, -1]], [20.0, 12.0, 99.0])).any(axis=1).all()


def test_seen_from_the_other_side_the_angle_counts_the_other_way() -> None:
    (line,) = _section(turned_over(plate((20.0, 12.0), (20, 12))), 30.0)
    assert _slope(line) == pytest.approx(-30.0, abs=1e-9)


def test_a_plane_along_edges_has_each_vertex_once() -> None:
    (line,) = _section(plate((20.0, 12.0), (20, 12)), 90.0)
    assert np.linalg.norm(np.diff(line, axis=0), axis=1).min() > 0.1
    np.testing.assert_allclose(line[:, 0], 10.0, atol=1e-9)


def test_over_a_cylinder_the_line_lies_in_its_plane_and_on_the_triangles() -> None:
    radius, around = 12.0, 60
    part = cylinder_patch(radius=radius, angle=1.4, length=30.0, divisions=(around, 40))
    (line,) = _section(part, 45.0)
    x, y, z = line.T
    np.testing.assert_allclose(y - 15.0, x, atol=1e-9)
    # On the chords of the facets, which lie so deep within the cylinder.
    deep = radius - np.hypot(x, z)
    assert deep.min() > -1e-9
    assert deep.max() < radius * (1.0 - np.cos(0.7 / around)) + 1e-9
    # Along the axis and around it the line is one of the cylinder's own.
    (along,), (across,) = _section(part, 90.0), _section(part, 0.0)
    np.testing.assert_allclose(along[:, [0, 2]], [[0.0, radius]] * len(along), atol=1e-9)
    np.testing.assert_allclose(across[:, 1], 15.0, atol=1e-9)


def test_a_layer_has_the_plane_of_the_part_below_it() -> None:
    base = spherical_cap(radius=20.0, angle=0.6, rings=12)
    level = Surface(1.1 * base.vertices[:, [1, 0, 2]] * [1.0, -1.0, 1.0] + [0.0, 0.3, 0.0], base.faces, "level")
    (line,) = _section(level, 0.0, base)
    np.testing.assert_allclose(line[:, 1], 0.0, atol=1e-9)
    (own,) = _section(level, 0.0)
    np.testing.assert_allclose(own[:, 1], 0.3, atol=1e-9)


def test_a_piece_beside_the_plane_gets_a_parallel_one_through_its_own_middle() -> None:
    base = plate((20.0, 12.0), (20, 12))
    corner = Surface(0.2 * base.vertices + [1.0, 8.0, 1.0], base.faces, "island")
    (line,) = _section(corner, 0.0, base)
    np.testing.assert_allclose(line[:, 1], 9.2, atol=1e-9)


def test_a_part_with_a_hole_has_a_line_on_either_side_of_it_and_several_patches_one_each() -> None:
    ring = annulus(inner=6.0, outer=20.0, divisions=(72, 12))
    lines = _section(ring, 20.0)
    assert sorted(round(float(np.linalg.norm(line[-1] - line[0])), 2) for line in lines) == pytest.approx([14.0, 14.0])
    both = united([ring, Surface(ring.vertices + np.array([50.0, 3.0, 0.0]), ring.faces)])
    source = source_of(job_of(surface="a.ply", source="angle:0"), both)
    heights = [piece.own(source.curves).xyz(piece.surface, 0)[:, 1] for piece in pieces(both)]
    np.testing.assert_allclose([np.ptp(each) for each in heights], 0.0, atol=1e-9)
    assert [float(each[0]) for each in heights] == pytest.approx([0.0, 3.0], abs=1e-9)


@pytest.mark.parametrize("backend", ["heat", "lscm"])
def test_rows_at_an_angle_cover_a_part_with_a_hole(tmp_path: Path, backend: str) -> None:
    path = tmp_path / "ring.ply"
    save_ply(annulus(inner=5.0, outer=16.0), path)
    asked = {"surface": path, "unit": "mm", "spacing": 1.5, "robot": False, "backend": backend}
    found = plan(job_of(**asked, pattern="guided", source="angle:30"))
    # Where rows turn at a rim they leave corners: 4 % of such a disc without a hole.
    assert found.uniformity is not None
    assert found.uniformity.gap < 0.08
    # Beside the two lines rows are as straight as these, half a spacing and whole ones away.
    places, rows = found.toolpath.curves.points.xyz(found.workpiece.surface), found.toolpath.rows
    along = np.array([np.cos(np.radians(30.0)), np.sin(np.radians(30.0)), 0.0])
    beside = (np.abs(places @ along) > 6.0) & (np.linalg.norm(places, axis=1) < 13.5) & (rows % 1.0 == 0.0)
    off = np.abs(places @ [-along[1], along[0], 0.0]) - 1.5 * (rows + 0.5)
    assert beside.sum() > 100
    assert np.abs(off[beside]).max() < 0.05


def test_a_part_that_faces_all_ways_has_no_angle() -> None:
    surface = sphere(radius=5.0, subdivisions=2)
    with pytest.raises(FieldError, match="cancel, as on a closed part"):
        section_source(surface, angle_deg=45.0, base=surface)


def test_an_angle_beyond_half_a_turn_is_refused() -> None:
    with pytest.raises(UsageError, match=r"source.angle: it must be at most 180"):
        job_of(surface="a.ply", source="angle:200")
