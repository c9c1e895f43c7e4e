"""Where fronts meet: plain and fitted contours are measured, the better ones taken, and both are told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from geoprint.config import job_of
from geoprint.errors import UsageError
from geoprint.geometry.files import save_ply
from geoprint.model import Surface
from geoprint.reporting import recorded_comparison
from geoprint.reporting.plan import record_plan
from geoprint.reporting.records.comparison import PartRecord
from geoprint.results import Plan
from geoprint.workflow import compare, plan
from geoprint.workflow.covering import Measured, taken_alike
from tests.meshes import annulus, plate
from tests.shared_data import shared

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
    (note,) = (note for note in record.details if "fronts meet" in note)
    assert "contours are fitted; area missed + covered twice: 0.0% + 0.0% in 5 runs" in note
    assert "in 4 runs if plain (`--middle plain`)" in note


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
    with pytest.raises(UsageError, match="no middle 'wide'"):
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
