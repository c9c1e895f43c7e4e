"""From measured files of toolpaths to what measure.json says of them."""

from __future__ import annotations

from importlib.metadata import version

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.account.evenness import record_evenness
from geoprint.account.prints.expected import record_printed
from geoprint.account.records.measure import (
    MeasuredRecord,
    MeasurementRecord,
    MeasureSecondsRecord,
    MeasureTimingsRecord,
    MotionFitRecord,
)
from geoprint.account.records.plan import FileRecord
from geoprint.account.records.reading import record_reading
from geoprint.account.records.rounding import place_of
from geoprint.quality import RigidFit
from geoprint.results import MeasuredFile, Measurement

# Version of the layout of measure.json; a change that breaks a reader raises it.
MEASURE_SCHEMA = 4


def record_measurement(found: Measurement) -> MeasurementRecord:
    """Return what measure.json says: the source of table, report and CSV."""
    part = found.part
    return MeasurementRecord(
        schema=MEASURE_SCHEMA,
        version=version("geoprint"),
        part=FileRecord(name=part.name, sha256=part.digest, unit=part.unit),
        area_mm2=found.files[0].measured.area,
        spacing_mm=found.spacing,
        files=tuple(_file(each, own_errors=found.own_errors) for each in found.files),
    )


def record_measure_timings(found: Measurement) -> MeasureTimingsRecord:
    """Return what measuring took."""
    return MeasureTimingsRecord(
        files=tuple(
            MeasureSecondsRecord(
                file=each.name,
                processor_s=each.seconds,
                processor_s_per_m=each.seconds / (each.measured.length / 1000.0),
            )
            for each in found.files
        )
    )


def _file(each: MeasuredFile, *, own_errors: bool) -> MeasuredRecord:
    measured = each.measured
    return MeasuredRecord(
        file=each.name,
        format=each.format,
        deposit=each.deposit,
        points=each.points,
        runs=measured.run_count,
        dropped_runs=each.dropped,
        reading=record_reading(each.reading),
        length_mm=measured.length,
        off_mean_mm=measured.off_mean,
        off_max_mm=measured.off_max,
        fit=None if each.fit is None else _fit(each.fit),
        uniformity=record_evenness(measured, printed=record_printed(each.printed, of_cell=own_errors)),
    )


def _fit(fit: RigidFit) -> MotionFitRecord:
    turn = Rotation.from_matrix(fit.T_part_paths[:3, :3]).as_rotvec()
    angle = float(np.linalg.norm(turn))
    axis = turn / angle if angle > 0.0 else np.array([0.0, 0.0, 1.0])
    return MotionFitRecord(
        rotation_deg=float(np.degrees(angle)),
        axis=place_of(axis),
        translation_mm=place_of(fit.T_part_paths[:3, 3]),
        residual_mm=fit.residual,
        before_mm=fit.before,
    )
