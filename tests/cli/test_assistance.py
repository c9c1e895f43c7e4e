"""Help is found however it is asked for, and a shell completes commands and options that are read lazily."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from geoprint.cli.application import COMMANDS, run


def shown(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert run(arguments) == 0
    return capsys.readouterr().out


def test_help_is_found_however_it_is_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    whole = shown(capsys, "--help")
    assert shown(capsys, "-h") == shown(capsys, "help") == whole
    assert all(name.replace("_", "-") in whole for commands in COMMANDS.values() for name in commands)
    of_plan = shown(capsys, "plan", "--help")
    assert shown(capsys, "plan", "-h") == shown(capsys, "help", "plan") == of_plan
    assert "--spacing" in of_plan


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with `geoprint` as a shell finds it."""
    folder = tmp_path_factory.mktemp("bin")
    script = folder / "geoprint"
    script.write_text(f"#!{sys.executable}\nfrom geoprint.cli import main\nmain()\n", encoding="utf-8")
    script.chmod(0o755)
    return folder


def test_bash_completes_commands_and_their_options(installed: Path) -> None:
    bash = shutil.which("bash")
    assert bash is not None
    asked = """
        eval "$(geoprint completion bash)"
        complete_line() {
            COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
            _geoprint_completion geoprint
            echo "${COMPREPLY[@]}"
        }
        complete_line geoprint pl; complete_line geoprint plan --sp; complete_line geoprint fit-flow --d
    """
    kept = os.environ | {"PATH": f"{installed}:{os.environ['PATH']}", "PYTHONPATH": str(Path.cwd())}
    done = subprocess.run([bash, "-c", asked], capture_output=True, text=True, check=True, env=kept)
    assert done.stdout.split("\n") == ["plan place", "--spacing --speed", "--density", ""], done.stderr


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_are_told_how_to_ask(capsys: pytest.CaptureFixture[str], shell: str) -> None:
    assert "_GEOPRINT_COMPLETE=complete_" in shown(capsys, "completion", shell)
