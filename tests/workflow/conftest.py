"""Bundles that the tests of this folder share: each is planned once, from files that are gone afterwards."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from geoprint.config import job_of, packaged_cell_text
from geoprint.geometry.files import save_ply
from geoprint.results import Plan
from geoprint.workflow import compare, plan, save_comparisons, save_plan
from tests.brief_proofs import proving_briefly
from tests.meshes import plate
from tests.shared_plans import SharedPlans

CALIBRATED = """source = "calibrated"
model_mm = [[-50, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]]
touched_mm = [[250, 50, 30], [350, 50, 30], [350, -50, 30], [250, -50, 30]]
part_mm = [-8, -6, 20]"""


@pytest.fixture(scope="session")
def printed_plan(shared_plans: SharedPlans, tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Return the plan of a patch on a body, in centimetres, with a cell file of its own."""

    def make() -> Plan:
        folder = tmp_path_factory.mktemp("printed")
        surface = plate((1.6, 1.2), (12, 9), jitter_seed=1)
        lines = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in surface.vertices.tolist()]
        lines += [f"g lid\nf {a + 1} {b + 1} {c + 1}\n" for a, b, c in surface.faces.tolist()]
        (folder / "plate.obj").write_text("".join(lines))
        save_ply(plate((2.0, 2.0), (4, 4), jitter_seed=2), folder / "table.ply")
        (folder / "own cell.toml").write_text(
            packaged_cell_text("irb120-bent45").replace('source = "demo"', CALIBRATED)
        )
        job = job_of(
            surface=folder / "plate.obj", unit="cm", spacing=2.5, cell=folder / "own cell.toml",
            body=folder / "table.ply", patch={"at": [0.0, 0.0, 0.0], "radius": 5.0, "region": "lid"},
            backend="fast-marching",
        )  # fmt: skip
        planned = plan(job)
        for name in ("plate.obj", "table.ply", "own cell.toml"):
            (folder / name).unlink()
        return planned

    return shared_plans.value("a patch on a body", make)


@pytest.fixture(scope="session")
def printed(printed_plan: Plan, shared_plans: SharedPlans) -> Path:
    """Return the bundle of that plan."""
    return shared_plans.folder("bundle of a patch on a body", lambda folder: save_plan(printed_plan, folder))


@pytest.fixture(scope="session")
def compared(shared_plans: SharedPlans) -> Path:
    """Return a comparison of two backends on a plate that stands where the arm does not reach it."""

    def write(folder: Path) -> None:
        inputs = folder.with_name("compared inputs")
        inputs.mkdir(exist_ok=True)
        save_ply(plate((16.0, 12.0), (12, 9), jitter_seed=1), inputs / "plate.ply")
        # Where its attitude is stated, no other one is searched.
        far = "[900, 0, 50]\ndemo_rpy_deg = [0, 0, 0]"
        text = packaged_cell_text("irb120-bent45").replace("[300, 0, 50]", far)
        assert far in text
        (inputs / "far.toml").write_text(text)
        # Nor does the nozzle lean.
        job = job_of(
            surface=inputs / "plate.ply", unit="mm", rounds=3, place="demo", cell=inputs / "far.toml", max_tilt=0.0
        )
        with proving_briefly():
            save_comparisons([compare(job, backends=["heat", "lscm"])], folder)
        (inputs / "plate.ply").unlink()

    return shared_plans.folder("comparison of what is out of reach", write)


@pytest.fixture
def copy(printed: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(printed, tmp_path / "copy"))
