"""CONTRIBUTING's recipes work: followed in a copy of the tree, they touch only the files that they name."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numba.core import caching

from benchmarks.code_base import ROOT, CodeBase
from geoprint.geometry.files import load

CONTRIBUTING = (ROOT / ".github" / "CONTRIBUTING.md").read_text(encoding="utf-8")

READER = '''"""Reading .tri files: nine coordinates a line, one triangle each."""

import numpy as np

from geoprint.geometry.files.mesh_file import MeshFile


def read_tri(data: bytes, /, *, name: str) -> MeshFile:
    """Read a .tri file."""
    corners = np.array(data.decode("ascii").split(), dtype=np.float64).reshape(-1, 3)
    return MeshFile(corners, np.arange(len(corners)).reshape(-1, 3))
'''
EXPORTER = '''"""The tips of a program's targets, a line each."""

from geoprint.postprocessor.orders import Orders


def tip_list(orders: Orders) -> bytes:
    """Return the file."""
    return "".join(f"{x:.3f} {y:.3f} {z:.3f}\\n" for x, y, z in orders.tips).encode("ascii")
'''
FEATURE = """[commands]
size = "Say how long a file is."

["geoprint.reports"]
size = "geoprint.size.report:Size"
"""
COMMANDS = '''"""The command that says how long a file is."""

from pathlib import Path

import typer


def size(file: Path) -> None:
    """Say how many bytes a file has."""
    typer.echo(f"{file.stat().st_size} bytes")
'''
REPORT = '''"""The longest run of plans."""

from collections.abc import Mapping

import numpy as np

from geoprint.reporting.records.plan import FigureRecord
from geoprint.reporting.values import Section
from geoprint.results import Plan


class Size:
    """Measures runs."""

    title = "size"

    def __init__(self, *, scale: float = 1.0) -> None:
        self._scale = scale

    def figures(self, plan: Plan) -> tuple[FigureRecord, ...]:
        """Return the length of the longest run."""
        lengths = [float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum()) for path in plan.paths]
        return (
            FigureRecord(figure="longest", label="longest run [mm]", meaning="", value=self._scale * max(lengths)),
        )

    def section(self, plans: Mapping[str, Plan]) -> Section:
        """Return how many runs there are."""
        return Section("How long runs are", tuple(f"{name}: {len(plan.paths)} runs." for name, plan in plans.items()))
'''
PAGE = """---
order: 900
title: Size
summary: How long files and runs are.
---

`geoprint size FILE` says how many bytes a file has.
"""
# Runs commands one after another, each a line of words.
ONE_BY_ONE = """
import sys
from geoprint.cli.application import run

for line in sys.argv[1:]:
    assert run(line.split()) == 0, line
"""
FUTURE = "from __future__ import annotations\n"


@dataclass(frozen=True)
class Recipe:
    """What somebody writes who follows a recipe.

    Attributes:
        name: of what is new.
        texts: of its own files, by the ends of their names.
        lines: to add, by the file that has them: behind which text, and what.
    """

    name: str
    texts: Mapping[str, str]
    lines: Mapping[str, tuple[tuple[str, str], ...]]


RECIPES = {
    "reader": Recipe(
        "tri",
        {
            "feature.toml": '["geoprint.readers"]\ntri = "geoprint.tri.reader:read_tri"\n',
            "__init__.py": '"""Files of triangles."""\n',
            "reader.py": READER,
        },
        {},
    ),
    "exporter": Recipe(
        "tips",
        {"NAME.py": EXPORTER},
        {
            "geoprint/workflow/saving.py": (
                (FUTURE, "\nfrom geoprint.postprocessor.tips import tip_list\n"),
                ('        "targets.csv": targets_table(orders),\n', '        "tips.txt": tip_list(orders),\n'),
            )
        },
    ),
    "feature": Recipe(
        "size",
        {
            "feature.toml": FEATURE,
            "__init__.py": '"""How long files and runs are."""\n',
            "commands.py": COMMANDS,
            "report.py": REPORT,
            "guide.md": PAGE,
        },
        {},
    ),
}


def named_files(new: str) -> set[str]:
    """Return the files that CONTRIBUTING names for something new, its own called NAME."""
    row = re.search(rf"^\| {new} \|.*\|(.*)\|$", CONTRIBUTING, re.MULTILINE)
    assert row is not None, f"CONTRIBUTING has no row for a new {new}"
    return set(re.findall(r"`([^`]+)`", row[1]))


def followed(recipe: Recipe, tree: Path) -> None:
    """Follow a recipe in a tree."""
    for new in (path for path in named_files(kind_of(recipe)) if "NAME" in path):
        path = tree / new.replace("NAME", recipe.name)
        path.parent.mkdir(exist_ok=True)
        path.write_text(recipe.texts[new.rpartition("/")[2]], encoding="utf-8")
    for file, additions in recipe.lines.items():
        text = (tree / file).read_text(encoding="utf-8")
        for behind, line in additions:
            assert text.count(behind) == 1, f"{file} has no single {behind!r} any more"
            text = text.replace(behind, behind + line)
        (tree / file).write_text(text, encoding="utf-8")


def kind_of(recipe: Recipe) -> str:
    return next(kind for kind, each in RECIPES.items() if each is recipe)


def contents(tree: Path) -> dict[str, bytes]:
    return {
        path.relative_to(tree).as_posix(): path.read_bytes()
        for path in tree.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package with what numba compiled for it, which would take a minute again."""
    copy = tmp_path_factory.mktemp("tree")
    shutil.copytree(ROOT / "geoprint", copy / "geoprint")
    shutil.copy(ROOT / "pyproject.toml", copy)
    if "NUMBA_CACHE_DIR" in os.environ:
        for package in (ROOT / "geoprint").rglob("__init__.py"):
            old, new = (compiled(each) for each in (package, copy / package.relative_to(ROOT)))
            if old.is_dir() and not new.is_symlink():
                new.symlink_to(old)
    return copy


def compiled(path: Path) -> Path:
    """Return where numba keeps what it compiled from the files beside one, below NUMBA_CACHE_DIR."""
    name = caching._CacheLocator.get_suitable_cache_subpath(str(path))  # pyright: ignore[reportPrivateUsage]
    return Path(os.environ["NUMBA_CACHE_DIR"], name)


@pytest.fixture(scope="module")
def touched(tree: Path) -> Mapping[str, set[str]]:
    """Return the files of the tree that each recipe touched, which is followed then."""
    found = dict[str, set[str]]()
    before = contents(tree)
    for kind, recipe in RECIPES.items():
        followed(recipe, tree)
        after = contents(tree)
        found[kind] = {path for path in after if before.get(path) != after[path]}
        before = after
    return found


@pytest.mark.parametrize("kind", RECIPES)
def test_a_recipe_touches_only_the_files_that_it_names(touched: Mapping[str, set[str]], kind: str) -> None:
    assert touched[kind] == {path.replace("NAME", RECIPES[kind].name) for path in named_files(kind)}


@pytest.mark.usefixtures("touched")
def test_what_the_recipes_made_imports_nothing_upwards(tree: Path) -> None:
    assert list(CodeBase(tree).upwards()) == list(CodeBase(tree).unlisted()) == []


@pytest.mark.usefixtures("touched")
def test_what_the_recipes_made_works(tree: Path) -> None:
    plate = load(ROOT / "data" / "plate.ply", unit="mm")
    np.savetxt(tree / "part.tri", plate.vertices[plate.faces].reshape(-1, 9))
    small = "--at 0 0 0 --radius 4 --spacing 3"
    part = f"part.tri --unit mm {small}"
    commands = (
        "--help",
        "size part.tri",
        f"plan {part} --place demo --set options.size --out plan",
        f"compare {part} --no-robot --set options.size.scale=2.0 --out both",
        "check plan",
        "guide size",
    )

    done = subprocess.run(
        [sys.executable, "-c", ONE_BY_ONE, *commands],
        cwd=tree, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip

    assert done.returncode == 0, done.stdout + done.stderr
    assert "  size " in done.stdout
    assert f"\n{(tree / 'part.tri').stat().st_size} bytes\n" in done.stdout
    assert "says how many bytes a file has" in done.stdout
    (alone,) = json.loads((tree / "plan" / "plan.json").read_text(encoding="utf-8"))["features"]
    (figure,) = alone["figures"]
    assert 10.0 < figure["value"] < 8.0 * np.pi
    assert f"size: longest run [mm] {figure['value']:.4g}\n" in done.stdout
    (part,) = json.loads((tree / "both" / "compare.json").read_text(encoding="utf-8"))["parts"]
    doubled = [row["features"][0]["figures"][0]["value"] for row in part["backends"]]
    assert doubled == pytest.approx([2.0 * figure["value"]] * len(doubled), rel=0.1)
    page = (tree / "both" / "report.html").read_text(encoding="utf-8")
    assert "How long runs are" in page
    assert f"<td>{doubled[0]:.4g}</td>" in page
    tips = np.loadtxt(tree / "plan" / "tips.txt")
    assert len(tips) == len((tree / "plan" / "targets.csv").read_text(encoding="utf-8").splitlines()) - 1
    np.testing.assert_allclose(tips.mean(axis=0)[:2], 0.0, atol=1.0)
