"""Compiles most kernels in two processes, before the workers of a fresh clone come to them test by test.

numba keeps what it compiled, so that it is done once; what is left out is compiled by the test that needs it first.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PATCH = (
    "data/heart_apex_patch.ply", "--unit", "mm", "--at", "8", "0", "-60", "--radius", "8", "--spacing", "3",
    "--no-robot",
)  # fmt: skip
# What a robot needs is compiled by one process, what these commands need by the other.
ROBOT = """
import sys
from pathlib import Path
from geoprint.workflow.precompile import compile_later_stages
compile_later_stages(Path(sys.argv[1]))
"""
COMMANDS = (
    ("compare", *PATCH, "--backend", "all", "--out", "compared"),
    ("plan", *PATCH, "--pattern", "fibres", "--field", "tests/golden/helix.toml", "--out", "fibres"),
    ("remesh", "data/plate.ply", "--unit", "mm", "--edge-length", "3", "--out", "plate.ply"),
)


def is_compiled() -> bool:
    """Return whether an earlier run has kept what it compiled."""
    folders = [ROOT / "geoprint", *(Path(each) for each in (os.environ.get("NUMBA_CACHE_DIR"),) if each)]
    return any(next(folder.rglob("*.nbi"), None) is not None for folder in folders)


def precompile() -> None:
    """Compile; what fails here leaves the rest to the tests, which say why."""
    with tempfile.TemporaryDirectory() as folder:
        robot = _started("-c", ROBOT, folder)
        for *command, result in COMMANDS:
            _started("-m", "geoprint", *command, f"{folder}/{result}").wait()
        robot.wait()


def _started(*arguments: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, *arguments], cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
