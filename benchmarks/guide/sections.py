"""The guide's pictures of layers: a groove and what is printed over it, and a printed stack, both cut across."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from benchmarks.guide.shaded import BLUE, GREY, ORANGE, panels, small_png, smaller
from geoprint.account.stacked.page import sliced_pictures
from geoprint.backends import isolines
from geoprint.config import job_of
from geoprint.layers import level_surface
from geoprint.model import ScalarField, Surface
from geoprint.pipeline import plan
from geoprint.pipeline.stacked.simulating import finished_stack, stacked_layer
from geoprint.pipeline.workpiece import read_stack
from geoprint.surfaces import vertex_normals

# A groove between two ridges [mm]: how long, how wide, and how deep.
LENGTH, WIDTH, DEPTH = 4.0, 24.0, 4.0
LAYERS, HEIGHT = 5, 0.6


def layers(_data: Path) -> bytes:
    """Draw layers over a groove at even distances, and what pushing it along its normals makes."""
    part = _groove()
    figure, axes = panels(2, width=8.2, height=3.3)
    for axis, title in zip(axes, ("even distance", "pushed along normals"), strict=True):
        _section(axis, part, color="black", width=1.6)
        for number in range(1, LAYERS + 1):
            over = number * HEIGHT
            level = (
                level_surface(part, height=over, edge_length=0.3, tolerance=0.005)
                if axis is axes[0]
                else _pushed(part, over)
            )
            _section(axis, level, color=BLUE if axis is axes[0] else ORANGE, width=1.0)
        axis.set_title(title, fontsize=10)
        axis.set_aspect("equal")
        axis.set_xlim(-6.5, 6.5)
        axis.set_ylim(-0.8, 8.0)
        axis.axis("off")
    return small_png(figure)


def sliced(data: Path) -> bytes:
    """Draw a stack over a patch of a heart, sliced open as in its report."""
    job = job_of(surface=data / "heart_apex_patch.ply", unit="mm", spacing=1.0, thickness=2.0, robot=False)
    stack = read_stack(job)
    layers = [stacked_layer(plan(job.model_copy(update={"layer": number}))) for number in range(1, stack.count + 1)]
    return smaller(sliced_pictures(finished_stack(job, stack, layers))[0].content, width=1000)


def _groove() -> Surface:
    """Return a strip with two round ridges and a narrow groove between them."""
    across, along = np.linspace(-WIDTH / 2.0, WIDTH / 2.0, 97), np.linspace(0.0, LENGTH, 9)
    x, y = (each.ravel() for each in np.meshgrid(across, along, indexing="ij"))
    z = DEPTH * (1.0 - np.exp(-((x / 1.6) ** 2))) - 0.05 * x**2
    cell = (np.arange(96)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate([
        np.column_stack([cell, cell + 9, cell + 10]),
        np.column_stack([cell, cell + 10, cell + 1]),
    ])  # fmt: skip
    return Surface(np.column_stack([x, y, z]), faces, "groove")


def _pushed(part: Surface, height: float) -> Surface:
    """Return a part whose vertices are pushed along their normals [mm]."""
    return Surface(part.vertices + height * vertex_normals(part), part.faces, part.name)


def _section(axis: Axes, surface: Surface, *, color: str, width: float) -> None:
    """Draw where a surface is cut across the middle of the groove."""
    curves, _ = isolines(surface, ScalarField(surface.vertices[:, 1]), levels=np.array([LENGTH / 2.0 + 1e-6]))
    for curve in range(curves.count):
        places = curves.xyz(surface, curve)
        axis.plot(places[:, 0], places[:, 2], color=color, linewidth=width)
    if color == "black":
        (places,) = (curves.xyz(surface, curve) for curve in range(curves.count))
        axis.fill_between(places[:, 0], places[:, 2], places[:, 2].min() - 1.0, color=GREY, alpha=0.4, linewidth=0)
