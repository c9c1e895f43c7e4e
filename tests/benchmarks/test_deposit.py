"""The benchmark of deposits: it reads a program's text alone, and finds what was made wrong in it."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from benchmarks.deposit import deposited, read_program
from geoprint import job_of, plan, save_plan
from geoprint.account import PlanRecord
from geoprint.surfaces.files import save_ply
from tests.meshes import spherical_cap


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, PlanRecord]:
    folder = tmp_path_factory.mktemp("deposit")
    save_ply(spherical_cap(radius=15.0, angle=0.5, rings=12), folder / "cap.ply")
    planned = plan(job_of(surface=folder / "cap.ply", unit="mm", spacing=2.0, place="demo"))
    return folder / "out", save_plan(planned, folder / "out")


def test_what_the_text_deposits_is_what_the_plan_says(printed: tuple[Path, PlanRecord]) -> None:
    folder, told = printed
    found, said = deposited(read_program(folder / "rapid"), told, spacing=2.0), told.robot[0].motion.deposited
    assert said is not None
    assert len(found.runs) == told.paths.runs
    assert found.whole == pytest.approx(said.share, abs=0.005)
    assert found.runs.max() == pytest.approx(said.most_run, abs=0.02)
    assert found.whole == pytest.approx(1.0, abs=0.02)
    np.testing.assert_allclose(found.runs, 1.0, atol=0.06)


def test_a_run_at_half_its_speed_gets_twice_its_volume(printed: tuple[Path, PlanRecord], tmp_path: Path) -> None:
    folder, told = printed
    program = read_program(shutil.copytree(folder / "rapid", tmp_path / "rapid"))
    stops = np.flatnonzero(program.stops)
    opened = [move for move, _, opens in program.switches if opens]
    first, last = stops[np.searchsorted(stops, opened[0]) - 1], stops[np.searchsorted(stops, opened[0])]
    speeds = program.speeds.copy()
    speeds[first + 1 : last + 1] /= 2.0
    before, after = (deposited(each, told, spacing=2.0) for each in (program, program._replace(speeds=speeds)))
    assert after.runs[0] == pytest.approx(2.0 * before.runs[0], rel=0.01)
    np.testing.assert_allclose(after.runs[1:], before.runs[1:])
