"""Lead-ins and lead-outs: how the tool comes to its speed before a deposit begins, and slows down behind its end."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.distance.heat import Heat
from geoprint.geometry import boundary_source
from geoprint.model import IntArray, PoseStream, Surface
from geoprint.toolpath import PATTERNS, Leads, arrange, posed_surface, poses
from geoprint.transforms import angles_between, rotation_of
from tests.meshes import plate, spherical_cap
from tests.robot.cells import straight_cell

LENGTH, STANDOFF = 0.5, 0.3
LEADS = Leads(length=LENGTH, radius=2.0)


def stream(surface: Surface, leads: Leads | None, *, spacing: float = 2.0) -> PoseStream:
    paths = PATTERNS["contours"]().paths(surface, boundary_source(surface), backend=Heat(surface), spacing=spacing)
    return poses(
        arrange(paths, surface, speed=20.0), posed_surface(surface, part=surface, body=None), R_base_work=np.eye(3),
        standoff=STANDOFF, retract=5.0, layer_height=0.5, max_tilt=0.3, tool=straight_cell().tool, leads=leads,
    )  # fmt: skip


def ends_of(found: PoseStream, run: int) -> tuple[IntArray, IntArray]:
    """Return the rows of a run from its first to its last deposit, and those of its leads."""
    own = np.flatnonzero((found.runs == run) & found.deposit)
    leads = np.flatnonzero(np.append(found.printing, False) | np.append(False, found.printing))
    return own, leads[(found.runs[leads] == run) & ~found.deposit[leads]]


@pytest.fixture(scope="module")
def cap() -> Surface:
    return spherical_cap(radius=30.0, angle=0.8, rings=30, jitter_seed=2)


def test_runs_begin_and_end_in_motion(cap: Surface) -> None:
    """Each lead goes straight on from its run, at its height, while the tool turns on, and stops at its outer end."""
    found = stream(cap, LEADS)
    for run in range(6):
        own, leads = ends_of(found, run)
        assert not found.stops[own].any()
        before, behind = leads[leads < own[0]], leads[leads > own[-1]]
        np.testing.assert_array_equal(
            np.concatenate([before, own, behind]), np.arange(int(before[0]), int(behind[-1]) + 1)
        )
        np.testing.assert_array_equal(np.flatnonzero(found.stops[leads]), [0, leads.size - 1])
        for outer, end, inner in ((before[0], own[0], own[1]), (behind[-1], own[-1], own[-2])):
            ahead, along = found.tips[outer] - found.tips[end], found.tips[end] - found.tips[inner]
            length, step = np.linalg.norm(ahead), np.linalg.norm(along)
            assert length == pytest.approx(LENGTH)
            # The chord of the first step of a ring of 10 mm or more is off its tangent by less than two degrees.
            assert ahead @ along > np.cos(np.radians(2.0)) * length * step
            assert np.linalg.norm(found.tips[outer]) == pytest.approx(30.0 + STANDOFF, abs=0.05)
            turned = angles_between(*(rotation_of(found.quaternions[rows]) for rows in ([outer, end], [end, inner])))
            assert turned[0] / length == pytest.approx(turned[1] / step, rel=0.01)


def test_leads_change_nothing_but_the_stops_of_the_runs(cap: Surface) -> None:
    with_leads, without = stream(cap, LEADS), stream(cap, None)
    there, plain = with_leads.deposit, without.deposit
    for name in ("tips", "quaternions", "normals", "runs", "levels", "arcs", "flow"):
        np.testing.assert_array_equal(getattr(with_leads, name)[there], getattr(without, name)[plain])
    assert not with_leads.flow[~there].any()
    assert with_leads.deposited.sum() == without.deposited.sum()
    np.testing.assert_array_equal(without.printing, without.deposited)


def test_a_run_that_bends_as_soon_as_it_begins_starts_from_rest(cap: Surface) -> None:
    """The innermost ring of the cap is tighter than 2 mm, the others are not; no ring is wider than 40 mm."""
    found, last = stream(cap, LEADS), int(stream(cap, LEADS).runs.max())
    own, leads = ends_of(found, last)
    assert not leads.size
    np.testing.assert_array_equal(np.flatnonzero(found.stops[own]), [0, own.size - 1])
    none = stream(cap, Leads(length=LENGTH, radius=40.0))
    np.testing.assert_array_equal(none.printing, none.deposited)


def test_rings_of_a_plate_begin_on_its_straight_sides() -> None:
    found = stream(plate((40.0, 30.0), (40, 30), jitter_seed=1), LEADS)
    begins = [ends_of(found, run)[1].size > 0 for run in range(int(found.runs.max()) + 1)]
    assert np.mean(begins) > 0.5
