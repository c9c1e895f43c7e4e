"""A cell file that is edited keeps everything else, and appears verified or not at all."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomlkit
from hypothesis import given, settings, strategies as st

from geoprint.config import PACKAGED_CELLS, TILTING_CELL, packaged_cell_text
from geoprint.errors import ExportError, UsageError, VerificationError
from geoprint.workflow.calibrating import edited, write_cell


@pytest.mark.parametrize("name", [*PACKAGED_CELLS, TILTING_CELL])
def test_an_edited_cell_keeps_every_line_but_those_of_its_keys(name: str) -> None:
    text = packaged_cell_text(name)
    values = {"source": "calibrated", "model_mm": [[1.0, 2.0, 3.0]], "touched_mm": [[1.5, 2.0, -0.0]], "noise_mm": None}
    result = edited(text, table="work", values=values, name=name)
    before, after = text.splitlines(), result.splitlines()
    assert [line for line in before if line not in after] == ['source = "demo"']
    added = [line for line in after if line not in before]
    assert added == ['source = "calibrated"', "model_mm = [[1, 2, 3]]", "touched_mm = [[1.5, 2, 0]]"]


def test_comments_behind_values_and_lists_over_several_lines_are_handled() -> None:
    text = (
        '[a]\nwork = "[work]"  # not here\ntext = """\n[work]\nmodel_mm = 1\n"""\n'
        '[work] # "here"\nsource = "a # b"   # why\nmodel_mm = [ # old\n  [1, 2, 3], # first\n] # end\n'
        "noise_mm = 1 # gone\n\n# of the next table\n[b]\nlast = 1"
    )
    values = {"source": "x", "model_mm": [[4.0, 5.0, 6.0]], "noise_mm": None, "new": 0.5}
    assert edited(text, table="work", values=values, name="t") == (
        '[a]\nwork = "[work]"  # not here\ntext = """\n[work]\nmodel_mm = 1\n"""\n'
        '[work] # "here"\nsource = "x"   # why\nmodel_mm = [[4, 5, 6]] # end\nnew = 0.5\n'
        "\n# of the next table\n[b]\nlast = 1"
    )


def test_line_ends_of_windows_stay_and_an_empty_last_table_can_be_filled() -> None:
    assert edited("[a]\r\nb = 1\r\n[work]", table="work", values={"c": 2.0}, name="t") == (
        "[a]\r\nb = 1\r\n[work]\r\nc = 2\r\n"
    )


@pytest.mark.parametrize("text", ["work.source = 'a'", "work = { source = 'a' }", "[a]\nb = 1", "[work.deep]\na = 1"])
def test_a_table_without_a_header_of_its_own_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match=r"has no table \[work\]"):
        edited(text, table="work", values={"source": "x"}, name="t")


def test_a_dotted_key_is_replaced_with_its_neighbours() -> None:
    text = "[work]\na.b = 1\nkept = 2\na.c = 3\n"
    assert edited(text, table="work", values={"a": 1.0}, name="t") == "[work]\nkept = 2\na = 1\n"


def test_new_keys_stand_before_the_tables_within_a_table() -> None:
    text = "[work]\nb = 1\n\n# of the inner one\n[work.deep]\nc = 1\n"
    found = tomllib.loads(edited(text, table="work", values={"new": 2.0}, name="t"))
    assert found == {"work": {"b": 1, "new": 2, "deep": {"c": 1}}}


def test_an_edit_that_would_change_anything_else_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def spoil(text: str) -> tomlkit.TOMLDocument:
        return tomlkit.loads(text.replace("b = 1", "b = 2"))

    monkeypatch.setattr(tomlkit, "parse", spoil)
    with pytest.raises(UsageError, match="in a form that cannot be edited alone"):
        edited("[a]\nb = 1\n[work]\n", table="work", values={"a": 1.0}, name="t")


def test_a_list_too_long_for_a_line_has_an_entry_a_line() -> None:
    points = [[100.0 + number, 20.5, -0.00001] for number in range(8)]
    result = edited("[work]\r\na = 1\r\n", table="work", values={"points": points}, name="t")
    assert result.startswith("[work]\r\na = 1\r\npoints = [\r\n  [100, 20.5, 0],\r\n  [101, 20.5, 0],\r\n")
    assert result.endswith("  [107, 20.5, 0],\r\n]\r\n")


# What ends a string, a list or a comment in TOML, or a line in Python but not in TOML.
plain = st.text("ab#\"'\\[]=,\u2028\x85é\U00010000", max_size=8)


@settings(max_examples=40, deadline=None)
@given(plain, plain, st.lists(st.lists(st.floats(-1e4, 1e4), min_size=3, max_size=3), max_size=9))
def test_whatever_is_written_is_what_is_read(comment: str, source: str, points: list[list[float]]) -> None:
    text = f'# {comment}\n[work]\nsource = "demo" # {comment}\nkept = [1, # {comment}\n2]\n'
    found = tomllib.loads(edited(text, table="work", values={"source": source, "model_mm": points}, name="t"))
    assert found["work"]["source"] == source
    assert found["work"]["kept"] == [1, 2]
    np.testing.assert_allclose(found["work"]["model_mm"], points, atol=1e-4)


def accepted(_: Path) -> None:
    """Find nothing wrong with a written file."""


def test_a_file_appears_verified_or_not_at_all(tmp_path: Path) -> None:
    out = tmp_path / "new.toml"

    def fail(_: Path) -> None:
        raise VerificationError("no")

    with pytest.raises(VerificationError):
        write_cell(out, "a = 1\n", overwrite=False, verify=fail)
    assert list(tmp_path.iterdir()) == []
    write_cell(out, "a = 1\r\n", overwrite=False, verify=accepted)
    with pytest.raises(UsageError, match="--overwrite"):
        write_cell(out, "a = 2\n", overwrite=False, verify=accepted)
    assert out.read_bytes() == b"a = 1\r\n"
    write_cell(out, "a = 2\n", overwrite=True, verify=accepted)
    assert [path.name for path in tmp_path.iterdir()] == ["new.toml"]
    assert out.read_bytes() == b"a = 2\n"
    with pytest.raises(UsageError, match="is a folder"):
        write_cell(tmp_path, "a = 2\n", overwrite=True, verify=accepted)
    with pytest.raises(ExportError, match="is no folder"):
        write_cell(tmp_path / "absent" / "new.toml", "a = 2\n", overwrite=True, verify=accepted)


def test_a_file_that_somebody_else_wrote_meanwhile_is_kept(tmp_path: Path) -> None:
    out = tmp_path / "new.toml"

    def meanwhile(_: Path) -> None:
        out.write_text("theirs")

    with pytest.raises(ExportError, match=r"cannot write .*new\.toml"):
        write_cell(out, "mine", overwrite=False, verify=meanwhile)
    assert out.read_text() == "theirs"
    assert [path.name for path in tmp_path.iterdir()] == ["new.toml"]
