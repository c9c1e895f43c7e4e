"""Attitudes of a table: what is admissible agrees with all candidates, and moves with the best of all cuts."""

from __future__ import annotations

from functools import cache
from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint import job_of, plan
from geoprint.errors import InputError, LimitError
from geoprint.metrics import overhang
from geoprint.model import FloatArray, IntArray
from geoprint.positioner import Tilts, UpRange, tilted
from geoprint.transforms import angles_between
from tests.positioner.cones import CRITICAL, Z, cone, directions, meridian
from tests.shared_data import shared

# Nearer to the edge than this [rad], caps may meet or miss: neither answer is wrong.
UNDECIDED = 1e-6


def crossings(one: FloatArray, half_one: float, other: FloatArray, half_other: float) -> list[FloatArray]:
    """Return where the borders of two caps cross, by linear algebra."""
    dot = one @ other
    if abs(dot) > 1.0 - 1e-12:
        return []
    a, b = np.linalg.solve(np.array([[1.0, dot], [dot, 1.0]]), [np.cos(half_one), np.cos(half_other)])
    inside = a * one + b * other
    rest = 1.0 - inside @ inside
    if rest < 0.0:
        return []
    across = np.cross(one, other)
    across *= np.sqrt(rest) / np.linalg.norm(across)
    return [inside + across, inside - across]


def meet(normals: FloatArray, *, range_deg: float, give: float) -> bool:
    """Say whether caps, wider by some, and the cone about z share a direction: every corner and centre is tried."""
    caps = [*((normal, CRITICAL + give) for normal in normals), (Z, np.radians(range_deg) + give)]
    tried = [centre for centre, _ in caps]
    for (one, half_one), (other, half_other) in combinations(caps, 2):
        tried += crossings(one, half_one, other, half_other)
    return any(all(angles_between(at, centre) <= half + 1e-12 for centre, half in caps) for at in np.array(tried))


def fewest(normals: FloatArray, runs: IntArray, *, range_deg: float) -> int:
    """Return the fewest stretches over all cuts: dynamic programming, each stretch judged by `meet`."""
    count = len(normals)

    def feasible(first: int, behind: int) -> bool:
        return meet(normals[first:behind], range_deg=range_deg, give=1e-9)

    least = np.full(count + 1, count + 1)
    least[0] = 0
    for behind in range(1, count + 1):
        for cut in range(behind):
            shares = cut > 0 and runs[cut - 1] == runs[cut] and feasible(cut - 1, cut + 1)
            if feasible(cut - 1 if shares else cut, behind):
                least[behind] = min(least[behind], least[cut] + 1)
    return int(least[count])


def tilts(normals: FloatArray, *, range_deg: float, runs: IntArray | None = None, least: float = 0.0) -> Tilts:
    within = UpRange(cone(range_deg), rest=Z, critical=CRITICAL, least=least)
    count = len(normals)
    return tilted(normals, runs=np.zeros(count, dtype=np.int64) if runs is None else runs, within=within)


def holds(found: Tilts, normals: FloatArray, runs: IntArray, *, range_deg: float) -> None:
    """Check that stretches join, and that each keeps every pose of its own within the critical angle and the range."""
    assert found.starts[0] == 0
    assert found.ends[-1] == len(normals)
    for start, before in zip(found.starts[1:], found.ends[:-1], strict=True):
        assert start == before or (start == before - 1 and runs[start] == runs[before])
    assert angles_between(found.ups, Z).max() <= np.radians(range_deg) + 1e-8
    for start, end, up in zip(found.starts, found.ends, found.ups, strict=True):
        assert angles_between(normals[start:end], up).max() <= CRITICAL + 1e-8


@st.composite
def walks(draw: st.DrawFn, *, most_deg: float) -> FloatArray:
    """Draw normals that wander about the sphere within an angle of z."""
    count = draw(st.integers(1, 9))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    step = draw(st.sampled_from([5.0, 15.0, 40.0]))
    polars = most_deg * np.abs(np.sin(np.radians(np.cumsum(random.uniform(-step, step, count))) + 1.0))
    return directions(polars, np.cumsum(random.uniform(-2.0 * step, 2.0 * step, count)))


@settings(max_examples=25, deadline=None)
@given(normals=walks(most_deg=119.0), range_deg=st.sampled_from([10.0, 30.0, 60.0, 90.0]))
def test_a_direction_is_admissible_where_every_corner_and_centre_says_so(normals: FloatArray, range_deg: float) -> None:
    within = UpRange(cone(range_deg), rest=Z, critical=CRITICAL)
    found = within.admissible(normals)
    if len(found):
        assert meet(normals, range_deg=range_deg, give=UNDECIDED)
        assert angles_between(normals, found[0]).max() <= CRITICAL + 1e-8
        assert float(angles_between(found[0], Z)) <= np.radians(range_deg) + 1e-8
    else:
        assert not meet(normals, range_deg=range_deg, give=-UNDECIDED)


@settings(max_examples=15, deadline=None)
@given(normals=walks(most_deg=59.0), data=st.data())
def test_moves_are_as_few_as_the_best_of_all_cuts(normals: FloatArray, data: st.DataObject) -> None:
    runs = np.cumsum(data.draw(st.lists(st.booleans(), min_size=len(normals), max_size=len(normals)))).astype(np.int64)
    range_deg = data.draw(st.sampled_from([30.0, 45.0, 90.0]))
    found = tilts(normals, range_deg=range_deg, runs=runs)
    assert found.moves == fewest(normals, runs, range_deg=range_deg)
    assert not found.missing.any()
    holds(found, normals, runs, range_deg=range_deg)


def small(seed: int) -> tuple[FloatArray, IntArray]:
    """Eight normals of one to three runs: scattered in one case of two, else in small steps."""
    random, count = np.random.default_rng(seed), 8
    polars, turns = random.uniform(0.0, 75.0, count), random.uniform(0.0, 360.0, count)
    if seed % 2:
        polars = np.abs(75.0 * np.sin(np.cumsum(random.uniform(-0.4, 0.4, count))))
        turns = np.cumsum(random.uniform(-40.0, 40.0, count))
    return directions(polars, turns), np.sort(random.integers(0, 1 + seed % 3, count))


def fewest_of_all_cuts(normals: FloatArray, runs: IntArray, *, range_deg: float) -> int:
    """Return the fewest stretches over all cuts of a deposit, every one of which is tried."""
    count = len(normals)

    @cache
    def feasible(first: int, behind: int) -> bool:
        return meet(normals[first:behind], range_deg=range_deg, give=1e-9)

    def carried(first: int, behind: int) -> bool:
        # What is laid across a cut is laid in one attitude where one admits both of its ends.
        shares = first > 0 and runs[first - 1] == runs[first] and feasible(first - 1, first + 1)
        return feasible(first - 1 if shares else first, behind)

    return next(
        number
        for number in range(1, count + 1)
        for cuts in combinations(range(1, count), number - 1)
        if all(carried(first, behind) for first, behind in pairwise([0, *cuts, count]))
    )


def test_with_the_order_fixed_no_cuts_of_any_of_thirty_small_cases_move_the_table_less() -> None:
    moves = [
        (tilts(normals, range_deg=80.0, runs=runs).moves, fewest_of_all_cuts(normals, runs, range_deg=80.0))
        for normals, runs in map(small, range(30))
    ]
    assert [one for one, _ in moves] == [least for _, least in moves]
    # They are no trivial ones: neither one attitude for all, nor one for each pose.
    assert len({least for _, least in moves}) >= 5


def test_a_meridian_of_120_degrees_takes_two_attitudes_and_no_stretch_can_be_joined_to_the_next() -> None:
    normals = meridian(-60.0, 60.0, 121)
    found = tilts(normals, range_deg=90.0)
    assert (found.starts.tolist(), found.ends.tolist()) == ([0, 60], [61, 121])
    within = UpRange(cone(90.0), rest=Z, critical=CRITICAL)
    assert not len(within.admissible(normals))
    assert np.degrees(angles_between(found.ups, Z)) == pytest.approx([30.0, 30.0], abs=0.01)
    assert found.angles.max() == pytest.approx(CRITICAL, abs=1e-8)


def test_of_the_admissible_directions_the_one_with_most_left_is_taken() -> None:
    # One normal at 40 degrees: a share of 30 is left to it as of the cone's 45, at 4 / 7 of the way from rest.
    found = tilts(meridian(40.0, 40.0, 1), range_deg=45.0)
    away = float(np.degrees(angles_between(found.ups[0], Z)))
    assert 1.0 - (40.0 - away) / 30.0 == pytest.approx(1.0 - away / 45.0, abs=0.01)
    assert found.slacks[0] == pytest.approx(1.0 - away / 45.0, abs=1e-3)


def test_what_overhangs_whatever_the_table_does_misses_least_and_is_listed() -> None:
    normals = meridian(0.0, 85.0, 86)
    found = tilts(normals, range_deg=30.0)
    wanted = np.maximum(np.arange(86.0) - 60.0, 0.0)
    assert np.degrees(found.missing) == pytest.approx(wanted, abs=1e-4)
    assert (np.degrees(found.angles) <= 30.0 + wanted + 1.0 + 1e-4).all()
    assert np.degrees(found.angles[:61]).max() <= 30.0 + 1e-4


def test_a_ceiling_opposite_to_rest_misses_by_what_the_range_lacks() -> None:
    found = tilts(np.array([-Z, -Z]), range_deg=90.0)
    assert np.degrees(found.missing) == pytest.approx([60.0, 60.0], abs=1e-3)
    assert np.degrees(found.angles) == pytest.approx([90.0, 90.0], abs=1.1)


def test_a_table_that_turns_everything_up_prints_a_ceiling() -> None:
    found = tilts(meridian(150.0, 180.0, 31), range_deg=180.0)
    assert (found.moves, found.missing.max()) == (1, 0.0)
    assert found.angles.max() <= CRITICAL + 1e-8


def test_a_range_that_is_no_cone_is_kept_and_what_it_lacks_is_told() -> None:
    # Rest, and a spot of 20 degrees about 80 degrees of tilt towards x: nothing between.
    spot = directions(np.array([80.0]), np.array([0.0]))[0]
    within = UpRange(lambda ups: np.maximum(cone(10.0)(ups), cone(20.0, rest=spot)(ups)), rest=Z, critical=CRITICAL)
    normals = meridian(0.0, 130.0, 131)
    found = tilted(normals, runs=np.zeros(131, np.int64), within=within)
    lacking = np.maximum(np.minimum(np.arange(131.0) - 40.0, np.abs(np.arange(131.0) - 80.0) - 50.0), 0.0)
    assert np.degrees(found.missing) == pytest.approx(lacking, abs=0.01)
    at = np.maximum(cone(10.0)(found.ups), cone(20.0, rest=spot)(found.ups))
    assert at.min() >= -1e-9
    assert found.moves == 3


def test_a_margin_that_is_wanted_is_kept() -> None:
    found = tilts(meridian(0.0, 45.0, 46), range_deg=30.0, least=0.5)
    assert np.degrees(angles_between(found.ups, Z)).max() <= 15.0 + 1e-6
    assert found.missing.max() == pytest.approx(0.0, abs=1e-9)
    assert np.degrees(tilts(meridian(0.0, 50.0, 51), range_deg=30.0, least=0.5).missing.max()) == pytest.approx(
        5.0, abs=1e-4
    )


def test_a_pose_is_shared_only_where_its_run_goes_on_and_both_are_admissible() -> None:
    apart = meridian(0.0, 70.0, 2)
    assert tilts(apart, range_deg=90.0).starts.tolist() == [0, 1]
    near = meridian(-31.0, 31.0, 63)
    assert tilts(near, range_deg=90.0).starts.tolist() == [0, 60]
    split = (np.arange(63) >= 61).astype(np.int64)
    assert tilts(near, range_deg=90.0, runs=split).starts.tolist() == [0, 61]


def test_a_table_without_margin_anywhere_is_refused() -> None:
    with pytest.raises(LimitError, match="no direction of the part up with a margin of 2"):
        UpRange(cone(30.0), rest=Z, critical=CRITICAL, least=2.0)


def test_poses_without_normals_or_runs_are_refused() -> None:
    within = UpRange(cone(30.0), rest=Z, critical=CRITICAL)
    with pytest.raises(InputError, match="found 2 and 1"):
        tilted(np.array([Z, Z]), runs=np.zeros(1, np.int64), within=within)
    with pytest.raises(InputError, match="found 0 and 0"):
        tilted(np.empty((0, 3)), runs=np.empty(0, np.int64), within=within)


# Other directions that the beads of an attitude admit, and what is left at one.


def reachable(half_angle_deg: float) -> UpRange:
    return UpRange(cone(half_angle_deg), rest=Z, critical=CRITICAL)


def test_directions_that_admit_all_normals_are_those_in_all_of_their_caps() -> None:
    within, normals = reachable(60.0), meridian(0.0, 40.0, 500)
    found = within.admitting(normals)
    every = within.directions
    angles = np.stack([angles_between(every, one) for one in normals])
    wanted = every[(angles <= CRITICAL + 1e-9).all(axis=0)]
    np.testing.assert_array_equal(found, wanted)
    assert len(found) > 100
    assert not len(within.admitting(meridian(0.0, 61.0, 50)))


def test_what_is_left_is_the_smaller_share_of_angle_and_of_the_table() -> None:
    within = reachable(40.0)
    normals = meridian(0.0, 20.0, 3)
    assert within.slack(directions(np.array([10.0]), np.zeros(1))[0], normals) == pytest.approx(1.0 - 10.0 / 30.0)
    assert within.slack(directions(np.array([30.0]), np.zeros(1))[0], normals[1:]) == pytest.approx(1.0 - 30.0 / 40.0)
    assert within.slack(directions(np.array([50.0]), np.zeros(1))[0], normals) < 0.0
    np.testing.assert_array_equal(within.rest, Z)


# What overhangs without a table and with one: 0 where its range allows, and elsewhere what it lacks.


@pytest.mark.parametrize(("range_deg", "left"), [(30.0, [75.0, 85.0]), (90.0, [])])
def test_rows_of_a_cap_of_85_degrees_overhang_where_the_range_ends(range_deg: float, left: list[float]) -> None:
    polars = np.arange(5.0, 86.0, 10.0)
    azimuths = np.linspace(0.0, 360.0, 361)
    normals = np.concatenate([directions(np.full(361, polar), azimuths) for polar in polars])
    runs = np.repeat(np.arange(polars.size), 361)
    within = UpRange(cone(range_deg), rest=Z, critical=CRITICAL)
    found = tilted(normals, runs=runs, within=within)
    beyond = found.angles > CRITICAL + 1e-8
    assert np.unique(runs[beyond]).tolist() == [polars.tolist().index(polar) for polar in [65.0, *left] if left]
    assert (found.missing[beyond] > 0.0).all()
    expected = [max(polar - range_deg - 30.0, 0.0) for polar in polars]
    assert np.degrees(found.missing) == pytest.approx(np.repeat(expected, 361), abs=1e-4)


@pytest.mark.parametrize("name", ["lv_apex_disc_r20", "mitral_annulus_band_8mm"])
def test_a_real_part_overhangs_no_more_where_the_table_can_prevent_it(name: str) -> None:
    file = shared(f"patches/{name}.ply")
    planned = plan(job_of(surface=file, unit="mm", spacing=4.0, robot=False))
    poses, rest = planned.poses, planned.workpiece.upright[2]
    critical = planned.workpiece.cell.critical_overhang
    before = overhang(poses, up=rest, critical=critical)
    assert before.share > 0.5
    deposited = np.flatnonzero(poses.deposit)
    for range_deg in (30.0, 90.0):
        within = UpRange(cone(range_deg, rest=rest), rest=rest, critical=critical)
        found = tilted(poses.normals[deposited], runs=poses.runs[deposited], within=within)
        ups = np.tile(rest, (poses.count, 1))
        ups[deposited] = found.pose_ups
        after = overhang(poses, up=ups, critical=critical + 1e-8)
        lacking = np.zeros(poses.count, dtype=np.bool_)
        lacking[deposited] = found.missing > 0.0
        beside = poses.deposited & (lacking[1:] | lacking[:-1])
        most = float(np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)[beside].sum())
        assert after.length <= most + 1e-9
        assert after.length < before.length
        assert np.degrees(after.largest - critical) <= np.degrees(found.missing.max()) + 1.001
    assert after.length == 0.0
