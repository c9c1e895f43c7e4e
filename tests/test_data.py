"""The project's own test parts are what data/README.md says of them."""

from __future__ import annotations

import runpy
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of, load_cell
from geoprint.distance.heat import Heat
from geoprint.distance.lscm_chart import conformal_chart
from geoprint.geometry import (
    boundary_loops,
    closest,
    describe,
    edge_lengths,
    euler_characteristic,
    face_areas,
    face_normals,
    mean_normal,
    point_source,
    prepare,
    refine,
)
from geoprint.geometry.files import load
from geoprint.model import FloatArray, GoodPrint, Surface
from geoprint.process_fitting.recommending import recommendation
from geoprint.process_fitting.text import recommendation_text

DATA = Path(__file__).parents[1] / "data"
TOPOLOGY = {
    "heart.ply": "closed, genus 0",
    "heart_apex_patch.ply": "disc",
    "heart_flat_patch.ply": "disc",
    "plate.ply": "disc",
}
# Middle and geodesic radius of each patch [mm].
PATCHES = {"heart_apex_patch.ply": ((8.0, 0.0, -60.0), 20.0), "heart_flat_patch.ply": ((41.705, 4.011, -5.982), 25.0)}


@cache
def part(name: str) -> Surface:
    return load(DATA / name, unit="mm")


def run_script(name: str, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run a script of the folder here, as the command that its beginning names does."""
    monkeypatch.setattr("sys.argv", [name, "--out", str(out)])
    runpy.run_path(str(DATA / name), run_name="__main__")


def corner_angles(surface: Surface) -> FloatArray:
    """Return the (m, 3) angles of the triangles [rad]."""
    corners = surface.vertices[surface.faces]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return np.arctan2(np.linalg.norm(np.cross(ahead, behind), axis=2), (ahead * behind).sum(axis=2))


def total_curvature(surface: Surface) -> float:
    """Return the sum of the angle defects of the inner vertices [sr]."""
    around = np.bincount(surface.faces.ravel(), corner_angles(surface).ravel())
    inner = np.ones(len(surface.vertices), dtype=np.bool_)
    for loop in boundary_loops(surface):
        inner[loop] = False
    return float((2 * np.pi - around[inner]).sum())


def cone(surface: Surface) -> float:
    """Return the largest angle between a face's normal and the mean normal [degrees]."""
    mean = mean_normal(surface)
    return float(np.degrees(np.arccos((face_normals(surface) @ mean / np.linalg.norm(mean)).min())))


@pytest.mark.parametrize("name", TOPOLOGY)
def test_a_part_prepares_without_any_change(name: str) -> None:
    prepared, report = prepare(part(name))
    assert np.array_equal(prepared.vertices, part(name).vertices)
    assert np.array_equal(prepared.faces, part(name).faces)
    done = report.repairs
    assert (done.flipped_faces, done.welded_vertices, done.dropped_degenerate_faces) == (0, 0, 0)


@pytest.mark.parametrize(("name", "topology"), TOPOLOGY.items())
def test_a_part_has_the_promised_topology(name: str, topology: str) -> None:
    assert describe(part(name)) == topology
    assert euler_characteristic(part(name)) == (2 if name == "heart.ply" else 1)


@pytest.mark.parametrize("name", TOPOLOGY)
def test_triangles_are_irregular_but_well_shaped(name: str) -> None:
    angles, lengths = np.degrees(corner_angles(part(name))), edge_lengths(part(name))
    assert angles.min() > 15.0
    assert angles.max() < 130.0
    assert lengths.mean() == pytest.approx(1.55, abs=0.15)
    assert lengths.max() < 3.0
    assert lengths.std() > 0.1 * lengths.mean()


def test_the_heart_has_life_size_about_the_origin_with_its_apex_down() -> None:
    vertices = part("heart.ply").vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    assert high - low == pytest.approx(np.array([88.0, 81.0, 121.0]), abs=0.5)
    assert (low + high) / 2 == pytest.approx(np.zeros(3), abs=4.0)
    assert vertices[np.argmin(vertices[:, 2])] == pytest.approx(np.array(PATCHES["heart_apex_patch.ply"][0]), abs=1.0)


def test_the_files_are_small() -> None:
    assert [len(part(name).faces) for name in TOPOLOGY] == [28652, 1134, 1722, 1080]
    assert sum((DATA / name).stat().st_size for name in TOPOLOGY) < 1_500_000


def test_the_apex_has_a_radius_of_seven_and_a_half_millimetres() -> None:
    offset = part("heart.ply").vertices - np.array(PATCHES["heart_apex_patch.ply"][0])
    near: FloatArray = offset[np.linalg.norm(offset, axis=1) < 3.5]
    x, y, z = near[:, 0], near[:, 1], near[:, 2]
    terms: FloatArray = np.column_stack([x * x, x * y, y * y, x, y, np.ones(len(near))])
    fit = np.linalg.solve(terms.T @ terms, terms.T @ z)
    curvatures = np.linalg.eigvalsh(np.array([[2 * fit[0], fit[1]], [fit[1], 2 * fit[2]]]))
    assert 1 / curvatures == pytest.approx(np.array([7.5, 7.5]), abs=0.1)


@pytest.mark.parametrize("name", PATCHES)
def test_a_patch_lies_on_the_heart_and_faces_its_direction(name: str) -> None:
    patch, heart = part(name), part("heart.ply")
    centres = patch.vertices[patch.faces].mean(axis=1)
    points, distances = closest(heart, np.concatenate([patch.vertices, centres]))
    assert distances.max() < 1e-3
    along = (face_normals(heart)[points.faces[-len(centres) :]] * face_normals(patch)).sum(axis=1)
    assert along.min() > 1 - 1e-9


@pytest.mark.parametrize(("name", "middle", "radius"), [(name, *rest) for name, rest in PATCHES.items()])
def test_the_rim_of_a_patch_is_smooth_and_everywhere_as_far_from_its_middle(
    name: str, middle: tuple[float, float, float], radius: float
) -> None:
    patch = part(name)
    rim = boundary_loops(patch)[0]
    side = np.roll(patch.vertices[rim], -1, axis=0) - patch.vertices[rim]
    before = np.roll(side, 1, axis=0)
    turns = np.arctan2(np.linalg.norm(np.cross(before, side), axis=1), (before * side).sum(axis=1))
    assert np.degrees(turns.max()) < 10.0
    fine = refine(patch, edge_length=0.4)
    distance = Heat(fine).distance(point_source(fine, np.array(middle), tolerance=0.1)).values[rim]
    assert distance == pytest.approx(np.full(rim.size, radius), abs=0.4)


def test_the_apex_patch_is_strongly_curved_yet_faces_one_direction() -> None:
    patch = part("heart_apex_patch.ply")
    assert cone(patch) == pytest.approx(53.6, abs=0.5)
    assert np.linalg.norm(mean_normal(patch)) == pytest.approx(0.77, abs=0.005)
    assert total_curvature(patch) == pytest.approx(1.86, abs=0.05)


def test_the_flat_patch_is_nearly_developable() -> None:
    patch = part("heart_flat_patch.ply")
    assert cone(patch) < 50.0
    assert total_curvature(patch) == pytest.approx(0.36, abs=0.005)


def test_a_conformal_chart_nearly_keeps_areas_on_the_flat_patch_and_ruins_them_on_the_apex() -> None:
    flat, apex = (
        np.percentile(face_areas(conformal_chart(part(name))) / face_areas(part(name)), [1, 99])
        for name in ("heart_flat_patch.ply", "heart_apex_patch.ply")
    )
    assert flat == pytest.approx(np.array([0.97, 1.03]), abs=0.005)
    assert apex == pytest.approx(np.array([0.59, 1.32]), abs=0.005)


def test_the_plate_is_a_flat_rectangle_facing_up() -> None:
    plate = part("plate.ply")
    assert np.array_equal(plate.vertices.min(axis=0), [-20.0, -15.0, 0.0])
    assert np.array_equal(plate.vertices.max(axis=0), [20.0, 15.0, 0.0])
    assert face_normals(plate)[:, 2].min() > 0
    assert face_areas(plate).sum() == pytest.approx(1200.0)


@pytest.mark.needs("skimage")
def test_making_the_parts_again_gives_the_same_surfaces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_script("make_heart.py", tmp_path, monkeypatch)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(TOPOLOGY)
    for name in TOPOLOGY:
        again, kept = load(tmp_path / name, unit="mm"), part(name)
        assert describe(again) == TOPOLOGY[name]
        # The cut follows a geodesic distance, so a better one moves the rim by a little.
        _, there = closest(kept, again.vertices)
        _, back = closest(again, kept.vertices)
        assert max(there.max(), back.max()) < 0.4


PRINTS = {
    "a": ("20 kPa and 10 rounds compared with 10 kPa and 20", "over-dispensing", "beads 2 times as far apart"),
    "b": ("10 kPa and 10 rounds compared with 10 kPa and 20", "too little: 0.50 times", "gaps"),
    "c": (
        "10 kPa and 20 rounds compared with 10 kPa and 20",
        "as the good print",
        "the same material on the same paths",
    ),
}


@pytest.mark.parametrize("case", PRINTS)
def test_recommend_judges_each_print_of_the_paper_as_it_came_out(case: str) -> None:
    job = job_of(surface="", cell=DATA / f"paper_case_{case}.toml")
    text = recommendation_text(recommendation(job, part=False, pressure_kpa=None, good=None))
    for words in PRINTS[case]:
        assert words in text


def test_the_cells_of_the_paper_say_what_table_1_says_and_nothing_else_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = {"a": (20e3, 10), "b": (10e3, 10), "c": (10e3, 20)}
    run_script("make_paper_cells.py", tmp_path, monkeypatch)
    packaged = load_cell(None)
    for case, (pressure, rounds) in table.items():
        path = DATA / f"paper_case_{case}.toml"
        assert path.read_text(encoding="utf-8") == (tmp_path / path.name).read_text(encoding="utf-8")
        cell = load_cell(path)
        assert cell.process == replace(packaged.process, pressure=pressure, rounds=rounds)
        # Over the pedestal, straight ahead of the arm.
        np.testing.assert_array_equal(cell.demo_position, [300.0, 0.0, 50.0])
        assert cell.good_print == GoodPrint(10e3, 20)
        assert cell.flood is not None
        assert (cell.flood.duration, cell.flood.joints, cell.material) == (60.0, None, None)
        assert cell.signals == packaged.signals
