"""What the first run needs later is compiled beside it: the loops that a plan calls, for as long as the run lasts."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from geoprint.config import job_of
from geoprint.geometry.files import save_ply
from geoprint.metrics.oracle import geodesic, tracing
from geoprint.robot.controller import choice, fitting
from geoprint.robot.reach import ladder
from geoprint.workflow import compiled_ahead, plan, precompile
from tests.meshes import spherical_cap

# The loops that take longest to compile of those that come after the contours.
LATE: tuple[Callable[..., object], ...] = (
    tracing.connect,
    geodesic.search_all,
    ladder._sweep,  # pyright: ignore[reportPrivateUsage]
    choice._weigh,  # pyright: ignore[reportPrivateUsage]
    fitting._follow,  # pyright: ignore[reportPrivateUsage]
)


def nothing_kept(_kernel: object) -> bool:
    return False


def something_kept(_kernel: object) -> bool:
    return True


def one_core() -> int:
    return 1


def never_ending(_folder: Path) -> None:
    time.sleep(3600.0)


@pytest.fixture
def first_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine with two cores on which nothing is kept, and a process beside that would go on for ever."""
    monkeypatch.setattr(precompile, "is_kept", nothing_kept)
    monkeypatch.setattr(precompile.os, "cpu_count", lambda: 2)
    monkeypatch.setattr(precompile, "_quietly", never_ending)


def signatures(kernel: Callable[..., object]) -> set[object]:
    return {*getattr(kernel, "signatures")}  # noqa: B009  (numba adds it)


@pytest.mark.usefixtures("first_run")
def test_a_process_compiles_beside_the_body_and_ends_with_it_whether_or_not_that_fails() -> None:
    with compiled_ahead():
        (beside,) = multiprocessing.active_children()
        assert beside.is_alive()
    assert multiprocessing.active_children() == []
    with pytest.raises(ValueError, match="'1 beside'"), compiled_ahead():
        float(f"{len(multiprocessing.active_children())} beside")
    assert multiprocessing.active_children() == []


@pytest.mark.usefixtures("first_run")
@pytest.mark.parametrize(
    ("place", "name", "answer"),
    [
        (precompile, "is_kept", something_kept),
        (precompile, "keeps", nothing_kept),
        (precompile.os, "cpu_count", one_core),
    ],
)
def test_nothing_is_compiled_beside_a_later_run_or_on_a_single_core(
    monkeypatch: pytest.MonkeyPatch, place: object, name: str, answer: Callable[..., object]
) -> None:
    monkeypatch.setattr(place, name, answer)
    with compiled_ahead():
        assert multiprocessing.active_children() == []


def test_what_goes_wrong_beside_is_not_told(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    process = multiprocessing.get_context("spawn").Process(target=precompile._quietly, args=(tmp_path / "missing",))  # pyright: ignore[reportPrivateUsage]
    process.start()
    process.join(300.0)
    assert process.exitcode == 0
    assert capfd.readouterr() == ("", "")


def test_a_plan_calls_the_loops_as_they_were_compiled_ahead_of_it(tmp_path: Path) -> None:
    precompile.compile_later_stages(tmp_path)
    compiled = [signatures(kernel) for kernel in LATE]
    assert all(compiled)

    cap = tmp_path / "cap.ply"
    save_ply(spherical_cap(radius=30.0, angle=0.2, rings=4), cap)
    plan(job_of(surface=cap, unit="mm", spacing=3.0, place="demo"))

    assert [signatures(kernel) for kernel in LATE] == compiled
