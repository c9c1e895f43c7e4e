"""Every page of the guide says what a page has to say, and what it tells people to run runs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import pytest

from benchmarks.guide.pictures import PICTURES
from benchmarks.guide.stamps import figures_in, figures_of
from geoprint.guide import Page, pages, picture_bytes
from tests.guide.outputs import LEFT_OUT, commands, is_quoted, ran, sequences

ROOT = Path(__file__).parents[2]
PAGES = [page for page in pages() if not page.is_generated]
# Pictures of what commands of a page plan: that page prints the figures that they show.
OF_COMMANDS = {
    "first-comparison.png": "first-comparison",
    "measure.png": "measure",
    "middle.png": "medial-axis",
    "overhang.png": "overhang",
    "simulate.png": "simulate",
}
# Largest picture [bytes], most lines of a page but for what is printed (two screens and its tables), and of an output.
LARGEST, LONGEST, LONGEST_OUTPUT = 120_000, 120, 12


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where all pages run, one after another, as somebody does who reads them in a clone."""
    found = tmp_path_factory.mktemp("guide")
    (found / "data").symlink_to(ROOT / "data")
    return found


@pytest.mark.parametrize("sequence", sequences(), ids=lambda sequence: sequence[0].name)
def test_its_blocks_run_in_order_and_so_do_those_of_pages_that_go_on_with_it(
    sequence: Sequence[Page], folder: Path
) -> None:
    for page in sequence:
        every = ""
        for each in ran(page, folder):
            said = f"`python -m benchmarks.guide --outputs {page.name}`: {each.block.text}"
            printed = "".join(each.printed)
            every += printed
            assert each.quoted is not None or not each.needs, f"{said}prints\n{printed}"
            assert each.quoted is None or is_quoted(each.quoted, printed), f"{said}prints\n{printed}not\n{each.quoted}"
        for picture in (picture for picture, name in OF_COMMANDS.items() if name == page.name):
            shown = {*figures_of(picture_bytes(picture))}
            assert shown <= {*figures_in(every)}, f"python -m benchmarks.guide --draw {picture}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_it_has_a_title_a_summary_a_picture_and_a_command_that_is_run(page: Page) -> None:
    assert 3 <= len(page.title) <= 50
    assert re.fullmatch(r"[A-Z][^\n]{20,110}\.", page.summary)
    assert any(
        line.startswith("geoprint ") for block in page.blocks if block.language == "sh" for line in commands(block.text)
    )
    assert page.pictures, "a page shows what it is about"
    for words, picture in page.pictures:
        assert len(words) > 30, "who cannot see the picture reads what it shows"
        assert picture in PICTURES, f"benchmarks.guide draws no {picture}"
        assert 0 < len(picture_bytes(picture)) <= LARGEST
    written = re.sub(r"^```output\n.*?^```\n\n?", "", page.text, flags=re.DOTALL | re.MULTILINE)
    assert len(written.splitlines()) <= LONGEST
    for block in page.blocks:
        assert block.language != "output" or len(block.text.replace(LEFT_OUT, "").splitlines()) <= LONGEST_OUTPUT
    # Fits a terminal of 80 columns where it is read as it stands; tables and commands are as long as they are.
    prose = re.sub(r"^```.*?^```$|!\[.*?\)", "", page.text, flags=re.DOTALL | re.MULTILINE)
    assert [line for line in prose.splitlines() if len(line) > 82 and not line.startswith("|")] == []


def test_every_picture_stands_on_a_page() -> None:
    assert set(PICTURES) == {picture for page in PAGES for _, picture in page.pictures}


def test_names_orders_and_links_fit_together() -> None:
    assert len({(page.part, page.order) for page in PAGES}) == len(PAGES)
    places = {(page.part, page.name) for page in pages()}
    assert len({name for _, name in places}) == len(places)
    for page in PAGES:
        links = re.findall(r"\]\((?:\.\./([\w-]+)/)?([\w-]+)\.md\)", page.text)
        assert {(part or page.part, name) for part, name in links} <= places, page.name


def test_a_caption_says_the_figures_that_its_picture_was_drawn_with() -> None:
    for page in PAGES:
        for words, picture in page.pictures:
            said = f"{page.name}: python -m benchmarks.guide --draw {picture}"
            # One that says none is not out of date.
            assert figures_in(words) in ([], figures_of(picture_bytes(picture))), said
