"""Options of a job's keys come from its fields: a new key is one edit."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from geoprint.cli.options import Keys, job_asked, takes
from geoprint.config import Job, job_file_text, job_of
from geoprint.config.strict import Key
from geoprint.errors import UsageError


class LongerJob(Job):
    """A job with one key more."""

    colour: Annotated[str, Key("Colour of the ink.", "# of the ink", group="paths", record="colour_name")] = "red"


def said(*arguments: str, model: type[Job] = Job, rare: bool = False) -> Keys:
    """Return what a command with every key hears of a command line."""
    heard: list[Keys] = []

    @takes(model=model, rare=rare)
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
    assert said("--flip", "--no-robot") == {"flip": True, "robot": False}


def test_the_options_of_a_patch_are_one_patch(tmp_path: Path) -> None:
    curve = tmp_path / "curve.csv"
    curve.write_text("x,y,z\n0,0,0\n1,0,0\n0,1,0\n")
    assert said("--at", "1", "2", "3", "--cone", "20", "--curve", str(curve), rare=True) == {
        "patches": [{"at": [1.0, 2.0, 3.0], "cone_deg": 20.0, "curve": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}]
    }


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("500", 500), ("0.5", 0.5), ("true", True), ('"a b"', "a b"), ("fine", "fine"), ("a=b", "a=b"),
        ("[1, 2]", [1, 2]), ("1\nb = 2", "1\nb = 2"),
    ],
)  # fmt: skip
def test_a_setting_is_a_value_of_toml_or_a_bare_word(text: str, value: object) -> None:
    assert said("--set", f"options.lscm.resolution={text}", "--set", "max_tilt=2") == {
        "settings": [(("options", "lscm", "resolution"), value), (("max_tilt",), 2)]
    }


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("tilt=3", "no key `tilt`; did you mean `max_tilt`"),
        ("cone=3", r"did you mean `patches\.1\.cone_deg`"),
        ("resolution=500", r"did you mean `options\.lscm\.resolution`"),
        ("qqq=1", "no key `qqq`. `geoprint init` writes"),
        ("options.lscm.resolution", "has no value: write it as"),
        ("max_tilt=", "has no value"),
        ("options..resolution=3", "no key"),
        ("=3", "no key ``"),
    ],
)
def test_a_setting_of_no_key_or_without_a_value_is_refused(text: str, complaint: str) -> None:
    with pytest.raises(UsageError, match=complaint):
        said("--set", text)


def test_settings_reach_into_tables_and_lists_of_the_job_file(tmp_path: Path) -> None:
    path = tmp_path / "job.toml"
    path.write_text(
        'surface = "a.ply"\nmax_tilt = 3\n[[patches]]\nat = [0, 0, 0]\nradius = 2\n'
        "[[patches]]\nat = [9, 0, 0]\nradius = 2\n"
    )
    asked = said("--set", "patches.2.radius=5", "--set", "options.lscm.resolution=300", "--set", "options.longest")
    job = job_asked(path, {**asked, "unit": "mm"})
    assert [patch.radius for patch in job.patches] == [2.0, 5.0]
    assert job.options == {"lscm": {"resolution": 300}, "longest": {}}
    assert job_asked(path, said("--set", "max_tilt=5")).max_tilt == 5.0
    cut = job_asked(Path("a.ply"), said("--at", "0", "0", "0", "--set", "patches.1.cone_deg=20"))
    assert (cut.patches[0].at, cut.patches[0].cone_deg) == ([0.0, 0.0, 0.0], 20.0)


@pytest.mark.parametrize(
    ("texts", "complaint"),
    [
        (["max_tilt=99"], "^`--set max_tilt`: it must be at most 45, found 99"),
        (
            ["patches.1.cone_deg=200", "patches.1.at=[0, 0, 0]"],
            r"^`--set patches\.1\.cone_deg`: it must be less than 180",
        ),
        (["patches.3.radius=2"], "names item 3 of a list of 0"),
        (["spacing=-1"], "^`--spacing`: it must be at least 0.001"),
    ],
)
def test_a_setting_is_checked_as_the_key_of_a_job_file_is(texts: list[str], complaint: str) -> None:
    with pytest.raises(UsageError, match=complaint):
        job_asked(Path("a.ply"), said(*(word for text in texts for word in ("--set", text))))


def test_what_an_option_says_a_setting_does_not_say_again() -> None:
    with pytest.raises(UsageError, match="`spacing` is given twice"):
        job_asked(Path("a.ply"), said("--spacing", "2", "--set", "spacing=3"))


def test_options_join_those_of_the_job_file_and_are_told_only_where_given(tmp_path: Path) -> None:
    path = tmp_path / "job.toml"
    path.write_text('surface = "a.ply"\n[options.lscm]\nresolution = 500\nkept = true\n')
    job = job_of(surface=path, options={"lscm": {"resolution": 300}, "heat": {"steps": 2}})
    assert job.options == {"lscm": {"resolution": 300, "kept": True}, "heat": {"steps": 2}}
    assert job.settings()["options"] == job.options
    assert "options" not in Job(surface=Path("a.ply")).settings()


def test_settings_are_named_with_their_units_in_their_order() -> None:
    assert list(Job(surface=Path("a.ply")).settings()) == [
        "backend", "middle", "spacing_mm", "rounds", "source", "flip", "label", "patches",
        "fill_holes_mm", "cell", "place", "max_tilt_deg", "on_slowdown", "robot",
    ]  # fmt: skip


def test_a_job_that_accepts_any_flow_says_so_and_its_speed_is_that_of_the_print() -> None:
    usual, accepting = Job(surface=Path("a.ply")), Job(surface=Path("a.ply"), speed=15.0, accept_flow=True)
    assert accepting.settings() == {**usual.settings(), "accept_flow": True}
