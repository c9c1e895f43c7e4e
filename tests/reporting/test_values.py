"""The report's values refuse what cannot be drawn, and say why."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.reporting import MOST_FRAMES, BackendView, PathDistances, TableReplay, html_report
from tests.reporting.report_cases import backend, dome, part, replay


def view() -> BackendView:
    return backend("one", surface=dome(rings=4), error=0.1)


def test_a_replay_has_two_to_600_frames() -> None:
    for frames in (1, MOST_FRAMES + 1):
        with pytest.raises(InputError, match=f"{frames} frames"):
            replay(frames=frames)
    assert replay(frames=MOST_FRAMES).times.size == MOST_FRAMES


def test_times_of_a_replay_do_not_go_back() -> None:
    moving = replay()
    with pytest.raises(InputError, match="must rise"):
        replace(moving, times=np.zeros_like(moving.times))
    with pytest.raises(InputError, match="must not fall"):
        replace(moving, bead_times=moving.bead_times[::-1])


def test_a_table_has_frames_at_both_ends_of_each_motion_in_their_order() -> None:
    turning, times = np.array([[0.0, 1.0], [5.0, 6.0]]), np.array([0.0, 0.5, 1.0, 5.0, 6.0])
    stands = np.tile(np.eye(4)[:3], (5, 1, 1))
    assert TableReplay(turning, times, stands, stands[:, None]).part.shape == (5, 3, 4)
    with pytest.raises(InputError, match="moves 2 times, and its 4 frames do not match"):
        TableReplay(turning, times[1:], stands[1:], stands[1:, None])
    with pytest.raises(InputError, match="do not match"):
        TableReplay(turning, np.array([-1.0, 0.0, 1.0, 5.0, 6.0]), stands, stands[:, None])
    with pytest.raises(InputError, match="go back in time"):
        TableReplay(turning[::-1], times, stands, stands[:, None])
    with pytest.raises(InputError, match="go back in time"):
        TableReplay(turning, times[::-1], stands, stands[:, None])


def test_stretches_cover_all_points() -> None:
    with pytest.raises(InputError, match=r"Replay\.bead_offsets"):
        replace(replay(), bead_offsets=np.array([0, 5]))
    with pytest.raises(InputError, match=r"BackendView\.offsets"):
        replace(view(), offsets=np.array([0, 0, view().places.shape[0]]))


def test_ratios_may_be_unmeasured_but_not_infinite_and_not_too_few() -> None:
    shown = view()
    assert np.isnan(shown.ratios).any()
    assert not shown.ratios.flags.writeable
    with pytest.raises(InputError, match="ratios must be"):
        replace(shown, ratios=shown.ratios[1:])
    with pytest.raises(InputError, match="spacing_ratios must be"):
        replace(shown, spacing_ratios=np.full_like(shown.spacing_ratios, np.inf))


def test_there_are_three_classes_of_coverage() -> None:
    with pytest.raises(InputError, match="coverage"):
        replace(view(), coverage=np.full_like(view().coverage, 3))


def test_path_distances_name_every_backend() -> None:
    with pytest.raises(InputError, match="1 name for 2 paths"):
        PathDistances(("one",), np.zeros((2, 2)), np.zeros((2, 2)))


def test_a_part_needs_a_verdict_a_backend_and_values_that_fit() -> None:
    whole = part()
    with pytest.raises(InputError, match="verdict"):
        replace(whole, verdict=())
    with pytest.raises(InputError, match="at least one backend"):
        replace(whole, backends=())
    with pytest.raises(InputError, match="at least one backend"):
        replace(whole, winner=2)
    with pytest.raises(InputError, match="vertices of the view surface"):
        replace(whole, surface=dome(rings=3))
    with pytest.raises(InputError, match="'spacing CV' has 2 values for 1"):
        replace(whole, backends=whole.backends[:1])


def test_a_report_needs_a_part() -> None:
    with pytest.raises(InputError, match="at least one part"):
        html_report([], title="nothing")
