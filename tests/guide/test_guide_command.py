"""`geoprint guide` lists the pages, shows one in the width of a terminal, and writes all of them as one page."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from geoprint.errors import UsageError
from geoprint.guide import html_guide, page_named, pages
from geoprint.guide.commands import WIDEST, rendered
from geoprint.guide.pages import PARTS
from tests.commands import called
from tests.reporting.browser import Page

Run = Callable[..., tuple[int, str, str]]
NAMES = [page.name for page in pages()]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    def call(*arguments: object) -> tuple[int, str, str]:
        status = called(monkeypatch, "guide", *arguments)
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return call


def test_it_lists_every_page_with_its_title(run: Run) -> None:
    status, stdout, _ = run()

    assert status == 0
    assert re.findall("^  (\\S+)", stdout, flags=re.MULTILINE) == NAMES
    assert re.findall("^([A-Z]\\S+)$", stdout, flags=re.MULTILINE) == list(PARTS.values())
    for page in pages():
        assert re.search(f"^  {page.name} +{page.title}$", stdout, flags=re.MULTILINE)


def test_the_pages_stand_in_the_order_in_which_they_are_needed() -> None:
    assert NAMES[0] == "first-comparison"
    assert next(name for name in NAMES if name in {"your-cell", "calibrate", "your-part"}) == "your-part"
    assert {"report", "checks", "scripting", "own-backend", "troubleshooting", "glossary", "api"} < set(NAMES)


def test_a_page_that_is_piped_is_plain(run: Run) -> None:
    status, stdout, _ = run("calibrate")

    assert status == 0
    assert stdout.startswith("# Calibrate the cell and place the part\n")
    assert "\x1b" not in stdout
    assert "*Picture: Four touched points" in stdout
    assert "(`geoprint guide controller`)" in stdout
    assert ".md)" not in stdout


@pytest.mark.parametrize("width", [60, 80, 200])
@pytest.mark.parametrize("name", ["calibrate", "troubleshooting", "glossary"])
def test_a_page_fits_the_terminal(name: str, width: int) -> None:
    lines = rendered(page_named(name), width=width).splitlines()

    assert 0.8 * min(width, WIDEST) < max(map(len, lines)) <= min(width, WIDEST)


def test_a_page_that_is_not_there_is_refused_with_those_that_are(run: Run) -> None:
    with pytest.raises(UsageError, match="no page `flying`; choose one of: first-comparison, "):
        page_named("flying")
    assert run("flying")[0] == 2


def test_the_whole_is_one_file_that_fetches_and_runs_nothing(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "guide.html"

    assert run("--html", out)[0] == 0

    text = out.read_text(encoding="utf-8")
    assert len(text) < 4_000_000
    assert "default-src 'none'" in text
    assert "<script" not in text
    assert set(re.findall(r'src="([a-z]+):', text)) == {"data"}
    assert not re.search(r'(?:src|href)="(?!data:|#)', text)
    for page in pages():
        assert f'<section id="{page.name}">' in text
    assert set(re.findall(r'href="#([\w-]+)"', text)) == set(NAMES)
    status, _, stderr = run("--html", out)
    assert status == 2
    assert "--overwrite" in stderr
    assert run("glossary", "--html", out, "--overwrite")[0] == 0
    assert len(out.read_bytes()) < len(text) / 2


def test_what_a_docstring_or_a_page_says_is_no_markup() -> None:
    text = html_guide(pages()).decode("utf-8")
    assert set(re.findall(r"<(\w+)", text.partition("<body>")[2])) <= {
        "a", "code", "details", "div", "em", "h1", "h2", "h3", "h4", "img", "li", "main", "nav", "ol", "p", "pre",
        "section", "strong", "summary", "table", "tbody", "td", "th", "thead", "tr", "ul",
    }  # fmt: skip


def test_it_fits_a_telephone_and_follows_the_dark_mode_of_the_system(browser: Page, tmp_path: Path) -> None:
    path = tmp_path / "guide.html"
    path.write_bytes(html_guide(pages()))
    for width in (1440, 390):
        browser.resize(width=width)
        browser.open(path)
        assert browser.run("document.documentElement.scrollWidth") == width
        assert browser.run("[...document.images].every(image => image.complete && image.naturalWidth > 300)") is True
    shade = "getComputedStyle(document.body).backgroundColor"
    assert browser.run(shade) == "rgb(255, 255, 255)"
    with browser.dark():
        assert browser.run(shade) == "rgb(20, 25, 29)"
