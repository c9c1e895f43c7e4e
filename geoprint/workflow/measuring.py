"""Files of toolpaths, of geoprint or anybody else, read, aligned with a part and measured side by side."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from geoprint.config import Job, job_cell
from geoprint.errors import UsageError, naming
from geoprint.geometry import upright_of
from geoprint.geometry.files import MeshFile, load_file
from geoprint.metrics import measure_paths, moved, printed, rigid_fit
from geoprint.model import Cell, PrintErrors, Surface
from geoprint.reporting.figures import png_bytes
from geoprint.reporting.measurement import measure_csv, record_measurement
from geoprint.reporting.measurement_page import measure_report
from geoprint.reporting.records.comparison import MeasurementRecord
from geoprint.reporting.records.rounding import save_record
from geoprint.results import MeasuredFile, Measurement
from geoprint.toolpath_files import PathFile, read_paths
from geoprint.workflow.patches import prepared_part
from geoprint.workflow.saving import written

RECORD = "measure.json"
# More are no comparison any more.
MOST_FILES = 20


def measure_files(
    job: Job,
    paths: Sequence[Path | str],
    *,
    offset_up_to: float | None = None,
    fit: bool = False,
    deposit: str | None = None,
    dialect: str | None = None,
    observe: Callable[[str], None] = lambda _: None,
) -> Measurement:
    """Measure how evenly files of toolpaths cover a part.

    Args:
        job: the keys used are part, unit, label, patches, spacing and cell (for the errors of a print).
        paths: files of toolpaths or bundles, 1 to 20.
        offset_up_to: largest allowed distance of a path from the part [mm]; a tenth of the spacing by default.
        fit: whether to align each file with the part by a rigid motion first.
        deposit: what deposits, if a file does not state it: M-codes (M3/M5), an axis that extrudes (A), or the name of
            an output.
        dialect: of G-code; None to guess it.
        observe: called with the name of each stage as it starts.

    Returns:
        The evenness of each file, in the order given.

    Raises:
        UsageError: the first argument is no job, no spacing is given, or there are too many files.
        InputError: a file cannot be read, or does not lie on the part.
    """
    spacing, cell = _checked_spacing(job, paths, offset_up_to), job_cell(job)
    observe("part")
    part, surface = _part(job)
    found: list[MeasuredFile] = []
    for path, name in zip(paths, _names(paths), strict=True):
        observe(name)
        read = read_paths(path, deposit=deposit, dialect=dialect)
        with naming(name):
            found.append(_measured(name, read, surface, cell, spacing=spacing, offset_up_to=offset_up_to, fit=fit))
    own = job.cell is not None and cell.errors is not None
    return Measurement(part, surface, upright_of(surface), spacing, tuple(found), cell.name, own_errors=own)


def _measured(
    name: str, read: PathFile, surface: Surface, cell: Cell, *, spacing: float, offset_up_to: float | None, fit: bool
) -> MeasuredFile:
    """Return how evenly the paths of a file cover a part, aligned with it first where that is asked for."""
    fitted = rigid_fit(surface, read.curves) if fit else None
    curves = read.curves if fitted is None else moved(read.curves, fitted)
    begun = time.process_time()
    measured = measure_paths(
        surface, curves, spacing=spacing, offset_up_to=offset_up_to, flow_shares=cell.process.flow_shares
    )
    seconds = time.process_time() - begun
    # How the tool stands nobody knows.
    layer = measured.layer(follows=cell.signals.mode == "analog")
    return MeasuredFile(
        name, read.format, read.deposit, read.points, read.dropped, read.reading, fitted, measured,
        printed(*layer, measured, cell.errors or PrintErrors()), seconds,
    )  # fmt: skip


def _checked_spacing(job: Job, paths: Sequence[Path | str], offset_up_to: float | None) -> float:
    """Return the spacing that was meant, after a look at what else was asked for."""
    if not isinstance(job, Job):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise UsageError(
            "measure_files takes the job first and the files of toolpaths second; the first argument here is no job. "
            "Make one of the part: `geoprint.job_of(surface=PART, spacing=MM)`."
        )
    if job.spacing is None:
        raise UsageError("give `--spacing`: the intended distance between neighbouring paths in mm.")
    if isinstance(paths, str | Path):
        raise UsageError(f"give the files of toolpaths as a list: `[{str(paths)!r}]`.")
    if not 1 <= len(paths) <= MOST_FILES:
        raise UsageError(f"give 1 to {MOST_FILES} files of toolpaths, found {len(paths)}.")
    if offset_up_to is not None and not (np.isfinite(offset_up_to) and offset_up_to > 0.0):
        raise UsageError(f"`--offset-up-to {offset_up_to:g}`: it must be a positive number of mm.")
    return job.spacing


@written.register
def _save(found: Measurement, directory: Path | str, *, overwrite: bool) -> MeasurementRecord:
    """Write measure.json, measure.csv, measure.png and report.html."""
    record = record_measurement(found)
    files = {
        "measure.csv": measure_csv(record).encode("utf-8"),
        "measure.png": png_bytes(found.figure()),
        "report.html": measure_report(found, record),
    }
    return save_record(record, RECORD, files, directory, overwrite=overwrite)


def _part(job: Job) -> tuple[MeshFile, Surface]:
    """Return the file of a part, and the part or the patches of it that are meant, ready to be measured on."""
    part = load_file(job.surface, unit=job.unit, label=job.label, threshold=job.threshold)
    return part, prepared_part(job, part).surface


def _names(paths: Sequence[Path | str]) -> list[str]:
    """Return the names of files, with their folders where two are alike, and numbered where these are."""
    short = [Path(path).name or str(path) for path in paths]
    alike = Counter(short)
    names = [str(path) if alike[name] > 1 else name for path, name in zip(paths, short, strict=True)]
    return [
        f"{name} ({names[:place].count(name) + 1})" if names.count(name) > 1 else name
        for place, name in enumerate(names)
    ]
