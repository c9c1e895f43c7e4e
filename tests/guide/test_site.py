"""The site of the guide builds without a warning, and opens from a file: nothing is fetched, and search finds pages."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from benchmarks.guide.site import build, lay_out
from geoprint.guide import pages
from tests.reporting.browser import Page

pytestmark = pytest.mark.needs("mkdocs")
# How a person gets from the front page to an answer: what is searched for, or the links that are clicked, and where the
# answer stands, in words of that page.
ANSWERS = {
    "print at 0.4 mm": (["Print lines of 0.4 mm"], "--needle 0.4"),
    "what CV means": (["Metrics of evenness"], "standard deviation over mean"),
    "which point to touch": (["Calibrate the cell and place the part"], "Touch them with the tip of the nozzle"),
    "another arm": (["Describe your own robot cell"], "UR5"),
    "why a part is refused": (["Find out why a part is refused"], "wrong unit"),
}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the site, built as strictly as it is published."""
    pytest.importorskip("mkdocs", reason="mkdocs is not installed: pip install -e '.[docs]'")
    return build(lay_out(tmp_path_factory.mktemp("site"))).parent


@pytest.fixture(scope="module")
def opened(site: Path, browser: Page) -> Page:
    browser.resize(width=1440)
    browser.forget()
    browser.open(site / "index.html")
    return browser


def test_every_page_stands_in_it_with_its_title(site: Path) -> None:
    for page in pages():
        text = (site / page.part / f"{page.name}.html").read_text(encoding="utf-8")
        assert re.search(
            rf'<h1 id="[^"]*">{re.escape(page.title)}<', text.replace("&#39;", "'").replace("&rsquo;", "'")
        )
    assert 'id="compare"' in (site / "reference" / "api" / "geoprint.workflow.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("place", ["index", "tutorials/gallery", "how-to/calibrate", "reference/files"])
def test_a_page_opens_from_a_file_and_fits_a_telephone(site: Path, opened: Page, place: str) -> None:
    opened.forget()
    opened.open(site / f"{place}.html")
    for width in (1440, 390):
        opened.resize(width=width)
        assert opened.run("document.documentElement.scrollWidth") == width
    opened.resize(width=1440)
    with opened.dark():
        opened.wait_until("document.body.dataset.mdColorScheme === 'slate'")
    opened.wait_until("document.body.dataset.mdColorScheme === 'default'")
    assert opened.run("[...document.images].every(image => image.complete && image.naturalWidth > 300)") is True
    assert opened.errors() == []
    assert {address.partition(":")[0] for address in opened.requests()} == {"file"}


@pytest.mark.parametrize(
    ("words", "title"),
    [
        ("stepover", "Glossary and units"),
        ("pressure", "Measure a material, and set pressure and speed"),
        ("label", "Read a part and choose where paths begin"),
        ("compare", "geoprint.workflow"),
        ("UR5", "Describe your own robot cell"),
        ("touch", "Calibrate the cell and place the part"),
    ],
)
def test_search_finds_pages(site: Path, opened: Page, words: str, title: str) -> None:
    opened.forget()
    opened.open(site / "index.html")
    opened.click(".md-search__input")
    opened.driver.find_element("css selector", ".md-search__input").send_keys(words)
    opened.wait_until("document.querySelector('.md-search-result__item') !== null")
    found = opened.run("[...document.querySelectorAll('.md-search-result__article h1')].map(h => h.innerText)")
    assert isinstance(found, list)
    assert title in found[:5]  # pyright: ignore[reportUnknownVariableType]
    assert opened.errors() == []
    assert {address.partition(":")[0] for address in opened.requests()} == {"file"}


@pytest.mark.parametrize("question", ANSWERS)
def test_a_newcomer_finds_the_answer_in_two_clicks(site: Path, opened: Page, question: str) -> None:
    clicks, answer = ANSWERS[question]
    opened.open(site / "index.html")
    for link in clicks:
        opened.driver.find_element("partial link text", link).click()
    assert answer in " ".join(str(opened.run("document.querySelector('article').innerText")).split())
