"""Kernels compile wherever geoprint is installed, and two first runs at once share what they leave."""

from __future__ import annotations

import errno
import os
import shutil
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

import geoprint
from geoprint.kernels import taken

# Compiles a small kernel for each type that is named, and says what they answer and whether anything is kept.
PROBE = """
import sys
import numpy as np
from geoprint.kernels import is_kept
from small_kernel import summed
for kind in sys.argv[1:]:
    print(summed(np.array([2, 1], dtype=kind)), end=" ")
print(is_kept(summed))
"""
SMALL_KERNEL = """
from geoprint.kernels import njit

@njit
def summed(values):
    total = 0
    for value in values:
        total += value
    return total
"""


@pytest.fixture(scope="module")
def locked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package, with a kernel beside it, in which nothing can be written."""
    root = tmp_path_factory.mktemp("installed")
    package = Path(geoprint.__file__).parent
    shutil.copytree(package, root / "geoprint", ignore=shutil.ignore_patterns("__pycache__"))
    (root / "small_kernel.py").write_text(SMALL_KERNEL)
    for folder in [root, *(path for path in root.rglob("*") if path.is_dir())]:
        folder.chmod(0o555)
    return root


def started(root: Path, temporary: Path, *types: str) -> subprocess.Popen[str]:
    """Start the probe where neither the package nor a home can be written; root minds rights only without powers."""
    powerless = ["setpriv", "--bounding-set", "-dac_override", "--inh-caps", "-all"] if os.getuid() == 0 else []
    if powerless and shutil.which("setpriv") is None:
        pytest.skip("root writes everywhere, and setpriv, which takes that power away, is not installed")
    kept = {name: value for name, value in os.environ.items() if name not in {"NUMBA_CACHE_DIR", "XDG_CACHE_HOME"}}
    places = {"HOME": "/proc/nobody", "TMPDIR": str(temporary), "PYTHONPATH": str(root)}
    command = [*powerless, sys.executable, "-P", "-c", PROBE, *types]
    return subprocess.Popen(
        command, cwd=root, env=kept | places, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def test_two_first_runs_share_a_folder_of_their_own_where_package_and_home_cannot_be_written(
    locked: Path, tmp_path: Path
) -> None:
    both = [started(locked, tmp_path, "int64", "int32") for _ in range(2)]
    record = [run.communicate(timeout=120) for run in both]
    assert [stdout for stdout, _ in record] == ["3 3 True\n"] * 2, record
    folder = tmp_path / f"geoprint-{os.getuid()}"
    assert any(f"note: compiled loops are cached in {folder}, because" in stderr for _, stderr in record)
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700

    assert started(locked, tmp_path, "int64").communicate(timeout=120) == ("3 True\n", "")


def test_a_folder_that_others_may_write_is_not_trusted(locked: Path, tmp_path: Path) -> None:
    (tmp_path / f"geoprint-{os.getuid()}").mkdir()
    (tmp_path / f"geoprint-{os.getuid()}").chmod(0o777)
    stdout, stderr = started(locked, tmp_path, "int64").communicate(timeout=120)
    assert stdout == "3 False\n"
    assert "note: compiled loops cannot be cached, so each run compiles them" in stderr
    assert len(stderr.splitlines()) == 1


# A loop for other loops has no entry for Python: without a stand-in Python would jump to nowhere, and take the tests
# with it.
CALLED = """
from geoprint.geometry.halfedges import next_half
print(next_half(2), next_half(3), next_half.signatures)
"""


def test_python_runs_a_loop_that_is_for_other_loops_as_it_stands() -> None:
    run = subprocess.run([sys.executable, "-c", CALLED], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stdout) == (0, "0 4 []\n"), run.stderr


# Parts into three processes that compile one kernel; each says how often it found it kept and how often it did not.
COUNTING = """
import os
from counted_kernel import work
for _ in range(3):
    child = os.fork()
    if child == 0:
        work(3.0)
        found = f"{sum(work.stats.cache_hits.values())} {sum(work.stats.cache_misses.values())}\\n"
        os.write(1, found.encode())
        os._exit(0)
for _ in range(3):
    os.wait()
"""
COUNTED_KERNEL = """
from geoprint.kernels import njit

@njit
def work(x):
    total = 0.0
    for turn in range(9):
        total += x * turn
    return total
"""


def test_of_processes_that_come_to_a_kernel_together_one_compiles_it(tmp_path: Path) -> None:
    (tmp_path / "counted_kernel.py").write_text(COUNTED_KERNEL)
    kept = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    paths = os.pathsep.join([str(Path(geoprint.__file__).parents[1]), str(tmp_path)])
    run = subprocess.run(
        [sys.executable, "-P", "-c", COUNTING],
        env=kept | {"PYTHONPATH": paths}, capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert sorted(run.stdout.splitlines()) == ["0 1", "1 0", "1 0"], run.stderr


def test_where_the_file_system_knows_no_locks_nobody_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    fcntl = pytest.importorskip("fcntl")

    def no_locks(*_: object) -> None:
        raise OSError(errno.ENOLCK, "no locks available")

    def waiting(_: float) -> None:
        pytest.fail("it waits")

    monkeypatch.setattr(fcntl, "lockf", no_locks)
    monkeypatch.setattr(time, "sleep", waiting)
    assert taken("a loop") is None


# Compares backends on a part, and names each loop that was called with more than one kind of arrays.
ONCE = """
import gc
import sys
from numba.core.registry import CPUDispatcher
from geoprint.config import job_of
from geoprint.workflow import compare
compare(job_of(surface=sys.argv[1], unit="mm", spacing=6.0, place="demo"))
loops = [each for each in gc.get_objects() if isinstance(each, CPUDispatcher) and each.signatures]
ours = [each for each in loops if each.py_func.__module__.startswith("geoprint.")]
print(len(ours) > 20, *[f"{each.py_func.__qualname__}: {each.signatures}" for each in ours if len(each.signatures) > 1])
"""


def test_a_comparison_calls_each_loop_with_one_kind_of_arrays() -> None:
    # numba compiles a loop anew for int32 beside int64, read-only beside writable and columns beside rows.
    part = Path(geoprint.__file__).parents[1] / "data" / "plate.ply"
    run = subprocess.run([sys.executable, "-c", ONCE, str(part)], capture_output=True, text=True, check=True)
    assert run.stdout.split(maxsplit=1) == ["True"], run.stdout
