"""Words of the field stand beside ours, and what geoprint is not is said plainly."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from geoprint import cli
from geoprint.guide import page_named

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def said(text: str) -> str:
    return " ".join(text.split())


def test_the_help_names_them_where_ours_differ(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["geoprint", "plan", "--help"])
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(SystemExit):
        cli.main()
    shown = said(capsys.readouterr().out)
    for word in ("(stepover)", "contour-parallel", "conformal map", "(source)"):
        assert word in shown


@pytest.mark.parametrize("text", [README, page_named("glossary").text], ids=["README", "page"])
@pytest.mark.parametrize(
    ("ours", "field"),
    [
        ("spacing", "stepover"),
        ("contours", "contour-parallel"),
        ("source", "where distance is zero"),
        ("run", "bead"),
        ("where fronts meet", "medial axis"),
        ("lscm", "conformal map"),
        ("on a curved surface", "conformal printing"),
    ],
)
def test_readme_and_guide_pair_them(text: str, ours: str, field: str) -> None:
    paragraphs = map(said, re.split(r"\n\n|\n(?=\|)", text.lower()))
    assert any(ours in each and field in each for each in paragraphs)


@pytest.mark.parametrize("text", [README, page_named("checks").text], ids=["README", "page"])
def test_what_geoprint_is_not_is_said(text: str) -> None:
    for words in ("no beating heart", "no medical device", "slices no solids"):
        assert words in said(text)
