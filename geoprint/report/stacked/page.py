"""The report of a stack: one HTML file of the same form as that of a comparison, and the data of its scene."""

from __future__ import annotations

from geoprint.report.markup import Json, element
from geoprint.report.page import page
from geoprint.report.scene import numbers, step, thinned, turned, with_breaks
from geoprint.report.stacked.section import stack_section
from geoprint.report.stacked.values import THICKNESS_RANGE, StackReport


def stack_report(stack: StackReport, *, title: str) -> bytes:
    """Return report.html of a stack: verdict, finished thickness in a 3D scene, and every layer.

    Args:
        stack: what to show.
        title: of the page.

    Returns:
        UTF-8 HTML; the same for the same input.
    """
    key = "part0"
    body = [element("h1", title), stack_section(stack, key=key)]
    return page(title, body, {key: stack_scene_data(stack)})


def stack_scene_data(stack: StackReport) -> Json:
    """Return everything page.js needs to draw a stack: as `scene_data`, with the flows as backends.

    Returns:
        Beside what both have: `path` of all layers, `layers`, how much of it lies up to the end of each, and of each
        flow its `thickness`.
    """
    upright, head = turned(stack.surface, R_view_work=stack.R_view_work, spacing=stack.spacing)
    kept, offsets = thinned(stack.offsets, step=step(len(stack.places)))
    return {
        **head,
        "winner": 0,
        "thicknesses": list(THICKNESS_RANGE),
        "machine": None,
        "path": numbers(with_breaks(upright(stack.places)[kept], offsets).T),
        # Between two runs stands a break.
        "layers": [int(offsets[runs]) + int(runs) - 1 for runs in stack.layers],
        "backends": [{"name": flow.name, "thickness": numbers(flow.thickness)} for flow in stack.flows],
    }
