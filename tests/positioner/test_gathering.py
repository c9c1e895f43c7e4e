"""Pieces of runs gathered by attitude: everything is printed once, admitted, and with fewer moves where it can be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import InputError
from geoprint.model import FloatArray, IntArray
from geoprint.positioner import Attitude, Margins, UpRange, attitudes_of, gathered, tilted
from geoprint.transforms import angles_between

CRITICAL = float(np.radians(30.0))
Z = np.array([0.0, 0.0, 1.0])


def cone(half_angle_deg: float) -> Margins:
    """Return the margins of a table that tilts by an angle to all sides."""
    return lambda ups: 1.0 - angles_between(ups, Z) / np.radians(half_angle_deg)


def rings(polar_deg: FloatArray, *, each: int) -> tuple[FloatArray, IntArray]:
    """Return normals and runs of circles on a sphere, with as many poses each."""
    turns = np.linspace(0.0, 2.0 * np.pi, each)
    polar, turn = np.radians(np.repeat(polar_deg, each)), np.tile(turns, polar_deg.size)
    normals = np.column_stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
    return normals, np.repeat(np.arange(polar_deg.size), each)


def check(found: tuple[Attitude, ...], normals: FloatArray, runs: IntArray, *, range_deg: float) -> None:
    """Check that each step of each run is printed once, in an attitude that admits its start and that the table takes.

    It admits the end as well, unless the table takes none that admits both.
    """
    printed = np.zeros(len(normals), dtype=np.int64)
    within = UpRange(cone(range_deg), rest=Z, critical=CRITICAL)
    for one in found:
        assert angles_between(one.up[None], Z)[0] <= np.radians(range_deg) + 1e-6
        for start, end in one.pieces.tolist():
            assert end - start > 1
            assert np.unique(runs[start:end]).size == 1
            printed[start : end - 1] += 1
            angles = angles_between(normals[start:end], one.up)
            assert angles[:-1].max() <= CRITICAL + 1e-6
            for end_of_step in start + np.flatnonzero(angles > CRITICAL + 1e-6):
                assert not len(within.admissible(normals[end_of_step - 1 : end_of_step + 1]))
    goes_on = np.append(np.diff(runs) == 0, False)
    np.testing.assert_array_equal(printed[goes_on], 1)
    np.testing.assert_array_equal(printed[~goes_on], 0)


def test_rings_about_an_apex_need_a_fraction_of_the_moves_of_their_order() -> None:
    normals, runs = rings(np.arange(2.0, 85.0, 3.0), each=120)
    within = UpRange(cone(90.0), rest=Z, critical=CRITICAL)
    kept = tilted(normals, runs=runs, within=within)
    found = gathered(normals, runs=runs, layers=np.zeros_like(runs), lengths=np.ones(len(runs)), within=within)
    check(found, normals, runs, range_deg=90.0)
    check(attitudes_of(kept, runs), normals, runs, range_deg=90.0)
    # A cap of 85 degrees has 0.91 of a half sphere; a cap of 30 degrees 0.13 of one, and caps overlap.
    assert 7 <= len(found) <= 16
    assert kept.moves > 3 * len(found)


def test_a_step_between_two_attitudes_is_laid_in_the_one_that_admits_both_of_its_ends() -> None:
    normals, runs = rings(np.arange(2.0, 85.0, 3.0), each=400)
    within = UpRange(cone(90.0), rest=Z, critical=CRITICAL)
    found = gathered(normals, runs=runs, layers=np.zeros_like(runs), lengths=np.ones(len(runs)), within=within)
    steepest = np.array([angles_between(normals[a:b], one.up).max() for one in found for a, b in one.pieces.tolist()])
    assert steepest.max() <= CRITICAL + 1e-6


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_whatever_lies_within_range_is_admitted_and_printed_once(seed: int) -> None:
    random = np.random.default_rng(seed)
    normals, runs = rings(random.uniform(0.0, 55.0, 6), each=int(random.integers(2, 30)))
    within = UpRange(cone(30.0), rest=Z, critical=CRITICAL)
    found = gathered(normals, runs=runs, layers=np.zeros_like(runs), lengths=np.ones(len(runs)), within=within)
    check(found, normals, runs, range_deg=30.0)


def test_layers_stay_in_their_order() -> None:
    normals, runs = rings(np.array([50.0, 10.0, 50.0, 10.0]), each=40)
    layers = runs // 2
    within = UpRange(cone(60.0), rest=Z, critical=CRITICAL)
    found = gathered(normals, runs=runs, layers=layers, lengths=np.ones(len(runs)), within=within)
    order = [int(layers[one.pieces[0, 0]]) for one in found]
    assert order == sorted(order)
    assert all(np.unique(layers[one.pieces[:, 0]]).size == 1 for one in found)


def test_what_overhangs_whatever_the_table_does_is_printed_all_the_same() -> None:
    normals, runs = rings(np.array([80.0]), each=60)
    within = UpRange(cone(20.0), rest=Z, critical=CRITICAL)
    found = gathered(normals, runs=runs, layers=np.zeros_like(runs), lengths=np.ones(len(runs)), within=within)
    worst = max(
        float(angles_between(normals[start : end - 1], one.up).max()) for one in found for start, end in one.pieces
    )
    # 80 degrees less the 20 of the table are the least; 1 degree of give lets poses share an attitude.
    assert np.radians(60.0) - 1e-6 <= worst <= np.radians(61.1)
    assert sum(int(end - start - 1) for one in found for start, end in one.pieces) == 59


def test_tilts_are_told_by_attitude_with_the_pieces_of_each_run() -> None:
    normals, runs = rings(np.array([5.0, 10.0]), each=10)
    within = UpRange(cone(60.0), rest=Z, critical=CRITICAL)
    kept = tilted(normals, runs=runs, within=within)
    (only,) = attitudes_of(kept, runs)
    np.testing.assert_array_equal(only.pieces, [[0, 10], [10, 20]])
    assert only.slack == pytest.approx(float(kept.slacks[0]))


def test_poses_without_lengths_are_refused() -> None:
    within = UpRange(cone(30.0), rest=Z, critical=CRITICAL)
    with pytest.raises(InputError, match="found 1, 1, 1 and 0"):
        gathered(Z[None], runs=np.zeros(1, np.int64), layers=np.zeros(1, np.int64), lengths=np.empty(0), within=within)
