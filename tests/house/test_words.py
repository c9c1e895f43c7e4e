"""One word, one thing: what CONTRIBUTING retires stands nowhere in the package, and no two classes share a name."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.parts.house_tree import House
from benchmarks.parts.house_words import CONTRIBUTING, Retired, offences, retired

WAY = Retired("way", ["shortest way", "way over the surface"], ["quality/oracle/"])


@pytest.mark.parametrize(
    "line", ["on the way home", "class WayBack:", "tip_way = 1", "# By the way.", "the shortest way, and the way back"]
)
def test_a_retired_word_is_found_in_text_and_names(line: str) -> None:
    assert WAY.found(line)


@pytest.mark.parametrize(
    "line", ["the shortest way", "A way over the surface.", "always", "waypoint", "away", "Away", "Wayne"]
)
def test_it_is_not_found_in_other_words_and_where_it_stays(line: str) -> None:
    assert not WAY.found(line)


def test_offences_are_found_room_by_room(tmp_path: Path) -> None:
    package, contributing = tmp_path / "geoprint", tmp_path / CONTRIBUTING
    for folder in (package / "paths", package / "quality" / "oracle", contributing.parent):
        folder.mkdir(parents=True)
    for door in (package, package / "paths", package / "quality", package / "quality" / "oracle"):
        (door / "__init__.py").touch()
    (package / "paths" / "travel.py").write_text(
        "# The shortest\n# way, or a way.\nclass Piece: ...\n", encoding="utf-8"
    )
    (package / "paths" / "corners.py").write_text("# The shortest\n# way.\nclass Piece: ...\n", encoding="utf-8")
    (package / "quality" / "oracle" / "tracing.py").write_text("# A way.\n", encoding="utf-8")
    contributing.write_text(
        "| retired | say | stays in |\n|---|---|---|\n| `way` | path | `shortest way`, `quality/oracle/` |\n\nMore.\n",
        encoding="utf-8",
    )
    (tmp_path / "pyproject.toml").write_text(
        '[[tool.importlinter.contracts]]\ntype = "layers"\ncontainers = ["geoprint"]\nlayers = ["quality | paths"]\n'
        '[[tool.importlinter.contracts]]\ntype = "layers"\ncontainers = ["geoprint.quality"]\nlayers = ["oracle"]\n',
        encoding="utf-8",
    )

    assert list(offences(House(tmp_path))) == [
        "geoprint/paths/travel.py:2: `way`: # way, or a way.",
        "Piece is a class of geoprint.paths.corners and of geoprint.paths.travel",
    ]


def test_contributing_retires_these_words() -> None:
    assert {"way", "ways", "see there"} <= {each.word for each in retired(House())}
