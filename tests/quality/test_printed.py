"""What errors make of a spacing: known answers, laws, and prints that are made without the sampler."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.expected import NONE, expected_print, small_part
from benchmarks.parts.reprints import lines_of, planned_cv, reprinted
from geoprint.model import FloatArray, PoseStream, PrintErrors, Surface
from geoprint.quality import Spans, Uniformity, alike, difference, joined_spans, printed, thickness_cv, uniformity
from geoprint.quality.spans import no_spans
from geoprint.quality.straying import node_counts, strays
from tests.meshes import plate
from tests.quality.deposits import deposited, straight_line

# Of the distance from the mean place in space, and in a plane: mean and three standard deviations, by ISO 9283.
IN_SPACE, IN_A_PLANE = 3.6161, 3.2187
TEN_MICRONS = replace(NONE, repeatability=0.01 * IN_SPACE)


def rows_of(count: int, *, spacing: float, length: float = 12.0) -> tuple[PoseStream, Surface]:
    """Return straight runs beside each other on a plate, and the plate."""
    across = spacing * (np.arange(count) + 0.5)
    lines = [straight_line((0.0, y), (length, y)) for y in across.tolist()]
    return deposited(lines, list(range(count))), plate((length, spacing * count), (12, count))


def measured_rows(count: int, *, spacing: float) -> tuple[PoseStream, Uniformity]:
    poses, surface = rows_of(count, spacing=spacing)
    return poses, uniformity(poses, surface, spacing=spacing)


@pytest.fixture(scope="module")
def rows() -> tuple[PoseStream, Uniformity]:
    return measured_rows(30, spacing=1.0)


def spread(measured: Uniformity, errors: PrintErrors, poses: PoseStream | None) -> tuple[float, ...]:
    """Return the variances of plan, runs, along runs, placement and needle."""
    found = printed(measured.spans, errors, spacing=measured.spacing, poses=poses)
    assert found is not None
    return found.variances


def test_repeatability_is_that_of_iso_9283() -> None:
    rng = np.random.default_rng(3)
    for dimensions, factor in ((3, IN_SPACE), (2, IN_A_PLANE)):
        away = np.linalg.norm(rng.standard_normal((400_000, dimensions)), axis=1)
        assert away.mean() + 3.0 * away.std() == pytest.approx(factor, rel=0.005)
    errors = PrintErrors(repeatability=IN_SPACE, path_repeatability=IN_A_PLANE)
    assert errors.run_deviation == pytest.approx(1.0, rel=1e-4)
    assert errors.path_deviation == pytest.approx(1.0, rel=1e-4)


def test_ways_lead_straight_across_to_the_run_outside(rows: tuple[PoseStream, Uniformity]) -> None:
    spans = rows[1].spans
    assert spans.count == rows[1].ratios.size > 1000
    assert spans.feet - spans.places == pytest.approx(np.tile([0.0, -1.0, 0.0], (spans.count, 1)), abs=1e-9)
    assert spans.towards == pytest.approx(np.tile([0.0, -1.0, 0.0], (spans.count, 1)), abs=1e-9)
    assert spans.beyond == pytest.approx(spans.towards, abs=1e-9)
    assert (spans.runs[:, 1] == spans.runs[:, 0] - 1).all()
    assert spans.arcs[:, 1] == pytest.approx(spans.arcs[:, 0], abs=1e-9)


def test_ten_microns_are_1_4_percent_of_a_millimetre_and_3_5_of_less(rows: tuple[PoseStream, Uniformity]) -> None:
    finer = measured_rows(30, spacing=0.4)
    for (poses, measured), cv in ((rows, 0.01414), (finer, 0.03536)):
        found = printed(measured.spans, TEN_MICRONS, spacing=measured.spacing, poses=poses)
        assert found is not None
        assert found.planned == pytest.approx(0.0, abs=1e-6)
        # Of 29 spacings the standard deviation comes out a little too small in the mean.
        assert found.cv.mean == pytest.approx(cv, rel=0.03)
        assert found.cv.low < 0.85 * cv < 1.15 * cv < found.cv.high


def test_what_moves_all_paths_alike_changes_no_spacing_on_a_plane(rows: tuple[PoseStream, Uniformity]) -> None:
    rigid = replace(NONE, placement=0.5, placement_turn=0.01, needle_runout=0.3)
    found = printed(rows[1].spans, rigid, spacing=1.0, poses=rows[0])
    assert found is not None
    assert found.cvs == pytest.approx(np.full(found.cvs.size, found.planned), abs=1e-9)
    assert found.variances[1:] == pytest.approx((0.0,) * 4, abs=1e-12)


def test_an_error_is_a_smaller_share_of_a_wider_spacing(rows: tuple[PoseStream, Uniformity]) -> None:
    poses, measured = rows
    some = measured.spans

    def halved_below_the_middle(places: FloatArray) -> FloatArray:
        return np.where(places[:, 1] < 15.0, 2.0, 1.0)

    found = printed(some, TEN_MICRONS, spacing=1.0, poses=poses, wanted=halved_below_the_middle)
    plain = printed(some, TEN_MICRONS, spacing=1.0, poses=poses)
    assert found is not None
    assert plain is not None
    wide = (some.places[:, 1] < 15.0).mean()
    assert 0.4 < wide < 0.6
    assert found.variances[1] == pytest.approx((1.0 - 0.75 * wide) * plain.variances[1], rel=0.02)


def test_a_bent_needle_counts_where_the_tool_turns_from_run_to_run(rows: tuple[PoseStream, Uniformity]) -> None:
    poses, measured = rows
    turned = (Rotation.from_quat(poses.quaternions, scalar_first=True) * Rotation.from_euler("z", np.pi)).as_quat(
        scalar_first=True
    )
    every_second = (poses.runs % 2 == 1)[:, None]
    turning = replace(poses, quaternions=np.where(every_second, turned, poses.quaternions))
    bent = replace(NONE, needle_runout=0.05)
    # Neighbouring runs are off by 0.05 mm to either side: spacings alternate by twice that, squared 0.01 mm2.
    assert spread(measured, bent, turning)[4] == pytest.approx(0.01, rel=0.01)
    assert spread(measured, bent, poses)[4] == pytest.approx(0.0, abs=1e-12)
    assert spread(measured, bent, None)[4] == 0.0


def test_what_strays_along_a_run_fades_with_the_stated_length(rows: tuple[PoseStream, Uniformity]) -> None:
    spans, errors = rows[1].spans, replace(NONE, path_repeatability=IN_A_PLANE, correlation=3.0)
    some = spans.some(np.flatnonzero(spans.runs[:, 0] == 5))
    along = strays(some, errors, poses=None)[1].toarray()
    apart = some.arcs[:, :1] - some.arcs[:, 0]
    # Sample and foot are independent of each other: twice the covariance.
    assert along @ along.T == pytest.approx(2.0 * np.exp(-0.5 * (apart / 3.0) ** 2), abs=0.02)
    assert node_counts(some, errors).size == 6


@pytest.mark.parametrize(
    ("radius", "errors"), [(12.0, PrintErrors()), (np.inf, PrintErrors(correlation=2.0, repeatability=0.04))]
)
def test_the_interval_holds_95_of_100_prints_that_are_made_and_measured_otherwise(
    radius: float, errors: PrintErrors
) -> None:
    shape, poses, measured = small_part(radius)
    stated = expected_print(measured, errors, poses).cv
    lines = lines_of(poses, shape, spacing=1.0)
    assert planned_cv(lines, shape) == pytest.approx(measured.cv, abs=1e-4)
    cvs = reprinted(lines, errors, shape, prints=1000, rng=np.random.default_rng(11))
    assert 0.93 <= ((cvs >= stated.low) & (cvs <= stated.high)).mean() <= 0.97
    assert stated.mean == pytest.approx(cvs.mean(), rel=0.03)


def test_what_is_expected_is_the_same_every_time(rows: tuple[PoseStream, Uniformity]) -> None:
    spans = rows[1].spans
    one, again = (printed(spans, PrintErrors(), spacing=1.0) for _ in range(2))
    assert one is not None
    assert again is not None
    assert (one.cvs == again.cvs).all()
    # Printed again, the same plan comes out otherwise: the arm strays anew.
    apart = difference(one, again)
    assert apart.mean == pytest.approx(0.0, abs=1e-12)
    assert apart.low == pytest.approx(-apart.high)
    # Two independent prints are sqrt(2) times as far apart as one is from the mean.
    assert apart.high == pytest.approx(np.sqrt(2.0) * (one.cv.high - one.cv.low) / 2.0, rel=0.1)


def test_two_prints_in_a_row_stand_on_the_same_cell() -> None:
    _, poses, measured = small_part(12.0)
    placed = expected_print(measured, replace(NONE, placement=0.1, needle_runout=0.05), poses).cvs.reshape(-1, 2)
    assert (placed[:, 0] == placed[:, 1]).all()
    assert np.unique(placed[:, 0]).size == len(placed)
    strayed = expected_print(measured, TEN_MICRONS, poses).cvs.reshape(-1, 2)
    one, other = strayed.T - strayed.mean()
    assert abs((one * other).mean() / (one.std() * other.std())) < 0.1


def with_ratios(spans: Spans, ratios: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Spans:
    return replace(spans, ratios=ratios)


def test_plans_are_alike_where_neither_is_more_even_in_95_of_100_prints(rows: tuple[PoseStream, Uniformity]) -> None:
    spans = rows[1].spans
    wave = np.sin(np.arange(spans.count) * 0.9)
    even, hardly, much = (
        printed(with_ratios(spans, 1.0 + size * wave), PrintErrors(), spacing=1.0) for size in (0.0, 0.004, 0.03)
    )
    assert even is not None
    assert hardly is not None
    assert much is not None
    assert alike(hardly, even)
    assert not alike(much, even)
    apart = difference(much, even)
    assert 0.0 < apart.low < apart.mean < apart.high
    assert even.largest_error == "path_repeatability"
    assert much.largest_error is None
    assert much.shares["plan"] == pytest.approx(0.03**2 / 2 / sum(much.variances), rel=0.02)


def test_where_there_is_no_spacing_none_is_expected() -> None:
    assert printed(no_spans(), PrintErrors(), spacing=1.0) is None
    assert joined_spans(no_spans(), no_spans()).count == 0


def test_of_many_samples_some_tell_what_errors_do_and_all_what_the_plan_is(
    rows: tuple[PoseStream, Uniformity], monkeypatch: pytest.MonkeyPatch
) -> None:
    spans = with_ratios(rows[1].spans, 1.0 + 0.01 * np.sin(np.arange(rows[1].spans.count)))
    all_of_them = printed(spans, PrintErrors(), spacing=1.0)
    monkeypatch.setattr(sys.modules["geoprint.quality.printed"], "MOST_SAMPLES", 300)
    some = printed(spans, PrintErrors(), spacing=1.0)
    assert all_of_them is not None
    assert some is not None
    assert some.planned == all_of_them.planned
    assert some.cv == pytest.approx(all_of_them.cv, rel=0.03)


def test_thickness_adds_the_flow_of_the_runs_and_a_quarter_of_what_the_arm_does_to_spacing(
    rows: tuple[PoseStream, Uniformity],
) -> None:
    flow = replace(NONE, run_flow=0.03, flow=0.5)
    assert thickness_cv(0.04, flow, None) == pytest.approx(0.05)
    found = printed(rows[1].spans, TEN_MICRONS, spacing=1.0)
    assert found is not None
    # Independent runs, 0.01 mm each: a strip between two of them is off by half their difference.
    assert thickness_cv(0.0, TEN_MICRONS, found) == pytest.approx(0.01 / np.sqrt(2.0), rel=0.03)
