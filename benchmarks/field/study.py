"""The comparison of planners as a study: a cell is one planner on one part, run and resumed as `geoprint sweep` does.

A cell's folder holds paths.csv, the planner's toolpath as a file, measure.json, which `geoprint measure` would say of
that file, and seconds.json, the processor time. A planner without a place in `PLANNERS` hands in such files: a folder
with one toolpath for each part, called as the part.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.field.figures import Figures, figures_of
from benchmarks.field.parts import Part
from benchmarks.field.planners import PLANNERS
from geoprint import job_of, measure_files
from geoprint.errors import GeoprintError, InputError
from geoprint.model import Polylines
from geoprint.reporting import read_record
from geoprint.reporting.measurement import record_measurement
from geoprint.reporting.records.comparison import MeasurementRecord
from geoprint.reporting.records.rounding import save_record
from geoprint.sweep import Study, StudyCell
from geoprint.sweep.running import CELLS, Limits, ending_of, run_study

PATHS, RECORD, SECONDS = "paths.csv", "measure.json", "seconds.json"
# Points of other planners' paths may lie so far off the part, over the spacing: chords of curves do.
OFFSET_SHARE: Final = 0.2
# What a planner may take for a part [s by the clock of a busy machine, GB].
LIMITS: Final = Limits(900.0, 8.0)


def field_study(parts: Sequence[Part], folder: Path, planners: Iterable[str], submissions: Mapping[str, Path]) -> Study:
    """Return every planner, and every folder of toolpath files, on every part: part after part.

    Args:
        parts: whose files stand in `folder`.
        folder: of the parts.
        planners: names in `PLANNERS`.
        submissions: folders of toolpath files by the names of their planners.
    """
    cells: list[StudyCell] = []
    for part in parts:
        job = job_of(surface=folder / f"{part.name}.ply", unit="mm", spacing=part.spacing, robot=False)
        names = dict.fromkeys(planners, "")
        # Another file under the same name is another cell.
        names |= {name: f"_{_digest(_submitted(files, part.name))}" for name, files in submissions.items()}
        for name, suffix in names.items():
            called = re.sub(r"[^a-z0-9]+", "-", name.lower())
            cells.append(StudyCell(f"{part.name}_{called}{suffix}", part.name, part.family, name, job))
    return Study(folder, tuple(cells))


def run(study: Study, folder: Path, *, submissions: Mapping[str, Path], workers: int | None) -> None:
    """Judge what has not been judged yet; whatever stops it, the same call goes on."""
    run_study(study, folder, workers=workers, limits=LIMITS, work=partial(judge, submissions=submissions))


def judge(cell: StudyCell, place: Path, *, submissions: Mapping[str, Path]) -> None:
    """Write a planner's toolpath on a part, and what measuring that file says.

    Raises:
        GeoprintError: the planner refuses the part, or what it returns cannot be measured.
    """
    spacing = cell.job.spacing
    assert spacing is not None
    begun = time.process_time()
    if cell.setting in submissions:
        file = _submitted(submissions[cell.setting], cell.part)
        if file is None:
            raise InputError(f"there is no toolpath for {cell.part}.")
        name, content = file.name, file.read_bytes()
    else:
        name, content = PATHS, _as_table(_planned(cell, spacing))
    planned = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, name).write_bytes(content)
        found = measure_files(cell.job, [Path(folder, name)], offset_up_to=OFFSET_SHARE * spacing)
    seconds = {"planning": planned - begun, "measuring": time.process_time() - planned}
    save_record(
        record_measurement(found), RECORD, {name: content}, place, overwrite=True,
        unlisted={SECONDS: json.dumps(seconds).encode()},
    )  # fmt: skip


def figures_in(study: Study, folder: Path) -> Iterator[Figures]:
    """Yield what became of each cell."""
    for cell in study.cells:
        place = folder / CELLS / cell.name
        status, reason = ending_of(place)
        ours = cell.setting in PLANNERS and PLANNERS[cell.setting].ours
        asked = Figures(cell.part, cell.site, cell.setting, ours, status, reason)
        yield asked if status != "done" else figures_of(read_record(place / RECORD, MeasurementRecord), asked)


def finished(study: Study, folder: Path) -> Study:
    """Return the study of the parts on which every cell has ended."""
    open_ = {cell.part for cell in study.cells if ending_of(folder / CELLS / cell.name)[0] == "missing"}
    return Study(study.file, tuple(cell for cell in study.cells if cell.part not in open_))


def hours(study: Study, folder: Path) -> float:
    """Return the processor time of all cells that are done [h]."""
    files = (folder / CELLS / cell.name / SECONDS for cell in study.cells)
    return sum(sum(json.loads(file.read_text("utf-8")).values()) for file in files if file.is_file()) / 3600.0


def _planned(cell: StudyCell, spacing: float) -> Polylines:
    planner = PLANNERS[cell.setting]
    try:
        return planner.paths(cell.job.surface, spacing)
    except (GeoprintError, MemoryError):
        raise
    except Exception as error:
        if planner.ours:
            raise
        raise InputError(f"{cell.setting} ended with {type(error).__name__}: {error}") from error


def _as_table(paths: Polylines) -> bytes:
    """Return paths as a table that `geoprint measure` reads, in mm."""
    text = io.StringIO("x,y,z,run\n")
    text.seek(0, io.SEEK_END)
    numbers = np.repeat(np.arange(paths.count), np.diff(paths.offsets))
    np.savetxt(text, np.column_stack([paths.points, numbers]), fmt=["%.6f"] * 3 + ["%d"], delimiter=",")
    return text.getvalue().encode()


def _submitted(folder: Path, part: str) -> Path | None:
    """Return the toolpath of a part in a folder, whatever its suffix."""
    return next((path for path in sorted(folder.iterdir()) if path.is_file() and path.stem == part), None)


def _digest(file: Path | None) -> str:
    return "none" if file is None else hashlib.sha256(file.read_bytes()).hexdigest()[:8]
