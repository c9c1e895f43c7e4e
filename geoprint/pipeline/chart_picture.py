"""The picture of a flattened plan: from its chart and curves to an image of the right size."""

from __future__ import annotations

import numpy as np

from geoprint.backends import Flattening, distortion
from geoprint.backends.chart_lookup import locate
from geoprint.backends.lscm import chart_images
from geoprint.pipeline.planning import Plan
from geoprint.pipeline.workpiece import upright
from geoprint.report import FlattenedPart, chart_figure
from geoprint.surfaces import positions

# Pixels across the chart in the picture: what a panel shows, whatever the raster of the plan.
PICTURE_PIXELS = 640


def chart_picture(plan: Plan, flattening: Flattening) -> bytes:
    """Return a PNG: chart coloured by area scale, distance image with level curves, curves on the surface.

    Args:
        plan: a plan in the plane.
        flattening: its chart.
    """
    workpiece, contours, chart = plan.workpiece, plan.contours, flattening.chart
    region, image = chart_images(workpiece.surface, chart, workpiece.seed, resolution=PICTURE_PIXELS)
    inside = region.values >= 0.0
    places = np.argwhere(inside)[:, ::-1] * region.pixel + region.origin
    scales = np.ones(inside.shape)
    found = distortion(workpiece.surface, chart.flat).area_scales
    scales[inside] = found[locate(chart.flat, places).faces]
    chart_places = positions(chart.flat, contours.curves.points)[:, :2]
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
        places=positions(workpiece.surface, contours.curves.points),
        offsets=contours.curves.offsets,
        levels=contours.levels,
        chart_offsets=np.union1d(contours.curves.offsets, crossing),
    )
    return chart_figure(
        workpiece.part,
        flattened,
        R_view_work=upright(workpiece),
        spacing=contours.spacing,
        title=f"{plan.job.surface.name}, flattened by the least squares conformal map (lscm)",
    )
