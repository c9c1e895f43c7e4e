"""All parts of a program together lay what one deposit asks for, or it is said where not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import VerificationError
from geoprint.model import PoseStream
from geoprint.toolpath import check_sum


def deposit(count: int = 11, *, start: int = 0) -> PoseStream:
    """A straight bead, a pose a millimetre."""
    places = np.column_stack([np.arange(start, start + count, dtype=np.float64), np.zeros(count), np.ones(count)])
    return PoseStream(
        tips=places,
        quaternions=np.tile([0.0, 1.0, 0.0, 0.0], (count, 1)),
        normals=np.tile([0.0, 0.0, 1.0], (count, 1)),
        runs=np.zeros(count, dtype=np.int64),
        levels=np.zeros(count, dtype=np.int64),
        layers=np.zeros(count, dtype=np.int64),
        deposit=np.ones(count, dtype=np.bool_),
        stops=np.isin(np.arange(count), [0, count - 1]),
        arcs=np.arange(count, dtype=np.float64),
        flow=np.full(count, 0.5),
        standoff=1.0,
    )


def faded(stream: PoseStream, rows: slice, shares: list[float]) -> PoseStream:
    flow = stream.flow.copy()
    flow[rows] *= shares
    return replace(stream, flow=flow)


def test_beads_that_meet_or_fade_into_each_other_are_one() -> None:
    whole = deposit()
    check_sum(whole, [whole.between(0, 6), whole.between(5, 11)])
    fading, growing = [1.0, 2 / 3, 1 / 3, 0.0], [0.0, 1 / 3, 2 / 3, 1.0]
    check_sum(
        whole, [faded(whole.between(0, 6), slice(2, 6), fading), faded(whole.between(2, 11), slice(0, 4), growing)]
    )


def test_what_is_missing_or_laid_twice_or_elsewhere_is_told_with_its_place() -> None:
    whole = deposit()
    with pytest.raises(
        VerificationError, match=r"lay 0 mm3 in run 1 at \(5.50, 0.00, 0.00\) mm, the paths ask for 0.5"
    ):
        check_sum(whole, [whole.between(0, 6), whole.between(6, 11)])
    with pytest.raises(VerificationError, match="lay 1 mm3 in run 1"):
        check_sum(whole, [whole.between(0, 7), whole.between(5, 11)])
    with pytest.raises(VerificationError, match="part 2 lays material in its run 1"):
        check_sum(whole, [whole, deposit(3, start=20)])


def test_a_line_that_is_passed_twice_asks_for_both() -> None:
    once = deposit()
    twice = replace(
        once,
        **{
            name: np.concatenate([getattr(once, name)] * 2)
            for name in ("tips", "quaternions", "normals", "levels", "layers", "deposit", "stops", "arcs", "flow")
        },
        runs=np.repeat([0, 1], once.count),
    )
    check_sum(twice, [once, once])
    with pytest.raises(VerificationError, match="the paths ask for 1"):
        check_sum(twice, [once])
