"""Stages: named as they start, timed as they end, and what they freed is the system's again."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from geoprint.model import FloatArray
from geoprint.pipeline.stages import Stages


def test_stages_are_named_as_they_start_and_timed_as_they_end() -> None:
    seen: list[str] = []
    stages = Stages(seen.append)
    with stages("distance"):
        assert seen == ["distance"]
        assert stages.timings == []
    with stages("distance"):
        pass
    assert [name for name, _ in stages.timings] == ["distance", "distance"]
    assert stages.begun("distance") == 2
    assert stages.begun("motion") == 0


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read as Linux tells it")
def test_what_a_stage_freed_is_the_system_s_again() -> None:
    stages = Stages(lambda _: None)
    with stages("taken"):
        taken: list[FloatArray] = []
        kept: list[FloatArray] = []
        for _ in range(1_500):
            # Both lie in glibc's heap, the small one above the large one.
            taken.append(np.ones(12_000))
            kept.append(np.ones(100))
        taken.clear()
        within = _resident()
    assert within - _resident() > 50.0
    assert len(kept) == 1_500


def _resident() -> float:
    """Return what this process holds of the machine's memory [MB]."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024.0
