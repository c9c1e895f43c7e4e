"""Options of a job reach the backend and the pattern that they are given to, and nobody else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from geoprint.cli.options import job_asked
from geoprint.config import Job, job_of
from geoprint.distance.lscm import Lscm
from geoprint.errors import UsageError
from geoprint.geometry.files import save_ply
from geoprint.model import Surface
from geoprint.reporting import recorded_comparison
from geoprint.reporting.plan import record_plan
from geoprint.reporting.records.comparison import PartRecord
from geoprint.results import Plan
from geoprint.toolpath.contours import ContourPattern
from geoprint.toolpath.guided import GuidedPattern
from geoprint.workflow import compare, plan
from geoprint.workflow.backend_choice import backend_of, check_options, pattern_of
from geoprint.workflow.covering import Measured, taken_alike
from tests.meshes import annulus, plate
from tests.shared_data import shared


def job(**values: object) -> Job:
    return job_of(surface=Path("part.ply"), unit="mm", spacing=2.0, **values)


def test_an_option_goes_to_its_backend() -> None:
    asked = job(backend="lscm", options={"lscm": {"resolution": 321}, "heat": {"time_factor": 1.0}})
    check_options(asked, ["lscm", "heat"])
    built = backend_of(asked)(plate())
    assert isinstance(built, Lscm)
    assert built.shown(spacing=2.0).resolution == 321


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"middle": "plain", "options": {"contours": {"middle": "fitted"}}}, r"given twice, as `middle = plain` and"),
        ({"options": {"lcsm": {"resolution": 8}}}, r"'lcsm', which is not a backend, pattern or feature; .* lscm, "),
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


ALTERNATING = "contours,guided:45,guided -45"


def test_patterns_take_turns_from_the_lowest_layer_and_one_layer_alone_has_its_own() -> None:
    found = [job(thickness=3.0, pattern=ALTERNATING, layer=layer) for layer in range(1, 6)]
    assert [str(each.drawing) for each in found] == ["contours", "guided:45", "guided:-45", "contours", "guided:45"]
    assert [str(each.counted_from) for each in found[:3]] == ["None", "angle:45", "angle:-45"]
    assert isinstance(pattern_of(found[0]), ContourPattern)
    assert isinstance(pattern_of(found[4]), GuidedPattern)
    record = found[1].settings()
    assert (record["pattern"], str(record["source"])) == ("guided", "angle:45")
    assert str(job(thickness=3.0, pattern="contours,guided:0", source="loops:1").counted_from) == "loops:1"


def test_options_of_one_pattern_go_to_that_one_of_those_that_take_turns() -> None:
    for layer in (1, 2):
        asked = job(thickness=3.0, pattern="contours,guided:0", middle="plain", contours=2, layer=layer)
        check_options(asked, ["heat"])
        pattern_of(asked)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"pattern": "guided:0", "thickness": 2.0, "source": "loops:1"}, "the source loops:1 does not apply"),
        ({"pattern": "", "thickness": 2.0}, "'' is not a pattern of a layer"),
        ({"pattern": "guided:east", "thickness": 2.0}, "'guided:east' is not a pattern of a layer: give its name"),
        ({"pattern": "guided:270", "thickness": 2.0}, "(-180 to 180)"),
        ({"pattern": "guided:1:2", "thickness": 2.0}, "'guided:1:2' is not a pattern of a layer"),
        ({"pattern": "guided:nan", "thickness": 2.0}, "'guided:nan' is not a pattern of a layer"),
        ({"pattern": "contours,", "thickness": 2.0}, "'' is not a pattern of a layer"),
        ({"pattern": "contours,rows:4", "thickness": 2.0}, "no pattern named 'rows'; choose one of: contours"),
        ({"pattern": "contours:45", "thickness": 2.0}, "contours:45 gives an angle, but .* write contours alone"),
        ({"pattern": "contours,guided", "thickness": 2.0}, "rows of guided follow a line: give their angle"),
        ({"pattern": "spiral", "thickness": 2.0, "middle": "plain"}, "the pattern spiral has none"),
    ],
)
def test_patterns_of_layers_that_cannot_be_meant_are_refused(values: dict[str, object], sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence):
        check_options(job(**values), ["heat"])


def test_a_pattern_that_is_given_replaces_those_of_a_job_file(tmp_path: Path) -> None:
    path = tmp_path / "job.toml"
    path.write_text('surface = "a.ply"\nthickness = 2.0\npattern = "contours,guided:45"\n')
    assert [str(each) for each in job_of(surface=path).drawings] == ["contours", "guided:45"]
    assert [str(each) for each in job_of(surface=path, pattern="spiral").drawings] == ["spiral"]
    assert job_asked(path, {"pattern": "guided:0,guided:90"}).drawings[1].angle_deg == 90.0


# Where fronts meet: plain and fitted contours are measured, the better ones taken, and both are told.


# Fronts from both rims of this band meet 2.4 spacings from either, 0.9 from the innermost contour.
BAND = annulus(inner=4.0, outer=13.6, divisions=(60, 10))


def planned(folder: Path, surface: Surface, **values: object) -> Plan:
    path = folder / "part.ply"
    save_ply(surface, path)
    return plan(job_of(surface=path, unit="mm", spacing=2.0, robot=False, **values))


def measured(paths: Plan) -> Measured:
    assert paths.uniformity is not None
    return paths, paths.uniformity


def taken(each: Sequence[Measured]) -> list[str]:
    return [tried.middle for paths, _ in each for tried in paths.middles if tried.taken]


def missed_or_twice(found: Plan) -> float:
    assert found.uniformity is not None
    return found.uniformity.gap + found.uniformity.overlap


def test_the_better_middle_is_taken_and_both_are_told(tmp_path: Path) -> None:
    best, plain, fitted = (planned(tmp_path, BAND, middle=middle) for middle in (None, "plain", "fitted"))
    # The innermost two of plain contours lie 1.8 spacings apart: 0.7 of them, 1.4 of 9.6 mm, are near neither.
    assert missed_or_twice(plain) == pytest.approx(1.4 / 9.6, abs=0.003)
    assert missed_or_twice(fitted) < 0.003
    tried = {each.middle: each for each in best.middles}
    assert [name for name, each in tried.items() if each.taken] == ["fitted"]
    for name, alone in (("plain", plain), ("fitted", fitted)):
        assert alone.uniformity is not None
        assert (tried[name].gap, tried[name].overlap, tried[name].cv, tried[name].runs) == (
            alone.uniformity.gap, alone.uniformity.overlap, alone.uniformity.thickness.cv, alone.toolpath.curves.count
        )  # fmt: skip
        assert alone.middles == ()
    assert (best.poses.tips == fitted.poses.tips).all()
    assert best.job.middle is None
    record = record_plan(best)
    assert [each.middle for each in record.middles] == ["fitted", "plain"]
    (note,) = (note for note in record.details if "medial axis" in note)
    assert "contours are fitted. Area missed + covered twice: 0.0 % + 0.0 % in 5 runs" in note
    assert "with `--set middle=plain`: " in note


def test_plain_contours_stay_where_they_leave_next_to_nothing(tmp_path: Path) -> None:
    # Two levels from either rim, edge to edge: 8 mm wide.
    found = planned(tmp_path, annulus(inner=6.0, outer=14.0, divisions=(60, 8)), backend="fast-marching")
    assert found.middles == ()
    assert found.toolpath.curves.count == 4


def test_a_comparison_says_what_was_tried_with_each_backend(tmp_path: Path) -> None:
    path = tmp_path / "part.ply"
    save_ply(BAND, path)
    found = compare(job_of(surface=path, unit="mm", spacing=2.0, robot=False), backends=["heat", "fast-marching"])
    (part,) = recorded_comparison([found]).record.parts
    assert isinstance(part, PartRecord)
    for backend in ("heat", "fast-marching"):
        assert any(f"contours with {backend} are fitted" in sentence for sentence in part.verdict)


def test_compared_backends_all_have_the_middle_of_the_best_covering(tmp_path: Path) -> None:
    plain, fitted = (measured(planned(tmp_path, BAND, middle=middle)) for middle in ("plain", "fitted"))
    # By itself the second one would stay plain.
    worse = fitted[0], replace(fitted[1], gap=0.4)
    assert taken(taken_alike([(plain, worse)])) == ["plain"]
    assert taken(taken_alike([(plain, fitted), (plain, worse)])) == ["fitted", "fitted"]
    assert taken(taken_alike([(plain, worse), (plain, worse)])) == ["plain", "plain"]
    # One for which there is no choice keeps what it has.
    alone, chosen = taken_alike([(plain,), (plain, fitted)])
    assert alone[0].middles == ()
    assert alone[1].gap == plain[1].gap
    assert taken([chosen]) == ["fitted"]
    # Nor does it decide for others, however well it covers.
    best = plain[0], replace(plain[1], gap=0.0, overlap=0.0)
    assert taken(taken_alike([(best,), (plain, fitted)])) == ["fitted"]
    assert taken_alike([]) == []


def test_a_compared_backend_is_planned_again_as_it_was_compared(tmp_path: Path) -> None:
    path = tmp_path / "part.ply"
    save_ply(BAND, path)
    job = job_of(surface=path, unit="mm", spacing=2.0, robot=False)
    for name, outcome in compare(job, backends=["heat", "fast-marching"]).planned:
        again = plan(outcome.plan.job)
        assert outcome.plan.job.backend == name
        assert again.middles == outcome.plan.middles
        assert (again.poses.tips == outcome.plan.poses.tips).all()


def test_a_pattern_without_a_middle_and_one_given_twice_are_refused(tmp_path: Path) -> None:
    table = plate((20.0, 12.0), (10, 6))
    with pytest.raises(UsageError, match="the middle of contours is given twice"):
        planned(tmp_path, table, middle="plain", options={"contours": {"middle": "fitted"}})
    with pytest.raises(UsageError, match="no `middle` 'wide'"):
        planned(tmp_path, table, options={"contours": {"middle": "wide"}})
    # As an option of the pattern it is what was asked for, and nothing else is tried.
    assert planned(tmp_path, table, options={"contours": {"middle": "plain"}}).middles == ()


@pytest.mark.parametrize(
    ("part", "left", "varies"), [("aortic_root_band_6mm", 0.34, 0.021), ("tricuspid_leaflet_disc_r6", 0.56, 0.045)]
)
def test_on_hearts_fitted_contours_leave_little_of_what_plain_ones_do(part: str, left: float, varies: float) -> None:
    found = plan(job_of(surface=shared(f"patches/{part}.ply"), unit="mm", spacing=1.0, robot=False))
    tried = {each.middle: each for each in found.middles}
    assert tried["fitted"].gap + tried["fitted"].overlap < left * (tried["plain"].gap + tried["plain"].overlap)
    assert tried["fitted"].cv < 0.85 * tried["plain"].cv
    assert found.uniformity is not None
    # A flow that follows makes up for the widths that differ; what is left lies at rims and corners.
    assert found.uniformity.followed.cv < varies
    assert found.uniformity.followed.within_10_percent > 0.95
