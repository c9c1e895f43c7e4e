"""Words that the glossary replaces are counted in text and in names, and so are names that two classes share."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.parts.house_tree import House
from benchmarks.parts.house_words import CONTRIBUTING, retired, said, shared_names


@pytest.fixture
def house(tmp_path: Path) -> House:
    """A package of two modules with a glossary."""
    package, contributing = tmp_path / "geoprint", tmp_path / CONTRIBUTING
    for folder in (package, contributing.parent):
        folder.mkdir(parents=True)
    (package / "travel.py").write_text("# Way, anyway, always.\nclass WayBack: ...\ntip_way = 1\n", encoding="utf-8")
    (package / "corners.py").write_text("# A waypoint, away.\nclass WayBack: ...\n", encoding="utf-8")
    contributing.write_text("| say | not |\n|---|---|\n| path | `way`, `ways` |\n\nMore.\n", encoding="utf-8")
    return House(tmp_path)


def test_words_come_from_the_glossary(house: House) -> None:
    assert retired(house) == [("way", "path"), ("ways", "path")]


def test_a_word_is_counted_in_text_and_in_names_and_not_within_other_words(house: House) -> None:
    assert said(house, "way") == {"geoprint.travel": 3, "geoprint.corners": 1}
    assert said(house, "ways") == {}


def test_names_of_two_classes_are_found(house: House) -> None:
    assert list(shared_names(house)) == ["WayBack is a class of geoprint.corners and of geoprint.travel"]


def test_the_glossary_of_the_project_is_read() -> None:
    assert {"told", "laid", "mend"} <= {word for word, _ in retired(House())}
