"""`geoprint remesh`: what it writes, what it says, and what it refuses to write."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import InputError, UsageError
from geoprint.geometry import prepare, refine
from geoprint.geometry.files import load, save_ply
from geoprint.model import Surface
from geoprint.reporting import remeshing_text
from geoprint.results import FileInspection
from geoprint.workflow import inspect_file, remesh_file
from tests.cli.test_commands import Run, run
from tests.meshes import annulus, plate, spherical_cap

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
    assert "remeshed to edges of 4 mm" in stderr
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
    [({}, "say what to change"), ({"edge_length": 2.0, "faces": 100}, "give either `--edge-length` or `--faces`")],
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
    with pytest.raises(InputError, match="would read as disc, the part is annulus"):
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
