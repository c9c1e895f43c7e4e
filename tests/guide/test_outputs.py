"""What a page quotes of its commands is found to be old where anything of it changes, and is renewed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from geoprint.guide import Block, Page, page_named
from tests.guide.outputs import WIDTH, Ran, is_quoted, ran, renewed, with_outputs

PRINTED = """\
patch.ply, paths 2 mm apart

backend  thickness CV     once
------------------------------
lscm            5.62 %   98.23 %
heat            0.91 %  100.00 %

heat covers patch.ply best: 0.0 % of the area is missed or covered twice (lscm
  1.8 %).
written: comparison
"""
QUOTED = """\
...
backend  thickness CV     once
------------------------------
lscm            5.62 %   98.23 %
heat            0.91 %  100.00 %
...
heat covers patch.ply best: 0.0 % of the area is missed or covered twice (lscm
  1.8 %).
...
"""


def lines(text: str) -> list[str]:
    """Return the lines of a text, each with those in which it goes on below itself."""
    return re.findall(r".*\n(?:  .*\n)*", text)


def page_of(text: str) -> Page:
    return replace(page_named("glossary"), name="some", read=lambda: text)


def printed_by(text: str, folder: Path) -> Sequence[Ran]:
    return ran(page_of(text), folder)


def test_lines_are_quoted_in_their_order_and_what_is_left_out_is_marked() -> None:
    assert is_quoted(PRINTED, PRINTED)
    assert is_quoted(QUOTED, PRINTED)
    assert is_quoted("...\n", PRINTED)
    assert not is_quoted(QUOTED.removeprefix("...\n"), PRINTED)
    assert not is_quoted(QUOTED.removesuffix("...\n"), PRINTED)
    assert not is_quoted("...\nheat            0.91 %  100.00 %\nlscm            5.62 %   98.23 %\n...\n", PRINTED)


@pytest.mark.parametrize(
    ("old", "new"),
    [("5.62 %", "5.63 %"), ("0.91 %", "0.9 %"), ("1.8 %)", "1.9 %)"), ("best", "worst"), ("thickness CV", "CV of it")],
)
def test_an_output_that_changed_is_found_and_renewed(old: str, new: str) -> None:
    changed = PRINTED.replace(old, new)
    assert not is_quoted(QUOTED, changed)
    if new[0].isdigit():
        assert renewed(QUOTED, lines(changed)) == QUOTED.replace(old, new)


def test_a_line_that_is_printed_no_more_is_chosen_by_hand() -> None:
    with pytest.raises(ValueError, match=r"no line is printed like this one:\nheat +0\.91 %"):
        renewed(QUOTED, lines(PRINTED.replace("heat     ", "marching ")))


def test_a_sentence_that_takes_more_or_fewer_lines_is_quoted_whole() -> None:
    longer = PRINTED.replace("(lscm\n  1.8 %)", "(lscm\n  1.8 %, with holes\n  of 12 mm2)")
    found = renewed(QUOTED, lines(longer))
    assert is_quoted(found, longer)
    assert "  of 12 mm2" in found
    assert renewed(found, lines(PRINTED)) == QUOTED


def test_results_notes_and_refusals_are_quoted_as_a_terminal_shows_them(tmp_path: Path) -> None:
    text = "```sh\necho one; echo two >&2\n```\n\n```output\none\n...\n```\n\n```python\nprint(3)\n```\n"
    shell, python, refused = printed_by(f"{text}\n```sh refused\ngeoprint guide 000\n```\n", tmp_path)
    assert (shell.printed, shell.quoted, shell.needs) == (["one\n", "two\n"], "one\n...\n", False)
    assert (python.printed, python.quoted, python.needs) == (["3\n"], None, True)
    (refusal,) = refused.printed
    assert refusal.startswith("geoprint: the guide has no page `000`; choose one of: ")
    assert 20 < max(map(len, refusal.splitlines())) <= WIDTH
    assert (refused.quoted, refused.needs) == (None, True)


def test_a_command_that_ends_otherwise_is_found(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="some: geoprint guide 000\nended with 2:\n"):
        printed_by("```sh\ngeoprint guide 000\n```\n", tmp_path)
    with pytest.raises(RuntimeError, match="ended with 0:"):
        printed_by("```sh refused\ntrue\n```\n", tmp_path)


def test_a_page_gets_what_it_lacks_and_figures_of_today() -> None:
    text = "Before.\n\n```sh\na\n```\n\n```output\nmm: 1.5\n...\n```\n\nBetween.\n\n```sh\nb\n```\n\nBehind.\n"
    blocks = [
        Ran(Block("sh", "", "a\n"), ["mm: 2.5\n", "more\n"], needs=True, quoted="mm: 1.5\n...\n"),
        Ran(Block("sh", "", "b\n"), ["all\n", "of it\n"], needs=True, quoted=None),
    ]
    wanted = text.replace("1.5", "2.5").replace("b\n```\n", "b\n```\n\n```output\nall\nof it\n```\n")
    assert with_outputs(text, blocks) == wanted
