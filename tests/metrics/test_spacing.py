"""Distance to the level outside: the rounding that is allowed, where fronts meet, and what a small budget leaves."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import VerificationError
from geoprint.geometry import closest
from geoprint.metrics import spacing as module
from geoprint.metrics.deposited import Samples, sampled
from geoprint.metrics.oracle import FlatMesh, GeodesicDistance, SurfacePath, flat_mesh, flat_places
from geoprint.metrics.oracle.tracing import trace
from geoprint.metrics.spacing import meeting_share, outer_distance
from tests.meshes import plate

SURFACE = plate((40.0, 30.0), (80, 60))
MESH: FlatMesh = flat_mesh(SURFACE)


def deposited(*lines: list[tuple[float, float]], levels: list[int] | None = None) -> SurfacePath:
    """Return lines in the plate's plane as runs, one a level from 0 on where nothing else is said."""
    places = np.array([(x, y, 0.0) for line in lines for x, y in line])
    runs = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
    return trace(
        MESH,
        flat_places(MESH, closest(SURFACE, places)[0]),
        runs=runs,
        levels=np.arange(len(lines)) if levels is None else np.array(levels),
        closed=np.zeros(len(lines), dtype=np.bool_),
    )


def of_run(samples: Samples, *runs: int) -> Samples:
    return samples.some(np.isin(samples.runs, runs))


def row(y: float) -> list[tuple[float, float]]:
    return [(0.0, y), (40.0, y)]


def point(x: float, y: float) -> list[tuple[float, float]]:
    """Return a line so short that it is a point."""
    return [(x, y), (x + 1e-7, y)]


def test_a_way_may_be_shorter_than_the_straight_line_by_a_millionth_of_a_millimetre() -> None:
    # Two points 10 mm from the level outside; that level a little nearer to one of them plays a way that is too short.
    # A point is 1e-7 mm long, and half of that is taken off the straight distance.
    path, near, nearer = (
        deposited(point(10.0, 5.0), point(30.0, y), point(10.0, 15.0), point(30.0, 15.0), levels=[0, 0, 1, 1])
        for y in (5.0, 5.0 + 1.03e-6, 5.0 + 1.07e-6)
    )
    samples = of_run(sampled(path, step=0.5), 2, 3)
    for to, short in ((path, 0.0), (near, 1.03e-6)):
        found = outer_distance(MESH, path, GeodesicDistance(MESH, to), samples, spacing=2.0)
        np.testing.assert_allclose(found.distances, [10.0, 10.0, 10.0 - short, 10.0 - short], atol=1e-8)
    with pytest.raises(VerificationError, match=r"at \(30\.000, 15\.000, 0\.000\) mm is 1\.0\de-06 mm shorter"):
        outer_distance(MESH, path, GeodesicDistance(MESH, nearer), samples, spacing=2.0)


def test_the_level_outside_is_the_next_lower_one_whatever_is_nearer() -> None:
    path = deposited(row(3.0), row(9.0), row(8.0), row(9.5), levels=[0, 4, 7, 7])
    samples = sampled(path, step=0.5)
    found = outer_distance(MESH, path, GeodesicDistance(MESH, path), of_run(samples, 1, 2, 3), spacing=2.0)
    wanted = np.repeat([6.0, 1.0, 0.5], 81)
    for measured in (found.distances, found.bounds, found.straight):
        np.testing.assert_allclose(measured, wanted, atol=1e-9)
    assert found.exact.all()


def test_without_work_the_straight_distance_is_the_bound_and_a_way_is_found_all_the_same() -> None:
    path = deposited(row(3.0), row(9.0))
    samples = of_run(sampled(path, step=2.0), 1)
    lame = GeodesicDistance(MESH, path, windows=30)
    found = outer_distance(MESH, path, lame, samples, spacing=2.0)
    reached = np.isfinite(found.distances)
    assert not found.exact.all()
    assert (found.bounds <= 6.0 + 1e-9).all()
    # The pieces of the run are at most as long as a diagonal of the mesh, and the nearest one is 6 mm away.
    assert (found.bounds[~found.exact] > 6.0 - np.sqrt(0.5) / 2.0 - 1e-9).all()
    assert (found.distances[reached] >= 6.0 - 1e-9).all()


def hairpin(gap: float) -> tuple[SurfacePath, Samples]:
    """Return a run that comes back beside itself, and samples every 0.05 mm."""
    path = deposited([(0.0, 10.0), (40.0, 10.0), (40.0, 10.0 + gap), (0.0, 10.0 + gap)])
    return path, sampled(path, step=0.05)


@pytest.mark.parametrize(
    ("gap", "wanted"),
    [
        # Beyond 4 mm along the run and within 2 mm: all but 0.738 mm of either leg beside the turn, and the turn.
        (1.9, 2.0 * (40.0 - 0.738) / 81.9),
        (2.01, 0.0),
    ],
)
def test_fronts_meet_within_a_spacing_of_a_stretch_two_spacings_along_the_run(gap: float, wanted: float) -> None:
    path, samples = hairpin(gap)
    found = meeting_share(path, GeodesicDistance(MESH, path), samples, spacing=2.0)
    assert found == pytest.approx(wanted, abs=0.003)


def test_of_no_samples_none_is_where_fronts_meet() -> None:
    path, samples = hairpin(1.9)
    none = samples.some(np.zeros(samples.runs.size, dtype=np.bool_))
    assert meeting_share(path, GeodesicDistance(MESH, path), none, spacing=2.0) == 0.0


def test_runs_cut_twice_as_finely_are_as_far_away_through_the_air(monkeypatch: pytest.MonkeyPatch) -> None:
    path = deposited([(0.0, 5.0), (13.0, 6.0), (40.0, 5.0)], [(0.0, 7.0), (20.0, 8.0), (40.0, 6.5)])
    samples = of_run(sampled(path, step=0.5), 1)
    distance = GeodesicDistance(MESH, path)
    found = [outer_distance(MESH, path, distance, samples, spacing=2.0).straight]
    monkeypatch.setattr(module, "PIECES_PER_SPACING", 2 * module.PIECES_PER_SPACING)
    found.append(outer_distance(MESH, path, distance, samples, spacing=2.0).straight)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


def test_the_straight_distance_is_that_to_the_corner_of_a_bent_run() -> None:
    corners = [(20.3 + 0.37 * k, 9.2 + 0.23 * k) for k in range(6)]
    bent = [[(0.0, y), (x, y), (x, 30.0)] for x, y in corners]
    for (x, y), line in zip(corners, bent, strict=True):
        path = deposited(line, point(x + 1.2, y - 0.9))
        samples = of_run(sampled(path, step=0.5), 1)
        found = outer_distance(MESH, path, GeodesicDistance(MESH, path), samples, spacing=2.0)
        np.testing.assert_allclose(found.straight, 1.5, atol=1e-6)
        np.testing.assert_allclose(found.distances, 1.5, atol=1e-6)


def test_no_straight_distance_is_thought_longer_than_the_one_to_the_end_of_a_piece() -> None:
    # An edge of the mesh as the level outside, and a point in line with it.
    path = deposited([(10.0, 5.0), (10.5, 5.0)], point(12.0, 5.0))
    samples = of_run(sampled(path, step=0.5), 1)
    found = outer_distance(MESH, path, GeodesicDistance(MESH, path), samples, spacing=2.0)
    np.testing.assert_allclose(found.distances, 1.5, atol=1e-6)
    lame = outer_distance(MESH, path, GeodesicDistance(MESH, path, windows=1), samples, spacing=2.0)
    assert (lame.bounds <= 1.5 + 1e-6).all()
