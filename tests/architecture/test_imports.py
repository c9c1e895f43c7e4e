"""Imports run one way, also where import-linter's contracts list no order."""

from __future__ import annotations

import re
import shutil
import tomllib
from pathlib import Path

import pytest

from benchmarks.code_base import CONTRIBUTING, ROOT, CodeBase
from tests.architecture.whole_code_base import whole_code_base
from tests.shared_plans import SharedPlans


def test_nothing_imports_upwards(shared_plans: SharedPlans) -> None:
    assert list(whole_code_base(shared_plans).upwards()) == []


def test_every_module_is_on_a_layer_or_in_a_feature(shared_plans: SharedPlans) -> None:
    code_base = whole_code_base(shared_plans)
    assert list(code_base.unlisted()) == []
    assert {"geoprint.fibers", "geoprint.inspection", "geoprint.layers"} < set(code_base.features)


def test_contributing_shows_the_imports_and_lists_every_package(shared_plans: SharedPlans) -> None:
    code_base = whole_code_base(shared_plans)
    text = (ROOT / CONTRIBUTING).read_text(encoding="utf-8")
    drawn = [*code_base.picture()]
    assert text.partition("```mermaid\n")[2].partition("\n```")[0].splitlines() == drawn
    table = re.findall(r"^\| `(\w+)` \| ", text.partition("| package | holds |")[2].partition("\n\n")[0], re.MULTILINE)
    packages = {name.split(".")[1] for name in code_base.modules if name.count(".") > 1}
    assert set(table) == packages
    assert packages == set(re.findall(r"\w+", " ".join(drawn[1:])))


def test_no_package_but_post_processors_and_readers_names_a_dialect() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    (found,) = [each for each in contracts if each["name"] == "Only post-processors know a dialect"]
    packages = {path.parent.name for path in (ROOT / "geoprint").glob("*/__init__.py")}
    listed = {module.removeprefix("geoprint.") for module in found["source_modules"]}
    assert packages - listed == {"postprocessor", "toolpath_files"}
    words = re.compile(r"\brapid/|\bGeo(Cell|Guard|Print|Stack|Path)|\bgeo(DryRun|SpeedPct|FirstRun)")
    paths = [path for name in listed for path in (ROOT / "geoprint" / name).rglob("*.py")]
    assert len(paths) > 100
    assert [str(path) for path in paths if words.search(path.read_text(encoding="utf-8"))] == []


def test_an_import_that_others_imply_is_not_drawn(tmp_path: Path) -> None:
    files = {
        "top/a.py": "from geoprint.low import c\nfrom geoprint.middle import b\n",
        "middle/b.py": "def f():\n    from geoprint.low.c import g\n",
        "low/c.py": "",
        "single.py": "from geoprint.top import a\n",
    }
    for name, text in files.items():
        path = tmp_path / "geoprint" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    assert [*CodeBase(tmp_path).picture()] == ["flowchart TD", "    middle --> low", "    top --> middle"]


# What an engineer from outside looks for, and one module that a search by name and first line shall lead to.
@pytest.mark.parametrize(
    ("search", "module"),
    [
        ("waypoint", "robot.controller.targets"),
        ("hatch", "toolpath.guided"),
        ("zigzag", "toolpath.guided"),
        ("post-processor", "postprocessor"),
        ("stepover", "metrics.spacing"),
        ("stepover", "toolpath.contours"),
        ("medial axis", "toolpath.medial_axis"),
        ("speed profile", "robot.timing.topp"),
        ("feed rate", "robot.timing.print_speed"),
        ("inverse kinematics", "robot.reach.inverse"),
        ("collision", "robot.collision.clearance"),
        ("geodesic", "metrics.oracle.geodesic"),
        ("fast marching", "distance.fast_marching"),
        ("remeshing", "geometry.remeshing"),
        ("g-code", "toolpath_files.gcode"),
    ],
)
def test_a_search_for_a_word_of_the_field_leads_to_its_module(
    shared_plans: SharedPlans, search: str, module: str
) -> None:
    files = {name: each.path for name, each in whole_code_base(shared_plans).modules.items()}
    lines = {name: path.read_text(encoding="utf-8").partition("\n")[0] for name, path in files.items()}
    found = [name for name, line in lines.items() if search in f"{name.replace('_', ' ')} {line}".lower()]
    assert f"geoprint.{module}" in found
    # More would be no answer.
    assert len(found) <= 15


def test_an_import_upwards_is_found(tmp_path: Path) -> None:
    package = tmp_path / "geoprint"
    for name in ("geoprint/__init__.py", "geoprint/toolpath", "geoprint/geometry", "geoprint/model"):
        source, target = ROOT / name, tmp_path / name
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            package.mkdir()
            shutil.copy(source, target)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    (package / "model" / "above.py").write_text("def f():\n    from geoprint.toolpath import poses\n", encoding="utf-8")

    assert set(CodeBase(tmp_path).upwards()) == {("geoprint.model.above", "geoprint.toolpath.poses")}

    (package / "toolpath" / "feature.toml").write_text("", encoding="utf-8")
    (package / "stray.py").write_text("from geoprint.toolpath import poses\n", encoding="utf-8")
    found = CodeBase(tmp_path)
    assert set(found.upwards()) >= {("geoprint.stray", "geoprint.toolpath.poses")}
    assert list(found.unlisted()) == ["geoprint.stray"]
