"""Curves cut to where a field is large enough: crossings, seams of closed ones, and what is spared."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.toolpath.guided import parts_within


def _parts(values: list[float], *, closed: bool = False, spared: float = 0.0) -> list[tuple[list[float], bool]]:
    """Return the parts above 1 of a curve whose places count along x."""
    places = np.column_stack([np.arange(float(len(values))), np.zeros((len(values), 2))])
    if closed:
        places[-1] = places[0]
    found = parts_within(places, np.array(values), closed=closed, least=1.0, spared=spared, grazing=0.9)
    return [(part[:, 0].tolist(), whole) for part, whole in found]


def test_a_curve_ends_where_the_field_crosses() -> None:
    assert _parts([0.0, 2.0, 2.0, 0.0, 0.5, 1.5]) == [([0.5, 1.0, 2.0, 2.5], False), ([4.5, 5.0], False)]


@pytest.mark.parametrize("closed", [True, False])
def test_all_of_it_or_none(*, closed: bool) -> None:
    assert _parts([2.0, 2.0, 3.0, 2.0], closed=closed) == [([0.0, 1.0, 2.0, 0.0 if closed else 3.0], closed)]
    assert _parts([0.0, 0.5, 0.9, 0.0], closed=closed) == []


def test_a_closed_curve_is_no_longer_one_and_goes_on_over_its_seam() -> None:
    assert _parts([2.0, 2.0, 0.0, 2.0, 2.0], closed=True) == [([2.5, 3.0, 0.0, 1.0, 1.5], False)]


def test_a_little_below_is_spared() -> None:
    assert _parts([0.95, 2.0, 0.95, 2.0, 0.0], spared=0.1) == [([0.0, 1.0, 2.0, 3.0, 3.5], False)]
    assert _parts([0.95, 0.95], spared=0.1) == [([0.0, 1.0], False)]
    assert _parts([0.95, 2.0, 0.0, 2.0, 0.95], closed=True, spared=0.1) == [([2.5, 3.0, 0.0, 1.0, 1.5], False)]


def test_a_curve_that_grazes_ends_where_it_leaves() -> None:
    ((line, _),) = _parts([0.0, 0.95, 0.95, 2.0, 0.95, 0.95, 0.0], spared=0.1)
    assert line == pytest.approx([0.9 / 0.95, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0 - 0.9 / 0.95])
    ((line, _),) = _parts([0.0, 0.95, 0.95, 0.95, 0.0], spared=0.1)
    assert line[0] == pytest.approx(0.9 / 0.95)
    assert line[-1] == pytest.approx(4.0 - 0.9 / 0.95)
