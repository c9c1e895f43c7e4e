"""Bundles that the tests of this folder share: each is planned once, from files that are gone afterwards."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from geoprint.config import job_of, packaged_cell_text
from geoprint.pipeline import compare, plan, save_comparisons, save_plan
from geoprint.surfaces.files import save_ply
from tests.brief_proofs import proving_briefly
from tests.meshes import plate

CALIBRATED = """source = "calibrated"
model_mm = [[-50, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]]
touched_mm = [[250, 50, 30], [350, 50, 30], [350, -50, 30], [250, -50, 30]]
part_mm = [-8, -6, 20]"""


@pytest.fixture(scope="session")
def printed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the bundle of a patch on a body, in centimetres, with a cell file of its own."""
    folder = tmp_path_factory.mktemp("printed")
    surface = plate((1.6, 1.2), (12, 9), jitter_seed=1)
    lines = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in surface.vertices.tolist()]
    lines += [f"g lid\nf {a + 1} {b + 1} {c + 1}\n" for a, b, c in surface.faces.tolist()]
    (folder / "plate.obj").write_text("".join(lines))
    save_ply(plate((2.0, 2.0), (4, 4), jitter_seed=2), folder / "table.ply")
    (folder / "own cell.toml").write_text(packaged_cell_text("irb120-bent45").replace('source = "demo"', CALIBRATED))
    job = job_of(
        surface=folder / "plate.obj", unit="cm", spacing=2.5, cell=folder / "own cell.toml", body=folder / "table.ply",
        patch={"at": [0.0, 0.0, 0.0], "radius": 5.0, "region": "lid"}, backend="fast-marching",
    )  # fmt: skip
    save_plan(plan(job), folder / "out")
    for name in ("plate.obj", "table.ply", "own cell.toml"):
        (folder / name).unlink()
    return folder / "out"


@pytest.fixture(scope="session")
def compared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a comparison of three backends on a plate that stands where the arm does not reach it."""
    folder = tmp_path_factory.mktemp("compared")
    save_ply(plate((16.0, 12.0), (12, 9), jitter_seed=1), folder / "plate.ply")
    text = packaged_cell_text("irb120-bent45").replace("[300, 0, 50]", "[900, 0, 50]")
    assert "[900, 0, 50]" in text
    (folder / "far.toml").write_text(text)
    job = job_of(surface=folder / "plate.ply", unit="mm", rounds=3, place="demo", cell=folder / "far.toml")
    with proving_briefly():
        save_comparisons([compare(job, backends=["lscm", "heat", "fast-marching"])], folder / "out")
    (folder / "plate.ply").unlink()
    return folder / "out"


@pytest.fixture
def copy(printed: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(printed, tmp_path / "copy"))
