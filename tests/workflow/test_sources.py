"""Sources on a part: where distance is zero is what was asked for, and the best one is the best of those tried."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from geoprint.cli.options import job_asked
from geoprint.config import job_of
from geoprint.distance import BACKENDS
from geoprint.errors import FieldError, UsageError
from geoprint.geometry import positions, united
from geoprint.geometry.files import save_ply
from geoprint.metrics import Covering, ranked
from geoprint.model import FloatArray, Surface
from geoprint.reporting import summary
from geoprint.results import Plan, TriedSource
from geoprint.workflow import compare, plan
from geoprint.workflow.sources import curve_source, preferred, source_of
from tests.meshes import annulus, cylinder_patch, disc, plate, sphere

# A band 7.6 mm wide: fronts from both rims meet where the fourth level would lie 0.2 spacings from itself.
INNER, OUTER = 4.0, 11.6
BAND = annulus(inner=INNER, outer=OUTER)


def saved(folder: Path, surface: Surface) -> Path:
    path = folder / "part.ply"
    save_ply(surface, path)
    return path


def planned(folder: Path, surface: Surface, **values: object) -> Plan:
    return plan(job_of(surface=saved(folder, surface), unit="mm", spacing=2.0, robot=False, **values))


def distances(found: Plan) -> FloatArray:
    return found.contours.distance.values


@pytest.mark.parametrize(
    ("backend", "sources"),
    # What a source means is the same for all of them; its distance each measures itself, inwards and outwards.
    [("heat", ("loops:1", "near:0,3,0")), ("fast-marching", ("loops:1", "loops:2")), ("lscm", ("loops:1", "loops:2"))],
)
def test_distance_is_measured_from_what_was_asked_for(tmp_path: Path, backend: str, sources: tuple[str, ...]) -> None:
    # The exact distance on the flat ring is that of the radii.
    for source in sources:
        radius = OUTER if source == "loops:1" else INNER
        found = planned(tmp_path, BAND, source=source, backend=backend, middle="plain")
        radii = np.linalg.norm(found.workpiece.surface.vertices, axis=1)
        np.testing.assert_allclose(distances(found), np.abs(radii - radius), atol=0.12)


def test_part_of_a_rim_and_a_drawn_curve_are_sources(tmp_path: Path) -> None:
    table = plate((20.0, 12.0), (10, 6))
    left = planned(tmp_path, table, source="between:0,0,0:0,12,0", backend="fast-marching")
    np.testing.assert_allclose(distances(left), left.workpiece.surface.vertices[:, 0], atol=1e-6)
    drawn = tmp_path / "drawn.csv"
    drawn.write_text("0.1,6.1,0\n19.9,6.1,0\n")
    job = job_asked(saved(tmp_path, table), {"unit": "mm", "spacing": 2.0, "robot": False, "source": {"curve": [
        [0.1, 6.1, 0.0], [19.9, 6.1, 0.0]
    ]}})  # fmt: skip
    middle = plan(job)
    x, y, _ = middle.workpiece.surface.vertices.T
    inside = (x > 1.0) & (x < 19.0)
    np.testing.assert_allclose(distances(middle)[inside], np.abs(y - 6.1)[inside], atol=0.1)


def test_a_drawn_curve_follows_the_surface_between_its_points() -> None:
    # A quarter turn around a cylinder of radius 20 mm is 31.4 mm, its chord 28.3 mm.
    tube = cylinder_patch()
    low, high = tube.vertices.min(axis=0), tube.vertices.max(axis=0)
    ends = tube.vertices[[int(np.argmin(tube.vertices @ (low - high))), int(np.argmax(tube.vertices @ (low - high)))]]
    curves = curve_source(tube, ends).curves
    places = positions(tube, curves.points)
    np.testing.assert_allclose(places[[0, -1]], ends, atol=1e-9)
    assert len(places) > 5
    assert not curves.closed.any()


@pytest.mark.parametrize(
    ("points", "why"),
    [
        ([[0.0, 0.0, 0.0], [10.0, 6.0, 3.0]], r"point 2 .* lies 3 mm off"),
        ([[5.0, 5.0, 0.0], [5.0, 5.0, 0.0]], "two or more different"),
    ],
)
def test_a_curve_that_is_none_is_refused(points: list[list[float]], why: str) -> None:
    with pytest.raises(FieldError, match=why):
        curve_source(plate((20.0, 12.0), (10, 6)), np.array(points))


def test_of_a_band_one_rim_covers_more_than_both_and_is_taken(tmp_path: Path) -> None:
    best = planned(tmp_path, BAND, source="best", middle="plain")
    tried = {each.source: each for each in best.workpiece.tried}
    assert list(tried) == ["border", "loops:1", "loops:2"]
    (taken,) = (each for each in tried.values() if each.taken)
    # Each is what planning from it alone finds, and none is better.
    planned_alone = {source: planned(tmp_path, BAND, source=source, middle="plain") for source in tried}
    for source, each in tried.items():
        alone = planned_alone[source]
        assert alone.uniformity is not None
        assert (alone.uniformity.gap, alone.uniformity.overlap) == (each.gap, each.overlap)
        assert alone.uniformity.thickness.cv == each.cv
        assert alone.toolpath.curves.count == each.runs
        assert taken.gap + taken.overlap <= each.gap + each.overlap + 0.001
    assert taken.source != "border"
    assert tried["border"].gap + tried["border"].overlap > taken.gap + taken.overlap + 0.005
    np.testing.assert_array_equal(distances(best), distances(planned_alone[taken.source]))
    record = json.loads(json.dumps(summary(best)))
    assert [source["taken"] for source in record["sources"]] == [each.taken for each in tried.values()]
    assert any(
        note.startswith(f"distance is measured from {taken.source}, which covers best. Area missed")
        for note in record["notes"]
    )


def test_of_a_disc_the_border_stays_and_of_a_ball_one_of_two_poles_is_taken(tmp_path: Path) -> None:
    flat = planned(tmp_path, disc(radius=8.0), source="best")
    assert [each.source.partition(":")[0] for each in flat.workpiece.tried] == ["border", "point"]
    assert [each.taken for each in flat.workpiece.tried] == [True, False]
    ball = planned(tmp_path, sphere(radius=6.0, subdivisions=2), source="best", backend="fast-marching")
    poles = np.array([[float(value) for value in each.source[6:].split(",")] for each in ball.workpiece.tried])
    assert np.linalg.norm(poles[0] - poles[1]) == pytest.approx(12.0, abs=0.1)


def test_each_patch_has_its_own_source(tmp_path: Path) -> None:
    shifted = Surface(BAND.vertices + np.array([50.0, 0.0, 0.0]), BAND.faces)
    both = united([BAND, shifted])
    places = [[8.0, 0.0, 0.0], [58.0, 0.0, 0.0]]
    boxes = [[-25, -25, -1, 25, 25, 1], [25, -25, -1, 75, 25, 1]]
    patches: list[dict[str, object]] = [{"at": at, "box": box} for at, box in zip(places, boxes, strict=True)]
    patches[0]["source"] = "loops:2"
    asked = {"unit": "mm", "spacing": 2.0, "robot": False, "backend": "fast-marching", "middle": "plain"}
    found = plan(job_of(surface=saved(tmp_path, both), patches=patches, **asked))
    values, (x, y, _) = distances(found), found.workpiece.surface.vertices.T
    first = x < 25.0
    np.testing.assert_allclose(values[first], np.hypot(x, y)[first] - INNER, atol=0.12)
    assert values[~first].max() == pytest.approx(3.8, abs=0.2)
    # What is sought for one is not sought for the other.
    patches[0]["source"] = "best"
    sought = plan(job_of(surface=saved(tmp_path, both), patches=patches, **asked))
    assert {each.patch for each in sought.workpiece.tried} == {1}
    with pytest.raises(FieldError, match=r"patch 1, about .*: there is no loop 4"):
        source_of(
            job_of(surface="a.ply", patches=[{**patches[0], "source": "loops:4"}, patches[1]]), found.workpiece.surface
        )


def test_a_comparison_measures_all_backends_from_one_best_source(tmp_path: Path) -> None:
    found = compare(
        job_of(surface=saved(tmp_path, BAND), unit="mm", spacing=2.0, robot=False, source="best", middle="plain")
    )
    assert sum(each.taken for each in found.workpiece.tried) == 1
    assert len({id(one.plan.workpiece.source) for _, one in found.planned}) == 1
    assert set(BACKENDS) >= {name for name, _ in found.planned}


def test_no_source_that_can_be_planned_from_is_the_error_of_the_first(tmp_path: Path) -> None:
    with pytest.raises(FieldError):
        plan(job_of(surface=saved(tmp_path, disc(radius=12.0)), unit="mm", spacing=30.0, robot=False, source="best"))


def test_a_folder_is_no_source_but_to_plan_it_again(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"is a folder: `geoprint plan --from` one, without a part"):
        job_asked(tmp_path / "part.ply", {"source": tmp_path})


def test_what_covers_comes_first_then_what_leaves_least_then_what_is_even() -> None:
    holes, twice = Covering(0.021, 0.0, 0.0), Covering(0.0, 0.051, 0.0)
    rough, even, fair = Covering(0.004, 0.0, 0.02), Covering(0.005, 0.003, 0.01), Covering(0.009, 0.001, 0.001)
    assert ranked([holes, rough, even, twice]) == [2, 1, 0, 3]
    # 0.006 worse is not alike.
    assert ranked([fair, rough, even]) == [2, 1, 0]


def tried(gap: float, overlap: float, cv: float, runs: int) -> TriedSource:
    return TriedSource(1, "border", gap, overlap, cv, runs, taken=False)


@pytest.mark.parametrize(
    ("sources", "taken"),
    [
        # 0.4 % covered twice is worse than nothing, however alike they are in a verdict.
        ([tried(0.0, 0.0042, 0.0057, 18), tried(0.0, 0.0, 0.0035, 18)], 1),
        # Within 0.1 % the fewest runs decide, as long as the thickness varies by less than 4 %.
        ([tried(0.0, 0.0, 0.001, 20), tried(0.0009, 0.0, 0.039, 12)], 1),
        ([tried(0.0, 0.0, 0.001, 20), tried(0.0009, 0.0, 0.041, 12)], 0),
        ([tried(0.0, 0.0, 0.001, 20), tried(0.0011, 0.0, 0.001, 12)], 0),
        # What covers comes before what leaves holes; where nothing does, what leaves least is taken.
        ([tried(0.03, 0.0, 0.001, 5), tried(0.019, 0.049, 0.01, 9)], 1),
        ([tried(0.03, 0.0, 0.001, 5), tried(0.04, 0.0, 0.001, 3)], 0),
        # Where none is even, the most even one.
        ([tried(0.0, 0.0, 0.12, 1), tried(0.0, 0.0, 0.05, 2)], 1),
    ],
)
def test_the_source_that_leaves_least_is_taken(sources: list[TriedSource], taken: int) -> None:
    assert preferred(sources) == taken
