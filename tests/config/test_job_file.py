"""A job file: the keys of a job, its files found from its folder, options counting more, errors with line and key."""

from __future__ import annotations

import re
import tomllib
from os import mkfifo
from pathlib import Path
from typing import Literal

import pytest
from typer.testing import CliRunner

from geoprint.cli.application import app
from geoprint.config import Job, PatchRegion, SourceTable, job_file_text, job_of, load_cell
from geoprint.errors import UsageError
from geoprint.geometry.files import save_ply
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import prepare_workpiece
from tests.meshes import plate

SMALL = 'surface = "part.ply"\nunit = "mm"\nspacing = 2.0\n'


def written(folder: Path, text: str, *, name: str = "job.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_holds_what_a_job_holds(tmp_path: Path) -> None:
    text = (
        SMALL
        + 'backend = "lscm"\nmax_tilt = 5\nrobot = false\nsource = { point = [1, 2, 3] }\n'
        + "speed = 12.5\naccept_flow = true\n"
        + "[[patches]]\nbox = [0, 0, 0, 1, 1, 1]\n"
    )
    job = job_of(surface=written(tmp_path, text))
    assert (job.backend, job.max_tilt, job.robot, str(job.source)) == ("lscm", 5.0, False, "point:1,2,3")
    assert (job.speed, job.accept_flow, job.on_slowdown) == (12.5, True, "auto")
    assert job.patches == [PatchRegion(box=[0.0, 0.0, 0.0, 1.0, 1.0, 1.0])]


def test_files_are_found_from_the_folder_of_the_job_inside_or_outside_of_it(tmp_path: Path) -> None:
    text = 'surface = "../hearts/a.ply"\nbody = "parts/b.ply"\ncell = "/cells/c.toml"\nspacing = 1\n'
    job = job_of(surface=str(written(tmp_path, text, name="JOB.TOML")))
    assert job.surface == tmp_path / "../hearts/a.ply"
    assert job.body == tmp_path / "parts/b.ply"
    assert job.cell == Path("/cells/c.toml")


def test_what_is_given_beside_the_file_counts_more(tmp_path: Path) -> None:
    path = written(tmp_path, SMALL + 'backend = "lscm"\nflip = true\n[[patches]]\nat = [0, 0, 0]\nradius = 1\n')
    kept = job_of(surface=path, backend=None, flip=None, spacing=None, patch=None, max_tilt=None)
    assert (kept.backend, kept.flip, kept.spacing, len(kept.patches)) == ("lscm", True, 2.0, 1)
    job = job_of(surface=path, backend="heat", flip=False, body="b.ply", patch={"at": [5.0, 0.0, 0.0], "radius": 3.0})
    assert (job.backend, job.flip, job.body) == ("heat", False, Path("b.ply"))
    assert [patch.radius for patch in job.patches] == [3.0]


@pytest.mark.parametrize(("other", "replaced"), [("rounds", "spacing"), ("spacing", "rounds")])
def test_rounds_that_are_given_replace_the_spacing_of_the_file_and_the_other_way(
    tmp_path: Path, other: Literal["rounds", "spacing"], replaced: str
) -> None:
    path = written(tmp_path, f'surface = "part.ply"\n{replaced} = 3\n')
    job = job_of(surface=path, **{other: 7 if other == "rounds" else 0.7})
    assert getattr(job, replaced) is None
    assert getattr(job, other) is not None


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (SMALL + "spacng = 1.0\n", "job.toml, line 4: spacng: there is no such key"),
        (SMALL + "spacing = 1.0\n", "job.toml is not valid TOML.*line 4"),
        ('surface = "a.ply"\nspacing = nan\n', "job.toml, line 2: spacing: .*finite"),
        ('surface = "a.ply"\nspacing = "1"\n', "job.toml, line 2: spacing: .*number, found '1'"),
        (SMALL + "speed = 0\n", "job.toml, line 4: speed: .*greater than 0"),
        (SMALL + 'on_slowdown = "lower"\n', "job.toml, line 4: on_slowdown: .*'auto' or 'follow', found 'lower'"),
        ("surface = 5\nspacing = 1.0\n", "job.toml, line 1: surface: "),
        ("spacing = 1.0\n", "job.toml: surface: this key is missing"),
        (SMALL + "rounds = 3\n", "job.toml: give either spacing or rounds"),
        (
            SMALL
            + "# [[patches]]\n[[patches]]\nat = [0, 0, 0]\nradius = 1\n\n[[patches]]\nat = [0, 0, 0]\nradus = 1\n",
            "line 11: patches.2.radus",
        ),
        (
            SMALL + "patches = [\n  { at = [0, 0, 0], radius = 1 },\n  { radius = 2 },\n]\n",
            "line 4: patches.2: a radius or",
        ),
        (SMALL + "[[patches]]\nradius = 2\nat = [0, 0]\n", "line 6: patches.1.at: it must have at least 3 items"),
        (SMALL + "[patches]\nradius = 2\n", "line 4: patches: it must be a list"),
        (
            SMALL + "source = { loops = [1] }\n" + 2 * "[[patches]]\nat = [0, 0, 0]\nradius = 1\n",
            "job.toml: the source loops:1 lies on one of 2 patches",
        ),
        ('surface = "other.toml"\n', "job.toml: surface: other.toml is a job file too"),
        ("a = " + 5000 * "[", "job.toml: its lists are nested too deeply"),
    ],
)
def test_a_wrong_file_is_refused_with_its_line_and_key(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence):
        job_of(surface=written(tmp_path, text))


@pytest.mark.parametrize("path", ["absent.toml", "a\0b.toml"])
def test_a_file_that_cannot_be_read_is_refused(path: str) -> None:
    with pytest.raises(UsageError, match=r"cannot be read.*`geoprint init` writes one"):
        job_of(surface=path)


def test_the_cell_of_a_hostile_job_is_refused_in_a_sentence(tmp_path: Path) -> None:
    save_ply(plate(), tmp_path / "part.ply")
    path = written(tmp_path, SMALL + 'cell = "a\\u0000b"\n')
    done = CliRunner().invoke(app, ["plan", str(path), "--out", str(tmp_path / "out")])
    assert isinstance(done.exception, UsageError)
    assert "cannot be read" in str(done.exception)


def test_the_file_that_geoprint_brings_names_every_key_and_each_of_its_lines_is_valid(tmp_path: Path) -> None:
    text = job_file_text()
    whole, patches = text.split("# [[patches]]")
    head, source = whole.split("# [source]")
    source, options = source.split("# [options.")
    job_of(surface=written(tmp_path, text))
    named = {match[1] for match in re.finditer(r"^(?:# )?(\w+) = ", head, re.MULTILINE)}
    assert named | {"patches", "options", "source"} == set(Job.model_fields)
    lines = re.findall(r"^# (\w+ = .*)$", source, re.MULTILINE)
    assert {line.split()[0] for line in lines} == set(SourceTable.model_fields)
    for line in lines:
        assert job_of(surface=written(tmp_path, f"{head}[source]\n{line}\n")).source is not None
    region = "[[patches]]" + re.sub(r"^# ", "", patches, flags=re.MULTILINE)
    assert set(tomllib.loads(region)["patches"][0]) == set(PatchRegion.model_fields)
    job_of(surface=written(tmp_path, head + region))
    shown = "[options." + re.sub(r"^# ", "", options.split("\n\n")[0], flags=re.MULTILINE)
    assert tomllib.loads(shown) == {"options": {"lscm": {"resolution": 500}}}
    defaults = {name: field.default for name, field in Job.model_fields.items()}
    for match in re.finditer(r"^# (\w+) = .*$", head, re.MULTILINE):
        shown = job_of(surface=written(tmp_path, 'surface = "a.ply"\n' + match[0].removeprefix("# ")))
        # What has a default shows it.
        assert not defaults[match[1]] or defaults[match[1]] == getattr(shown, match[1])


def test_a_job_is_planned_with_the_keys_of_its_file_and_the_options_of_the_command(tmp_path: Path) -> None:
    save_ply(plate((16.0, 12.0)), tmp_path / "part.ply")
    path = written(
        tmp_path,
        SMALL + 'backend = "fast-marching"\nrobot = false\nmax_tilt = 3.0\non_slowdown = "follow"\nspeed = 12.5\n',
    )
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["plan", str(path), "--out", str(out), "--spacing", "3", "--json"])
    assert done.exit_code == 0, done.output
    assert all(
        f'"{key}": {value}' in done.stdout
        for key, value in (
            ("backend", '"fast-marching"'), ("robot", "false"), ("max_tilt_deg", "3.0"), ("on_slowdown", '"follow"'),
            ("spacing_mm", "3.0"), ("name", '"part.ply"'), ("speed_mm_s", "12.5"),
        )
    )  # fmt: skip


def test_a_job_may_print_slower_than_its_cell_and_no_faster(tmp_path: Path) -> None:
    save_ply(plate((16.0, 12.0)), tmp_path / "part.ply")
    path, stages = written(tmp_path, SMALL + "robot = false\n"), Stages(lambda _: None)

    def speed(asked: float | None) -> float:
        return prepare_workpiece(job_of(surface=path, speed=asked), stages, backends=["heat"]).cell.process.speed

    # The packaged cell prints at 20 mm/s.
    assert [speed(asked) for asked in (None, 20.0, 12.5)] == [20.0, 20.0, 12.5]
    with pytest.raises(UsageError, match=r"`--speed 20\.1` is above the speed_mm_s of .*, 20: give less"):
        speed(20.1)


@pytest.mark.parametrize("kind", ["pipe", "long"])
def test_a_job_or_a_cell_that_might_never_end_is_refused_before_it_is_read(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "job.toml"
    if kind == "pipe":
        mkfifo(path)
    else:
        path.write_text("#" * 2_000_000)
    wanted = "not a regular file" if kind == "pipe" else "larger than 1 MB"
    with pytest.raises(UsageError, match=rf"job file .*{wanted}"):
        job_of(surface=path)
    with pytest.raises(UsageError, match=rf"cell file .*{wanted}"):
        load_cell(path)


@pytest.mark.parametrize(
    "line",
    [
        f"[[patches]]\nbox = [{', '.join(['1'] * 100_000)}]",
        "[[patches]]\nradius = 1.0\nat = [0, 0, 0]\n" * 101,
        f"{'k' * 300_000} = 1",
        f'flip = "{"m" * 300_000}"',
        f"a{'.a' * 5_000} = 1",
        f"label = {'9' * 5_000}",
    ],
    ids=["list", "patches", "key", "text", "nesting", "digits"],
)
def test_a_job_of_endless_values_is_refused_in_one_short_sentence(tmp_path: Path, line: str) -> None:
    with pytest.raises(UsageError) as refused:
        job_of(surface=written(tmp_path, SMALL + line + "\n"))
    assert len(str(refused.value)) < 400


@pytest.mark.parametrize("spacing", [0.0, -1.0, 1e-300])
def test_a_spacing_that_no_needle_has_is_refused(spacing: float) -> None:
    with pytest.raises(UsageError, match=r"spacing: it must be at least 0\.001"):
        job_of(surface="part.ply", spacing=spacing)
