"""Photographs of 21 printed lines, their masks, other lightings of the same, and simulated rows on a plate."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.parts.streams import rows_on_plate
from benchmarks.prints.print_outlines import true_camera
from geoprint.inspection import Held, held_against, in_sight, measured_stretches, planned_runs
from geoprint.model import BoolArray, FloatArray, Surface
from geoprint.simulation import Faults, Lighting, deposited_beads, looking_at, pictured

# Lines between two rails of a frame, which are lines of the mask as well.
LINES, RAILS = 21, 2
# No line is thicker in the mask [pixels]; what is thicker is the frame seen along a rail.
THICKEST = 60
# A middle nearer than this to that of the mask is right [pixels], and a line is found where so much of it is.
RIGHT, FOUND_SHARE = 3.0, 0.8
# Rows on a plate: between them, of a bead [mm], and how many.
SPACING, HEIGHT, WIDTH, ROWS = 4.0, 0.25, 1.6, 6
POSES_A_ROW = 31
# What is seen lies so far within the picture [pixels].
MARGIN = 10.0
# From above, aslant, through a lens that bends.
VIEW = looking_at(
    np.array([20.0, 15.0, 0.0]), place=np.array([30.0, 0.0, 110.0]), focal=1150.0, size=(480, 400), turn=0.1,
    radial=(-0.1, 0.02),
)  # fmt: skip
PHOTOGRAPHS = ("pacamera_black_frame45_4-5", "pacamera_gold_frame50_4-5")


def reference_lines(mask: BoolArray) -> list[FloatArray]:
    """Return of each of the 21 lines the (k, 2) middles (u, v), where a column of the mask shows all of them.

    Args:
        mask: (h, w) white of the supplied mask.
    """
    found: list[tuple[int, FloatArray]] = []
    for column in range(mask.shape[1]):
        steps = np.diff(np.concatenate([[0], mask[:, column].astype(np.int64), [0]]))
        starts, ends = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
        thin = ends - starts <= THICKEST
        middles: FloatArray = (0.5 * (starts + ends - 1.0))[thin].astype(np.float64)
        if middles.size == LINES + RAILS:
            found.append((column, middles[1:-1]))
    columns = np.array([column for column, _ in found], dtype=np.float64)
    rows = np.array([middles for _, middles in found]).reshape(-1, LINES)
    return [np.column_stack([columns, rows[:, line]]) for line in range(LINES)]


def judged(middles: FloatArray, lines: list[FloatArray]) -> tuple[int, float]:
    """Return how many lines are found, and which share of the length of all has a middle within 3 pixels.

    Lines run about along u: at each column the nearest middle within half a pixel of it counts.

    Args:
        middles: (n, 2) that were found.
        lines: of the mask.
    """
    order = middles[np.argsort(middles[:, 0])]
    shares: list[float] = []
    for line in lines:
        firsts = np.searchsorted(order[:, 0], line[:, 0] - 1.0)
        lasts = np.searchsorted(order[:, 0], line[:, 0] + 1.0)
        misses = [
            np.abs(order[first:last, 1] - row).min(initial=np.inf)
            for first, last, row in zip(firsts, lasts, line[:, 1], strict=True)
        ]
        shares.append(float((np.array(misses) <= RIGHT).mean()))
    return sum(share >= FOUND_SHARE for share in shares), float(np.mean(shares))


def lightings(grey: FloatArray) -> Mapping[str, FloatArray]:
    """Return a photograph as it is and under other lights: darker, with another gamma, with light from one side.

    Args:
        grey: (h, w).
    """
    height, width = grey.shape
    down, right = np.linspace(0.0, 1.0, height)[:, None], np.linspace(0.0, 1.0, width)[None, :]
    return {
        "as taken": grey,
        "darker by half": 0.5 * grey,
        "gamma 1.8": grey**1.8,
        "from the left, 3 to 1": grey * (1.0 - 0.66 * right),
        "from above, 1 to 3": np.clip(grey * (0.4 + 0.8 * down), 0.0, 1.0),
    }


def mask_of(path: Path) -> BoolArray:
    """Return (h, w) what is white in a mask."""
    return np.asarray(np.asarray(Image.open(path).convert("L")) > 127)


def plate_print(faults: Faults, *, seed: int = 1) -> Held:
    """Return rows of beads on a plate, printed in simulation with faults, photographed and held against their plan.

    Args:
        faults: that are put in.
        seed: of the noise.
    """
    surface = _plate()
    poses = rows_on_plate(
        np.linspace(5.0, 35.0, POSES_A_ROW), first=5.0, spacing=SPACING, count=ROWS, height=HEIGHT, flow=WIDTH * HEIGHT
    )
    random = np.random.default_rng(seed)
    beads = deposited_beads(poses, surface, height=HEIGHT, faults=faults, random=random)
    grey = pictured(surface, beads, VIEW, Lighting(np.array([0.1, 0.0, 1.0])), random=random)
    camera = true_camera(VIEW)
    plan = planned_runs(poses, spacing=SPACING)
    visible = in_sight(camera, surface, plan.places, size=VIEW.size, margin=MARGIN)
    measured = measured_stretches(grey, plan, camera, surface, visible=visible)
    return held_against(plan, measured, visible=visible, height=HEIGHT)


def _plate() -> Surface:
    """Return a plate of 40 x 30 mm of two triangles."""
    corners = np.array([[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [40.0, 30.0, 0.0], [0.0, 30.0, 0.0]])
    return Surface(vertices=corners, faces=np.array([[0, 1, 2], [0, 2, 3]]), name="plate")
