"""Every page of the guide says what a page has to say, and what it tells people to run runs."""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path

import pytest

from benchmarks.guide.pictures import PICTURES
from geoprint import cli
from geoprint.distance import registry
from geoprint.guide import Page, page_named, pages, picture_bytes
from tests.guide.here import working_here

ROOT = Path(__file__).parents[2]
PAGES = [page for page in pages() if not page.is_generated]
# Pages that go on with what another one has written, behind that one.
GO_ON = {"your-cell": ("calibrate", "fine-lines", "controller", "checks", "simulate")}
# Largest picture [bytes], and most lines of a page: two screens and its tables.
LARGEST, LONGEST = 120_000, 120


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where all pages run, one after another, as somebody does who reads them in a clone."""
    found = tmp_path_factory.mktemp("guide")
    (found / "data").symlink_to(ROOT / "data")
    return found


def commands(text: str) -> list[str]:
    """Return the lines of a block; what ends in a backslash goes on in the next."""
    return text.replace("\\\n", " ").splitlines()


def run(line: str, monkeypatch: pytest.MonkeyPatch) -> int:
    """Run a line of a page and return its status."""
    if not line.startswith("geoprint "):
        return subprocess.run(["/bin/bash", "-c", line], check=False).returncode
    monkeypatch.setattr("sys.argv", shlex.split(line))
    with pytest.raises(SystemExit) as ended:
        cli.main()
    return int(ended.value.code or 0)


def begun() -> list[Page]:
    """Return the pages that go on with no other."""
    return [page for page in PAGES if not any(page.name in others for others in GO_ON.values())]


@pytest.mark.parametrize("page", begun(), ids=lambda page: page.name)
def test_its_blocks_run_in_order_and_so_do_those_of_pages_that_go_on_with_it(
    page: Page, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    # Of the poses of a camera that are tried fewer are enough here.
    monkeypatch.setattr("geoprint.inspection.outline_pose.COARSE", 40)
    monkeypatch.setattr("geoprint.inspection.outline_pose.FINE", 6)
    with working_here():
        for each in (page, *map(page_named, GO_ON.get(page.name, ()))):
            run_blocks(each, folder, monkeypatch, capsys)


def run_blocks(page: Page, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Write the files of a page, and run its Python blocks and its commands."""
    # What a page registers is gone when it ends.
    monkeypatch.setattr(registry._KNOWN, "_own", dict(registry._KNOWN._own))  # pyright: ignore[reportPrivateUsage]
    names: dict[str, object] = {"__name__": "__main__"}
    printed = ""
    for block in page.blocks:
        if block.word and block.word != "refused":
            (folder / block.word).write_text(block.text, encoding="utf-8")
        if block.language == "python":
            capsys.readouterr()
            exec(compile(block.text, f"{page.name}.md", "exec"), names)  # noqa: S102  (our own text)
            printed = capsys.readouterr().out
        if block.language == "output":
            assert block.text == printed, f"{page.name}: what it says is printed is not"
        for line in commands(block.text) if block.language == "sh" else []:
            status = run(line, monkeypatch)
            expected = (2, 3, 4) if block.word == "refused" else (0,)
            assert status in expected, f"{page.name}: {line}\n{capsys.readouterr().err}"


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
    assert len(page.text.splitlines()) <= LONGEST
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


def test_no_caption_quotes_a_figure() -> None:
    # They would be older than what the commands print some day: figures stand in blocks that are compared with it.
    for page in PAGES:
        captions = re.findall(r"!\[([^\]]*)\]", page.text)
        assert not [caption for caption in captions if re.search(r"\d\s*%", caption)], page.name
