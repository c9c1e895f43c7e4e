"""The pictures of the guide are drawn with what they say they are, and what has changed since is found."""

from __future__ import annotations

import io
import re
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image

from benchmarks import DATA
from benchmarks.guide import surfaces
from benchmarks.guide.__main__ import captioned, main
from benchmarks.guide.pictures import PICTURES
from benchmarks.guide.stamps import (
    FIGURES,
    MADE_FROM,
    Inputs,
    figures_in,
    figures_of,
    made_from,
    source_of,
    stamped,
    texts_of,
    with_figures,
)
from benchmarks.paths.uniformity import KEPT
from geoprint.guide import Page, page_named, picture_bytes
from tests.guide.test_pages import OF_COMMANDS

# Those whose figures no command of a page prints; three prints of the paper take ten times as long as the others.
NOT_AGAIN = {*OF_COMMANDS, "paper.png"}
DRAWN = [name for name in PICTURES if figures_of(picture_bytes(name)) and name not in NOT_AGAIN]


@pytest.mark.parametrize("name", PICTURES)
def test_it_was_made_from_what_is_here(name: str) -> None:
    found = texts_of(picture_bytes(name)).get(MADE_FROM)
    assert found == made_from(PICTURES[name]), f"older than what it shows: python -m benchmarks.guide --draw {name}"


@pytest.mark.parametrize("name", DRAWN)
def test_it_shows_the_figures_of_today(name: str) -> None:
    drawn = figures_of(PICTURES[name](DATA))
    assert drawn == figures_of(picture_bytes(name)), f"python -m benchmarks.guide --draw {name}"


def test_a_picture_keeps_what_it_was_made_from_and_looks_as_before() -> None:
    drawn = io.BytesIO()
    Image.linear_gradient("L").save(drawn, format="png")
    marked = stamped(with_figures(drawn.getvalue(), ["1.5", "12"]), MADE_FROM, "12ab")
    assert texts_of(marked) == {MADE_FROM: "12ab", FIGURES: "1.5 12"}
    assert figures_of(marked) == ["1.5", "12"]
    assert figures_of(drawn.getvalue()) == []
    assert Image.open(io.BytesIO(marked)).tobytes() == Image.open(drawn).tobytes()


def old_pictures(before: Mapping[str, str]) -> set[str]:
    """Return the pictures whose inputs are others than before."""
    return {name for name, drawing in PICTURES.items() if made_from(drawing) != before[name]}


@pytest.fixture(scope="module")
def before() -> Mapping[str, str]:
    return {name: made_from(drawing) for name, drawing in PICTURES.items()}


@pytest.mark.parametrize(
    ("written", "instead", "old"),
    [
        ("TIP = [1.5, 0.0, -57.5]", "TIP = [1.5, 0.0, -57.4]", {"your-part.png", "several-patches.png"}),
        ('set_title("the patch on its body"', 'set_title("a patch"', {"your-part.png"}),
        ('"""Draw a heart with a patch, and', '"""Draw a heart, and', set[str]()),
        ("import re\n", "import re\nimport os\n", set[str]()),
    ],
)
def test_a_statement_that_changed_makes_the_pictures_old_that_it_draws(
    written: str, instead: str, old: set[str], before: Mapping[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def edited(module: str) -> str:
        source = source_of(module)
        return source.replace(written, instead) if module == surfaces.__name__ else source

    assert written in source_of(surfaces.__name__)
    monkeypatch.setattr("benchmarks.guide.stamps.source_of", edited)
    assert old_pictures(before) == old


def test_a_file_that_changed_makes_the_pictures_old_that_show_it(
    before: Mapping[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copied = Path(shutil.copytree(DATA, tmp_path / "data"))
    monkeypatch.setattr("benchmarks.guide.stamps.DATA", copied)
    assert old_pictures(before) == set()
    with (copied / "heart.ply").open("ab") as file:
        file.write(b"\n")
    assert old_pictures(before) == {"your-part.png", "several-patches.png", "paper.png"}


def test_a_block_that_changed_makes_the_pictures_old_that_are_made_of_it(
    before: Mapping[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def edited(name: str) -> Page:
        page = page_named(name)
        return replace(page, read=lambda: page.text.replace(*change))

    monkeypatch.setattr("benchmarks.guide.stamps.page_named", edited)
    change = ("-19,-7.0,0,2", "-19,-6.0,0,2")
    assert old_pictures(before) == {"measure.png"}
    change = ("independent of how a path is cut", "blind to how a path is cut")
    assert old_pictures(before) == set()


def test_the_figures_that_are_kept_are_inputs() -> None:
    inputs = Inputs()
    inputs.follow("benchmarks.guide.pictures", "evenness")
    assert KEPT in inputs.files
    assert "benchmarks.paths.uniformity.picture" in inputs.texts


def test_a_caption_that_is_off_by_one_digit_is_found_and_gets_the_figures_of_its_picture(
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = "![Rings: heat {} %, lscm {} % of 2\nspacings](../pictures/rings.png)\n\n![3 more](../pictures/more.png)\n"
    figures = ["0.9", "5.6", "2"]
    right, wrong = text.format("0.9", "5.6"), text.format("0.9", "5.7")
    caption = re.compile(r"!\[(.*?)\]", re.DOTALL)
    assert figures_in(caption.findall(right)[0]) == figures
    assert figures_in(caption.findall(wrong)[0]) != figures
    assert captioned(wrong, "rings.png", figures) == right
    assert captioned(wrong, "rings.png", figures[:2]) == wrong
    assert capsys.readouterr().out == "say in the caption of rings.png, in this order: 0.9 5.6\n"


def test_the_smoke_run_draws_a_picture_and_writes_the_guide(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["guide", "--smoke"])
    main()
    picture, guide = (int(line.split()[-2]) for line in capsys.readouterr().out.splitlines())
    assert 3_000 < picture < 30_000
    assert 500_000 < guide < 4_000_000
