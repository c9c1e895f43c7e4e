"""The README keeps its word: its Python blocks run, its two commands, its Pythons and its files exist."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path

import pytest

from geoprint import cli
from geoprint.guide import pages

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


@pytest.mark.parametrize("code", blocks("python"))
def test_python_blocks_run(code: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(ROOT)
    exec(compile(code, "README.md", "exec"), {})  # noqa: S102  (our own text)
    assert re.fullmatch(r"\d+ runs, \d+ s\n", capsys.readouterr().out)


@pytest.mark.parametrize("mark", ["main", "tests"])
def test_the_two_commands_stand_behind_their_marks_and_install_everything(mark: str) -> None:
    command = re.search(rf"<!-- {mark} -->\n```sh\n(.*?)\n```", README)
    assert command is not None
    assert "python3 -m venv" in command[1]
    assert "pip install" in command[1]


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


def test_it_lists_every_page_of_the_guide() -> None:
    for page in pages():
        assert f"{page.title}" in README
        assert f"| {page.summary} |" in README


def test_the_examples_run_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [line for line in "\n".join(blocks("sh")).splitlines() if line.startswith("geoprint ")]
    assert [line.split()[1] for line in lines] == ["guide", "guide", "inspect", "plan", "check"]
    (tmp_path / "data").symlink_to(ROOT / "data")
    monkeypatch.chdir(tmp_path)
    for line in lines:
        monkeypatch.setattr("sys.argv", shlex.split(line, comments=True))
        with pytest.raises(SystemExit) as ended:
            cli.main()
        assert not ended.value.code, f"{line}: {capsys.readouterr().err}"
    written = {path.name for path in tmp_path.iterdir()} - {"data"}
    assert written == {"guide.html", "plan"}
