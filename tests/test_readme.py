"""The README keeps its word: its Python blocks run, its two commands and its files exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

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


def test_linked_files_exist() -> None:
    links = re.findall(r"\]\(([^)#]+)\)", README)
    assert len(links) >= 3
    for link in links:
        assert (ROOT / link).is_file(), link


def test_every_command_of_the_examples_is_one_of_the_command_line() -> None:
    commands = set(re.findall(r"^geoprint (\w+)", "\n".join(blocks("sh")), flags=re.MULTILINE))
    assert commands == {"init", "plan", "compare", "doctor"}
