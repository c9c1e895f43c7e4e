"""Options of a job reach the backend and the pattern that they are given to, and nobody else."""

from __future__ import annotations

from pathlib import Path

import pytest

from geoprint.backends.lscm import Lscm
from geoprint.config import Job, job_of
from geoprint.errors import UsageError
from geoprint.pipeline.choice import backend_of, check_options, pattern_of, with_backend
from tests.meshes import plate


def job(**values: object) -> Job:
    return job_of(surface=Path("part.ply"), unit="mm", spacing=2.0, **values)


@pytest.mark.parametrize(
    "values", [{"resolution": 321}, {"options": {"lscm": {"resolution": 321}, "heat": {"time_factor": 1.0}}}]
)
def test_an_option_says_what_the_flag_says(values: dict[str, object]) -> None:
    asked = job(backend="lscm", **values)
    check_options(asked, ["lscm", "heat"])
    built = backend_of(asked)(plate())
    assert isinstance(built, Lscm)
    assert built.shown(spacing=2.0).resolution == 321


def test_the_flag_does_not_follow_to_a_backend_without_a_raster_but_options_stay() -> None:
    asked = job(resolution=321, options={"heat": {"time_factor": 1.0}})
    assert with_backend(asked, "lscm").resolution == 321
    assert with_backend(asked, "heat").resolution is None
    assert with_backend(asked, "heat").options == asked.options


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"resolution": 9, "options": {"lscm": {"resolution": 8}}}, r"given twice, as `--resolution 9` and .* 8"),
        (
            {"options": {"lcsm": {"resolution": 8}}},
            r"'lcsm', but .* no backend or pattern .* lscm, ",
        ),
        ({"options": {"lscm": {"pixels": 8}}}, r"lscm has no option 'pixels'; it takes resolution \(int \| None\)"),
        ({"options": {"lscm": {"resolution": "fine"}}}, r"`lscm.resolution`: .*valid integer, found 'fine'"),
        ({"options": {"fast-marching": {"speed": 2}}}, "fast-marching has no option 'speed'; it takes no option"),
        ({"pattern": "spirals"}, "no pattern named 'spirals'; choose one of: contours"),
        ({"options": {"contours": {"turns": 2}}}, "contours has no option 'turns'"),
    ],
)
def test_options_that_cannot_be_meant_are_refused_before_the_long_work(
    values: dict[str, object], sentence: str
) -> None:
    with pytest.raises(UsageError, match=sentence):
        check_options(job(**values), ["lscm", "heat"])


def test_a_job_without_a_pattern_has_contours() -> None:
    assert type(pattern_of(job())).title == "level curves of the distance"
