"""The pictures of plans: charts with their curves, and the paths of backends side by side, coloured by spacing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from geoprint.account.evenness import record_evenness
from geoprint.account.metrics import GAP, OVERLAP, THICKNESS
from geoprint.account.records.evenness import EvennessRecord
from geoprint.backends import distortion, locate
from geoprint.model import FollowedLines, Seed
from geoprint.report import CoveragePanel, FlattenedPart, chart_figure, coverage_figure, lines_figure
from geoprint.results import Plan, Planned, Workpiece
from geoprint.surfaces import pieces, positions

# Pixels across the chart in the picture: what a panel shows, whatever the raster of the plan.
PICTURE_PIXELS = 640


def chart_pictures(plan: Plan) -> dict[str, bytes]:
    """Return a PNG by file name for each chart of a plan in the plane: one, or one a patch.

    It shows the chart coloured by area scale, the distance image with level curves, and the curves on the surface.
    """
    return {file: draw() for file, draw in chart_drawings(plan).items()}


def chart_drawings(plan: Plan) -> dict[str, Callable[[], bytes]]:
    """Return by file name what draws each chart of a plan in the plane, as `chart_pictures` does; it can be pickled."""
    several = len(plan.flattenings) > 1
    # What the robot does is in none.
    paths = replace(plan, robot=())
    return {
        f"chart-{number}.png" if several else "chart.png": partial(_picture, paths, number - 1)
        for number in range(1, len(plan.flattenings) + 1)
    }


def _picture(plan: Plan, index: int) -> bytes:
    workpiece, contours, shown = plan.workpiece, plan.contours, plan.flattenings[index]
    piece, part = pieces(workpiece.surface)[index], pieces(workpiece.part)[index].surface
    curves, levels = piece.own(contours.curves), contours.levels[piece.holds(contours.curves)]
    seed = Seed(piece.own(workpiece.seed.curves))
    image = shown.image(seed, PICTURE_PIXELS)
    places = np.argwhere(image.inside)[:, ::-1] * image.pixel + image.origin
    scales = np.ones(image.inside.shape)
    found = distortion(piece.surface, shown.flat).area_scales
    scales[image.inside] = found[locate(shown.flat, places).faces]
    chart_places = positions(shown.flat, curves.points)[:, :2]
    low = image.origin - 0.5 * image.pixel
    high = low + image.pixel * np.array(image.inside.shape[::-1])
    flattened = FlattenedPart(
        area_scales=scales,
        distances=image.distances,
        inside=image.inside.astype(np.float64),
        extent=np.array([low[0], high[0], low[1], high[1]]),
        chart_places=chart_places,
        places=positions(piece.surface, curves.points),
        offsets=curves.offsets,
        levels=levels,
        chart_offsets=np.union1d(curves.offsets, shown.jumps(chart_places)),
    )
    which = f", patch {index + 1}" if len(plan.flattenings) > 1 else ""
    return chart_figure(
        part,
        flattened,
        R_view_work=workpiece.upright,
        spacing=contours.spacing,
        title=f"{plan.workpiece.name}{which}, flattened by {shown.mapped}",
    )


def lines_picture(workpiece: Workpiece, followed: FollowedLines, *, title: str) -> bytes:
    """Return the PNG of the lines that paths follow, with the indices of the places about which they turn."""
    return lines_figure(workpiece.surface, followed, R_view_work=workpiece.upright, title=title)


def coverage_drawing(
    workpiece: Workpiece, planned: Sequence[tuple[str, Planned]], *, title: str
) -> Callable[[], bytes]:
    """Return what draws a PNG with a panel for each of the planned backends; it can be pickled.

    Args:
        workpiece: what they planned on.
        planned: name and outcome, at least one.
        title: above all of them.
    """
    return partial(
        coverage_figure,
        workpiece.part,
        [coverage_panel(name, outcome) for name, outcome in planned],
        R_view_work=workpiece.upright,
        spacing=planned[0][1].plan.contours.spacing,
        title=title,
    )


def coverage_panel(name: str, outcome: Planned) -> CoveragePanel:
    """Return the panel of a backend: each place of its paths by the spacing on the side where that is worse."""
    measured, wanted = outcome.uniformity, outcome.plan.workpiece.widths
    sides = measured.sides
    return CoveragePanel(
        title=name,
        caption=caption_of(record_evenness(measured)),
        places=sides.places,
        offsets=sides.offsets,
        ratios=sides.worse(),
        gaps=measured.judged_places[measured.gaps],
        widths=1.0 if wanted is None else wanted(sides.places) / measured.spacing,
    )


def caption_of(told: EvennessRecord) -> str:
    """Return the figures below a picture."""
    return f"thickness CV {THICKNESS.text(told)}, missed {GAP.text(told)}, covered twice {OVERLAP.text(told)}"
