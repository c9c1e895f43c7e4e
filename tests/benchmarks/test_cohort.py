"""A cohort for an hour: what is said of samples of its memory, and that its study is what `geoprint sweep` reads."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.parts.hearts import write_hearts
from benchmarks.whole.cohort import SPACING, STUDY, Sample, held_by, said
from geoprint.sweep.study import read_study


def test_parts_an_hour_failures_and_memory_at_three_times_are_said() -> None:
    # 1000 parts in 50 minutes; memory rises from 300 to 400 MB at the half, but for one peak.
    minutes = range(1, 51)
    samples = [
        Sample(60.0 * minute, 20 * minute, 2, 2, 900.0 if minute == 5 else 300.0 if minute < 25 else 400.0)
        for minute in minutes
    ]
    assert said(samples) == (
        "1000 parts in 50 minutes, 1200 an hour, 2 not planned; 300 MB at 10 %, 400 MB at 50 %, 400 MB at 100 %"
    )


def test_a_heart_of_the_cohort_is_a_cell_of_the_study(tmp_path: Path) -> None:
    write_hearts(tmp_path / "hearts", count=2)
    (tmp_path / "study.toml").write_text(STUDY.format(spacing=SPACING), encoding="utf-8")
    cells = read_study(tmp_path / "study.toml").cells
    assert [cell.name for cell in cells] == ["heart-0000_apex_heat", "heart-0001_apex_heat"]
    assert not any(cell.job.robot for cell in cells)


def test_what_a_process_holds_counts_what_it_has_written() -> None:
    # Processes of their own: what this one has freed before, it would take again.
    def held(size: int) -> float:
        code = f"import os; kept = os.urandom({size}); print(len(kept), flush=True); input()"
        with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
            assert child.stdin is not None
            assert child.stdout is not None
            assert int(child.stdout.readline()) == size
            found = sum(held_by(child.pid))
            child.stdin.write(b"\n")
        return found

    assert held(30_000_000) - held(0) == pytest.approx(30_000_000 / 2.0**20, abs=3.0)
