"""What a program lays: by time through a valve, by length where the flow follows the speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.metrics.stack_thickness import deposited_volume, flow_by_length, flow_by_time, flow_of_all
from geoprint.model import FloatArray, PoseStream
from tests.metrics.deposits import deposited, straight_line

# Two lines of 40 mm at 10 mm/s, and 2 s of travel between them.
SPEED, BETWEEN = 10.0, 2.0


def lines() -> PoseStream:
    made = deposited([straight_line((0.0, y), (40.0, y)) for y in (0.0, 1.0)], (0, 1))
    return replace(made, flow=np.full(made.count, 0.4))


def times(stream: PoseStream) -> FloatArray:
    along = stream.surface_points[:, 0] / SPEED
    return along + stream.runs * (4.0 + BETWEEN)


MATERIAL = np.array([[0.0, 4.0], [6.0, 10.0]])


def test_at_the_set_speed_both_lay_what_was_planned() -> None:
    stream = lines()
    for found in (
        flow_by_time(stream, times(stream), MATERIAL, rate=0.4 * SPEED),
        flow_by_length(stream, times(stream), MATERIAL),
    ):
        np.testing.assert_allclose(found, 0.4)
        assert deposited_volume(stream, found) == pytest.approx(0.4 * 80.0)


def test_a_valve_lays_more_where_the_tip_is_slower_and_a_flow_that_follows_does_not() -> None:
    stream = lines()
    slow = np.where(stream.runs == 0, times(stream), 6.0 + 2.0 * (times(stream) - 6.0))
    material = np.array([[0.0, 4.0], [6.0, 14.0]])
    valve = flow_by_time(stream, slow, material, rate=0.4 * SPEED)
    np.testing.assert_allclose(valve, np.where(stream.runs == 0, 0.4, 0.8))
    assert deposited_volume(stream, valve) == pytest.approx(0.4 * SPEED * 12.0)
    np.testing.assert_allclose(flow_by_length(stream, slow, material), 0.4)


def test_what_opens_late_and_shuts_early_is_missing_at_the_ends() -> None:
    stream = lines()
    material = MATERIAL + np.array([[0.5, 0.0], [0.0, -1.0]])
    for found in (
        flow_by_time(stream, times(stream), material, rate=0.4 * SPEED),
        flow_by_length(stream, times(stream), material),
    ):
        x, second = stream.surface_points[:, 0], stream.runs == 1
        np.testing.assert_allclose(found[(~second & (x < 4.7)) | (second & (x > 30.3))], 0.0, atol=1e-12)
        np.testing.assert_allclose(found[(~second & (x > 5.6)) | (second & (x < 29.4))], 0.4)
        assert deposited_volume(stream, found) == pytest.approx(0.4 * 65.0)


def test_half_of_what_flows_while_a_flow_settles_lies_at_the_start_of_each_deposit() -> None:
    stream = lines()
    at_once, settled = (
        flow_by_time(stream, times(stream), MATERIAL, rate=0.4 * SPEED, settle=settle) for settle in (0.0, 0.5)
    )
    # Two lines get 0.25 s of the flow more each, in their first step.
    assert deposited_volume(stream, settled) - deposited_volume(stream, at_once) == pytest.approx(
        2.0 * 0.25 * 0.4 * SPEED
    )
    starts = np.flatnonzero(np.diff(stream.deposited.astype(int), prepend=0) == 1)
    np.testing.assert_array_equal(np.flatnonzero(settled != at_once), sorted([*starts, *(starts + 1)]))


def test_what_flows_while_the_tip_stands_comes_to_its_neighbours() -> None:
    stream = lines()
    points = stream.tips.copy()
    points[51] = points[50]
    waiting = times(stream) + np.where((np.arange(stream.count) > 50), 3.0, 0.0)
    found = flow_by_time(replace(stream, tips=points), waiting, np.array([[0.0, 7.0], [9.0, 13.0]]), rate=4.0)
    assert deposited_volume(replace(stream, tips=points), found) == pytest.approx(4.0 * 11.0)
    assert found.argmax() in (50, 51)


def test_parts_that_share_the_lines_lay_together_what_each_lays_of_them_wherever_they_end() -> None:
    stream = lines()
    count = stream.count
    middle = count // 4
    # One part lays the start of the first line, at twice its flow, the other the rest; both have the pose between them.
    first, second = stream.taken(np.arange(middle + 1)), stream.taken(np.arange(middle, count))
    found = flow_of_all(stream, [(second, second.flow), (first, 2.0 * first.flow)])
    assert deposited_volume(stream, found) == pytest.approx(
        deposited_volume(second, second.flow) + 2.0 * deposited_volume(first, first.flow)
    )
    np.testing.assert_allclose(found[:middle], 0.8)
    np.testing.assert_allclose(found[middle + 1 :], 0.4)
    assert 0.4 < found[middle] < 0.8


def test_beads_that_fade_over_one_another_add_to_one() -> None:
    stream = lines()
    half = stream.count // 2
    first, second = stream.taken(np.arange(half)), stream.taken(np.arange(half, stream.count))
    fading = np.linspace(1.0, 0.0, half)
    found = flow_of_all(
        stream, [(first, fading * first.flow), (first, (1.0 - fading) * first.flow), (second, second.flow)]
    )
    np.testing.assert_allclose(found, 0.4, atol=1e-9)
