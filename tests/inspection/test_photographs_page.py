"""The page of photographs shows every picture, runs nothing, asks for nothing, escapes names and fits the screen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.inspection.appraise_photographs import appraise_photographs
from geoprint.reporting.html import Document, row_table
from geoprint.simulation import png
from geoprint.workflow import save
from tests.inspection.drawn import drawn, straight
from tests.reporting.browser import Page

HOSTILE = "<script>window.hacked=1<img src=x onerror='window.hacked=2'>\"&%{x}<b>.png"
SIZE = (320, 220)
LINE = (straight(40, 80, 280, 80), 12.0)
# Its second line is broken: where it goes on is the same line.
BROKEN = [LINE, (straight(40, 150, 140, 150), 12.0), (straight(180, 150, 280, 150), 12.0)]


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a whole line, and of one that is broken, in a photograph with a hostile name."""
    folder = tmp_path_factory.mktemp("photographs")
    for name, lines in (("whole.png", [LINE]), (HOSTILE, BROKEN)):
        (folder / name).write_bytes(png(drawn(SIZE, lines, noise=0.01)))
    save(appraise_photographs([folder / "whole.png", folder / HOSTILE]), folder / "both")
    return folder / "both" / "report.html"


def test_the_page_holds_no_script_and_says_what_is_wrong_and_what_is_not(report: Path) -> None:
    page = report.read_text(encoding="utf-8")
    assert "<script" not in page
    assert "script-src &#x27;none&#x27;" in page
    assert "onerror='" not in page
    assert page.count("No line is broken.") == 1
    assert page.count("<td>break</td>") == 1
    assert page.count('class="histograms"') == 2
    assert "How far their lines lie apart" in page
    assert "Run by run" not in page


def test_a_single_photograph_has_no_distances(report: Path) -> None:
    alone = report.parents[1] / "alone"
    save(appraise_photographs([report.parents[1] / "whole.png"]), alone)
    page = (alone / "report.html").read_text(encoding="utf-8")
    assert 'class="matrix"' not in page
    assert "How far their lines lie apart" not in page


def test_a_page_without_a_verdict_and_rows_of_another_length_are_refused() -> None:
    with pytest.raises(InputError, match="needs a verdict"):
        Document(name="a part", verdict=(), cautions=(), blocks=(), settings=(), inputs=())
    with pytest.raises(InputError, match="needs 2 cells in every row"):
        row_table(("run", "fault"), (("1",),), label="Faults")


@pytest.mark.parametrize(("width", "columns"), [(1440, 2), (390, 1)])
def test_a_browser_shows_every_picture_within_the_screen(browser: Page, report: Path, width: int, columns: int) -> None:
    browser.resize(width=width)
    browser.forget()
    browser.open(report)
    assert browser.run("window.hacked === undefined")
    assert browser.errors() == []
    assert browser.requests() == [report.as_uri()]
    assert browser.run("document.documentElement.scrollWidth <= innerWidth")
    shown = "[...document.querySelectorAll('figure img')].map((one) => [one.naturalWidth, one.clientWidth])"
    pictures = np.array(browser.run(shown))
    assert pictures[:, 0].tolist() == 4 * [SIZE[0]]
    assert (pictures[:, 1] > 0.4 * min(width, 640)).all()
    # Lines and edges stand beside each other where there is room.
    tops = np.array(browser.run("[...document.querySelectorAll('figure')].map((one) => one.getBoundingClientRect().y)"))
    assert np.unique(tops[:2]).size == 3 - columns
    # What is white in the file is white on the screen.
    assert browser.picture("figure:nth-child(2) img").max() > 0.6
