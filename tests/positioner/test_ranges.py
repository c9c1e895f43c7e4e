"""Other directions that the beads of an attitude admit, and what is left at one."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.positioner import UpRange
from geoprint.transforms import angles_between
from tests.positioner.cones import CRITICAL, Z, cone, directions, meridian


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
