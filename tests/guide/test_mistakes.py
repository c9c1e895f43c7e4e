"""Ten common mistakes end in a sentence that names the next step, as the page on refusals lists them."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Callable
from pathlib import Path

import nibabel
import numpy as np
import pytest

from geoprint import cli
from geoprint.config import packaged_cell_text
from geoprint.guide import page_named
from tests.brief_proofs import FEW

ROOT = Path(__file__).parents[2]
PLATE = "data/plate.ply --unit mm"
SMALL = f"{PLATE} --at 0 0 0 --radius 4 --spacing 3"
TWO_SOURCES = """\
surface = "data/heart.ply"
unit = "mm"
spacing = 2.0
source = { point = [1.5, 0.0, -57.5] }
robot = false

[[patches]]
at = [1.5, 0.0, -57.5]
radius = 6.0

[[patches]]
at = [9.0, -10.0, -54.0]
radius = 4.0
"""


def far_cell(folder: Path) -> None:
    # It says how the part is turned, so that it stays there.
    text = packaged_cell_text("irb120-bent45").replace("# demo_rpy_deg", "demo_rpy_deg")
    (folder / "far.toml").write_text(re.sub(r"(?m)^demo_position_mm = .*", "demo_position_mm = [900, 0, 50]", text))


def cell_without_stand_off(folder: Path) -> None:
    text = packaged_cell_text("irb120-bent45")
    (folder / "lacking.toml").write_text(re.sub(r"(?m)^standoff_mm = .*\n", "", text))


def cell_without_part(folder: Path) -> None:
    known = "model_mm = [[-50, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]]\n"
    known += "touched_mm = [[250, 50, 0], [350, 50, 0], [350, -50, 0], [250, -50, 0]]\nnoise_mm = 0.05"
    text = packaged_cell_text("irb120-bent45").replace('\nsource = "demo"', f'\nsource = "calibrated"\n{known}')
    (folder / "touched.toml").write_text(text)


def labels(folder: Path) -> None:
    volume = np.zeros((12, 12, 12), dtype=np.uint8)
    volume[3:9, 3:9, 3:9] = 2
    (folder / "labels.nii").write_bytes(nibabel.Nifti1Image(volume, np.diag([2.0, 2.0, 2.0, 1.0])).to_bytes())


def two_sources(folder: Path) -> None:
    (folder / "two.toml").write_text(TWO_SOURCES)


def older_bundle(folder: Path) -> None:
    run(f"plan {SMALL} --place demo --out old")
    plan = folder / "old" / "plan.json"
    plan.write_text(re.sub(r"\"schema\": \d+", '"schema": 1', plan.read_text()))


def nothing(_folder: Path) -> None: ...


# The proof and the change that was tried come through the whole chain.
OUT_OF_REACH = (
    r"`geoprint place`.*no nozzle direction within 15 degrees of the normal, turn or branch .* reaches run 1 .*"
    r"`--cell irb120-straight160\.toml` prints it \(tried: the whole program is checked\)"
)
# What is typed, what it needs before, and what the sentence has to say of the next step.
MISTAKES: dict[str, tuple[Callable[[Path], None], str, str]] = {
    "wrong unit": (nothing, "plan data/plate.ply --unit m --spacing 1 --no-robot --out out", r"`--unit mm`"),
    "without a rim": (nothing, "plan data/heart.ply --unit mm --spacing 5 --no-robot --out out", r"--from point:X,Y,Z"),
    "spacing too large": (nothing, f"plan {PLATE} --spacing 50 --no-robot --out out", r"choose a spacing below 30 mm"),
    "out of reach": (far_cell, f"plan {SMALL} --cell far.toml --place demo --out out", OUT_OF_REACH),
    "`part_mm`": (cell_without_part, f"plan {SMALL} --cell touched.toml --out out", r"part_mm"),
    "wrong label": (labels, "inspect labels.nii --label 7", r"holds 2 .*`--label N`"),
    "key is missing": (
        cell_without_stand_off,
        f"plan {SMALL} --cell lacking.toml --place demo --out out",
        r"standoff_mm.*`geoprint init`",
    ),
    "two sources": (two_sources, "plan two.toml --out out", r"give each patch its own"),
    "older version": (older_bundle, "check old", r"`geoprint plan`"),
    "extra is not installed": (labels, "inspect labels.nii --label 2", r"pip install .*\[medical\]'"),
}


def run(line: str) -> int:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("sys.argv", ["geoprint", *shlex.split(line)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
    return int(ended.value.code or 0)


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_ends_in_a_sentence_that_names_the_next_step(
    mistake: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    prepare, line, next_step = MISTAKES[mistake]
    (tmp_path / "data").symlink_to(ROOT / "data")
    monkeypatch.chdir(tmp_path)
    prepare(tmp_path)
    if mistake == "extra is not installed":
        monkeypatch.setitem(sys.modules, "nibabel", None)
    if mistake == "out of reach":
        # Fewer poses than a real part needs; they are searched as finely as ever, and every change is tried.
        for name, count in FEW.items():
            monkeypatch.setattr(f"geoprint.robot.reach.exhaustion.{name}", count)
    capsys.readouterr()

    status = run(line)

    said = capsys.readouterr().err
    # A cell that lacks part_mm alone is no mistake yet: its program runs dry, and says so.
    assert status == 0 if mistake == "`part_mm`" else status in (2, 3, 4, 5)
    assert re.search(next_step, said, flags=re.DOTALL), said
    assert "defect of geoprint" not in said
    assert (tmp_path / "out").exists() == (status == 0)


def test_an_option_that_holds_once_is_refused_where_it_is_given_twice(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"plan {PLATE} --from point:0,0,0 --spacing 5 --from point:5,0,0 --no-robot --out out") == 2
    assert "`--from` is given 2 times" in capsys.readouterr().err
    assert run("plan missing.ply --set options.lscm.resolution=500 --set options.heat.time_factor=1 --out out") != 0
    assert "times" not in capsys.readouterr().err


def test_the_page_on_refusals_lists_all_of_them() -> None:
    mistakes, _, _ = page_named("troubleshooting").text.partition("When the arm or the nozzle cannot print")
    rows = [line for line in mistakes.splitlines() if line.startswith("| ")][1:]
    assert len(rows) == len(MISTAKES)
    for mistake, row in zip(MISTAKES, rows, strict=True):
        assert mistake in row
