"""What is stated of a pose holds, also where beads differ from the plan along their runs as no part of a run does."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from geoprint import transforms
from geoprint.inspection.scan_registration import POSE, adjusted
from geoprint.simulation import Faults
from tests.inspection.prints import scan_of, target_of

SEEDS, LEVEL = 12, 0.95


def test_poses_lie_within_what_is_stated_where_the_width_of_beads_varies_at_random() -> None:
    offs: list[float] = []
    for seed in range(SEEDS):
        scan = scan_of(Faults(width_noise=0.05), T_work_scan=np.eye(4), noise=0.02, missing=0.3, seed=seed)
        found = adjusted(scan.points[::2], target_of(), start=np.eye(4), steps=20)
        turn = Rotation.from_matrix(found.T_work_scan[:3, :3]).as_rotvec()
        off = np.concatenate([turn, transforms.apply(found.T_work_scan, found.middle[None])[0] - found.middle])
        offs.append(float(off @ np.linalg.solve(found.covariance[:POSE, :POSE], off)))
    # Of 12, 95 % are 11 with a deviation of 1; without what a fit takes up of the errors it would be 8.
    assert (np.array(offs) < chi2.ppf(LEVEL, POSE)).sum() >= SEEDS - 2
    assert np.mean(offs) / POSE > 0.2
