"""The guide's picture of overhang: paths over an apex, and in which attitude of a tilting table each is printed."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.guide.shaded import BLUE, ORANGE, draw_lines, draw_surface, panels, small_png, view_from
from geoprint.config import TILTING_CELL, job_of, packaged_cell_text
from geoprint.pipeline import plan
from geoprint.surfaces import mean_normal
from geoprint.transforms import angles_between

# Colours of matplotlib's cycle.
CYCLE = 10


def tilted(data: Path) -> bytes:
    """Draw what overhangs while an apex stands still, and a colour for each attitude in which nothing does.

    Raises:
        ValueError: the plan has no table.
    """
    with tempfile.TemporaryDirectory() as folder:
        cell = Path(folder) / "cell.toml"
        cell.write_text(packaged_cell_text(TILTING_CELL))
        planned = plan(
            job_of(
                surface=data / "heart_apex_patch.ply", unit="mm", spacing=2.0, backend="heat", robot=False, cell=cell
            )
        )
    if planned.tilting is None:
        raise ValueError("the plan has no table")
    rows = np.flatnonzero(planned.poses.deposit)
    places, normals = planned.poses.surface_points[rows], planned.poses.normals[rows]
    view = view_from(mean_normal(planned.workpiece.surface), up=np.array([0.0, 1.0, 0.0]))
    every = np.ones(len(rows), dtype=np.bool_)
    figure, axes = panels(2, width=7.2, height=3.6)
    for axis in axes:
        draw_surface(axis, planned.workpiece.surface, view)
    over = angles_between(normals, planned.workpiece.upright[2]) > planned.workpiece.cell.critical_overhang
    cuts = np.union1d(np.flatnonzero(np.diff(over)), np.flatnonzero(np.diff(planned.poses.runs[rows]))) + 1
    for piece in np.split(np.arange(len(rows)), cuts):
        colour = ORANGE if over[piece[0]] else BLUE
        draw_lines(axes[0], (places[piece] @ view.T)[:, :2], every[piece], colour=colour, width=1.2)
    axes[0].set_title("standing still: what overhangs in orange", fontsize=10)
    for number, one in enumerate(planned.tilting.attitudes):
        for start, end in one.pieces.tolist():
            colour = f"C{number % CYCLE}"
            draw_lines(axes[1], (places[start:end] @ view.T)[:, :2], every[start:end], colour=colour, width=1.2)
    axes[1].set_title(f"{len(planned.tilting.attitudes)} attitudes of a tilt-turn table", fontsize=10)
    return small_png(figure)
