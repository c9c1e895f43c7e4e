"""Runs and levels of a plan as tables of arrays, for statistics of one's own, and such tables as CSV.

| table | column | meaning |
|---|---|---|
| runs | run, layer, level | as in poses.csv, in printing order |
| | closed | whether the run ends where it starts |
| | x, y, z | where it starts on the surface, in the coordinates of the part [mm] |
| | length | of what is laid [mm] |
| | volume | of what is laid [mm3] |
| levels | level | 0, the outermost, has no neighbour and no row |
| | samples | measured on it |
| | mean, cv, worst | of the spacing to the level outside, over the wanted one: 1, 0 and 1 are ideal |
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geoprint.account.spacing_table import Table, csv_bytes, table_of
from geoprint.quality import LevelSpacings
from geoprint.results import Plan
from geoprint.surfaces.files import write_whole


def runs_table(plan: Plan) -> Table:
    """Return a row for each run of a plan, in printing order: run, layer, level, closed, x, y, z, length, volume.

    Lengths are those of the tip, as `deposit_mm` in plan.json is.
    """
    poses, path = plan.poses, plan.toolpath
    lengths = np.where(poses.laid, np.linalg.norm(np.diff(poses.tips, axis=0), axis=1), 0.0)
    count = path.curves.count
    length, volume = (
        np.bincount(poses.runs[:-1], weights=each, minlength=count) for each in (lengths, lengths * poses.flow[:-1])
    )
    starts = path.curves.points.xyz(plan.workpiece.surface)[path.curves.offsets[:-1]]
    return table_of(
        {
            "run": np.arange(count), "layer": path.layers, "level": path.levels, "closed": path.curves.closed,
            "x": starts[:, 0], "y": starts[:, 1], "z": starts[:, 2], "length": length, "volume": volume,
        }
    )  # fmt: skip


def levels_table(measured: LevelSpacings) -> Table:
    """Return a row for each level but the outermost: level, samples, and mean, cv and worst of their spacing.

    Args:
        measured: the spacing from level to level of a plan (`uniformity(...).levels`).
    """
    levels, samples = np.unique(measured.levels, return_counts=True)
    mean, cv, worst = np.array([level[1:] for level in measured.by_level()]).reshape(-1, 3).T
    return table_of({"level": levels, "samples": samples, "mean": mean, "cv": cv, "worst": worst})


def csv_text(table: Table) -> str:
    """Return a table of runs, levels or samples as CSV: its columns in the first row, then a row each."""
    return csv_bytes(table).decode("ascii")


def save_table(table: Table, path: Path | str) -> None:
    """Write a table of runs, levels or samples as a CSV file, whole or not at all; one of that name is replaced.

    Raises:
        ExportError: the file cannot be written.
    """
    write_whole(path, csv_bytes(table))
