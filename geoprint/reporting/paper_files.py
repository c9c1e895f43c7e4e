"""The figures for papers of a comparison, for whoever asks for them."""

from __future__ import annotations

from collections.abc import Sequence

from geoprint.reporting.paper_figures import paper_figures
from geoprint.reporting.pictures import coverage_panel
from geoprint.results import Planned, Workpiece


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
