"""The pictures of a flattened plan: from its charts and curves to images of the right size."""

from __future__ import annotations

import numpy as np

from geoprint.backends.lscm import chart_images, distortion, locate
from geoprint.model import Seed
from geoprint.report import FlattenedPart, chart_figure
from geoprint.results import Plan
from geoprint.surfaces import pieces, positions

# Pixels across the chart in the picture: what a panel shows, whatever the raster of the plan.
PICTURE_PIXELS = 640


def chart_pictures(plan: Plan) -> dict[str, bytes]:
    """Return a PNG by file name for each chart of a plan in the plane: one, or one a patch.

    It shows the chart coloured by area scale, the distance image with level curves, and the curves on the surface.
    """
    several = len(plan.flattenings) > 1
    return {
        f"chart-{number}.png" if several else "chart.png": _picture(plan, number - 1)
        for number in range(1, len(plan.flattenings) + 1)
    }


def _picture(plan: Plan, index: int) -> bytes:
    workpiece, contours, chart = plan.workpiece, plan.contours, plan.flattenings[index].chart
    piece, part = pieces(workpiece.surface)[index], pieces(workpiece.part)[index].surface
    curves, levels = piece.own(contours.curves), contours.levels[piece.holds(contours.curves)]
    seed = Seed(piece.own(workpiece.seed.curves))
    region, image = chart_images(piece.surface, chart, seed, resolution=PICTURE_PIXELS)
    inside = region.values >= 0.0
    places = np.argwhere(inside)[:, ::-1] * region.pixel + region.origin
    scales = np.ones(inside.shape)
    found = distortion(piece.surface, chart.flat).area_scales
    scales[inside] = found[locate(chart.flat, places).faces]
    chart_places = positions(chart.flat, curves.points)[:, :2]
    nearest = chart.continuation.nearest_images(chart_places[1:], to=chart_places[:-1])
    crossing = np.flatnonzero((nearest != chart_places[1:]).any(axis=1)) + 1
    low = region.origin - 0.5 * region.pixel
    high = low + region.pixel * np.array(inside.shape[::-1])
    flattened = FlattenedPart(
        area_scales=scales,
        distances=image.values,
        inside=inside.astype(np.float64),
        extent=np.array([low[0], high[0], low[1], high[1]]),
        chart_places=chart_places,
        places=positions(piece.surface, curves.points),
        offsets=curves.offsets,
        levels=levels,
        chart_offsets=np.union1d(curves.offsets, crossing),
    )
    which = f", patch {index + 1}" if len(plan.flattenings) > 1 else ""
    return chart_figure(
        part,
        flattened,
        R_view_work=workpiece.upright,
        spacing=contours.spacing,
        title=f"{plan.job.surface.name}{which}, flattened by the least squares conformal map (lscm)",
    )
