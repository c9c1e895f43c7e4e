"""What a person sees fits the terminal, has its weight in front, and goes on when nobody reads it."""

from __future__ import annotations

import os
import pty
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from geoprint.cli import terminal
from tests.cli.screens import screen

GEOPRINT = [sys.executable, "-m", "geoprint"]
ESCAPES = re.compile(r"\x1b\[[\d;]*m")


def plain(text: str) -> str:
    return ESCAPES.sub("", text)


@pytest.mark.parametrize(
    ("line", "shown"),
    [
        ("one two three four five six", ["one two three four", "  five six"]),
        ("  inset two three four five", ["  inset two three", "    four five"]),
        ("label     two three four", ["label     two three", "          four"]),
        ("a_path_that_is_longer_than_the_line", ["a_path_that_is_longer_than_the_line"]),
        ("short", ["short"]),
        ("", [""]),
    ],
)
def test_a_long_line_breaks_between_words_and_hangs_below_its_text(line: str, shown: list[str]) -> None:
    assert terminal.fitted(line, 20) == "\n".join(shown)
    assert terminal.fitted(line, None) == line


def test_each_weight_has_a_word_and_on_a_terminal_a_colour_of_its_own() -> None:
    said = "geoprint: a\nwarning: b\nnote: c\nnot checked: d\nplain: e"
    shown = terminal.coloured(said)
    assert plain(shown) == said
    assert len(set(re.findall(r"\x1b\[([\d;]+[1-9])m", shown))) == 4
    assert shown.endswith("plain: e")


@pytest.mark.parametrize(("variables", "coloured"), [({}, True), ({"NO_COLOR": "1"}, False), ({"TERM": "dumb"}, False)])
def test_colours_are_for_terminals_that_want_them(
    monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], *, coloured: bool
) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    master, slave = pty.openpty()
    with os.fdopen(slave, "w", encoding="utf-8") as stream:
        assert terminal.has_colours(stream) is coloured
        monkeypatch.setenv("COLUMNS", "72")
        assert terminal.columns(stream) == 72
    os.close(master)


def test_a_refusal_wraps_and_is_coloured_on_a_terminal_and_is_one_line_elsewhere() -> None:
    asked = [*GEOPRINT, "plan", "data/plate.ply", "--unit", "inch", "--spacing", "1", "--out", "nowhere"]
    shown = screen(asked, columns=60).splitlines()
    assert shown[0].startswith("\x1b[1;31mgeoprint:\x1b[0m `--unit`: input should be")
    assert len(shown) > 1
    assert all(len(plain(line)) <= 60 for line in shown)
    assert all(line.startswith("  ") for line in shown[1:])
    piped = subprocess.run(asked, capture_output=True, text=True, check=False, env=os.environ | {"COLUMNS": "60"})
    assert piped.stderr == " ".join(line.strip() for line in map(plain, shown)) + "\n"


def test_a_reader_that_is_gone_is_no_failure() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    asked = [*GEOPRINT, "recommend", "--pressure", "20", "--rounds", "12", "--good", "10", "20", "--json"]
    done = subprocess.run(asked, stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "20 kPa and 12 rounds beside" in done.stderr
    shown = subprocess.run([*GEOPRINT, "--help"], stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writing)
    assert (shown.returncode, shown.stderr) == (0, "")
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        script = [*GEOPRINT, "completion", "bash"]
        done = subprocess.run(script, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 7
    assert "the result cannot be printed on stdout" in done.stderr


@pytest.mark.parametrize("error", ["KeyboardInterrupt", "ImportError('a library hid it')"])
def test_an_interrupt_while_libraries_are_read_ends_in_a_sentence(tmp_path: Path, error: str) -> None:
    # In the place of the first library that is read: it interrupts itself, as Ctrl-C would.
    (tmp_path / "typer").mkdir()
    (tmp_path / "typer" / "__init__.py").write_text(
        f"import os, signal, time\ntry:\n    os.kill(os.getpid(), {signal.SIGINT:d})\n    time.sleep(10)\n"
        f"except KeyboardInterrupt:\n    raise {error}\n"
    )
    kept = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run([*GEOPRINT, "plan", "--json"], capture_output=True, text=True, check=False, env=kept)
    assert (done.returncode, done.stderr) == (130, "geoprint: stopped; nothing was written.\n")
    assert '"exit_status": 130' in done.stdout
