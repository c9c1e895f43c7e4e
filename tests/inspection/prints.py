"""Rows on a plate, printed and scanned, in simulation, and what of them needs open3d."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.inspection.scan_target import PlannedDeposit, ScanTarget
from geoprint.model import FloatArray
from geoprint.simulation import Faults, Sensor, SimulatedScan, deposited_beads, looking_at, scanned
from tests.inspection.drawn import rows_on_plate, stream
from tests.meshes import plate

SPACING, HEIGHT, FLOW = 4.0, 0.5, 1.2
PLATE = plate((40.0, 30.0), (20, 15))
# Every other row runs back, so that beads to the left of all are not the same as a plate that is shifted.
POSES = stream([row[:: 1 - 2 * (number % 2)] for number, row in enumerate(rows_on_plate())], flow=FLOW)
DEPOSIT = PlannedDeposit(POSES, spacing=SPACING, height=HEIGHT)
VIEW = looking_at(np.array([20.0, 15.0, 0.0]), place=np.array([20.0, 15.0, 300.0]), focal=750.0, size=(110, 85))


@cache
def target_of(*, spread: float = 1.0, offset: float = 0.0) -> ScanTarget:
    """Return the plate with beads that are as wide and as far to the left as this."""
    return ScanTarget(PLATE, DEPOSIT, spread=spread, offset=offset)


def pose(*, turn: tuple[float, float, float] = (0.0, 0.0, 0.0), shift: tuple[float, float, float]) -> FloatArray:
    """Return a motion that turns about the middle of the plate [rad] and shifts [mm]."""
    middle = np.array([20.0, 15.0, 0.0])
    rotation: FloatArray = Rotation.from_rotvec(turn).as_matrix()
    return transforms.rigid(rotation, middle + np.array(shift) - rotation @ middle)


def scan_of(
    faults: Faults, *, T_work_scan: FloatArray | None = None, noise: float = 0.03, missing: float = 0.2, seed: int = 1
) -> SimulatedScan:
    """Return a scan of the rows, printed with faults."""
    random = np.random.default_rng(seed)
    beads = deposited_beads(POSES, PLATE, height=HEIGHT, faults=faults, random=random)
    stands = np.eye(4) if T_work_scan is None else T_work_scan
    return scanned(PLATE, beads, Sensor(VIEW, noise, missing), T_work_scan=stands, random=random)
