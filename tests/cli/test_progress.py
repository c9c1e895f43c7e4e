"""How far a command is: the share and the time left follow from the stages, and stderr alone shows them."""

from __future__ import annotations

import io
import sys
import time
from pathlib import Path

import pytest

from geoprint import cli
from geoprint.cli.bounds import WEIGHTS, Progress, planning_stages, watch
from geoprint.config import Job
from geoprint.config.cells import packaged_cell_text

DATA = Path(__file__).parents[2] / "data"


class Clock:
    """A clock that is set by hand [s]."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def test_the_share_is_that_of_the_stages_and_the_rest_takes_as_long_as_their_pace_says() -> None:
    clock = Clock()
    progress = Progress(["reach", "reach", "timing", "timing"], now=clock)
    assert (progress.share, progress.left) == (0.0, None)
    progress.begin("lscm: reach")
    # At three times the usual time a stage.
    clock.now += 3.0 * WEIGHTS["reach"]
    progress.begin("lscm: timing")
    share = WEIGHTS["reach"] / (2.0 * WEIGHTS["reach"] + 2.0 * WEIGHTS["timing"])
    assert progress.share == pytest.approx(share)
    assert progress.left == pytest.approx(clock.now * (1.0 - share) / share)
    clock.now += 1.5 * WEIGHTS["timing"]
    assert progress.share == pytest.approx(share + 0.5 * WEIGHTS["timing"] / (WEIGHTS["reach"] / share))


def test_a_stage_that_is_not_expected_or_comes_too_often_adds_nothing_and_one_that_takes_long_is_not_done() -> None:
    clock = Clock()
    progress = Progress(["reach", "timing"], now=clock)
    progress.begin("reach")
    clock.now += 4.0
    for name in ("trying another needle: reach", "exhaustive search"):
        progress.begin(name)
        before = progress.share
        clock.now += 100.0
        assert progress.share == before
    progress.begin("timing")
    clock.now += 1e4
    assert progress.share is not None
    assert progress.share < 1.0


@pytest.mark.parametrize(
    ("stage", "share"),
    [("checking heat, 2 of 4", 0.25), ("12 layers, 3 done", 0.25), ("attitude 1 of 5", 0.0), ("inspecting", None)],
)
def test_stages_that_count_themselves_have_a_share_and_others_alone_none(stage: str, share: float | None) -> None:
    progress = Progress()
    progress.begin(stage)
    assert progress.share == share
    assert progress.line().startswith(stage)


def test_every_stage_that_planning_names_has_a_weight() -> None:
    jobs = [Job(surface=Path("a.ply"), place="best"), Job(surface=Path("a.ply"), robot=False)]
    stages = planning_stages(jobs, backends=2)
    assert set(stages) <= {*WEIGHTS}
    assert (stages.count("evenness"), stages.count("reach"), stages.count("writing")) == (10, 3, 1)


@pytest.mark.parametrize(
    "command",
    [
        ["inspect", "part.ply", "--unit", "mm"],
        ["patch", "part.ply", "--unit", "mm", "--at", "0", "0", "0", "--radius", "6", "--out", "cut.ply"],
        ["remesh", "part.ply", "--unit", "mm", "--smooth", "2", "--edge-length", "2", "--out", "new.ply"],
        ["recommend", "part.ply", "--unit", "mm", "--cell", "cell.toml", "--pressure", "30", "--rounds", "5"],
    ],
    ids=lambda command: command[0],
)
def test_commands_about_files_show_a_share_at_every_stage_and_expect_what_comes(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.ply").write_bytes((DATA / "plate.ply").read_bytes())
    cell = packaged_cell_text("irb120-bent45")
    material = "\n[material]\ndensity_g_cm3 = 1.1\nconsistency_pa_sn = 20\nflow_index = 0.6\nyield_stress_pa = 0\n"
    (tmp_path / "cell.toml").write_text(cell + material)
    shown: list[tuple[str, float | None]] = []
    begin = Progress.begin

    def beginning(self: Progress, stage: str) -> None:
        begin(self, stage)
        shown.append((stage, self.share))

    monkeypatch.setattr(Progress, "begin", beginning)
    monkeypatch.setattr("sys.argv", ["geoprint", *command])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert not ended.value.code
    shares = [share for _, share in shown]
    assert None not in shares
    assert shares[0] == pytest.approx(0.0, abs=0.01)
    assert shares == sorted(shares, key=lambda share: share or 0.0)
    assert 0.2 < (shares[-1] or 0.0) < 1.0


def test_elsewhere_than_on_a_terminal_a_stage_is_a_line_once_some_time_has_passed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    heard = io.StringIO()
    monkeypatch.setattr(sys, "stderr", heard)
    with watch("reading", expected=["reading", "reach"]) as observe:
        observe("reach")
    assert heard.getvalue() == ""
    monkeypatch.setattr("geoprint.cli.bounds.PATIENCE", 0.02)
    with watch("reading", expected=["reading", "reach"]) as observe:
        time.sleep(0.2)
        observe("reach")
    lines = heard.getvalue().splitlines()
    assert [line.split()[0] for line in lines] == ["reading", "reach"]
    assert "%" in lines[1]
