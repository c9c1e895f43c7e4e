"""A scan whose pose is about known is registered, errors put into the print are found, and the uncertainty holds."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError
from geoprint.inspection.scan_measuring import MeasuredPrint, measured_print
from geoprint.inspection.scan_registration import Adjusted, Registration, adjusted
from geoprint.inspection.scan_target import ScanTarget
from geoprint.model import FloatArray
from geoprint.simulation import Break, Faults, deposited_beads, heights
from tests.inspection.prints import DEPOSIT, HEIGHT, PLATE, POSES, pose, scan_of, target_of

STANDS = pose(turn=(0.01, -0.008, 0.012), shift=(0.3, -0.25, 0.4))


def found_by(points: FloatArray, *, spread: float = 1.0, offset: float = 0.0) -> tuple[Adjusted, Registration]:
    one = adjusted(points, target_of(spread=spread, offset=offset), start=np.eye(4), steps=40)
    covariance = one.covariance[:6, :6]
    return one, Registration(
        one.T_work_scan, one.middle, covariance, one.loose, float(one.shares[0]), spread, offset, one.noise, one.used
    )


@cache
def measured(faults: Faults, *, spread: float = 1.0, offset: float = 0.0) -> MeasuredPrint:
    scan = scan_of(faults, T_work_scan=STANDS)
    _, found = found_by(scan.points, spread=spread, offset=offset)
    return measured_print(scan.points, found, PLATE, DEPOSIT, random=np.random.default_rng(1))


def test_the_pose_is_found_within_its_uncertainty_and_beads_fix_all_six_directions() -> None:
    within: list[bool] = []
    for seed in range(6):
        scan = scan_of(Faults(flow=1.1), T_work_scan=STANDS, seed=seed)
        one, _ = found_by(scan.points, spread=1.1**0.5)
        left = one.T_work_scan @ transforms.inverse(STANDS)
        turn = Rotation.from_matrix(left[:3, :3]).as_rotvec()
        shift = transforms.apply(left, one.middle[None])[0] - one.middle
        assert np.linalg.norm(shift) < 0.05
        assert np.degrees(np.linalg.norm(turn)) < 0.1
        assert len(one.loose) == 0
        # A floor for the shape of beads is added where scans are registered.
        allowed = 3.0 * np.sqrt(np.diag(one.covariance)[:6]) + np.repeat([3e-4, 6e-3], 3)
        within.append(bool((np.abs(np.concatenate([turn, shift])) < allowed).all()))
        assert one.shares[0] == pytest.approx(1.1, abs=0.03)
    assert sum(within) >= 5


def test_without_a_print_a_flat_part_leaves_three_directions_loose() -> None:
    random = np.random.default_rng(1)
    points = np.column_stack([random.uniform(5.0, 35.0, 3000), random.uniform(5.0, 25.0, 3000), np.full(3000, 0.2)])
    one = adjusted(points, ScanTarget(PLATE, None), start=np.eye(4), steps=20)
    assert len(one.loose) == 3
    # What is loose: the shifts along the plate and the turn about its normal.
    assert np.abs(one.loose[:, [0, 1, 5]]).max() < 1e-6
    assert transforms.apply(one.T_work_scan, points)[:, 2] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("faults", "volume"), [(Faults(), 1.0), (Faults(flow=1.2), 1.2), (Faults(viscosity=1.25), 0.8)]
)
def test_the_volume_that_was_laid_is_found_along_every_run(faults: Faults, volume: float) -> None:
    held = measured(faults, spread=volume**0.5)
    parts = held.parts
    off = (parts.ratios - volume)[parts.seen]
    assert parts.seen.mean() > 0.9
    assert np.abs(off).mean() < 0.03
    assert (np.abs(off) < 1.96 * parts.ratio_deviations[parts.seen]).mean() > 0.85
    cells = held.cells
    total = float((cells.areas * cells.thickness)[cells.seen].sum())
    assert total == pytest.approx(volume * float((cells.areas * cells.planned)[cells.seen].sum()), rel=0.03)
    assert held.bare > 0.2


def test_a_break_is_missing_where_it_is_and_nowhere_else() -> None:
    held = measured(Faults(breaks=(Break(2, 8.0, 24.0),)))
    parts = held.parts
    gone = (parts.runs == 2) & (parts.starts >= 7.9) & (parts.ends <= 24.1) & parts.seen
    assert gone.any()
    assert np.abs(parts.ratios[gone]).max() < 0.1
    whole = parts.seen & (parts.runs != 2)
    assert parts.ratios[whole].min() > 0.85


def test_beads_beside_their_path_are_found_there() -> None:
    straight = measured(Faults()).parts
    assert np.abs(straight.offsets[straight.seen]).max() < 0.1
    parts = measured(Faults(offset=0.2), offset=0.1).parts
    assert parts.offsets[parts.seen].mean() == pytest.approx(0.2, abs=0.03)


@pytest.mark.parametrize("width", [0.5, 1.4])
@pytest.mark.parametrize("share", [1.0, 0.25])
def test_crests_of_narrow_and_wide_beads_are_within_their_intervals_also_where_scans_are_thin(
    width: float, share: float
) -> None:
    within: list[bool] = []
    for seed in range(4):
        faults = Faults(width_scale=width, width_noise=0.03)
        scan = scan_of(faults, seed=seed)
        random = np.random.default_rng(seed)
        few = scan.points[random.random(len(scan.points)) < share]
        _, found = found_by(few, spread=width)
        crests = measured_print(few, found, PLATE, DEPOSIT, random=random).crests
        beads = deposited_beads(POSES, PLATE, height=HEIGHT, faults=faults, random=np.random.default_rng(seed))
        high = heights(beads, beads.places)
        truth = np.array([high[beads.runs == run].mean() for run in crests.runs])
        assert crests.seen.all()
        off = crests.heights - truth
        assert np.abs(off / truth).mean() < 0.03
        # Beads are 7 % lower in the mean over 0.12 of the planned width than at their crest, where they are narrow.
        assert abs(float((off / truth).mean())) < 0.015
        within += (np.abs(off) < 1.96 * crests.deviations).tolist()
        # An interval that is right is not much wider than it must be, either.
        assert float((crests.deviations / truth).max()) < 0.05
    assert np.mean(within) > 0.9


def test_parts_of_a_run_without_points_on_their_crest_are_no_data_and_make_no_run_lower() -> None:
    scan = scan_of(Faults(), T_work_scan=STANDS)
    one, found = found_by(scan.points)
    here = transforms.apply(one.T_work_scan, scan.points)
    whole = measured_print(scan.points, found, PLATE, DEPOSIT, random=np.random.default_rng(1))
    run = int(whole.crests.runs[2])
    # The end of the run loses all that is on its crest, and keeps its flanks.
    away, stretch = DEPOSIT.nearest(here * np.array([1.0, 1.0, 0.0]))
    lost = (away < 0.9) & (DEPOSIT.runs.runs[stretch] == run) & (DEPOSIT.runs.arcs[stretch] > 19.0)
    held = measured_print(scan.points[~lost], found, PLATE, DEPOSIT, random=np.random.default_rng(1))
    gone = (held.parts.runs == run) & held.parts.seen & ~held.parts.crested
    assert gone.any()
    assert (held.parts.crests[gone] == 0.0).all()
    assert held.crests.heights[2] == pytest.approx(whole.crests.heights[2], rel=0.02)


def test_a_scan_beside_the_print_is_refused() -> None:
    far = scan_of(Faults()).points + np.array([0.0, 0.0, 40.0])
    known = Registration(np.eye(4), np.zeros(3), 1e-8 * np.eye(6), np.zeros((0, 6)), 1.0, 1.0, 0.0, 0.03, 1.0)
    with pytest.raises(InputError, match="shows no run of the plan"):
        measured_print(far, known, PLATE, DEPOSIT, random=np.random.default_rng(1))
