"""Options of a job's keys come from its fields: a new key is one edit."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from geoprint.cli.options import Keys, takes
from geoprint.config import Job, job_file_text, job_of
from geoprint.config.strict import Key
from geoprint.errors import UsageError


class LongerJob(Job):
    """A job with one key more."""

    colour: Annotated[str, Key("Colour of the ink.", "# of the ink", group="paths", record="colour_name")] = "red"


def said(*arguments: str, model: type[Job] = Job) -> Keys:
    """Return what a command with every key hears of a command line."""
    heard: list[Keys] = []

    @takes(model=model)
    def command(*, keys: Keys) -> None:
        """Listen."""
        heard.append(keys)

    app = typer.Typer()
    app.command()(command)
    done = CliRunner().invoke(app, [*arguments])
    if isinstance(done.exception, UsageError):
        raise done.exception
    assert done.exit_code == 0, done.output
    return heard[0]


def test_a_new_field_of_the_job_is_an_option_a_line_of_the_job_file_and_a_setting() -> None:
    @takes(model=LongerJob)
    def command(*, keys: Keys) -> None:
        """Say nothing."""

    assert "colour" in inspect.signature(command).parameters
    app = typer.Typer(rich_markup_mode=None)
    app.command()(command)
    shown = CliRunner().invoke(app, ["--help"]).output
    assert "--colour" in shown
    assert "Colour of the ink.  [default: red]" in shown
    assert said("--colour", "blue", model=LongerJob) == {"colour": "blue"}
    assert '\n# colour = "red"            # of the ink\n' in job_file_text(LongerJob)
    assert LongerJob(surface=Path("a.ply")).settings()["colour_name"] == "red"


def test_what_is_not_given_is_not_said() -> None:
    assert said() == {}
    assert said("--no-flip", "--robot") == {"flip": False, "robot": True}


def test_the_options_of_a_patch_are_one_patch(tmp_path: Path) -> None:
    curve = tmp_path / "curve.csv"
    curve.write_text("x,y,z\n0,0,0\n1,0,0\n0,1,0\n")
    assert said("--at", "1", "2", "3", "--cone", "20", "--curve", str(curve)) == {
        "patches": [{"at": [1.0, 2.0, 3.0], "cone_deg": 20.0, "curve": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}]
    }


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("500", 500), ("0.5", 0.5), ("true", True), ('"a b"', "a b"), ("fine", "fine"), ("a=b", "a=b"), ("", ""),
    ],
)  # fmt: skip
def test_options_of_a_backend_are_values_of_toml_or_bare_words(text: str, value: object) -> None:
    assert said("--option", f"lscm.resolution={text}", "--option", "heat.steps=2") == {
        "options": {"lscm": {"resolution": value}, "heat": {"steps": 2}}
    }


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("lscm.resolution", "lacks a '='"),
        ("resolution=500", "lacks a dot"),
        (".resolution=500", "lacks a dot"),
        ("lscm.=500", "lacks a dot"),
        ("lscm.resolution=[1]", "is no number, true, false or text"),
    ],
)
def test_an_option_without_dot_sign_or_plain_value_is_refused(text: str, complaint: str) -> None:
    with pytest.raises(UsageError, match=complaint):
        said("--option", text)


def test_options_join_those_of_the_job_file_and_are_told_only_where_given(tmp_path: Path) -> None:
    path = tmp_path / "job.toml"
    path.write_text('surface = "a.ply"\n[options.lscm]\nresolution = 500\nkept = true\n')
    job = job_of(surface=path, options={"lscm": {"resolution": 300}, "heat": {"steps": 2}})
    assert job.options == {"lscm": {"resolution": 300, "kept": True}, "heat": {"steps": 2}}
    assert job.settings()["options"] == job.options
    assert "options" not in Job(surface=Path("a.ply")).settings()


def test_settings_are_named_with_their_units_in_their_order() -> None:
    assert list(Job(surface=Path("a.ply")).settings()) == [
        "backend", "middle", "spacing_mm", "resolution", "rounds", "source", "flip", "label", "patches",
        "fill_holes_mm", "cell", "place", "max_tilt_deg", "on_slowdown", "robot",
    ]  # fmt: skip


def test_a_job_that_accepts_any_flow_says_so_and_its_speed_is_that_of_the_print() -> None:
    usual, accepting = Job(surface=Path("a.ply")), Job(surface=Path("a.ply"), speed=15.0, accept_flow=True)
    assert accepting.settings() == {**usual.settings(), "accept_flow": True}
