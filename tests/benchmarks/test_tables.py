"""The benchmark of tables: it can tell a table that falls short, and it draws its picture."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.motion import tables
from benchmarks.motion.tables import every_up_within, reached, residual
from tests.positioner.tables import hexapod, tilt_turn


def test_what_a_hexapod_reaches_ends_where_its_legs_do() -> None:
    short = hexapod(leg_mm=[190.0, 222.8])
    assert -10.0 < reached(short, "z")[0] < -9.0
    assert reached(short, "z")[1] == pytest.approx(reached(hexapod(), "z")[1])


def test_every_direction_within_the_tilt_is_brought_up() -> None:
    assert np.degrees(every_up_within(tilt_turn(tilt_deg=[-40.0, 40.0]))) == pytest.approx(40.0, abs=0.26)


@pytest.mark.parametrize("table", [hexapod(), tilt_turn()], ids=["hexapod", "tilt-turn"])
def test_forward_of_inverse_is_the_pose(table: tables.TiltingTable) -> None:
    assert residual(table, count=300) < 1e-9


def test_the_run_prints_both_tables_and_draws_the_workspace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "workspace.png"
    monkeypatch.setattr(sys, "argv", ["tables", "--smoke", "--picture", str(picture)])
    tables.main()
    printed = capsys.readouterr().out
    assert re.search(r"\| z +\| -25 to 25 mm +\| -2\d\.\d\d to 2\d\.\d\d mm", printed)
    assert {"hexapod", "tilt-turn"} <= {line.split("|")[1].strip() for line in printed.splitlines() if "|" in line}
    assert picture.read_bytes().startswith(b"\x89PNG")
