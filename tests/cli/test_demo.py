"""`geoprint demo`: with nothing to give, a comparison and where its report is; nothing of anybody else is lost."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from geoprint.cli import planning
from tests.commands import called

README = Path(__file__).parents[2] / "README.md"


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The empty folder that commands are called in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_it_compares_both_ways_anywhere_and_says_where_the_report_is(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert called(monkeypatch, "demo") == 0
    captured = capsys.readouterr()
    # README shows the same comparison, in fewer words.
    (shown,) = re.findall(r"```text\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
    said = iter(f"{captured.out} {captured.err}".split())
    assert all(word in said for word in re.sub(r"-{3,}|comparison", "", shown).split()), shown
    folder = elsewhere / "geoprint-demo"
    assert f"open in a browser: {folder / 'report.html'}" in captured.out + captured.err
    assert {path.name for path in elsewhere.iterdir()} == {folder.name}
    assert {"report.html", "compare.png", "heat", "lscm"} < {path.name for path in folder.iterdir()}
    assert (folder / "heat" / "rapid" / "GeoPrint.pgf").is_file()


def test_what_it_did_not_write_stays_as_it_is(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    notes = elsewhere / "geoprint-demo" / "notes.txt"
    notes.parent.mkdir()
    notes.write_text("mine", encoding="utf-8")
    assert called(monkeypatch, "demo") == 2
    assert "notes.txt" in capsys.readouterr().err
    assert [*elsewhere.rglob("*.*")] == [notes]


@pytest.mark.parametrize(
    ("stream", "display", "opened"), [("terminal", ":0", 1), ("terminal", "", 0), ("pipe", ":0", 0)]
)
def test_a_browser_opens_only_for_somebody_before_a_screen(
    stream: str, display: str, opened: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []

    def opening(address: str) -> bool:
        asked.append(address)
        return True

    monkeypatch.setattr("webbrowser.open", opening)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: stream == "terminal")
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    planning._opened(Path("/somewhere/report.html"))  # pyright: ignore[reportPrivateUsage]
    assert asked == ["file:///somewhere/report.html"] * opened
