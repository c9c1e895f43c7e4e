"""The core stands alone: with everything optional hidden it plans and compares a part, robot and report included."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest

from benchmarks.code_base import ROOT, CodeBase
from geoprint.cli.application import run
from tests.architecture.whole_code_base import whole_code_base
from tests.shared_plans import SharedPlans

CODE_BASE = CodeBase()
# What the extras `cad`, `medical`, `photo` and `scan` install.
EXTRAS = ("cascadio", "nibabel", "nrrd", "pydicom", "skimage", "cv2", "open3d", "pyfqmr")
# Refuses to import the modules that its first argument lists, then runs the commands that the others have, and prints
# how each ended and what it said. Nothing works beside it, where nothing would be hidden.
ALONE = """
import contextlib, io, json, sys

hidden, *commands = map(json.loads, sys.argv[1:])

class Hiding:
    def find_spec(self, name, path=None, target=None):
        if any(name == one or name.startswith(f"{one}.") for one in hidden):
            raise ImportError(f"{name} is hidden")

sys.meta_path.insert(0, Hiding())
from geoprint.cli import main, planning

planning.PROCESSES = 1
ends = []
for command in commands:
    sys.argv[1:] = command
    with contextlib.redirect_stderr(io.StringIO()) as said:
        try:
            main()
        except SystemExit as end:
            ends.append([end.code, said.getvalue()])
print(json.dumps(ends))
"""


@dataclass(frozen=True)
class Alone:
    """What was written with everything optional hidden.

    Attributes:
        folder: of what was written.
        ends: status and words of each command, by its name.
    """

    folder: Path
    ends: Mapping[str, tuple[int, str]]


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Alone:
    """Compare, plan and inspect in one process in which everything optional is hidden."""
    folder = tmp_path_factory.mktemp("alone")
    cloud = folder / "cloud.xyz"
    cloud.write_text("0 0 0\n" * 300, encoding="ascii")
    disc = ["--at", "0", "0", "0", "--radius", "5", "--spacing", "3"]
    part = ["data/plate.ply", "--unit", "mm", *disc, "--place", "demo", "--out"]
    commands = {
        "compare": ["compare", *part, str(folder / "compared")],
        "plan": ["plan", *part, str(folder / "plan"), "--backend", "fast-marching"],
        "inspect": ["inspect", str(cloud), "--unit", "mm"],
        "layers": ["plan", *part, str(folder / "layers"), "--thickness", "1"],
        "check": ["check", str(folder / "compared")],
    }
    given = map(json.dumps, ([*CODE_BASE.optional, *EXTRAS], *commands.values()))
    done = subprocess.run(
        [sys.executable, "-c", ALONE, *given], cwd=ROOT, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr
    ends: list[tuple[int, str]] = [(status, said) for status, said in json.loads(done.stdout.splitlines()[-1])]
    return Alone(folder, dict(zip(commands, ends, strict=True)))


def test_it_compares_and_writes_checked_programs_with_everything_optional_hidden(alone: Alone) -> None:
    for command in ("compare", "plan"):
        status, said = alone.ends[command]
        assert status == 0, said
    assert (alone.folder / "compared" / "report.html").is_file()
    assert len(list((alone.folder / "compared").glob("*/rapid/*.mod"))) >= 2
    assert list((alone.folder / "plan" / "rapid").glob("*.mod"))


def test_what_is_hidden_is_really_hidden_and_asked_for_by_name(alone: Alone) -> None:
    status, said = alone.ends["inspect"]
    assert status != 0
    assert "point_clouds is hidden" in said


def test_single_skins_are_checked_and_layers_refused_without_their_feature(alone: Alone) -> None:
    assert alone.ends["check"] == (0, "")
    status, said = alone.ends["layers"]
    assert status == 2
    assert "the division 'layers'" in said
    assert "geoprint.layers is hidden" in said
    assert not (alone.folder / "layers").exists()


def test_every_hidden_module_is_there(shared_plans: SharedPlans) -> None:
    modules = whole_code_base(shared_plans).modules
    assert [name for name in CODE_BASE.optional if name not in modules] == []


def test_what_the_core_needs_is_followed_to_where_it_is_made(shared_plans: SharedPlans) -> None:
    needed = whole_code_base(shared_plans).core()
    assert {"geoprint.distance.fast_marching", "geoprint.postprocessor.rapid.program"} < set(needed)
    assert not set(CODE_BASE.optional) & set(needed)


def test_without_second_libraries_the_same_program_is_written_and_said_not_to_be_confirmed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    said = dict[str, str]()
    for found in ("both", "neither"):
        if found == "neither":
            for library in ("toppra", "pinocchio"):
                monkeypatch.setitem(sys.modules, library, None)
        plan = "plan data/plate.ply --unit mm --at 0 0 0 --radius 5 --spacing 3 --place demo --verbose --out"
        assert run([*plan.split(), str(tmp_path / found)]) == 0
        said[found] = capsys.readouterr().err
    for file in ("rapid/GeoPrint.mod", "rapid/GeoCell.mod", "trajectory.csv", "targets.csv"):
        assert (tmp_path / "neither" / file).read_bytes() == (tmp_path / "both" / file).read_bytes()
    for word in ("the speeds, by a second library: toppra", "the kinematics, by a second library: pin"):
        assert f"not checked: {word} is not installed" in said["neither"]
        assert word not in said["both"]
    # Whoever checks it may have what was not there when it was planned.
    monkeypatch.undo()
    monkeypatch.chdir(ROOT)
    assert run(["check", str(tmp_path / "neither")]) == 0
