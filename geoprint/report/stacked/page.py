"""The report of stacks: one HTML file of the same form as that of a comparison, and the data of its scene."""

from __future__ import annotations

from collections.abc import Callable

from geoprint.model import FloatArray
from geoprint.report.markup import Json, element
from geoprint.report.page import page
from geoprint.report.scene import numbers, step, thinned, turned, with_breaks
from geoprint.report.stacked.section import stack_section
from geoprint.report.stacked.values import THICKNESS_RANGE, StackPaths, StackReport


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
        Beside what both have: of each flow its `thickness`, `path` of all layers, and `layers`, how much of it lies up
        to the end of each; the latter two once where all flows have the same.
    """
    upright, head = turned(stack.surface, R_view_work=stack.R_view_work, spacing=stack.spacing)
    paths = [_path(one, upright) for one in stack.paths]
    same = len(paths) == 1
    return {
        **head,
        "winner": 0,
        "thicknesses": list(THICKNESS_RANGE),
        "machine": None,
        **(paths[0] if same else {}),
        "backends": [
            {"name": flow.name, "thickness": numbers(flow.thickness), **({} if same else paths[number])}
            for number, flow in enumerate(stack.flows)
        ],
    }


def _path(paths: StackPaths, upright: Callable[[FloatArray], FloatArray]) -> dict[str, Json]:
    kept, offsets = thinned(paths.offsets, step=step(len(paths.places)))
    return {
        "path": numbers(with_breaks(upright(paths.places)[kept], offsets).T),
        # Between two runs stands a break.
        "layers": [int(offsets[runs]) + int(runs) - 1 for runs in paths.layers],
    }
