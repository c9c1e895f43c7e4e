"""The processes that plan layers hold no more than they need."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

from geoprint.pipeline.processes.layer_by_layer import layer_processes

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
        [sys.executable, "-c", f"{HELD}\n{code}\nprint(kept())"], capture_output=True, text=True, check=True
    )
    return float(found.stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="what is free is given back as glibc is told to")
def test_large_arrays_go_back_as_soon_as_they_are_free() -> None:
    told = "from geoprint.pipeline.processes.layer_by_layer import give_back_memory\ngive_back_memory()"
    assert _given_back(told) > 0.9 * MB * (COUNT - 1)
    # Without that it would keep them, and this test would tell nothing.
    assert _given_back("") < 0.5 * MB * (COUNT - 1)


@pytest.mark.dear
def test_no_layer_is_planned_in_the_process_of_another() -> None:
    with layer_processes() as pool:
        assert len({pool.submit(_process).result() for _ in range(3)}) == 3


def _process() -> int:
    """Return the number of this process."""
    import os

    return os.getpid()
