"""Each script of the gallery runs as it stands, draws its picture, and prints what it says that it prints."""

from __future__ import annotations

import ast
import importlib
import re
import runpy
from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from PIL import Image

import geoprint
from benchmarks.guide.gallery import script_stamp
from benchmarks.guide.stamps import MADE_FROM, texts_of
from geoprint.distance import registry

FOLDER = Path(geoprint.__file__).parent / "guide" / "examples"
DATA = Path(__file__).parents[2] / "data"
SCRIPTS = sorted(FOLDER.glob("*.py"))
NAMES = [path.stem for path in SCRIPTS]
PRINTS = "# prints: "
# Of a script, with its docstring and what it prints.
MOST_LINES = 39
# Of one picture and of all [bytes], and the least width [pixels].
LARGEST, LARGEST_ALL, LEAST_WIDTH = 120_000, 900_000, 480
# Packages that only some scripts need.
NEEDED = {"feedback": ("cv2", "open3d"), "label_volume": ("nibabel", "skimage")}
RUNS = [
    pytest.param(path, marks=pytest.mark.needs(*NEEDED[path.stem])) if path.stem in NEEDED else path for path in SCRIPTS
]


def test_there_are_twelve_with_a_picture_each_that_is_no_larger_than_it_needs_to_be() -> None:
    assert len(NAMES) == 12
    pictures = {path.stem: path for path in FOLDER.glob("*.png")}
    assert sorted(pictures) == NAMES
    sizes = {name: path.stat().st_size for name, path in pictures.items()}
    assert max(sizes.values()) <= LARGEST, sizes
    assert sum(sizes.values()) <= LARGEST_ALL
    for name, path in pictures.items():
        with Image.open(path) as picture:
            assert picture.width >= LEAST_WIDTH, name


@pytest.mark.parametrize("path", SCRIPTS, ids=NAMES)
def test_a_picture_was_drawn_by_the_script_as_it_stands(path: Path) -> None:
    assert texts_of(path.with_suffix(".png").read_bytes()).get(MADE_FROM) == script_stamp(path)


@pytest.mark.parametrize("path", SCRIPTS, ids=NAMES)
def test_a_script_is_short_and_says_first_what_it_is_for(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= MOST_LINES
    title, gap, *rest = (ast.get_docstring(ast.parse(text)) or "").splitlines()
    assert title.endswith((".", "?"))
    assert (gap, bool(rest)) == ("", True)


@pytest.mark.parametrize("path", SCRIPTS, ids=NAMES)
def test_a_script_takes_public_names_alone(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        assert not (isinstance(node, ast.Attribute) and node.attr.startswith("_"))
    for module, name in _imported(tree):
        # A package, of which nothing is a module that nobody promises to keep.
        package = importlib.import_module(module)
        assert hasattr(package, "__path__"), f"{module} is a module of geoprint, not a package"
        assert name in dir(package), f"{module} has no public name {name}"


def _imported(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Yield package and name of whatever a script takes of geoprint, by import or as `geoprint.package.name`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "geoprint":
            yield from ((str(node.module), alias.name) for alias in node.names)
        if isinstance(node, ast.Attribute):
            module, _, name = ast.unparse(node).rpartition(".")
            if re.fullmatch(r"geoprint(\.\w+)*", module):
                yield module, name


@pytest.mark.parametrize("path", RUNS, ids=NAMES)
def test_a_script_draws_its_picture_and_prints_what_it_says(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "data").symlink_to(DATA)
    monkeypatch.chdir(tmp_path)
    # What a script registers is gone when it ends.
    monkeypatch.setattr(registry._KNOWN, "_own", dict(registry._KNOWN._own))  # pyright: ignore[reportPrivateUsage]
    plt.switch_backend("agg")
    runpy.run_path(str(path), run_name="__main__")
    plt.close("all")
    with Image.open(tmp_path / f"{path.stem}.png") as picture:
        assert picture.width >= LEAST_WIDTH
    lines = path.read_text(encoding="utf-8").splitlines()
    said = [line.removeprefix(PRINTS) for line in lines if line.startswith(PRINTS)]
    assert said
    assert capsys.readouterr().out.splitlines() == said
