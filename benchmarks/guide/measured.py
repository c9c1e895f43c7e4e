"""The guide's picture of measured toolpaths."""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.guide.shaded import smaller
from geoprint.account.measured.figures import record_measurement
from geoprint.account.measured.page import measure_picture
from geoprint.config import job_of
from geoprint.guide import page_named
from geoprint.pipeline import measure_files, plan, save_plan


def measured(data: Path) -> bytes:
    """Draw what the page measures: contours of a plate beside its rows."""
    (rows,) = (block.text for block in page_named("measure").blocks if block.word == "rows.csv")
    job = job_of(surface=data / "plate.ply", unit="mm", spacing=5.0, backend="fast-marching", robot=False)
    with tempfile.TemporaryDirectory() as folder:
        save_plan(plan(job), Path(folder) / "ours")
        (Path(folder) / "rows.csv").write_text(rows, encoding="utf-8")
        found = measure_files(job, [Path(folder) / "ours", Path(folder) / "rows.csv"])
    return smaller(measure_picture(found, record_measurement(found)), width=800)
