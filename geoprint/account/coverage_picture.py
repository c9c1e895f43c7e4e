"""The picture of compared paths: side by side, coloured by local spacing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geoprint.report import CoveragePanel, coverage_figure, paper_figures
from geoprint.results import Planned, Workpiece


def coverage_picture(workpiece: Workpiece, planned: Sequence[tuple[str, Planned]], *, title: str) -> bytes:
    """Return a PNG with a panel for each of the planned backends.

    Args:
        workpiece: what they planned on.
        planned: name and outcome, at least one.
        title: above all of them.
    """
    return coverage_figure(
        workpiece.part,
        [coverage_panel(name, outcome) for name, outcome in planned],
        R_view_work=workpiece.upright,
        spacing=planned[0][1].plan.contours.spacing,
        title=title,
    )


def paper_files(workpiece: Workpiece, planned: Sequence[tuple[str, Planned]]) -> dict[str, bytes]:
    """Return name and content of the figures for papers, as PNG and SVG.

    Args:
        workpiece: what they planned on.
        planned: name and outcome, at least one.
    """
    return paper_figures(
        workpiece.part,
        [coverage_panel(name, outcome) for name, outcome in planned],
        R_view_work=workpiece.upright,
        spacing=planned[0][1].plan.contours.spacing,
    )


def coverage_panel(name: str, outcome: Planned) -> CoveragePanel:
    """Return the panel of a backend; the outermost runs have no neighbour outside and so no spacing."""
    measured, poses = outcome.uniformity, outcome.plan.poses
    outermost = poses.deposit & (poses.levels == poses.levels[poses.deposit].min())
    _, counts = np.unique(poses.runs[outermost], return_counts=True)
    sizes = np.concatenate([np.diff(measured.offsets), counts])
    return CoveragePanel(
        title=name,
        caption=f"spacing CV {measured.cv:.1%}, uncovered {measured.uncovered:.1%}",
        places=np.concatenate([measured.places, poses.surface_points[outermost]]),
        offsets=np.concatenate([[0], np.cumsum(sizes)]),
        ratios=np.concatenate([measured.ratios, np.full(int(counts.sum()), np.nan)]),
    )
