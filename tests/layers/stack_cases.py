"""A stack for the page that is quick to make: circles on a dome, three layers of them, that nobody planned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geoprint.layers.stack_comparison import OF_BACKENDS
from geoprint.layers.stack_page import OF_FLOWS
from geoprint.reporting import Picture
from geoprint.reporting.thickness_page import FlowView, LayerPaths, ThicknessReport
from tests.reporting.report_cases import PIXEL, RADIUS, SPACING, circles, dome

LAYERS = 3
RADII = [19.0, 15.0, 11.0, 7.0, 3.0]


def flow(name: str, *, error: float) -> FlowView:
    """Return a flow that lays too little in the middle of the dome; its rim is not judged."""
    radii = np.hypot(*dome(rings=12).vertices[:, :2].T)
    thickness = np.where(radii > 19.0, np.nan, 1.0 - error * (1.0 - radii / RADIUS))
    return FlowView(
        name=name,
        title=f"{name}, in words",
        figures=(("thickness CV", f"{100 * error:.0f} %"),),
        thickness=thickness,
        ratios=thickness,
        still=Picture(f"Map of {name}", "png", PIXEL),
    )


def paths(radii: list[float]) -> LayerPaths:
    """Return circles of these radii in three layers, each a millimetre over the one below."""
    places, offsets = circles(radii)
    shifts = np.arange(LAYERS)[:, None, None] * np.array([0.0, 0.0, 1.0])
    return LayerPaths(
        places=(places + shifts).reshape(-1, 3),
        offsets=np.concatenate(
            [offsets[:-1] + layer * len(places) for layer in range(LAYERS)] + [[LAYERS * len(places)]]
        ),
        layers=(len(offsets) - 1) * np.arange(1, LAYERS + 1),
    )


def stack(name: str = "dome.ply") -> ThicknessReport:
    """Return a stack of three layers and two flows."""
    return ThicknessReport(
        name=name,
        verdict=("Finished thickness varies by 1 %.", f"{name}: 3 mm in 3 layers."),
        cautions=("Not checked: hoses.",),
        surface=dome(rings=12),
        R_view_work=np.eye(3),
        spacing=SPACING,
        words=OF_FLOWS,
        flows=(flow("following flow", error=0.01), flow("constant flow", error=0.08)),
        paths=(paths(RADII),),
        columns=("layer", "runs"),
        rows=tuple((str(number), str(len(RADII))) for number in range(1, LAYERS + 1)),
        pages=(),
        pictures=(("Sliced open", (Picture("A cut", "png", PIXEL),)), ("Empty", ())),
        settings=(("spacing", "2 mm"),),
        inputs=((name, 64 * "0"),),
    )


def compared_stacks() -> ThicknessReport:
    """Return the stacks of two backends, the second with fewer circles."""
    return replace(
        stack(),
        words=OF_BACKENDS,
        flows=(flow("heat", error=0.01), flow("lscm", error=0.08)),
        paths=(paths(RADII), paths(RADII[:2])),
        columns=("backend", "runs"),
        rows=(("lscm", "6"), ("heat", "15")),
        pages=(("heat", "heat/report.html"), ("lscm", "lscm/report.html")),
    )
