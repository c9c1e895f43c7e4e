"""The house keeps its rules: nothing too long, no crowded folder, no import upwards, and a picture that is true."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from benchmarks.house import breaches, table
from benchmarks.parts.house_picture import PICTURE, picture, reduced
from benchmarks.parts.house_tree import ROOT, House

HOUSE = House()


@pytest.fixture
def copy(tmp_path: Path) -> House:
    """A copy of the package that a test may spoil."""
    shutil.copytree(ROOT / "geoprint", tmp_path / "geoprint", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return House(tmp_path)


@pytest.mark.dear
def test_what_breaks_a_rule_is_found(copy: House) -> None:
    before = set(breaches(copy))
    package = copy.root / "geoprint"
    for number in range(20):
        (package / "paths" / f"spare_{number}.py").write_text('"""Nothing."""\n', encoding="utf-8")
    (package / "model" / "long.py").write_text("A = 1\n" * 351, encoding="utf-8")
    (package / "model" / "lengthy.py").write_text("def f():\n" + "    f()\n" * 50, encoding="utf-8")
    (package / "model" / "above.py").write_text("def f():\n    from geoprint.paths import poses\n", encoding="utf-8")
    (package / "surfaces" / "remesh" / "aside.py").write_text(
        "from geoprint.surfaces.repair import inspect\n", encoding="utf-8"
    )

    found = "\n".join(sorted(set(breaches(House(copy.root))) - before))

    assert "geoprint/paths holds 3" in found
    assert "geoprint/model/long.py has 351 lines, allowed are 350." in found
    assert "geoprint/model/lengthy.py: f has 51 lines, allowed are 50." in found
    assert "geoprint.model.above imports geoprint.paths.poses, which stands above it." in found
    assert "geoprint.surfaces.remesh.aside imports geoprint.surfaces.repair, which stands above it." in found
    assert found.count("\n") == 4


@pytest.mark.dear
def test_the_table_has_a_row_for_each_room_and_wing() -> None:
    names = {line.split("|")[1].strip() for line in table(HOUSE)}
    folders = {path.parent for path in (ROOT / "geoprint").rglob("*.py")}
    assert names >= {".".join(path.relative_to(ROOT / "geoprint").parts) or "geoprint" for path in folders}


def test_the_picture_is_that_of_today() -> None:
    drawn = (ROOT / PICTURE).read_text(encoding="utf-8")
    assert drawn == picture(HOUSE), "draw it anew: python -m benchmarks.house --draw"


def test_arrows_that_follow_from_others_are_left_out() -> None:
    assert reduced({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == {"a": ["b"], "b": ["c"], "c": []}
