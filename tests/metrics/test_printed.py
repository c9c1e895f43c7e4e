"""What errors make of a thickness: known answers, laws, and prints that are made without the sampler."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.paths.expected import NONE, expected_print, small_part
from benchmarks.paths.reprints import planned_cv, reprinted
from geoprint.metrics import Printed, Uniformity, alike, difference, joined_spans, printed, standoff_within, uniformity
from geoprint.metrics.spacing import no_spans, node_counts, strays
from geoprint.model import FloatArray, PoseStream, PrintErrors, Surface
from tests.meshes import plate
from tests.metrics.deposits import deposited, straight_line

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


def in_print(
    measured: Uniformity, errors: PrintErrors, *, poses: PoseStream | None = None, along: FloatArray | None = None
) -> Printed:
    """Return what is expected of a plan that is even, or whose thickness along the paths is given."""
    level = np.ones(len(measured.along)) if along is None else along
    return printed(float(level.std() / level.mean()), level, measured, errors, poses=poses)


def spread(measured: Uniformity, errors: PrintErrors, poses: PoseStream | None) -> tuple[float, ...]:
    """Return the variances of plan, flow, runs, along runs, placement, needle and an arm off its paths."""
    return in_print(measured, errors, poses=poses).variances


def test_repeatability_is_that_of_iso_9283() -> None:
    rng = np.random.default_rng(3)
    for dimensions, factor in ((3, IN_SPACE), (2, IN_A_PLANE)):
        away = np.linalg.norm(rng.standard_normal((400_000, dimensions)), axis=1)
        assert away.mean() + 3.0 * away.std() == pytest.approx(factor, rel=0.005)
    errors = PrintErrors(repeatability=IN_SPACE, path_repeatability=IN_A_PLANE)
    assert errors.run_deviation == pytest.approx(1.0, rel=1e-4)
    assert errors.path_deviation == pytest.approx(1.0, rel=1e-4)


def test_spans_lead_straight_across_to_the_runs_beside(rows: tuple[PoseStream, Uniformity]) -> None:
    samples, left, right = rows[1].sides.strips
    assert samples.size == left.count == right.count > 1000
    for spans, side in ((left, 1), (right, -1)):
        assert spans.feet - spans.places == pytest.approx(np.tile([0.0, side, 0.0], (spans.count, 1)), abs=1e-9)
        assert spans.towards == pytest.approx(np.tile([0.0, side, 0.0], (spans.count, 1)), abs=1e-9)
        assert spans.beyond == pytest.approx(spans.towards, abs=1e-9)
        assert (spans.runs[:, 1] == spans.runs[:, 0] + side).all()
        assert spans.arcs[:, 1] == pytest.approx(spans.arcs[:, 0], abs=1e-9)
    # Along the first and the last row lies the rim.
    along_rim, to_rim = rows[1].sides.rims
    places = rows[1].sides.places[along_rim]
    assert set(places[:, 1].round(6)) == {0.5, 29.5}
    assert (np.sign(to_rim.towards[:, 1]) == np.where(places[:, 1] < 15.0, -1.0, 1.0)).all()
    assert to_rim.arcs[:, 0] == pytest.approx(places[:, 0], abs=1e-6)


def test_ten_microns_are_0_8_percent_of_a_millimetre_and_2_of_less(rows: tuple[PoseStream, Uniformity]) -> None:
    finer = measured_rows(30, spacing=0.4)
    # Of rows that are off by 0.01 mm each the layer has the variance 0.01^2 / (4 sqrt(pi) 0.6^3) of 1 mm squared.
    share = 1.0 / (4.0 * np.sqrt(np.pi) * 0.6**3)
    for (poses, measured), spacing in ((rows, 1.0), (finer, 0.4)):
        found = in_print(measured, TEN_MICRONS, poses=poses)
        cv = 0.01 / spacing * np.sqrt(share)
        assert cv == pytest.approx(0.00808 / spacing, rel=1e-3)
        assert found.cv.mean == pytest.approx(cv, rel=0.06)
        assert found.cv.low < 0.9 * cv < 1.1 * cv < found.cv.high


def test_what_moves_all_paths_alike_leaves_less_along_the_rim_alone(rows: tuple[PoseStream, Uniformity]) -> None:
    found = in_print(rows[1], replace(NONE, placement=0.1), poses=rows[0])
    # Two of 30 rows lie along the rim: a tenth of a spacing is missing along one, and too much along the other.
    assert found.variances[4] == pytest.approx(2.0 / 30.0 * 0.01 / (np.sqrt(np.pi) * 0.6), rel=0.02)
    turned = in_print(rows[1], replace(NONE, needle_runout=0.3), poses=rows[0])
    assert turned.variances[:5] == pytest.approx((0.0,) * 5, abs=1e-12)
    assert turned.variances[5] == pytest.approx(9.0 * found.variances[4], rel=0.02)
    # An arm that is off by a mean of 0.1253 mm in the plane square to its paths is off by 0.1 mm along each axis.
    off = in_print(rows[1], replace(NONE, path_accuracy=0.125331), poses=rows[0])
    assert off.variances[:6] == pytest.approx((0.0,) * 6, abs=1e-12)
    assert off.variances[6] == pytest.approx(found.variances[4], rel=0.02)
    assert off.largest_error == "path_accuracy"


def test_an_arm_off_its_paths_changes_spans_by_what_it_changes_along_them(rows: tuple[PoseStream, Uniformity]) -> None:
    spans = rows[1].sides.spans[1]
    map_off = strays(spans, replace(NONE, path_accuracy=0.125331), poses=None)[4].toarray()
    centre = spans.places.mean(axis=0)
    a, b = (np.column_stack([np.ones(spans.count), (ends - centre) / 100.0]) for ends in (spans.places, spans.feet))
    norms = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    assert (map_off**2).sum(axis=1) == pytest.approx(2.0 * 0.01 * (1.0 - (a * b).sum(axis=1) / norms), rel=1e-5)
    # Spans are 1 mm long across the rows: a thousandth of a spacing, where 0.1 mm change in 100 mm.
    assert np.sqrt((map_off**2).sum(axis=1)) == pytest.approx(0.001, rel=0.1)
    # A shift alone leaves spans in the middle as they are; what grows along y makes all of them longer, to the right.
    middle = np.abs(spans.places - centre)[:, 1] < 1.0
    assert np.abs(map_off[middle, :3]).max() < 3e-5
    assert map_off[middle, 2 * 3 + 1] == pytest.approx(np.tile(0.001, middle.sum()), rel=0.01)


def test_the_arm_keeps_the_standoff_within_two_deviations_along_the_normal() -> None:
    # Mean distances of 0.114 mm in a plane: a deviation of 0.0910 mm along each axis, and 1.96 of them.
    assert standoff_within(replace(NONE, path_accuracy=0.114)) == pytest.approx(0.17828, abs=1e-5)
    all_of_arm = replace(NONE, path_accuracy=0.114, repeatability=0.05 * IN_SPACE, path_repeatability=0.05 * IN_A_PLANE)
    assert standoff_within(all_of_arm) == pytest.approx(1.96 * np.sqrt(0.09096**2 + 2 * 0.05**2), rel=1e-4)
    assert standoff_within(replace(PrintErrors(), path_accuracy=0.0)) is None


def test_flow_from_run_to_run_is_shared_by_neighbours(rows: tuple[PoseStream, Uniformity]) -> None:
    found = in_print(rows[1], replace(NONE, run_flow=0.03, flow=0.5))
    assert found.variances[1] == pytest.approx(0.03**2 / (2.0 * np.sqrt(np.pi) * 0.6), rel=0.05)
    # Thirty runs: a print of this cell may be a third more or less even than the mean of all.
    assert found.cv.low < 0.8 * found.cv.mean < 1.2 * found.cv.mean < found.cv.high


def test_an_error_is_a_smaller_share_of_a_wider_spacing(rows: tuple[PoseStream, Uniformity]) -> None:
    poses, measured = rows

    def twice_below_the_middle(places: FloatArray) -> FloatArray:
        return np.where(places[:, 1] < 15.0, 2.0, 1.0)

    level = np.ones(len(measured.along))
    found = printed(0.0, level, measured, TEN_MICRONS, poses=poses, wanted=twice_below_the_middle)
    plain = printed(0.0, level, measured, TEN_MICRONS, poses=poses)
    wide = (measured.sides.places[measured.sides.strips[0], 1] < 15.0).mean()
    assert 0.4 < wide < 0.6
    assert found.variances[2] == pytest.approx((1.0 - 0.75 * wide) * plain.variances[2], rel=0.05)


def test_a_bent_needle_counts_where_the_tool_turns_from_run_to_run(rows: tuple[PoseStream, Uniformity]) -> None:
    poses, measured = rows
    turned = (Rotation.from_quat(poses.quaternions, scalar_first=True) * Rotation.from_euler("z", np.pi)).as_quat(
        scalar_first=True
    )
    # Two rows with the tool turned follow two without, so that neighbours on both sides are off otherwise.
    in_pairs = (poses.runs // 2 % 2 == 1)[:, None]
    turning = replace(poses, quaternions=np.where(in_pairs, turned, poses.quaternions))
    bent = replace(NONE, needle_runout=0.05)
    rim = spread(measured, bent, poses)[5]
    # The strip between one row that is off by 0.05 mm and one that is off by -0.05 mm is 0.05 mm wider or narrower.
    assert spread(measured, bent, turning)[5] - rim == pytest.approx(0.05**2, rel=0.03)
    assert spread(measured, bent, None)[5] == 0.0


def test_what_strays_along_a_run_fades_with_the_stated_length(rows: tuple[PoseStream, Uniformity]) -> None:
    spans, errors = rows[1].sides.spans[1], replace(NONE, path_repeatability=IN_A_PLANE, correlation=3.0)
    some = spans.some(np.flatnonzero(spans.runs[:, 0] == 5))
    along = strays(some, errors, poses=None)[1].toarray()
    apart = some.arcs[:, :1] - some.arcs[:, 0]
    # Sample and foot are independent of each other: twice the covariance.
    assert along @ along.T == pytest.approx(2.0 * np.exp(-0.5 * (apart / 3.0) ** 2), abs=0.02)
    assert node_counts(some, errors).size == 6


@pytest.mark.parametrize(
    ("radius", "errors"), [(12.0, PrintErrors()), (np.inf, PrintErrors(correlation=2.0, repeatability=0.04))]
)
def test_the_interval_holds_about_95_of_100_prints_that_are_made_and_measured_otherwise(
    radius: float, errors: PrintErrors
) -> None:
    part = small_part(radius)
    stated = expected_print(part, errors).cv
    assert planned_cv(part.lines, part.layer) == pytest.approx(part.measured.thickness.cv, rel=0.1)
    cvs = reprinted(part.lines, errors, part.layer, prints=400, rng=np.random.default_rng(11))
    assert 0.9 <= ((cvs >= stated.low) & (cvs <= stated.high)).mean() <= 0.98
    # The rim of this small part is longer than the ring along it by a tenth.
    assert stated.mean == pytest.approx(cvs.mean(), rel=0.16)


def test_what_is_expected_is_the_same_every_time(rows: tuple[PoseStream, Uniformity]) -> None:
    one, again = (in_print(rows[1], PrintErrors()) for _ in range(2))
    assert (one.cvs == again.cvs).all()
    # Printed again, the same plan comes out otherwise: arm and flow stray anew.
    apart = difference(one, again)
    assert apart.mean == pytest.approx(0.0, abs=1e-12)
    assert apart.low == pytest.approx(-apart.high)


@pytest.mark.parametrize("order", [[3, 0, 4, 1, 2], [4, 3, 2, 1, 0]])
def test_the_order_in_which_runs_are_printed_changes_no_print(order: list[int]) -> None:
    # Rows of another length each: nothing but their order differs.
    lines = [straight_line((0.0, 0.5 + y), (8.0 + y, 0.5 + y)) for y in range(5)]
    found: list[Printed] = []
    for runs in (range(5), order):
        poses = deposited([lines[i] for i in runs], list(range(5)))
        found.append(in_print(uniformity(poses, plate((12.0, 5.0), (12, 5)), spacing=1.0), PrintErrors()))
    np.testing.assert_allclose(found[0].cvs, found[1].cvs, atol=1e-9)


def test_two_prints_in_a_row_stand_on_the_same_cell() -> None:
    part = small_part(12.0)
    of_cell = replace(NONE, placement=0.1, needle_runout=0.05, path_accuracy=0.1)
    placed = expected_print(part, of_cell).cvs.reshape(-1, 2)
    assert (placed[:, 0] == placed[:, 1]).all()
    assert np.unique(placed[:, 0]).size == len(placed)
    strayed = expected_print(part, TEN_MICRONS).cvs.reshape(-1, 2)
    one, other = strayed.T - strayed.mean()
    assert abs((one * other).mean() / (one.std() * other.std())) < 0.1


def test_plans_are_alike_where_neither_is_more_even_in_95_of_100_prints(rows: tuple[PoseStream, Uniformity]) -> None:
    wave = np.sin(np.arange(len(rows[1].along)) * 0.9)
    even, hardly, much = (in_print(rows[1], PrintErrors(), along=1.0 + size * wave) for size in (0.0, 0.004, 0.06))
    assert alike(hardly, even)
    assert not alike(much, even)
    apart = difference(much, even)
    assert 0.0 < apart.low < apart.mean < apart.high
    assert even.largest_error in {"path_repeatability", "placement"}
    assert much.largest_error is None
    assert much.shares["plan"] == pytest.approx(0.06**2 / 2 / sum(much.variances), rel=0.02)


def test_where_no_path_has_a_neighbour_the_rim_and_the_flow_are_left() -> None:
    _, measured = measured_rows(1, spacing=1.0)
    assert measured.sides.strips[0].size == 0
    found = in_print(measured, PrintErrors())
    # One run has no other to differ from.
    assert found.variances[1] == pytest.approx(0.0, abs=1e-12)
    assert found.variances[4] > 0.0
    assert joined_spans(no_spans(), no_spans()).count == 0


def test_of_many_samples_some_tell_what_errors_do(
    rows: tuple[PoseStream, Uniformity], monkeypatch: pytest.MonkeyPatch
) -> None:
    all_of_them = in_print(rows[1], PrintErrors())
    monkeypatch.setattr(sys.modules["geoprint.metrics.printed"], "MOST_SAMPLES", 301)
    some = in_print(rows[1], PrintErrors())
    assert some.planned == all_of_them.planned
    assert some.cv == pytest.approx(all_of_them.cv, rel=0.06)


def test_errors_that_no_sample_has_are_not_drawn_where_there_are_very_many(
    rows: tuple[PoseStream, Uniformity], monkeypatch: pytest.MonkeyPatch
) -> None:
    module = sys.modules["geoprint.metrics.printed"]
    monkeypatch.setattr(module, "MOST_SAMPLES", 5)
    counts: list[int] = []
    normal: Callable[[int, int], FloatArray] = module._normal

    def counted(batch: int, count: int) -> FloatArray:
        counts.append(count)
        return normal(batch, count)

    monkeypatch.setattr(module, "_normal", counted)
    of_all = in_print(rows[1], PrintErrors())
    monkeypatch.setattr(module, "MOST_DRAWN", 0)
    of_some = in_print(rows[1], PrintErrors())
    assert counts[-1] < 0.8 * counts[0]
    assert of_some.variances == of_all.variances
    assert of_some.cv == pytest.approx(of_all.cv, rel=0.06)
