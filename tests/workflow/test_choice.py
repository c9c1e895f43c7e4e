"""Options of a job reach the backend and the pattern that they are given to, and nobody else."""

from __future__ import annotations

from pathlib import Path

import pytest

from geoprint.cli.options import job_asked
from geoprint.config import Job, job_of
from geoprint.distance.lscm import Lscm
from geoprint.errors import UsageError
from geoprint.toolpath.contours import ContourPattern
from geoprint.toolpath.guided import GuidedPattern
from geoprint.workflow.backend_choice import backend_of, check_options, pattern_of, with_backend
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
    assert isinstance(pattern_of(job()), ContourPattern)


ALTERNATING = ["contours", "guided:45", "guided -45"]


def test_patterns_take_turns_from_the_lowest_layer_and_one_layer_alone_has_its_own() -> None:
    found = [job(thickness=3.0, patterns=ALTERNATING, layer=layer) for layer in range(1, 6)]
    assert [str(each.drawing) for each in found] == ["contours", "guided:45", "guided:-45", "contours", "guided:45"]
    assert [str(each.counted_from) for each in found[:3]] == ["None", "angle:45", "angle:-45"]
    assert isinstance(pattern_of(found[0]), ContourPattern)
    assert isinstance(pattern_of(found[4]), GuidedPattern)
    record = found[1].settings()
    assert (record["pattern"], record["patterns"], str(record["source"])) == ("guided", ALTERNATING, "angle:45")
    assert str(job(thickness=3.0, patterns=["contours", "guided:0"], source="loops:1").counted_from) == "loops:1"


def test_options_of_one_pattern_go_to_that_one_of_those_that_take_turns() -> None:
    for layer in (1, 2):
        asked = job(thickness=3.0, patterns=["contours", "guided:0"], middle="plain", contours=2, layer=layer)
        check_options(asked, ["heat"])
        pattern_of(asked)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"patterns": ALTERNATING, "thickness": 2.0, "pattern": "spiral"}, "either a pattern or patterns, not both"),
        ({"patterns": ["guided:0"], "thickness": 2.0, "source": "loops:1"}, "the source loops:1 is of none"),
        ({"patterns": [], "thickness": 2.0}, "at least 1 item"),
        ({"patterns": ["guided:east"], "thickness": 2.0}, "'guided:east' is no pattern of a layer: give its name"),
        ({"patterns": ["guided:270"], "thickness": 2.0}, "from -180 to 180 degrees"),
        ({"patterns": ["guided:1:2"], "thickness": 2.0}, "'guided:1:2' is no pattern of a layer"),
        ({"patterns": ["guided:nan"], "thickness": 2.0}, "'guided:nan' is no pattern of a layer"),
        ({"patterns": ["contours", ""], "thickness": 2.0}, "'' is no pattern of a layer"),
        ({"patterns": ["contours", "rows:4"], "thickness": 2.0}, "no pattern named 'rows'; choose one of: contours"),
        ({"patterns": ["contours:45"], "thickness": 2.0}, "contours:45 gives an angle, but .* write contours alone"),
        ({"patterns": ["guided"], "thickness": 2.0}, "rows of guided run beside a line: give their angle"),
        ({"patterns": ["spiral"], "thickness": 2.0, "middle": "plain"}, "the pattern spiral has none"),
    ],
)
def test_patterns_of_layers_that_cannot_be_meant_are_refused(values: dict[str, object], sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence):
        check_options(job(**values), ["heat"])


def test_a_pattern_that_is_given_replaces_the_patterns_of_a_job_file(tmp_path: Path) -> None:
    path = tmp_path / "job.toml"
    path.write_text('surface = "a.ply"\nthickness = 2.0\npatterns = ["contours", "guided:45"]\n')
    assert job_of(surface=path).patterns == ["contours", "guided:45"]
    assert job_of(surface=path, pattern="spiral").patterns is None
    assert job_asked(path, {"patterns": ["guided:0", "guided:90"]}).drawings[1].angle_deg == 90.0
