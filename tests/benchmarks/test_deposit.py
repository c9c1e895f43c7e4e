"""The benchmark of deposits: it reads a program's text alone, and finds what was made wrong in it."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from benchmarks.programs.deposit import (
    RADII,
    WAYS,
    Deposited,
    Program,
    at_ends,
    cases,
    deposited,
    discs,
    measured,
    numbers,
    output_of,
    programs,
    read_program,
    wanted,
)
from geoprint import job_of, plan
from geoprint.config import packaged_cell_text
from geoprint.geometry.files import save_ply
from geoprint.reporting import PlanRecord
from geoprint.workflow import check_bundle, save_plan
from tests.meshes import spherical_cap


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, PlanRecord]:
    folder = tmp_path_factory.mktemp("deposit")
    save_ply(spherical_cap(radius=15.0, angle=0.5, rings=12), folder / "cap.ply")
    planned = plan(job_of(surface=folder / "cap.ply", unit="mm", spacing=2.0, place="demo"))
    return folder / "out", save_plan(planned, folder / "out")


def in_text(folder: Path, record: PlanRecord, program: Program | None = None) -> Deposited:
    """Return what a program deposits, by default that of a bundle."""
    assert record.deposition is not None
    volumes = wanted(folder / "poses.csv").volumes
    return deposited(program or read_program(folder / "rapid"), volumes, rate=record.deposition.valve_mm3_s)


def test_what_the_text_deposits_is_what_the_plan_says(printed: tuple[Path, PlanRecord]) -> None:
    folder, record = printed
    found, said = in_text(folder, record), record.robot[0].motion.deposited
    assert said is not None
    assert len(found.runs) == record.paths.runs
    assert found.whole == pytest.approx(said.share, abs=0.005)
    # One run is opened at the very start of a move, and the shortest begins with two moves of its ramp.
    assert (found.runs.min(), found.runs.max()) == pytest.approx((said.least_run, said.most_run), abs=0.01)
    assert found.whole == pytest.approx(1.0, abs=0.02)
    # The innermost ring of 2.5 mm gets most.
    np.testing.assert_allclose(found.runs, 1.0, atol=0.07)


def ends_in_text(folder: Path, record: PlanRecord, program: Program) -> np.ndarray:
    """Return what the ends of each run of a bundle get, over what is wanted there."""
    assert record.deposition is not None
    beads = wanted(folder / "poses.csv")
    width = beads.widest / record.settings.layer_height_mm
    return at_ends(program, beads, rate=record.deposition.valve_mm3_s, width=width)


def test_runs_begin_and_end_with_the_bead_that_is_wanted(printed: tuple[Path, PlanRecord]) -> None:
    """The valve opens and shuts in motion: at the targets of a run with leads, else on its ramps."""
    folder, record = printed
    program = read_program(folder / "rapid")
    found = ends_in_text(folder, record, program)
    assert found.shape == (record.paths.runs, 2)
    np.testing.assert_allclose(found[:-1], 1.0, atol=0.005)
    # The innermost ring of 2.5 mm is looked at by halves.
    np.testing.assert_allclose(found[-1], 1.0, atol=0.1)
    # Where it opens a move sooner instead the start gets more, and the end of a run that is long what it did.
    early = [(move - 1, 0.0, True, True) if on else (move, off, start, on) for move, off, start, on in program.switches]
    sooner = ends_in_text(folder, record, program._replace(switches=early))
    assert (sooner[:, 0] > found[:, 0] + 0.04).all()
    # As the guide says of a cell.
    assert 16.0 < record.settings.speed_mm_s < 20.0
    np.testing.assert_array_equal(sooner[:-1, 1], found[:-1, 1])


def test_a_flow_that_settles_and_a_lamp_that_shines_on_are_written_executed_checked_and_counted(tmp_path: Path) -> None:
    """The arm waits where each run begins, and at the last lift: the text says the same volumes as the plan."""
    text = packaged_cell_text("irb120-bent45").replace("# settle_ms = 0\n", "settle_ms = 40\n")
    text = text.replace("# uv_tail_s = 0.0\n", "uv_tail_s = 20\n")
    (tmp_path / "cell.toml").write_text(text, encoding="utf-8")
    save_ply(spherical_cap(radius=15.0, angle=0.5, rings=12), tmp_path / "cap.ply")
    planned = plan(
        job_of(
            surface=tmp_path / "cap.ply", unit="mm", spacing=2.0, place="demo", cell=str(tmp_path / "cell.toml")
        )
    )  # fmt: skip
    record = save_plan(planned, tmp_path / "out")
    assert check_bundle(tmp_path / "out").findings == ()
    program, said = read_program(tmp_path / "out" / "rapid"), record.robot[0].motion.deposited
    assert said is not None
    found = in_text(tmp_path / "out", record)
    assert found.whole == pytest.approx(said.share, abs=0.005)
    assert (found.runs.min(), found.runs.max()) == pytest.approx((said.least_run, said.most_run), abs=0.01)
    waits = program.waits[program.waits > 0.0]
    np.testing.assert_array_equal(waits[:-1], 0.04)
    assert waits.size == record.paths.runs + 1
    ((_, on), off) = planned.robot[0].switching.lamp[-1], planned.robot[0].switching.deposits[-1, 1]
    assert on - off == pytest.approx(20.0, abs=0.03)
    # What flows meanwhile lies at the start, 20 ms of flow, and so does what the ramp gets too much: 1.2 %.
    speed = record.settings.speed_mm_s
    begun, ended = ends_in_text(tmp_path / "out", record, program)[:3].T
    np.testing.assert_allclose(begun, 1.0 + 0.02 * speed / 4.0 + 0.012, atol=0.005)
    np.testing.assert_allclose(ended, 1.0, atol=0.005)
    # As the guide says of a cell.
    assert round(speed) == 5
    # Without the waits the text deposits what flows in half of each less.
    still = in_text(tmp_path / "out", record, program._replace(waits=np.zeros(program.waits.size)))
    assert still.whole < found.whole - 0.001


def test_a_run_at_half_its_speed_gets_twice_its_volume(printed: tuple[Path, PlanRecord], tmp_path: Path) -> None:
    folder, record = printed
    program = read_program(shutil.copytree(folder / "rapid", tmp_path / "rapid"))
    stops = np.flatnonzero(program.stops)
    opened = [move for move, *_, opens in program.switches if opens]
    first, last = stops[np.searchsorted(stops, opened[0]) - 1], stops[np.searchsorted(stops, opened[0])]
    speeds = program.speeds.copy()
    speeds[first + 1 : last + 1] /= 2.0
    before, after = (in_text(folder, record, each) for each in (program, program._replace(speeds=speeds)))
    assert after.runs[0] == pytest.approx(2.0 * before.runs[0], rel=0.01)
    np.testing.assert_allclose(after.runs[1:], before.runs[1:])


def test_an_output_that_follows_the_speed_deposits_what_poses_csv_asks_for(tmp_path: Path) -> None:
    """Half of what the output is worth deposits half, with the timed path on the moves of the text."""
    text = packaged_cell_text("irb120-bent45").replace('mode = "io"', 'mode = "analog"')
    text = text.replace("# flow = ", "flow = ").replace("# flow_per_mm3_s = ", "flow_per_mm3_s = ")
    (tmp_path / "cell.toml").write_text(text, encoding="utf-8")
    save_ply(spherical_cap(radius=15.0, angle=0.5, rings=12), tmp_path / "cap.ply")
    cell = str(tmp_path / "cell.toml")
    record = save_plan(
        plan(job_of(surface=tmp_path / "cap.ply", unit="mm", spacing=2.0, place="demo", cell=cell)), tmp_path / "out"
    )
    assert programs(tmp_path / "out") == [tmp_path / "out"]
    found = measured(tmp_path / "out")
    assert found.whole == pytest.approx((1.0, 1.0), abs=0.003)
    assert max(found.off) < 0.2
    assert output_of(tmp_path / "out") == 0.1
    program, volumes = read_program(tmp_path / "out" / "rapid"), wanted(tmp_path / "out" / "poses.csv").volumes
    rate = record.deposition.valve_mm3_s if record.deposition is not None else 0.0
    halved = deposited(program._replace(flows=program.flows / 2.0), volumes, rate=rate, output=0.1)
    assert halved.whole == pytest.approx(0.5, abs=0.003)


def test_discs_are_drawn_alike_and_each_way_is_one_that_geoprint_knows(tmp_path: Path) -> None:
    body = tmp_path / "dome.ply"
    save_ply(spherical_cap(radius=40.0, angle=1.2, rings=24), body)
    drawn, again = (list(discs([body], numbers("5"), seed=3)) for _ in range(2))
    assert drawn == again
    assert drawn != list(discs([body], numbers("5"), seed=4))
    assert list(discs([body], numbers("2-4"), seed=3)) == drawn[1:4]
    assert all(RADII[0] <= keys["patches"][0]["radius"] <= RADII[1] for _, keys in drawn)
    # A spacing wider than the body is refused before the long work, for the same reason in every way; layers are
    # planned by workers of their own.
    ways = tuple(way for way in WAYS if way != "layers")
    found = list(cases(drawn[:1], backends=["heat"], ways=ways, spacing=200.0))
    assert [name.removeprefix(drawn[0][0]) for name, _ in found] == [
        " heat" if way == "default" else f" heat {way}" for way in ways
    ]
    assert all("spacing is 200 mm" in str(refused) for _, refused in found)
