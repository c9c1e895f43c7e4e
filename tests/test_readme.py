"""The README keeps its word: its Python blocks run, its two commands, its Pythons and its files exist."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from benchmarks.guide.__main__ import INDEX, index
from geoprint import cli
from tests.guide.here import working_here

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


@pytest.fixture(scope="module")
def scripted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Return the folder in which the Python blocks ran as one script, and what they printed."""
    folder = tmp_path_factory.mktemp("script")
    (folder / "data").symlink_to(ROOT / "data")
    environment = os.environ | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "agg"}
    command = [sys.executable, "-W", "error", "-c", "\n".join(blocks("python"))]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


def test_the_python_blocks_run_one_after_the_other_as_a_script(scripted: tuple[Path, str]) -> None:
    folder, said = scripted
    assert not said
    assert {path.name for path in folder.iterdir()} == {"data", "evenness.png"}


def test_the_figure_shows_where_lscm_is_uneven_and_fast_marching_is_not(scripted: tuple[Path, str]) -> None:
    pixels = plt.imread(scripted[0] / "evenness.png")[..., :3]
    coloured = np.ptp(pixels, axis=2) > 0.25
    # The last tenth holds the scale.
    left, right, _ = np.split(coloured, np.array([45, 90]) * coloured.shape[1] // 100, axis=1)
    assert left.mean() > 0.05
    assert right.mean() < 0.1 * left.mean()


def test_a_figure_takes_five_lines_and_the_whole_a_few_screens() -> None:
    (figure,) = ([line for line in block.splitlines() if line.strip()] for block in blocks("python"))
    assert len(figure) <= 5
    assert len(README.splitlines()) <= 120
    pictures = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", README)
    assert len(pictures) == 1
    assert (ROOT / pictures[0]).stat().st_size < 3_000_000


@pytest.mark.parametrize("mark", ["main", "tests"])
def test_the_two_commands_stand_behind_their_marks_and_install_everything(mark: str) -> None:
    command = re.search(rf"<!-- {mark} -->\n```sh\n(.*?)\n```", README)
    assert command is not None
    assert "python3 -m venv" in command[1]
    assert "pip install" in command[1]


def test_nothing_says_to_install_geoprint_from_a_package_index() -> None:
    # The name there is not ours: whoever takes it would run on the machines of those who follow the advice.
    named = re.compile(r"pip install[^\n`]*['\"\s]geoprint\b(?!\.whl)")
    said = [*(ROOT / "geoprint").rglob("*.py"), *(ROOT / "geoprint").rglob("*.md"), *ROOT.rglob("README.md")]
    assert named.search("`pip install 'geoprint[cad]'`")
    assert not [path for path in said if named.search(path.read_text(encoding="utf-8"))]


def test_it_names_the_pythons_of_the_classifiers() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found = (re.fullmatch(r"Programming Language :: Python :: (3\.\d+)", each) for each in project["classifiers"])
    versions = [each[1] for each in found if each]
    assert project["requires-python"] == f">={versions[0]}"
    words = f"Python {', '.join(versions[:-1])} or {versions[-1]}"
    assert words in README
    assert words in (ROOT / ".github" / "CONTRIBUTING.md").read_text(encoding="utf-8")


def test_linked_files_exist() -> None:
    links = re.findall(r"\]\(([^)#]+)\)", README)
    assert len(links) >= 3
    for link in links:
        assert (ROOT / link).is_file(), link


def test_the_guide_lists_its_pages_and_it_leads_there() -> None:
    assert f"]({INDEX.relative_to(ROOT).as_posix()})" in README
    assert INDEX.read_text(encoding="utf-8") == index(), "write it again: python -m benchmarks.guide --index"


def test_the_examples_run_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [line for line in "\n".join(blocks("sh")).splitlines() if line.startswith("geoprint ")]
    assert [line.split()[1] for line in lines] == ["inspect", "plan", "check", "measure"]
    (tmp_path / "data").symlink_to(ROOT / "data")
    monkeypatch.chdir(tmp_path)
    for line in lines:
        monkeypatch.setattr("sys.argv", shlex.split(line, comments=True))
        with working_here(), pytest.raises(SystemExit) as ended:
            cli.main()
        assert not ended.value.code, f"{line}: {capsys.readouterr().err}"
    written = {path.name for path in tmp_path.iterdir()} - {"data"}
    assert written == {"plan"}


def test_the_root_shows_what_a_newcomer_looks_for_and_nothing_that_fell_there() -> None:
    kept = {
        "CHANGELOG.md", "CITATION.cff", "LICENSE", "MANIFEST.in", "README.md", "benchmarks", "data", "geoprint",
        "pyproject.toml", "tests",
    }  # fmt: skip
    ignored = [line.rstrip("/") for line in (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()]
    found = {path.name for path in ROOT.iterdir() if not path.name.startswith(".")}
    # An unpacked source distribution has the last two as well.
    found -= {"PKG-INFO", "setup.cfg"}
    assert {name for name in found if not any(fnmatch(name, pattern) for pattern in ignored)} == kept
