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
from geoprint.kernel_cache import taken

# Compiles a small kernel for two types, and says what they answer and whether anything is kept.
PROBE = """
import numpy as np
from geoprint.kernels import is_kept
from geoprint.surfaces.halfedges import counted
keys = np.array([1, 0])
for kind in (np.int64, np.int32):
    print(*counted(keys.astype(kind), np.arange(2), 2), end=" ")
print(is_kept(counted))
"""


@pytest.fixture(scope="module")
def locked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package in which nothing can be written."""
    root = tmp_path_factory.mktemp("installed")
    package = Path(geoprint.__file__).parent
    shutil.copytree(package, root / "geoprint", ignore=shutil.ignore_patterns("__pycache__"))
    for folder in [root, *(path for path in root.rglob("*") if path.is_dir())]:
        folder.chmod(0o555)
    return root


def started(root: Path, temporary: Path) -> subprocess.Popen[str]:
    """Start the probe where neither the package nor a home can be written; root minds rights only without powers."""
    powerless = ["setpriv", "--bounding-set", "-dac_override", "--inh-caps", "-all"] if os.getuid() == 0 else []
    if powerless and shutil.which("setpriv") is None:
        pytest.skip("root writes everywhere, and setpriv, which takes that power away, is not installed")
    kept = {name: value for name, value in os.environ.items() if name not in {"NUMBA_CACHE_DIR", "XDG_CACHE_HOME"}}
    places = {"HOME": "/proc/nobody", "TMPDIR": str(temporary), "PYTHONPATH": str(root)}
    command = [*powerless, sys.executable, "-P", "-c", PROBE]
    return subprocess.Popen(
        command, cwd=root, env=kept | places, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def test_two_first_runs_share_a_folder_of_their_own_where_package_and_home_cannot_be_written(
    locked: Path, tmp_path: Path
) -> None:
    both = [started(locked, tmp_path) for _ in range(2)]
    told = [run.communicate(timeout=120) for run in both]
    assert [stdout for stdout, _ in told] == ["1 0 1 0 True\n"] * 2, told
    folder = tmp_path / f"geoprint-{os.getuid()}"
    assert any(f"note: compiled loops are kept in {folder}, because" in stderr for _, stderr in told)
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700

    assert started(locked, tmp_path).communicate(timeout=120) == ("1 0 1 0 True\n", "")


def test_a_folder_that_others_may_write_is_not_trusted(locked: Path, tmp_path: Path) -> None:
    (tmp_path / f"geoprint-{os.getuid()}").mkdir()
    (tmp_path / f"geoprint-{os.getuid()}").chmod(0o777)
    stdout, stderr = started(locked, tmp_path).communicate(timeout=120)
    assert stdout == "1 0 1 0 False\n"
    assert "note: compiled loops cannot be kept, so that each run compiles them anew" in stderr
    assert len(stderr.splitlines()) == 1


# A loop for other loops has no door: without a stand-in Python would jump to nowhere, and take the tests with it.
CALLED = """
from geoprint.surfaces.halfedges import next_half
print(next_half(2), next_half(3), next_half.signatures)
"""


def test_python_runs_a_loop_that_is_for_other_loops_as_it_stands() -> None:
    run = subprocess.run([sys.executable, "-c", CALLED], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stdout) == (0, "0 4 []\n"), run.stderr


# Compiles one kernel when it is told to, and says how often it found it kept and how often it did not.
COUNTING = """
import sys
import time
from counted_kernel import work
print("ready", flush=True)
sys.stdin.readline()
work(3.0)
print(sum(work.stats.cache_hits.values()), sum(work.stats.cache_misses.values()))
"""
COUNTED_KERNEL = """
import numpy as np
from geoprint.kernels import njit

@njit
def work(x):
    return np.sort(np.full(9, x)).sum()
"""


def test_of_processes_that_come_to_a_kernel_together_one_compiles_it(tmp_path: Path) -> None:
    (tmp_path / "counted_kernel.py").write_text(COUNTED_KERNEL)
    kept = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    paths = os.pathsep.join([str(Path(geoprint.__file__).parents[1]), str(tmp_path)])
    runs = [
        subprocess.Popen(
            [sys.executable, "-P", "-c", COUNTING], env=kept | {"PYTHONPATH": paths}, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )
        for _ in range(3)
    ]  # fmt: skip
    for run in runs:
        assert run.stdout is not None
        assert run.stdout.readline() == "ready\n"
    told = [run.communicate("\n", timeout=120)[0] for run in runs]
    assert sorted(told) == ["0 1\n", "1 0\n", "1 0\n"]


def test_where_the_file_system_knows_no_locks_nobody_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    fcntl = pytest.importorskip("fcntl")

    def no_locks(*_: object) -> None:
        raise OSError(errno.ENOLCK, "no locks available")

    def waiting(_: float) -> None:
        pytest.fail("it waits")

    monkeypatch.setattr(fcntl, "lockf", no_locks)
    monkeypatch.setattr(time, "sleep", waiting)
    assert taken("a loop") is None
