"""Files of toolpaths measured on a part: our own as compare does, others by what their planner does to a surface."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import job_of, plan, transforms
from geoprint.config import Job
from geoprint.errors import FieldError, InputError, UsageError
from geoprint.geometry import prepare, refine
from geoprint.geometry.files import load, save_ply
from geoprint.metrics import moved, rigid_fit, uniformity
from geoprint.model import FloatArray, Polylines, Surface
from geoprint.reporting import remeshing_text
from geoprint.results import FileInspection
from geoprint.workflow import inspect_file, measure_files, remesh_file, save_plan
from tests.cli.test_commands import Run, run
from tests.meshes import annulus, plate, spherical_cap
from tests.metrics.deposits import straight_line
from tests.workflow.dome_slicer import dome_gcode, dome_heights

RADIUS, OPENING = 15.0, 1.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("measured")
    save_ply(plate((40.0, 30.0), (20, 15)), folder / "plate.ply")
    save_ply(spherical_cap(radius=RADIUS, angle=OPENING, rings=30), folder / "dome.ply")
    save_ply(spherical_cap(radius=12.0, angle=OPENING, rings=8), folder / "small.ply")
    return folder


def job(path: Path, *, spacing: float = 2.0) -> Job:
    return job_of(surface=path, unit="mm", spacing=spacing)


def test_a_bundle_of_ours_gives_the_figures_of_compare(folder: Path) -> None:
    asked = job_of(surface=folder / "small.ply", unit="mm", spacing=2.0, backend="heat", robot=False, middle="plain")
    planned = plan(asked)
    save_plan(planned, folder / "bundle")
    record = uniformity(planned.poses, planned.workpiece.surface, spacing=2.0)
    found = measure_files(job(folder / "small.ply"), [folder / "bundle"]).files[0]
    # Contours of a rim run anticlockwise: outside is to their right.
    right = found.measured.sides.right
    assert found.format == "bundle"
    assert record.levels is not None
    assert right.mean == pytest.approx(record.levels.figures.mean, abs=1e-4)
    assert right.cv == pytest.approx(record.levels.figures.cv, abs=1e-4)
    assert found.measured.thickness.cv == pytest.approx(record.thickness.cv, abs=1e-4)
    assert found.measured.followed.cv == pytest.approx(record.followed.cv, abs=1e-4)
    assert found.measured.gap == pytest.approx(record.gap, abs=1e-4)
    assert found.measured.overlap == pytest.approx(record.overlap, abs=1e-4)


def test_slices_of_a_dome_are_as_far_apart_as_its_slope_makes_them(folder: Path) -> None:
    path = folder / "dome.gcode"
    path.write_text(dome_gcode(radius=RADIUS, opening=OPENING, layer=0.6), encoding="utf-8")
    found = measure_files(job(folder / "dome.ply", spacing=1.0), [path], offset_up_to=0.2).files[0]
    assert (found.format, found.deposit) == ("G-code", "growing E")
    polar = np.arccos(dome_heights(radius=RADIUS, opening=OPENING, layer=0.6) / RADIUS)
    between = -np.diff(polar) * RADIUS
    sides = found.measured.sides
    run = np.repeat(np.arange(polar.size), np.diff(sides.offsets))
    assert found.measured.run_count == polar.size
    # Anticlockwise from above: the next slice up is to the left, the one below to the right.
    for side, first in ((0, 0), (1, 1)):
        for place in range(first, polar.size - 1 + first):
            wanted = between[place - first]
            if wanted < 2.8:
                here = sides.sides()[run == place, side]
                assert np.nanmedian(here) == pytest.approx(wanted, abs=5e-3)
    # At the rim slices are 0.7 mm apart, near the top 1.8: what a planar slicer leaves bare.
    around = np.sin(polar[:-1])
    mean = np.average(between, weights=around)
    varying = np.sqrt(np.average((between - mean) ** 2, weights=around)) / mean
    assert varying > 0.28
    assert found.measured.sides.left.cv == pytest.approx(varying, rel=0.01)
    assert found.measured.gap > 0.1
    assert found.measured.hole > 10.0


def test_rapid_written_by_hand_is_judged(folder: Path) -> None:
    axes = "[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]"
    lines = ['PERS wobjdata part:=[FALSE,TRUE,"",[[300,0,200],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];', "PROC main()"]
    for k, y in enumerate([1.0, 3.0, 5.0, 7.2]):
        ends = (0, 40) if k % 2 == 0 else (40, 0)
        lines += [
            f"MoveJ [[{ends[0]},{y},0],{axes}],v100,fine,tool0\\WObj:=part;",
            f"MoveL [[{ends[1]},{y},0],{axes}],v20,fine,tool0\\WObj:=part;",
        ]
    path = folder / "Hand.mod"
    path.write_text("\n".join(["MODULE Hand", *lines, "ENDPROC", "ENDMODULE", ""]), encoding="utf-8")
    found = measure_files(job(folder / "plate.ply"), [path]).files[0].measured
    assert (found.run_count, found.length) == (4, pytest.approx(160.0))
    # To and fro: every row has a neighbour to its left, the last one, shifted by 0.2 mm, is that of the third.
    assert found.sides.left.mean == pytest.approx((1.0 + 1.0 + 1.1 + 1.1) / 4.0, abs=1e-6)
    assert found.sides.right.mean == pytest.approx(1.0, abs=1e-6)
    assert (found.sides.left.none, found.sides.right.none) == (0.0, 0.5)


def test_several_files_stand_side_by_side_with_names_that_differ(folder: Path) -> None:
    for name, shift in (("a", 0.0), ("b", 0.2)):
        (folder / name).mkdir(exist_ok=True)
        rows = [f"{x},{2.0 * k + shift * (k % 2)},0,{k}" for k in range(1, 8) for x in (0, 40)]
        (folder / name / "paths.csv").write_text("\n".join(["x,y,z,run", *rows, ""]), encoding="utf-8")
    paths = [folder / "a" / "paths.csv", folder / "b" / "paths.csv"]
    found = measure_files(job(folder / "plate.ply"), [*paths, paths[1]])
    assert len({each.name for each in found.files}) == 3
    even, shifted, _ = (each.measured.sides for each in found.files)
    assert even.left.cv == pytest.approx(0.0, abs=1e-6)
    assert (shifted.left.cv, shifted.right.cv) == (pytest.approx(0.1, abs=1e-6), pytest.approx(0.1, abs=1e-6))


def test_paths_off_the_part_are_refused_with_the_name_of_their_file(folder: Path) -> None:
    path = folder / "above.csv"
    path.write_text("x,y,z,run\n0,5,1,1\n40,5,1,1\n0,7,1,2\n40,7,1,2\n", encoding="utf-8")
    with pytest.raises(FieldError, match=r"above\.csv: the paths lie up to 1 mm off the part.*`--offset-up-to 1\.1`"):
        measure_files(job(folder / "plate.ply"), [path])
    assert measure_files(job(folder / "plate.ply"), [path], offset_up_to=1.1).files[0].measured.off_max == 1.0


def test_a_spacing_and_a_sensible_allowance_are_asked_for(folder: Path) -> None:
    path = folder / "above.csv"
    path.write_text("x,y,z\n0,5,0\n40,5,0\n", encoding="utf-8")
    with pytest.raises(UsageError, match="give `--spacing`"):
        measure_files(job_of(surface=folder / "plate.ply", unit="mm"), [path])
    with pytest.raises(UsageError, match="positive number of mm"):
        measure_files(job(folder / "plate.ply"), [path], offset_up_to=-1.0)
    with pytest.raises(UsageError, match="1 to 20 files"):
        measure_files(job(folder / "plate.ply"), [])


def test_arguments_in_the_wrong_order_are_refused_in_a_sentence(folder: Path) -> None:
    with pytest.raises(UsageError, match="takes the job first and the files of toolpaths second"):
        measure_files([folder / "rows.csv"], job(folder / "plate.ply"))  # pyright: ignore[reportArgumentType]
    with pytest.raises(UsageError, match=r"as a list: `\['rows\.csv'\]`"):
        measure_files(job(folder / "plate.ply"), "rows.csv")


def test_a_patch_of_a_body_is_cut_as_for_planning(folder: Path) -> None:
    path = folder / "middle.csv"
    path.write_text("x,y,z,run\n15,14,0,1\n25,14,0,1\n15,16,0,2\n25,16,0,2\n", encoding="utf-8")
    asked = job_of(surface=folder / "plate.ply", unit="mm", spacing=2.0, patches=[{"at": [20, 15, 0], "radius": 8}])
    found = measure_files(asked, [path]).files[0].measured
    assert found.area == pytest.approx(np.pi * 64.0, rel=0.02)


def crooked() -> tuple[Polylines, FloatArray]:
    """Rows over a part without symmetry, and a motion that removes them it."""
    lines = [straight_line((0.0, y), (40.0 - y, y), points=21) for y in np.arange(1.0, 30.0, 2.0).tolist()]
    curves = np.concatenate(lines)
    curves[:, 2] = bump(curves)
    motion = transforms.rigid(Rotation.from_rotvec([0.4, -1.1, 2.0]).as_matrix(), np.array([120.0, -40.0, 7.0]))
    return Polylines(curves, np.cumsum([0, *map(len, lines)])), motion


def bump(places: FloatArray) -> FloatArray:
    return 4.0 * np.sin(places[:, 0] / 9.0) + 3.0 * np.cos(places[:, 1] / 7.0) + 0.004 * places[:, 0] * places[:, 1]


def test_paths_in_other_coordinates_are_laid_onto_the_part(monkeypatch: pytest.MonkeyPatch) -> None:
    # So many points of rows this plain are enough. The package has a function of the module's name.
    module = import_module("geoprint.metrics.rigid_fit")
    monkeypatch.setattr(module, "COARSE_POINTS", 150)
    monkeypatch.setattr(module, "FINE_POINTS", 300)
    flat = plate((40.0, 30.0), (80, 60))
    kept = flat.vertices[flat.faces].mean(axis=1)[:, :2].sum(axis=1) < 41.0
    vertices = flat.vertices.copy()
    vertices[:, 2] = bump(vertices)
    surface = type(flat)(vertices, flat.faces[kept])
    curves, motion = crooked()
    away = Polylines(transforms.apply(motion, curves.points), curves.offsets)
    fit = rigid_fit(surface, away)
    assert fit.residual < 0.02
    assert fit.before > 20.0
    np.testing.assert_allclose(moved(away, fit).points, curves.points, atol=0.1)
    # What lies on the part already is left where it is.
    assert np.abs(moved(curves, rigid_fit(surface, curves)).points - curves.points).max() < 0.1


# `geoprint remesh`: what it writes, what it says, and what it refuses to write.


__all__ = ["run"]


@pytest.fixture
def cap(tmp_path: Path) -> Path:
    path = tmp_path / "cap.ply"
    save_ply(spherical_cap(rings=10, jitter_seed=1), path)
    return path


def test_the_command_writes_the_part_and_says_how_far_it_lies_off(run: Run, cap: Path, tmp_path: Path) -> None:
    out = tmp_path / "even.ply"
    status, stdout, stderr = run("remesh", cap, "--unit", "mm", "--edge-length", 4, "--out", out, "--json",
                                 "--max-deviation", 0.3)  # fmt: skip
    assert status == 0, stderr
    found = json.loads(stdout)
    assert found["steps"] == ["remeshed to edges of 4 mm"]
    assert found["after"]["edge_cv"] < 0.15
    assert found["deviation"]["old_to_new"]["max_bound_mm"] < found["deviation"]["allowed_mm"] == 0.3
    assert f"written: {out}" in stderr
    assert len(prepare(load(out, unit="mm"))[0].faces) == found["after"]["faces"]


def test_what_lies_farther_off_than_allowed_is_not_written(run: Run, cap: Path, tmp_path: Path) -> None:
    out = tmp_path / "even.ply"
    status, _, stderr = run("remesh", cap, "--unit", "mm", "--edge-length", 12, "--out", out)
    assert status == 3
    assert "remeshed to edges of 12 mm, lies up to" in stderr
    assert "or allow it with `--max-deviation" in stderr
    assert stderr.count("\n") == 1
    assert not out.exists()
    # The advice is enough.
    advised = stderr.split("--max-deviation ")[1].split("`")[0]
    status, _, stderr = run(
        "remesh", cap, "--unit", "mm", "--edge-length", 12, "--out", out, "--max-deviation", advised
    )
    assert status == 0, stderr


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [({}, "give `--edge-length MM`"), ({"edge_length": 2.0, "faces": 100}, "give either `--edge-length` or `--faces`")],
)
def test_one_thing_must_be_asked_for(cap: Path, settings: dict[str, float], sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence):
        remesh_file(cap, unit="mm", **settings)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("name", ["even.stl", "taken.ply"])
def test_a_result_needs_a_free_name_that_ends_in_ply(run: Run, cap: Path, tmp_path: Path, name: str) -> None:
    (tmp_path / "taken.ply").write_text("mine")
    status, _, stderr = run("remesh", cap, "--unit", "mm", "--edge-length", 4, "--out", tmp_path / name)
    assert status == 2
    assert "is written as PLY" in stderr or "choose another name" in stderr


def test_smoothing_comes_first_and_both_are_measured_together(tmp_path: Path) -> None:
    flat = plate(divisions=(30, 22), jitter_seed=1)
    vertices = flat.vertices + np.random.default_rng(2).normal(0.0, 0.1, flat.vertices.shape)
    save_ply(Surface(vertices=vertices, faces=flat.faces), tmp_path / "rough.ply")
    with pytest.raises(InputError, match="smoothed below 8 mm and remeshed to edges of 2 mm, lies up to"):
        remesh_file(tmp_path / "rough.ply", unit="mm", wavelength=8.0, edge_length=2.0)
    found = remesh_file(tmp_path / "rough.ply", unit="mm", wavelength=8.0, edge_length=2.0, max_deviation=1.5)
    assert found.after.vertices[:, 2].std() < 0.4 * found.before.vertices[:, 2].std()
    assert "smoothed below 8 mm; remeshed to edges of 2 mm" in remeshing_text(found)
    assert "rims at most" in remeshing_text(found)


def test_a_mesh_that_would_read_as_another_kind_of_surface_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    save_ply(annulus(), tmp_path / "ring.ply")

    def closing_holes(_: Surface, *, edge_length: float) -> Surface:
        return refine(plate(), edge_length=edge_length)

    monkeypatch.setattr("geoprint.workflow.mesh_files.remesh", closing_holes)
    with pytest.raises(InputError, match="would be disc, the part is annulus"):
        remesh_file(tmp_path / "ring.ply", unit="mm", edge_length=2.0)


def test_a_mesh_too_coarse_for_a_level_is_tried_as_finely_as_it_would_be_planned(tmp_path: Path) -> None:
    """As those of CAD: a strip of a cylinder whose vertices all lie on its border."""
    angles = np.linspace(0.0, np.pi, 13)
    arc = np.column_stack([10.0 * np.cos(angles), np.zeros(13), 10.0 * np.sin(angles)])
    first = np.arange(12)
    faces = np.vstack(
        [np.column_stack([first, first + 13, first + 1]), np.column_stack([first + 1, first + 13, first + 14])]
    )
    save_ply(Surface(np.vstack([arc, np.add(arc, (0.0, 30.0, 0.0))]), faces, "strip"), tmp_path / "strip.ply")
    seen = inspect_file(tmp_path / "strip.ply", unit="mm")
    assert isinstance(seen, FileInspection)
    assert [said for _, said in seen.backends] == ["yes", "yes", "yes"]
