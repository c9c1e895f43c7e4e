"""Killed at any moment, geoprint leaves no process, no folder and no open file behind.

CI kills a few times; `pytest -m fuzz tests/geometry/files/test_kills.py` does so 200 times.
"""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from geoprint.geometry.native import MEMORY
from tests.geometry.files.test_cad import iges_plate

pytestmark = [
    pytest.mark.skipif(importlib.util.find_spec("cascadio") is None, reason="the extra cad is not installed"),
    pytest.mark.skipif(sys.platform != "linux", reason="reads /proc"),
]
SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGKILL)
KILLS, MANY_KILLS = 4, 200
# The command takes about two seconds, its process for native code from one half of them on [s].
LATEST = 3.0
# What is killed has this long to be gone, however busy the machine is [s].
GONE_WITHIN = 30.0
# Its child works by then, however busy the machine is [s].
STARTED_WITHIN = 60.0
# Between two looks [s].
LOOK = 0.05
# Found again in the environment of every process that came of it.
MARK = "GEOPRINT_TEST_KILLS"


def processes(mark: str) -> list[str]:
    """Return the command lines of the living processes that carry a mark in their environment."""
    found: list[str] = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state = (folder / "stat").read_text().rpartition(")")[2].split()[0]
            if state != "Z" and f"{MARK}={mark}".encode() in (folder / "environ").read_bytes():
                found.append((folder / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        except OSError:
            continue
    return found


def working_child(process: int) -> int | None:
    """Return the child of a process that reads with native code, once it has bound itself to its parent."""
    try:
        tasks = list(Path(f"/proc/{process}/task").glob("*/children"))
        numbers = [int(child) for task in tasks for child in task.read_text().split()]
        # Its limits are what it sets next.
        return next((child for child in numbers if str(MEMORY) in Path(f"/proc/{child}/limits").read_text()), None)
    except OSError:
        return None


def handles() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def killed(path: Path, *, which: signal.Signals, after: float | None, temporary: Path) -> list[str]:
    """Inspect a file, kill that at a moment or once its child works, and return what lives or lies there after it."""
    mark = f"{os.getpid()}-{time.monotonic_ns()}"
    environment = {**os.environ, MARK: mark, "TMPDIR": str(temporary)}
    command = [sys.executable, "-m", "geoprint", "inspect", str(path)]
    running = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    if after is not None:
        time.sleep(after)
    until, child = time.monotonic() + STARTED_WITHIN, None
    while after is None and child is None and time.monotonic() < until:
        time.sleep(LOOK)
        child = working_child(running.pid)
    if child is not None:
        # As if its work took for ever.
        os.kill(child, signal.SIGSTOP)
    running.send_signal(which)
    running.wait(timeout=GONE_WITHIN)
    until = time.monotonic() + GONE_WITHIN
    while processes(mark) and time.monotonic() < until:
        time.sleep(LOOK)
    left = processes(mark)
    if left and child is not None:
        os.kill(child, signal.SIGKILL)
    return [*left, *map(str, temporary.iterdir())]


def kill_often(folder: Path, *, times: int) -> None:
    # A saddle that large keeps the tessellator busy for some seconds.
    (folder / "saddle.igs").write_text(iges_plate("MM", size=(1.9e3, 1.9e3), rise=1.9e3))
    moments: list[float | None] = [*np.random.default_rng(17).uniform(0.02, LATEST, times).tolist()]
    moments[: len(SIGNALS)] = [None] * len(SIGNALS)
    before = handles()

    def one(count: int) -> list[str]:
        temporary = folder / str(count)
        temporary.mkdir()
        return killed(folder / "saddle.igs", which=SIGNALS[count % 3], after=moments[count], temporary=temporary)

    with ThreadPoolExecutor(len(SIGNALS)) as pool:
        for count, left in enumerate(pool.map(one, range(times))):
            assert left == [], f"kill {count} by {SIGNALS[count % 3].name} after {moments[count]} s"
    assert handles() == before


def test_whatever_kills_it_nothing_is_left(tmp_path: Path) -> None:
    kill_often(tmp_path, times=KILLS)


@pytest.mark.fuzz
def test_whatever_kills_it_many_times_nothing_is_left(tmp_path: Path) -> None:
    kill_often(tmp_path, times=MANY_KILLS)
