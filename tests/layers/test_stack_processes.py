"""The processes that plan layers: they hold no more than they need, end as they should, and change nothing.

But for the last test they import of the pipeline only what starts and ends them: all of it takes each of them 3 s.
"""

from __future__ import annotations

import multiprocessing
import platform
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from geoprint.config import job_of
from geoprint.geometry.files import save_ply
from geoprint.layers import plan_stack
from geoprint.metrics.oracle import geodesic, tracing
from geoprint.robot.controller import choice, fitting
from geoprint.robot.reach import ladder
from geoprint.workflow import plan, precompile, precompiled
from geoprint.workflow.processes import FORSAKEN as ABANDONED, ended_at_once
from tests.layers.layers_here import planning_here
from tests.meshes import plate, spherical_cap

# Processes that a script starts run its beginning, too.
ALONE = """
import sys, types
from pathlib import Path
import geoprint

workflow = types.ModuleType("geoprint.workflow")
workflow.__path__ = [str(Path(geoprint.__file__).parent / "workflow")]
sys.modules["geoprint.workflow"] = workflow
"""
# Arrays of 2 MB, each freed but the last: a heap that has grown around them cannot shrink below that one.
COUNT, MB = 100, 2
HELD = f"""
import os
import numpy as np
from pathlib import Path

def held():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20

def kept():
    np.ones({MB} << 17)
    arrays = [np.ones({MB} << 17) for _ in range({COUNT})]
    before = held()
    del arrays[:-1]
    return before - held()
"""


def _given_back(code: str) -> float:
    """Return how much of the arrays a process gives back [MB]."""
    found = subprocess.run(
        [sys.executable, "-c", f"{ALONE}\n{HELD}\n{code}\nprint(kept())"], capture_output=True, text=True, check=True
    )
    return float(found.stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="what is free is given back as glibc is told to")
def test_large_arrays_go_back_as_soon_as_they_are_free() -> None:
    record = "from geoprint.workflow.processes import give_back_memory\ngive_back_memory()"
    assert _given_back(record) > 0.9 * MB * (COUNT - 1)
    # Without that it would keep them, and this test would tell nothing.
    assert _given_back("") < 0.5 * MB * (COUNT - 1)


# More layers than there are processes at a time, one after another.
NUMBERED = f"""{ALONE}
import os
from geoprint.workflow.processes import layer_processes

if __name__ == "__main__":
    with layer_processes() as pool:
        print(*(pool.submit(os.getpid).result() for _ in range(3)))
"""


def test_no_layer_is_planned_in_the_process_of_another(tmp_path: Path) -> None:
    script = tmp_path / "numbered.py"
    script.write_text(NUMBERED)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    numbers = done.stdout.split()
    assert (len(numbers), len(set(numbers))) == (3, 3)


# Says which process works, and then works longer than anybody waits.
FORSAKEN = """
import os, time
from geoprint.workflow.processes import {pool}

def work():
    print(os.getpid(), flush=True)
    time.sleep(600)

if __name__ == "__main__":
    with {pool}({arguments}) as pool:
        getattr(pool, "_pool", pool).submit(work).result()
"""


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="only Linux tells by a file whether a process is there")
@pytest.mark.parametrize(("pool", "arguments"), [("layer_processes", ""), ("beside", "1")])
def test_who_is_killed_leaves_no_process_behind(tmp_path: Path, pool: str, arguments: str) -> None:
    script = tmp_path / "forsaken.py"
    script.write_text(ALONE + FORSAKEN.format(pool=pool, arguments=arguments))
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as started:
        assert started.stdout is not None
        worker = Path("/proc", started.stdout.readline().strip())
        assert worker.exists()
        started.kill()
        ends = time.monotonic() + 60.0
        while _runs(worker) and time.monotonic() < ends:
            time.sleep(0.1)
    assert not _runs(worker)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="only Linux tells by a file whether a process is there")
@pytest.mark.parametrize(("pool", "arguments"), [("layer_processes", ""), ("beside", "1")])
def test_who_is_stopped_ends_its_processes_whatever_they_do(tmp_path: Path, pool: str, arguments: str) -> None:
    script = tmp_path / "forsaken.py"
    script.write_text(ALONE + FORSAKEN.format(pool=pool, arguments=arguments))
    with subprocess.Popen(
        [sys.executable, script], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as started:
        assert started.stdout is not None
        worker = Path("/proc", started.stdout.readline().strip())
        # It alone hears of it, as where a program asks it to stop.
        started.send_signal(signal.SIGINT)
        began = time.monotonic()
        started.wait(timeout=60.0)
        assert time.monotonic() - began < 5.0
        assert not _runs(worker)


# Stopped at the keyboard as soon as its process is started, before that could have imported anything.
STOPPED = """
import multiprocessing, os, signal
from geoprint.workflow.processes import end_with_parent, stopped_later

if __name__ == "__main__":
    with stopped_later():
        process = multiprocessing.get_context("spawn").Process(target=end_with_parent)
        process.start()
    os.kill(process.pid, signal.SIGINT)
    process.join()
    print(process.exitcode)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_process_that_is_stopped_while_it_imports_ends_without_a_word(tmp_path: Path) -> None:
    script = tmp_path / "stopped.py"
    script.write_text(ALONE + STOPPED)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == (f"{ABANDONED}\n", "")


def _runs(process: Path) -> bool:
    """Say whether a process runs: one that has ended is there until its parent has asked how."""
    try:
        return "State:\tZ" not in (process / "status").read_text()
    except OSError:
        return False


def test_layers_have_the_same_bytes_as_if_one_process_planned_them(tmp_path: Path) -> None:
    save_ply(plate((8.0, 6.0), (8, 6)), tmp_path / "plate.ply")
    job = job_of(surface=tmp_path / "plate.ply", unit="mm", spacing=2.0, thickness=0.5, robot=False)
    found = plan_stack(job, tmp_path / "apart")
    with planning_here():
        assert plan_stack(job, tmp_path / "here") == found
    one, other = (tmp_path / name / "manifest.json" for name in ("apart", "here"))
    assert one.read_bytes() == other.read_bytes()


def imports_for_long(begun: Path, done: Path) -> None:
    begun.touch()
    time.sleep(15.0)
    done.touch()


def test_a_process_that_still_imports_is_not_waited_for(tmp_path: Path) -> None:
    begun, done = tmp_path / "begun", tmp_path / "done"

    def pool(_: Connection) -> ProcessPoolExecutor:
        spawning = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(1, mp_context=spawning, initializer=imports_for_long, initargs=(begun, done))

    def fail() -> None:
        with ended_at_once(pool) as processes:
            processes.submit(time.sleep, 0.0)
            while not begun.exists():
                time.sleep(0.01)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert not done.exists()
    assert multiprocessing.active_children() == []


# What the first run needs later is compiled beside it: the loops that a plan calls, for as long as the run lasts.


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
    with precompiled():
        (beside,) = multiprocessing.active_children()
        assert beside.is_alive()
    assert multiprocessing.active_children() == []
    with pytest.raises(ValueError, match="'1 beside'"), precompiled():
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
    with precompiled():
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
