"""The core stands alone: with everything optional hidden it plans and compares a part, robot and report included."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from benchmarks.parts.house_tree import ROOT, House

HOUSE = House()
# What the extras `cad`, `medical`, `photo` and `scan` install.
EXTRAS = ("cascadio", "nibabel", "nrrd", "pydicom", "skimage", "cv2", "open3d", "pyfqmr")
# Refuses to import the modules that its first argument lists, then runs the command line with the rest.
ALONE = """
import json, sys

hidden = json.loads(sys.argv.pop(1))

class Hiding:
    def find_spec(self, name, path=None, target=None):
        if any(name == one or name.startswith(f"{one}.") for one in hidden):
            raise ImportError(f"{name} is hidden")

sys.meta_path.insert(0, Hiding())
from geoprint.cli import main
main()
"""

# Plans where what the first argument names, a comma between two, cannot be imported.
WITHOUT = """
import sys
sys.modules |= dict.fromkeys(sys.argv.pop(1).split(","))
from geoprint.cli import main
main()
"""


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    hidden = json.dumps([*HOUSE.optional, *EXTRAS])
    command = [sys.executable, "-c", ALONE, hidden, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=300)


def test_it_compares_and_writes_checked_programs_with_everything_optional_hidden(tmp_path: Path) -> None:
    part = ["data/plate.ply", "--unit", "mm", "--spacing", "6", "--place", "demo"]

    done = run("compare", *part, "--out", str(tmp_path / "compared"))

    assert done.returncode == 0, done.stderr
    assert (tmp_path / "compared" / "report.html").is_file()
    assert len(list((tmp_path / "compared").glob("*/rapid/*.mod"))) >= 2

    done = run("plan", *part, "--backend", "fast-marching", "--out", str(tmp_path / "plan"))

    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "plan" / "rapid").glob("*.mod"))


def test_what_is_hidden_is_really_hidden_and_asked_for_by_name(tmp_path: Path) -> None:
    cloud = tmp_path / "cloud.xyz"
    cloud.write_text("0 0 0\n" * 300, encoding="ascii")

    done = run("inspect", str(cloud), "--unit", "mm")

    assert done.returncode != 0
    assert "point_clouds is hidden" in done.stderr


def test_every_hidden_module_is_there() -> None:
    assert [name for name in HOUSE.optional if name not in HOUSE.modules] == []


def test_what_the_core_needs_is_followed_to_where_it_is_made() -> None:
    needed = HOUSE.needed("geoprint.pipeline.plan", "geoprint.pipeline.compare", "geoprint.pipeline.save_comparisons")
    assert {"geoprint.backends.marching.backend", "geoprint.export.rapid.program"} < set(needed)
    assert not set(HOUSE.optional) & set(needed)


def test_without_second_libraries_the_same_program_is_written_and_said_not_to_be_confirmed(tmp_path: Path) -> None:
    said = dict[str, str]()
    for missing in ("toppra,pinocchio", "no_such_package"):
        arguments = ["plan", "data/plate.ply", "--unit", "mm", "--spacing", "12", "--place", "demo", "--verbose"]
        command = [sys.executable, "-c", WITHOUT, missing, *arguments, "--out", str(tmp_path / missing)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=300)
        assert done.returncode == 0, done.stderr
        said[missing] = done.stdout + done.stderr
    without, usual = (tmp_path / missing for missing in said)
    for file in ("rapid/GeoPrint.mod", "rapid/GeoCell.mod", "trajectory.csv", "targets.csv"):
        assert (without / file).read_bytes() == (usual / file).read_bytes()
    for word in ("the speeds, by a second library (toppra", "the kinematics, by a second library (pin"):
        assert f"not checked: {word} is not installed)" in said["toppra,pinocchio"]
        assert word not in said["no_such_package"]
