"""Stages: named as they start, timed as they end, and what they freed is the system's again."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from geoprint.workflow import stages
from geoprint.workflow.stages import Stages


def test_stages_are_named_as_they_start_and_timed_as_they_end() -> None:
    seen: list[str] = []
    named = Stages(seen.append)
    with named("distance"):
        assert seen == ["distance"]
        assert named.timings == []
    with named("distance"):
        pass
    assert [name for name, _ in named.timings] == ["distance", "distance"]
    assert named.begun("distance") == 2
    assert named.begun("motion") == 0


# What other tests have left in the heap of their process decides how much of it can be given back.
FREED = """
import runpy
import sys
from pathlib import Path

import numpy as np


def resident() -> float:
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024.0


stages = runpy.run_path(sys.argv[1])["Stages"](lambda _: None)
taken, kept = [], []
with stages("taken"):
    for _ in range(1_500):
        # Both lie in glibc's heap, the small one above the large one.
        taken.append(np.ones(12_000))
        kept.append(np.ones(100))
    taken.clear()
    within = resident()
print(within - resident(), len(kept))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read as Linux tells it")
def test_what_a_stage_freed_is_the_system_s_again() -> None:
    command = [sys.executable, "-c", FREED, str(Path(stages.__file__))]
    freed, kept = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    # 1500 times 96 kB [MB].
    assert float(freed) > 50.0
    assert int(kept) == 1_500
