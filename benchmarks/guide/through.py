"""The guide's picture of a ventricle's wall: strokes of its layers, and their helix angle from the cavity outwards."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.guide.shaded import BLUE, GREEN, ORANGE, draw_curves, draw_surface, panels, small_png, view_from
from benchmarks.parts.wall_layers import Strokes, Ventricle, layers_through
from geoprint.surfaces import mean_normal
from tests.fields.tetrahedra import solved
from tests.shared_data import SHARED_DATA

# A human heart [Rodero2021, no. 01], and a place on the free wall of its left ventricle where that is 10 mm thick.
HEART = Ventricle(
    SHARED_DATA / "labels" / "rodero01_labels_1mm_ras.nii.gz", wall=(1, 7), cavity=11, base=(3, 5),
    at=(115.8, 69.1, 21.2), radius=12.0,
)  # fmt: skip
HEIGHT, SPACING = 1.3, 1.5


def through(_data: Path) -> bytes:
    """Draw layers through the wall of a real ventricle, whose labels are no part of this tree.

    Raises:
        RuntimeError: they are not here.
    """
    if not HEART.labels.exists():
        raise RuntimeError(f"no labels of a heart here: {HEART.labels}")
    own = solved(HEART.labels, wall=list(HEART.wall), cavity=[HEART.cavity], base=list(HEART.base))
    with tempfile.TemporaryDirectory() as folder:
        layers = list(layers_through(HEART, own, Path(folder), height=HEIGHT, spacing=SPACING))
    return through_picture(layers)


def through_picture(layers: Sequence[Strokes]) -> bytes:
    """Draw the strokes of the first, the middle and the last whole layer, and the helix angles of all."""
    figure, axes = panels(4, width=10.0, height=3.0)
    last = len(layers) - 2 if len(layers) > 2 else len(layers) - 1
    for axis, number, colour in zip(axes, (0, last // 2, last), (ORANGE, GREEN, BLUE), strict=False):
        paths = layers[number].paths
        view = view_from(mean_normal(layers[0].paths.workpiece.surface), up=layers[0].up)
        draw_surface(axis, paths.workpiece.surface, view)
        draw_curves(axis, paths.workpiece.surface, paths.toolpath.curves, view, colour=colour)
        # Over the middle of each, as far from it, whatever the height of its axes becomes.
        axis.text(0.5, 0.98, f"layer {number + 1}", fontsize=10, ha="center", va="top", transform=axis.transAxes)
        axis.margins(y=0.16)
    heights = [each.paths.workpiece.place.middle for each in layers if each.paths.workpiece.place is not None]
    found = np.array([each.mean(each.found) for each in layers])
    spread = [np.sqrt(each.mean((each.found - mean) ** 2)) for each, mean in zip(layers, found, strict=True)]
    axes[3].errorbar(heights, found, yerr=spread, fmt="o", color=BLUE, markersize=4, capsize=2, label="strokes")
    axes[3].plot(heights, [each.mean(each.wanted) for each in layers], color=ORANGE, label="rule")
    axes[3].set_xlabel("from the cavity [mm]", fontsize=9)
    axes[3].set_ylabel("helix angle [degrees]", fontsize=9)
    axes[3].legend(fontsize=8, frameon=False)
    return small_png(figure)
