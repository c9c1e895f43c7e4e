"""Scans of prints held against the plan of them, scans of parts before they are printed on, and what is written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from geoprint.errors import InputError, UsageError
from geoprint.geometry import prepare, upright_of
from geoprint.geometry.files import load_file, ply_bytes
from geoprint.geometry.files.mesh_file import UNITS
from geoprint.inspection.executing import printed_program
from geoprint.inspection.inputs import read_plan
from geoprint.inspection.pages import scan_page
from geoprint.inspection.records import parts_table, record_lying, record_scan
from geoprint.inspection.scan import AppraisedScan, LyingScan, Scan, read_scan
from geoprint.inspection.scan_lying import lying_part
from geoprint.inspection.scan_measuring import measured_print
from geoprint.inspection.scan_registration import Registration, registered
from geoprint.inspection.scan_target import PlannedDeposit
from geoprint.inspection.text import lying_text, scan_text
from geoprint.model import FloatArray, Surface
from geoprint.reporting.prints import RECORD, next_print
from geoprint.reporting.records.inspection import LyingRecord, ScanAppraisalRecord
from geoprint.reporting.records.rounding import save_record
from geoprint.workflow.number_tables import read_pose
from geoprint.workflow.saving import written

LYING_RECORD, LYING_MESH = "lying.json", "lying.ply"
# Points of a scan; touched points are fewer.
LEAST_POINTS, LEAST_TOUCHED = 200, 12
# A scan tells the same each time.
SEED = 24
# A scan is at most so many times larger or smaller than its part, of which it shows much and little else.
MOST_RATIO = 8.0
# Farthest that a part may lie off its file where nobody says more [mm]: a needle's stand-off and more.
MOST_OFFSET = 2.0


@final
@dataclass(frozen=True, slots=True)
class ScanAsked:
    """How a scan is laid onto its part.

    Attributes:
        unit: of its coordinates.
        pose: table of the pose it was taken from, in the part's coordinates; None where it is about in these already.
        features: whether it may lie anywhere, and features of the part tell where.
    """

    unit: str = "mm"
    pose: Path | None = None
    features: bool = False


# Millimetres, about in the part's coordinates.
AS_IT_IS = ScanAsked()


def appraise_scan(
    path: Path | str,
    *,
    bundle: Path | str,
    asked: ScanAsked = AS_IT_IS,
    observe: Callable[[str], None] = lambda _: None,
) -> AppraisedScan:
    """Appraise a scan of a print against its plan.

    Args:
        path: of the scan.
        bundle: folder of the plan.
        asked: how it is aligned with the part; as a scan in mm that stands about where the part does, if not given.
        observe: told the name of each stage as it starts.

    Raises:
        UsageError: an option has no meaning, or a package is missing.
        InputError: a file cannot be read, the scan does not lie on the part, or nothing fixes where it was taken.
        ResourceError: it takes too long or too much memory.
        VerificationError: the bundle was changed.
    """
    observe("scan")
    scan, bundle = read_scan(path, unit=asked.unit, least=LEAST_POINTS), Path(bundle)
    plan = read_plan(bundle)
    deposit = PlannedDeposit(plan.poses, spacing=plan.spacing, height=plan.height)
    observe("registration")
    found = _registered(scan, plan.surface, deposit, asked)
    if len(found.loose) and asked.pose is None:
        raise InputError(
            f"`{scan.name}`: {len(found.loose)} of six directions of its pose are free, because {plan.part} and its "
            "print are symmetric there. Give the pose from a calibration with `--pose`.",
            loose=len(found.loose),
        )
    observe("thickness")
    random = np.random.default_rng(SEED)
    held = measured_print(scan.points, found, plan.surface, deposit, random=random, name=scan.name)
    observe("program")
    parts = held.parts
    printed = printed_program(bundle, plan, runs=parts.runs, starts=parts.starts, ends=parts.ends)
    return AppraisedScan(
        scan,
        asked.unit,
        printed,
        asked.pose is not None,
        plan.surface,
        upright_of(plan.surface),
        plan.spacing,
        plan.printed_with,
        held,
    )


def scan_before(
    path: Path | str,
    *,
    part: Path,
    part_unit: str | None,
    asked: ScanAsked,
    most: float = MOST_OFFSET,
    observe: Callable[[str], None] = lambda _: None,
) -> LyingScan:
    """Tell how a part lies there before anything is printed on it.

    Args:
        path: of the scan, or of touched points.
        part: file of the part.
        part_unit: of that file; None where it says it.
        asked: how the scan is laid onto the part.
        most: largest offset that is allowed [mm].
        observe: told the name of each stage as it starts.

    Raises:
        UsageError: an option has no meaning, or a package is missing.
        InputError: a file cannot be read, or the surface is not seen or too far off.
        ResourceError: it takes too long or too much memory.
    """
    if not 0.0 < most < float("inf"):
        raise UsageError(f"`--most {most:g}`: it must be a positive number of mm.")
    observe("scan")
    scan = read_scan(path, unit=asked.unit, least=LEAST_TOUCHED)
    surface, _ = prepare(load_file(part, unit=part_unit).surface)
    observe("registration")
    found = _registered(scan, surface, None, asked)
    observe("surface")
    lying = lying_part(scan.points, found, surface, most=most, name=scan.name)
    return LyingScan(scan, asked.unit, Path(part).name, asked.pose is not None, most, LYING_MESH, lying)


@written.register
def _save(found: AppraisedScan, directory: Path | str, *, overwrite: bool) -> ScanAppraisalRecord:
    """Write appraisal.json, the text, the table of parts of runs and report.html."""
    record = record_scan(found)
    files = {
        "appraisal.txt": (
            f"{scan_text(record)}\n\n{next_print(record, plan=record.printed.plan, folder='.')}\n".encode()
        ),
        "parts.csv": parts_table(found.held.parts),
        "report.html": scan_page(found, record),
    }
    return save_record(record, RECORD, files, directory, overwrite=overwrite)


@written.register
def _save_lying(found: LyingScan, directory: Path | str, *, overwrite: bool) -> LyingRecord:
    """Write lying.json, the text, and the mesh of the surface that is there."""
    record = record_lying(found)
    # What no plan could be made on is refused here already.
    surface, _ = prepare(found.lying.surface)
    files = {
        "lying.txt": f"{lying_text(record)}\n".encode(),
        LYING_MESH: ply_bytes(surface),
    }
    return save_record(record, LYING_RECORD, files, directory, overwrite=overwrite)


def _registered(scan: Scan, surface: Surface, deposit: PlannedDeposit | None, asked: ScanAsked) -> Registration:
    _check_unit(scan, surface, asked.unit)
    start: FloatArray = np.eye(4) if asked.pose is None else read_pose(asked.pose)
    return registered(scan.points, surface, deposit, start=start, features=asked.features, name=scan.name)


def _check_unit(scan: Scan, surface: Surface, unit: str) -> None:
    """Refuse a scan that would be about as large as its part in another unit alone."""
    size, wanted = (float(np.ptp(places, axis=0).max()) for places in (scan.points, surface.vertices))
    ratios = {name: size / wanted * length / UNITS[unit] for name, length in UNITS.items()}
    likely = min(ratios, key=lambda name: abs(np.log(ratios[name])))
    if 1.0 / MOST_RATIO <= ratios[unit] <= MOST_RATIO or likely == unit:
        return
    raise InputError(
        f"`{scan.name}` is {size:.3g} mm large in {unit}, {surface.name} is {wanted:.3g} mm; in {likely} the scan "
        f"would be {ratios[likely] * wanted:.3g} mm: give `--scan-unit {likely}`.",
        size_mm=size,
    )
