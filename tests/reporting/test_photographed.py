"""The page of photographs shows every picture, runs nothing, asks for nothing, escapes names and fits the screen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.inspection.html import PhotographsReport, PhotographView, RowsReport, photographs_report
from geoprint.reporting import PathDistances, Picture
from geoprint.simulation import png
from tests.inspection.drawn import drawn, straight
from tests.reporting.browser import Page

HOSTILE = "</title><script>window.hacked=1</script><img src=x onerror='window.hacked=2'>\"&%{x}<b>.jpg"
SIZE = (800, 500)


def view(name: str, *, v: float) -> PhotographView:
    """Return a photograph with one line, its edges, a run and a fault."""
    grey = drawn(SIZE, [(straight(100, v, 700, v), 20.0)])
    return PhotographView(
        name=name,
        said=(f"{name}: of the plan 90.0% is in sight.",),
        pictures=(
            Picture(f"{name}: lines", "png", png(grey)),
            Picture(f"{name}: edges", "png", png(1.0 - grey)),
        ),
        runs=RowsReport(("run", "length mm", "gaps at mm"), (("1", "60.0", "12.0-14.0"),)),
        faults=RowsReport(("run", "fault", "from mm", "to mm"), (("1", "gap", "12.0", "14.0"),)),
        widths=np.array([0.9, 1.0, 1.1]),
    )


def report(*names: str) -> PhotographsReport:
    count = len(names)
    return PhotographsReport(
        verdict="The lines lie apart.",
        cautions=("Warning: all beads lie to one side.",),
        photographs=tuple(view(name, v=100.0 + 50.0 * k) for k, name in enumerate(names)),
        figures=RowsReport(("photograph", "lines"), tuple((name, "1") for name in names)),
        said=("They lie apart.",),
        distances=PathDistances(names, np.full((count, count), 62.2254), np.full((count, count), 7.5)),
        settings=(("beads are", "lighter"),),
        inputs=tuple((name, "0" * 64) for name in names),
    )


def test_the_page_holds_no_script_and_lets_none_run() -> None:
    page = photographs_report(report("a.jpg", HOSTILE), title=f"On {HOSTILE}").decode()
    assert "<script" not in page
    assert "script-src &#x27;none&#x27;" in page
    assert "onerror='" not in page
    assert page == photographs_report(report("a.jpg", HOSTILE), title=f"On {HOSTILE}").decode()


def test_the_matrix_has_the_digits_of_the_papers_table_and_one_photograph_has_none() -> None:
    page = photographs_report(report("a.jpg", "b.jpg"), title="Two").decode()
    assert '<td class="above">62.2254</td>' in page
    assert '<td class="below">7.5000</td>' in page
    alone = photographs_report(replace(report("a.jpg"), distances=None), title="One").decode()
    assert 'class="matrix"' not in alone
    assert "How far their lines lie apart" not in alone


def test_where_no_width_is_known_none_is_drawn() -> None:
    known = replace(report("a.jpg"), photographs=(view("a.jpg", v=100.0),))
    unknown = replace(known, photographs=(replace(view("a.jpg", v=100.0), widths=np.zeros(0)),))
    assert 'class="histograms"' in photographs_report(known, title="One").decode()
    page = photographs_report(unknown, title="One").decode()
    assert "No width is known." in page
    assert 'class="histograms"' not in page


def test_what_is_not_wrong_is_said_in_words() -> None:
    plain = replace(view("a.jpg", v=100.0), faults=RowsReport(("run",), ()))
    said = photographs_report(replace(report("a.jpg"), photographs=(plain,)), title="One").decode()
    assert "No stretch of the plan in sight is without material" in said
    without = replace(plain, runs=None)
    said = photographs_report(replace(report("a.jpg"), photographs=(without,)), title="One").decode()
    assert "No line is broken." in said
    assert "Run by run" not in said


def test_rows_of_another_length_and_a_page_on_nothing_are_refused() -> None:
    with pytest.raises(InputError, match="needs 2 cells in every row"):
        RowsReport(("run", "fault"), (("1",),))
    with pytest.raises(InputError, match="needs at least one"):
        replace(report("a.jpg"), photographs=())


@pytest.mark.parametrize(("width", "columns"), [(1440, 2), (390, 1)])
def test_a_browser_shows_every_picture_within_the_screen(
    browser: Page, tmp_path: Path, width: int, columns: int
) -> None:
    path = tmp_path / "report.html"
    path.write_bytes(photographs_report(report("a.jpg", HOSTILE), title=HOSTILE))
    browser.resize(width=width)
    browser.forget()
    browser.open(path)
    assert browser.run("window.hacked === undefined")
    assert browser.errors() == []
    assert browser.requests() == [path.as_uri()]
    assert browser.run("document.documentElement.scrollWidth <= innerWidth")
    shown = "[...document.querySelectorAll('figure img')].map((one) => [one.naturalWidth, one.clientWidth])"
    pictures = np.array(browser.run(shown))
    assert pictures[:, 0].tolist() == 4 * [SIZE[0]]
    assert (pictures[:, 1] > 0.4 * min(width, 1240)).all()
    # Lines and edges stand beside each other where there is room.
    tops = np.array(browser.run("[...document.querySelectorAll('figure')].map((one) => one.getBoundingClientRect().y)"))
    assert np.unique(tops[:2]).size == 3 - columns
    # What is white in the file is white on the screen.
    assert browser.picture("figure:nth-child(2) img").max() > 0.6
