"""The pieces of runs of each attitude: together the whole deposit, with beads that fade into each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.model import PoseStream
from geoprint.positioner import Attitude
from geoprint.workflow.tilting import portions

UP = np.array([0.0, 0.0, 1.0])
CRITICAL = float(np.radians(30.0))


def deposit(*counts: int) -> PoseStream:
    """Straight runs beside one another, a pose a millimetre."""
    count = sum(counts)
    arcs = np.concatenate([np.arange(each, dtype=np.float64) for each in counts])
    runs = np.repeat(np.arange(len(counts)), counts)
    return PoseStream(
        tips=np.column_stack([arcs, 5.0 * runs, np.ones(count)]).astype(np.float64),
        quaternions=np.tile([0.0, 1.0, 0.0, 0.0], (count, 1)),
        normals=np.tile(UP, (count, 1)),
        runs=runs,
        levels=runs,
        layers=np.zeros(count, dtype=np.int64),
        deposit=np.ones(count, dtype=np.bool_),
        stops=np.zeros(count, dtype=np.bool_),
        arcs=arcs,
        flow=np.full(count, 0.5),
        standoff=1.0,
    )


def attitude(*pieces: tuple[int, int]) -> Attitude:
    return Attitude(UP, 0.5, np.array(pieces))


# Two runs of 20 and 10 poses; the first is cut twice, the second is printed as one between.
POSES = deposit(20, 10)
ATTITUDES = (attitude((0, 9), (20, 30)), attitude((8, 11)), attitude((10, 20)))


@pytest.mark.parametrize("overlap", [0.0, 1.0, 3.0, 50.0])
def test_shares_of_all_pieces_add_to_one_along_the_whole_deposit(overlap: float) -> None:
    found = portions(ATTITUDES, POSES, overlap=overlap, critical=CRITICAL)
    volumes = np.zeros(POSES.count - 1)
    for one in found:
        for (first, behind), shares in zip(one.pieces.tolist(), one.shares, strict=True):
            assert shares.size == behind - first
            assert shares.min() >= 0.0
            assert shares.max() == 1.0
            volumes[first : behind - 1] += (shares[1:] + shares[:-1]) / 2.0
    within = np.diff(POSES.runs) == 0
    np.testing.assert_allclose(volumes[within], 1.0, atol=1e-12)
    assert not volumes[~within].any()


def test_pieces_overlap_by_what_is_asked_for_and_no_farther_than_the_piece_before() -> None:
    meeting, some, much = (
        portions(ATTITUDES, POSES, overlap=overlap, critical=CRITICAL) for overlap in (0.0, 3.0, 50.0)
    )
    assert [one.pieces.tolist() for one in meeting] == [[[0, 9], [20, 30]], [[8, 11]], [[10, 20]]]
    assert [one.pieces[0].tolist() for one in some] == [[0, 9], [5, 11], [8, 20]]
    assert [one.pieces[0].tolist() for one in much] == [[0, 9], [0, 11], [8, 20]]
    assert all((shares == 1.0).all() for one in meeting for shares in one.shares)


def test_a_bead_that_goes_on_grows_as_the_one_before_fades() -> None:
    before, after, _ = portions(ATTITUDES, POSES, overlap=3.0, critical=CRITICAL)
    np.testing.assert_allclose(before.shares[0][5:9], [1.0, 2 / 3, 1 / 3, 0.0])
    np.testing.assert_allclose(after.shares[0][:4], [0.0, 1 / 3, 2 / 3, 1.0])
    # What is a run by itself neither grows nor fades.
    assert (before.shares[1] == 1.0).all()


def test_beads_overlap_no_farther_than_where_they_would_overhang() -> None:
    # The run leans by 5 degrees a millimetre; what goes on at 40 degrees is printed with 60 degrees up.
    leans = np.radians(5.0 * np.arange(20))
    poses = replace(deposit(20), normals=np.column_stack([np.sin(leans), np.zeros(20), np.cos(leans)]))

    def pieces(up_deg: float, overlap: float) -> list[list[int]]:
        up = np.array([np.sin(np.radians(up_deg)), 0.0, np.cos(np.radians(up_deg))])
        attitudes = (Attitude(UP, 0.5, np.array([[0, 9]])), Attitude(up, 0.5, np.array([[8, 20]])))
        first, second = portions(attitudes, poses, overlap=overlap, critical=CRITICAL)
        return [*first.pieces.tolist(), *second.pieces.tolist()]

    # 30 degrees are 60 before the 6th pose, and nothing is farther before than the overlap.
    assert pieces(60.0, 5.0) == [[0, 9], [6, 20]]
    assert pieces(60.0, 1.0) == [[0, 9], [7, 20]]
    # What overhangs in both goes on where the other ends.
    assert pieces(85.0, 5.0) == [[0, 9], [8, 20]]
