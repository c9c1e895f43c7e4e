"""A tree of known size is measured right; words that the glossary replaces are counted in text and in names."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.code_base import CONTRIBUTING, CodeBase, sizes

CORNERS = '''"""Where paths turn."""

from __future__ import annotations

import math


class WayBack:
    """A waypoint, away."""

    def angle(self) -> float:
        """Return it."""
        # As anybody would.
        return math.tau
'''


@pytest.fixture
def code_base(tmp_path: Path) -> CodeBase:
    """A package with a glossary, of which two modules lead to the core and one is optional."""
    files = {
        "geoprint/__init__.py": "from geoprint.workflow import plan as plan, view as view\n",
        "geoprint/workflow/__init__.py": (
            "from geoprint.workflow.planning import plan as plan\nfrom geoprint.travel import view as view\n"
        ),
        "geoprint/workflow/planning.py": "def plan():\n    import geoprint.corners\n    from geoprint import corners\n",
        "geoprint/travel.py": "# Way, anyway, always.\nclass WayBack: ...\ntip_way = 1\n",
        "geoprint/corners.py": CORNERS,
        "tests/test_all.py": "assert True\n",
        "benchmarks/all.py": "assert True\n",
        CONTRIBUTING: "| say | not |\n|---|---|\n| path | `way`, `ways` |\n\nMore.\n",
        "pyproject.toml": "[tool.importlinter]\ncontracts = []\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return CodeBase(tmp_path)


def test_a_tree_is_measured_and_its_core_followed(code_base: CodeBase) -> None:
    assert sizes(code_base) == {
        "geoprint": {
            "modules": 5, "folders": 2, "code lines": 13, "lines": 23, "classes": 2,
            "imports [% of code]": pytest.approx(700 / 13), "longest function": 4, "core lines": 8,
        },
        "tests": {
            "modules": 1, "folders": 1, "code lines": 1, "lines": 1, "classes": 0,
            "imports [% of code]": 0, "longest function": 0,
        },
        "benchmarks": {
            "modules": 1, "folders": 1, "code lines": 1, "lines": 1, "classes": 0,
            "imports [% of code]": 0, "longest function": 0,
        },
    }  # fmt: skip


def test_words_come_from_the_glossary(code_base: CodeBase) -> None:
    assert code_base.retired_words() == [("way", "path"), ("ways", "path")]


def test_a_word_is_counted_in_text_and_in_names_and_not_within_other_words(code_base: CodeBase) -> None:
    assert code_base.count_word("way") == {"geoprint.travel": 3, "geoprint.corners": 1}
    assert code_base.count_word("ways") == {}


def test_names_of_two_classes_are_found(code_base: CodeBase) -> None:
    assert list(code_base.shared_names()) == ["WayBack is a class of geoprint.corners and of geoprint.travel"]


def test_the_glossary_of_the_project_is_read() -> None:
    assert {"told", "laid", "mend"} <= {word for word, _ in CodeBase().retired_words()}
