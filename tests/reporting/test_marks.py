"""What a person should mind stands in the order of its weight, each thing once and marked by a word."""

from __future__ import annotations

from geoprint.reporting.cautions import said_once
from geoprint.reporting.tables import marked_lines


def test_warnings_come_before_notes_and_what_was_not_checked_is_counted_until_asked_for() -> None:
    def said(*, verbose: bool) -> list[str]:
        return marked_lines(
            warnings=["act", "act", "soon"], notes=["know"], not_checked=["lamp", "cables", "lamp"], verbose=verbose
        )

    first = ["warning: act", "warning: soon", "note: know"]
    assert said(verbose=False) == [*first, "not checked: 2 things; `--verbose` lists them"]
    assert said(verbose=True) == [*first, "not checked: lamp", "not checked: cables"]
    assert marked_lines(not_checked=["lamp"]) == ["not checked: 1 thing; `--verbose` lists them"]
    assert marked_lines() == []


def test_what_holds_for_every_backend_is_said_once_and_the_rest_names_whose_it_is() -> None:
    said = {"heat": ["dry only", "slow"], "lscm": ["dry only"], "other": ["dry only", "slow"]}
    assert said_once(said) == ["dry only", "heat, other: slow"]
    assert said_once({"heat": ["slow"]}) == ["slow"]
