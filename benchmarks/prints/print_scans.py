"""Simulated scans of a print on a patch of a heart, and how far from their truth they are registered and measured."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from benchmarks import DATA
from geoprint import transforms
from geoprint.config import job_of
from geoprint.geometry import mean_normal
from geoprint.inspection.records import record_scan
from geoprint.inspection.scan import AppraisedScan, Scan
from geoprint.inspection.scan_measuring import measured_print
from geoprint.inspection.scan_registration import Registration, registered
from geoprint.inspection.scan_target import PlannedDeposit
from geoprint.model import FloatArray, IntArray, PoseStream, Surface
from geoprint.process.feedback import PrintedProgram
from geoprint.reporting.records.inspection import EstimateRecord
from geoprint.simulation import DepositedBeads, Faults, Sensor, deposited_beads, heights, looking_at, scanned
from geoprint.workflow import plan

FLAT, APEX, PLATE = "heart_flat_patch", "heart_apex_patch", "plate"
# Widths of narrow and of wide beads over what their flow asks for.
NARROW, WIDE = (0.45, 0.7), (0.9, 1.2)
SPACING, HEIGHT = 2.5, 0.5
# How far from where it is thought to be a scan is taken [mm, degrees].
OFF_MM, OFF_DEG = 10.0, 5.0
NOISE, MISSING = 0.05, 0.3
# Lines of sight to either side, and how far the sensor is away [mm].
RAYS, AWAY, FOCAL = 260, 300.0, 1200.0
LEVEL = 0.95
# Places of each triangle by which the truth is found, along either side: with fewer it errs more than what is judged.
SIDE = 12


class Registered(NamedTuple):
    """How far a scan is from its truth.

    Attributes:
        shift: of the middle of the scan [mm].
        turn: [degrees].
        stated: standard deviation of the turn, as told [degrees].
        points: of the scan.
        within: whether the true pose lies in the region that the covariance gives 95 %.
        thickness: mean error over the cells of the surface [mm].
        ratio: volume over the planned one, as found.
        cells: share of the cells whose truth is within 1.96 of their standard deviations.
    """

    shift: float
    turn: float
    stated: float
    points: int
    within: bool
    thickness: float
    ratio: float
    cells: float


@cache
def planned_patch(part: str = FLAT) -> tuple[Surface, PoseStream]:
    """Return a patch of a heart and the plan of a layer on it, without a robot."""
    job = job_of(surface=DATA / f"{part}.ply", unit="mm", spacing=SPACING, backend="fast-marching", robot=False)
    planned = plan(job)
    return planned.workpiece.surface, planned.poses


def registered_scan(faults: Faults, *, seed: int, part: str = FLAT, finer: int = 1) -> Registered:
    """Print on the patch with faults, scan it from a place that is badly known, and return what is found.

    Args:
        faults: that are put in.
        seed: of pose, noise and holes.
        part: on which it is printed.
        finer: by how much closer lines of sight lie, along either side.
    """
    surface, poses = planned_patch(part)
    random = np.random.default_rng(seed)
    beads = deposited_beads(poses, surface, height=HEIGHT, faults=faults, random=random)
    up, middle = mean_normal(surface), surface.vertices.mean(axis=0)
    up = up / np.linalg.norm(up)
    size = (finer * RAYS, finer * RAYS)
    view = looking_at(middle, place=middle + AWAY * up, focal=finer * FOCAL, size=size)
    T_work_scan = _away(middle, random)
    scan = scanned(surface, beads, Sensor(view, NOISE, MISSING), T_work_scan=T_work_scan, random=random)
    deposit = PlannedDeposit(poses, spacing=SPACING, height=HEIGHT)
    found = registered(scan.points, surface, deposit, start=np.eye(4))
    held = measured_print(scan.points, found, surface, deposit, random=random)
    cells = held.cells
    off = (cells.thickness - true_thickness(cells.places, surface, beads))[cells.seen]
    shift, turn, within = _error(found, T_work_scan)
    seen = held.parts.seen
    ratio = float(np.average(held.parts.ratios[seen], weights=(held.parts.ends - held.parts.starts)[seen]))
    sure = float((np.abs(off) < 1.96 * cells.deviations[cells.seen]).mean())
    stated = float(np.degrees(found.turn_deviation))
    return Registered(shift, turn, stated, len(scan.points), within, float(np.abs(off).mean()), ratio, sure)


class CrestScan(NamedTuple):
    """What is stated of a thinned scan of a print, each figure with its truth, in the order of the runs.

    Attributes:
        volume: ratio of the volume seen to the planned one, its standard deviation, and the truth.
        crests: (r, 3) crest of each run, its standard deviation, and the truth [mm].
        ratios: (r, 3) likewise of the volume of each run over the planned one.
        lengths: (r,) of the runs [mm].
        points: of the scan.
    """

    volume: tuple[float, float, float]
    crests: FloatArray
    ratios: FloatArray
    lengths: FloatArray
    points: int


def thinned_scan(*, wide: bool, seed: int) -> CrestScan:
    """Print on the patch or the plate with narrow or wide beads, scan and thin at random, and return what is stated."""
    random = np.random.default_rng([seed, int(wide)])
    surface, poses = planned_patch((FLAT, PLATE)[seed // 2 % 2])
    faults = Faults(
        width_scale=random.uniform(*(WIDE if wide else NARROW)), flow=random.uniform(0.85, 1.2),
        offset=random.uniform(-0.15, 0.15), width_noise=random.uniform(0.0, 0.05),
    )  # fmt: skip
    beads = deposited_beads(poses, surface, height=HEIGHT, faults=faults, random=random)
    up, middle = mean_normal(surface), surface.vertices.mean(axis=0)
    view = looking_at(middle, place=middle + AWAY * up / np.linalg.norm(up), focal=FOCAL, size=(RAYS, RAYS))
    sensor = Sensor(view, random.uniform(0.03, 0.06), random.uniform(0.0, MISSING))
    scan = scanned(surface, beads, sensor, T_work_scan=_away(middle, random, share=0.2), random=random)
    points = scan.points[random.random(len(scan.points)) < random.uniform(0.15, 1.0)]
    deposit = PlannedDeposit(poses, spacing=SPACING, height=HEIGHT)
    held = measured_print(
        points, registered(points, surface, deposit, start=np.eye(4)), surface, deposit, random=random
    )  # fmt: skip
    read = Scan("scan.xyz", "", points, len(points), of_mesh=False)
    record = record_scan(
        AppraisedScan(
            scan=read, unit="mm", printed=_as_wanted(held.parts.runs), given=False, surface=surface,
            upright=np.eye(3), spacing=SPACING, printed_with=(), held=held,
        )
    )  # fmt: skip
    high, planned = heights(beads, beads.places), deposit.runs.flows * deposit.runs.lengths
    shown = [run for run in record.runs if run.crest_mm is not None and run.ratio is not None]
    crests = [(*_of(run.crest_mm), float(high[beads.runs == run.run].mean())) for run in shown]
    deposited = [float(beads.volumes[beads.runs == run.run].sum()) / float(planned[deposit.runs.runs == run.run].sum())
            for run in shown]  # fmt: skip
    ratios = [(*_of(run.ratio), truth) for run, truth in zip(shown, deposited, strict=True)]
    whole = (*_of(record.volume_ratio), float(beads.volumes.sum()) / deposit.volume)
    return CrestScan(whole, np.array(crests), np.array(ratios), np.array([run.length_mm for run in shown]), len(points))


def _as_wanted(owners: IntArray) -> PrintedProgram:
    """Return a print of paths alone, which deposit what they ask for; owners: (k,) run of each part."""
    runs, wanted = np.unique(owners), np.ones(owners.size)
    return PrintedProgram(
        plan="plan", part="part", digest=64 * "0", executed=False, dispenser={}, speed=1.0, opened=0.0, shut=0.0,
        runs=runs, lengths=np.zeros(runs.size), middles=np.zeros((runs.size, 3)), owners=owners, factors=wanted,
        deposited=wanted,
    )  # fmt: skip


def _of(found: EstimateRecord | None) -> tuple[float, float]:
    assert found is not None  # Runs that are shown have it.
    return found.value, found.deviation


def _away(middle: FloatArray, random: np.random.Generator, *, share: float = 1.0) -> FloatArray:
    """Return a pose that is off by a share of a turn and a shift in some direction."""
    axis, direction = (each / np.linalg.norm(each) for each in random.standard_normal((2, 3)))
    turn: FloatArray = Rotation.from_rotvec(share * np.radians(OFF_DEG) * axis).as_matrix()
    return transforms.rigid(turn, middle + share * OFF_MM * direction - turn @ middle)


def true_thickness(
    places: FloatArray, surface: Surface, beads: DepositedBeads, *, side: int | None = None
) -> FloatArray:
    """Return the true mean thickness of the cells of the surface that are nearest to places, SIDE places to a side."""
    side = SIDE if side is None else side
    corners = surface.vertices[surface.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    first, second = (each.ravel() for each in np.meshgrid(*[(np.arange(side) + 0.5) / side] * 2))
    far = np.sqrt(first)
    # A square is laid onto a triangle so that areas keep their shares.
    weights = np.column_stack([1.0 - far, far * (1.0 - second), far * second])
    feet = np.einsum("kc,mcx->mkx", weights, corners).reshape(-1, 3)
    shares = np.repeat(areas, len(weights))
    owners = np.asarray(KDTree(places).query(feet)[1])
    whole = np.maximum(np.bincount(owners, shares, minlength=len(places)), 1e-12)
    return np.asarray(np.bincount(owners, shares * heights(beads, feet), minlength=len(places)) / whole)


def _error(found: Registration, T_work_scan: FloatArray) -> tuple[float, float, bool]:
    """Return shift [mm] and turn [degrees] from the truth, and whether that is within the stated uncertainty."""
    left = found.T_work_scan @ transforms.inverse(T_work_scan)
    turn = Rotation.from_matrix(left[:3, :3]).as_rotvec()
    shift = transforms.apply(left, found.middle[None])[0] - found.middle
    off = np.concatenate([turn, shift])
    within = bool(off @ np.linalg.solve(found.covariance, off) < chi2.ppf(LEVEL, 6))
    return float(np.linalg.norm(shift)), float(np.degrees(np.linalg.norm(turn))), within
