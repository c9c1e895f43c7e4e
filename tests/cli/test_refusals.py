"""What is wrong is said in the order in which a person thinks, by the name that was typed, to a program as JSON."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from geoprint.cli import terminal
from geoprint.config import packaged_cell_text
from geoprint.geometry.files import save_ply
from tests.cli.screens import screen
from tests.commands import called
from tests.meshes import plate


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("parts")
    save_ply(plate((40.0, 30.0), (20, 15), jitter_seed=1), folder / "plate.ply")
    (folder / "job.toml").write_text('surface = "plate.ply"\nunit = "mm"\nspacing = -2\n', encoding="utf-8")
    cell = packaged_cell_text("irb120-bent45").replace("[process]", "[process]\nrounds = 0")
    (folder / "cell.toml").write_text(cell, encoding="utf-8")
    return folder


def refused(monkeypatch: pytest.MonkeyPatch, folder: Path, *arguments: object) -> int:
    """Run a command in a folder and return its exit status."""
    monkeypatch.chdir(folder)
    return called(monkeypatch, *arguments)


# Everything is wrong; one after another is put right.
WRONG = [
    ("plan nowhere.ply --cell nowhere.toml --backend magic", 3, "there is no file `nowhere.ply`"),
    ("plan plate.ply --cell nowhere.toml", 2, "the cell file nowhere.toml does not exist"),
    ("plan plate.ply --spacing 2", 2, "`plate.ply` has no unit"),
    ("plan plate.ply", 2, "`--unit`, `--spacing` and `--place` are missing. `plate.ply` has no unit"),
    ("plan plate.ply --unit mm", 2, "10 rounds are about 1.5 mm apart on this part"),
    ("plan plate.ply --unit mm --spacing 2", 2, "irb120-bent45.toml is not calibrated"),
    ("plan plate.ply --unit mm --spacing 99 --place demo", 3, "the part is only 50 mm across"),
    ("compare plate.ply", 2, "`plate.ply` has no unit"),
    ("compare plate.ply --unit mm", 2, "Add `--spacing 1.5 --place demo`"),
    ("place nowhere.ply --cell nowhere.toml", 3, "there is no file `nowhere.ply`"),
]


@pytest.mark.parametrize(("line", "status", "complaint"), WRONG)
def test_what_a_person_thinks_of_first_is_asked_for_first(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    folder: Path,
    *,
    line: str,
    status: int,
    complaint: str,
) -> None:
    # A process beside this one takes seconds to start, and plans nothing here.
    monkeypatch.setattr("geoprint.cli.planning.PROCESSES", 1)
    out = [] if line.startswith("place") else ["--out", "out"]
    assert refused(monkeypatch, folder, *line.split(), *out) == status
    assert complaint in capsys.readouterr().err
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("plate.ply --unit inch", "geoprint: `--unit`: it must be 'mm', 'cm', 'm', 'um' or 'in', found 'inch'; "),
        ("plate.ply --at 0 0 0 --radius -1", "geoprint: `--radius`: it must be greater than 0, found -1.0; "),
        ("plate.ply --at 0 0 nan --radius 1", "geoprint: `--at`: it must be a finite number, found nan; "),
        (
            "plate.ply --at 0 0 0 --set patches.1.cone_deg=200",
            "geoprint: `--set patches.1.cone_deg`: it must be less than 180, found 200; ",
        ),
        ("plate.ply --radius 3", "geoprint: a radius or a cone needs its point"),
        ("plate.ply --set fill_holes=0", "geoprint: `--set fill_holes`: it must be greater than 0, found 0; "),
        ("job.toml --set max_tilt=5", "geoprint: job.toml, line 3: spacing: it must be at least"),
        ("plate.ply --cell cell.toml --unit mm", "geoprint: cell.toml, line 107: process.rounds: it must be"),
        ("plate.ply --spcing 3", "geoprint: `geoprint plan` has no option `--spcing`; did you mean `--spacing`?"),
        ("plate.ply --spacing x", "geoprint: `--spacing` takes a number in mm, found 'x'; "),
    ],
)
def test_an_error_names_what_was_typed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path, *, line: str, sentence: str
) -> None:
    assert refused(monkeypatch, folder, "plan", *line.split(), "--out", "out") == 2
    said = capsys.readouterr().err
    assert said.startswith(sentence)
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("line", "kind", "status"),
    [
        ("plan plate.ply --unit inch --out out", "UsageError", 2),
        ("plan plate.ply --bogus 3", "UsageError", 2),
        ("compare nowhere.ply --out out", "InputError", 3),
        ("inspect nowhere.ply", "InputError", 3),
        ("patch plate.ply --unit mm --out patch.ply", "UsageError", 2),
        ("remesh plate.ply --unit mm --out new.ply", "UsageError", 2),
        ("check nowhere", "InputError", 3),
        ("calibrate", "UsageError", 2),
        ("recommend", "UsageError", 2),
        ("fit-flow nowhere.csv --density 1", "InputError", 3),
        ("place nowhere.ply", "InputError", 3),
        ("bogus", "UsageError", 2),
    ],
)
def test_with_json_an_error_is_one_object_on_stdout(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    folder: Path,
    *,
    line: str,
    kind: str,
    status: int,
) -> None:
    assert refused(monkeypatch, folder, *line.split(), "--json") == status
    record = capsys.readouterr()
    found = json.loads(record.out)
    assert (found["kind"], found["exit_status"]) == (kind, status)
    assert record.err == f"geoprint: {found['error']}\n"


def test_the_numbers_of_an_error_are_told_to_programs(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    refused(monkeypatch, folder, "plan", "plate.ply", "--unit", "mm", "--out", "out", "--json")
    assert json.loads(capsys.readouterr().out)["details"]["depth_mm"] == pytest.approx(15.0, rel=0.05)


# What a person sees fits the terminal, has its weight in front, and goes on when nobody reads it.


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
        ("a number keeps its 5 % here", ["a number keeps its", "  5 % here"]),
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
    assert shown[0].startswith("\x1b[1;31mgeoprint:\x1b[0m `--unit`: it must be")
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
    assert (done.returncode, done.stderr) == (0, "")
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
    kept = "geoprint: stopped; nothing was written, and what was there before is kept.\n"
    assert (done.returncode, done.stderr) == (130, kept)
    assert '"exit_status": 130' in done.stdout
