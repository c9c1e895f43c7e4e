"""Simulated photographs of prints on parts that stand free, and cameras placed by the outline of the part in them."""

from __future__ import annotations

from functools import cache
from typing import final

import numpy as np

from benchmarks import DATA
from benchmarks.parts.streams import rows_on_plate
from geoprint.config import job_of
from geoprint.geometry import mean_normal, united
from geoprint.geometry.files import load
from geoprint.inspection import (
    Camera,
    Fiducials,
    Held,
    Lens,
    PlannedRuns,
    bead_width,
    beads_of,
    camera_by,
    held_against,
    in_sight,
    measured_stretches,
    paired_edges,
    planned_runs,
)
from geoprint.inspection.outline import picture_outline
from geoprint.inspection.outline_pose import PrintedLines, camera_by_outline
from geoprint.model import FloatArray, PoseStream, Surface, frozen
from geoprint.simulation import Faults, Lighting, Viewpoint, deposited_beads, looking_at, pictured
from geoprint.transforms import rigid
from geoprint.workflow import plan

# Parts. Contours of a plate look alike from two sides; rows that lie nearer to one of its sides do not.
FLAT, APEX, ON_HEART, ROWS, PLATE = "flat patch", "apex patch", "flat patch on the heart", "rows on a plate", "plate"
FILES = {FLAT: "heart_flat_patch", APEX: "heart_apex_patch", ON_HEART: "heart_flat_patch", PLATE: "plate"}
# Of every plan [mm].
SPACING, HEIGHT = 4.0, 0.5
# Of a row on a plate: its ends and how far the first one is from the middle [mm].
ROW_ENDS, FIRST_ROW, ROW_COUNT, ROW_FLOW = (-16.0, 16.0), -11.0, 6, 0.8
SIZE = (900, 760)
# Of the camera: how far aslant it looks [degrees], and how far away it is [radii of all that is seen].
TILTS_DEG, AWAY = (5.0, 45.0), (5.0, 9.0)
FILLED = 0.75
# Of what is printed: width over what the flow asks for, its noise, and an offset [mm].
FAULTS = Faults(width_scale=0.5, width_noise=0.03, offset=0.1)
# Fiducials are clicked so exactly (standard deviation) [pixels], so many of them.
CLICKED, MARKS = 0.5, 8


@final
@frozen
class OutlinedPrint:
    """A print that a plan asks for, and all that stands there.

    Attributes:
        surface: that is printed on.
        poses: of its plan.
        plan: what these lay.
        beside: what stands there besides.
    """

    surface: Surface
    poses: PoseStream
    plan: PlannedRuns
    beside: tuple[Surface, ...]


@final
@frozen
class OutlinedPhotograph:
    """How a camera was placed by an outline, and what was measured with it.

    Attributes:
        off: largest distance of a place of the part from where the camera sees it [pixels].
        off_mm: that on the part, across the line of sight [mm].
        within: what is told of it with 95 % confidence [pixels].
        clearer: how many times nearer the lines lie than from another place of the camera; None for one.
        width: mean of the beads, over that with the true camera; NaN where the photograph is too coarse for it [mm].
        offset: likewise, of their middles from the runs [mm].
        clicked_width: as the width, with fiducials that were clicked [mm].
        clicked_offset: as the offset, likewise [mm].
    """

    off: float
    off_mm: float
    within: float
    clearer: float | None
    width: float
    offset: float
    clicked_width: float
    clicked_offset: float


@cache
def outlined_print(part: str) -> OutlinedPrint:
    """Return the print of a part, by its name above."""
    beside = (load(DATA / "heart.ply", unit="mm"),) if part == ON_HEART else ()
    if part == ROWS:
        surface = load(DATA / "plate.ply", unit="mm")
        poses = rows_on_plate(
            np.linspace(*ROW_ENDS, 33), first=FIRST_ROW, spacing=SPACING, count=ROW_COUNT, height=HEIGHT, flow=ROW_FLOW
        )
    else:
        path = DATA / f"{FILES[part]}.ply"
        made = plan(job_of(surface=path, unit="mm", spacing=SPACING, backend="fast-marching", robot=False))
        surface, poses = made.workpiece.surface, made.poses
    return OutlinedPrint(surface, poses, planned_runs(poses, spacing=SPACING), beside)


def photograph_of(printed: OutlinedPrint, *, seed: int, size: tuple[int, int] = SIZE) -> tuple[Viewpoint, FloatArray]:
    """Return a camera that looks at a print from somewhere, and the (h, w) photograph that it takes.

    Args:
        printed: what it looks at.
        seed: of the camera, the light and the noise.
        size: of the photograph [pixels].
    """
    random = np.random.default_rng(seed)
    scene = united([printed.surface, *printed.beside])
    middle = 0.5 * (scene.vertices.min(axis=0) + scene.vertices.max(axis=0))
    radius = float(np.linalg.norm(scene.vertices - middle, axis=1).max())
    up = mean_normal(printed.surface)
    up = up / np.linalg.norm(up)
    across = random.standard_normal(3)
    across -= (across @ up) * up
    tilt = np.radians(random.uniform(*TILTS_DEG))
    toward = np.cos(tilt) * up + np.sin(tilt) * across / np.linalg.norm(across)
    away = radius * random.uniform(*AWAY)
    view = looking_at(
        middle + 0.05 * radius * random.standard_normal(3), place=middle + away * toward,
        focal=FILLED * 0.5 * min(size) * away / radius, size=size, turn=random.uniform(-np.pi, np.pi),
    )  # fmt: skip
    beads = deposited_beads(printed.poses, printed.surface, height=HEIGHT, faults=FAULTS, random=random)
    light = Lighting(up + 0.25 * random.standard_normal(3))
    grey = pictured(scene, beads, view, light, random=random)
    return view, np.rint(255.0 * grey) / 255.0


def true_camera(view: Viewpoint) -> Camera:
    """Return the camera that a viewpoint is."""
    lens = Lens(view.size, np.full(2, view.focal), view.middle, np.array(view.radial))
    return Camera(lens, rigid(view.axes, -view.axes @ view.place), 0.0, 0)


def placed_by_outline(part: str, *, seed: int, size: tuple[int, int] = SIZE) -> OutlinedPhotograph:
    """Return how well the outline of a part places a camera, and what is then measured.

    Args:
        part: its name.
        seed: of the photograph.
        size: of the photograph [pixels].

    Raises:
        InputError: the outline places none.
    """
    printed = outlined_print(part)
    return placement_of(printed, *photograph_of(printed, seed=seed, size=size), seed=seed)


def placement_of(printed: OutlinedPrint, view: Viewpoint, grey: FloatArray, *, seed: int) -> OutlinedPhotograph:
    """Return how well the outline in a photograph places its camera, and what is then measured.

    Args:
        printed: what it shows.
        view: its camera.
        grey: (h, w) of it.
        seed: of the fiducials that somebody clicks.

    Raises:
        InputError: the outline places none.
    """
    width = bead_width(grey)
    beads = beads_of(grey, paired_edges(grey, width=width))
    truth = true_camera(view)
    lines = PrintedLines(beads, printed.surface, printed.plan)
    found = camera_by_outline(picture_outline(grey), printed.surface, truth.lens, lines=lines, beside=printed.beside)

    def held(camera: Camera) -> Held:
        visible = in_sight(camera, printed.surface, printed.plan.places, size=view.size, margin=width)
        measured = measured_stretches(grey, printed.plan, camera, printed.surface, visible=visible)
        return held_against(printed.plan, measured, visible=visible, height=HEIGHT)

    def measured(camera: Camera) -> tuple[float, float]:
        result = held(camera)
        if not result.sized.any():
            return np.nan, np.nan
        return float(result.widths[result.sized].mean()), float(result.offsets[result.sized].mean())

    placing = found.outline
    assert placing is not None
    (wide, left), by_outline, clicked = (measured(each) for each in (truth, found, _clicked(printed, view, seed=seed)))
    places = printed.surface.vertices
    off = np.linalg.norm(found.seen(places) - truth.seen(places), axis=1)
    depths = (places - view.place) @ view.axes[2]
    return OutlinedPhotograph(
        float(off.max()), float((off * depths / view.focal).max()), placing.within, placing.clearer,
        by_outline[0] - wide, by_outline[1] - left, clicked[0] - wide, clicked[1] - left,
    )  # fmt: skip


def _clicked(printed: OutlinedPrint, view: Viewpoint, *, seed: int) -> Camera:
    """Return the camera that fiducials place which somebody clicked."""
    random = np.random.default_rng([seed, 1])
    places = printed.surface.vertices[random.choice(len(printed.surface.vertices), MARKS, replace=False)]
    pixels = view.pixels(places) + CLICKED * random.standard_normal((MARKS, 2))
    return camera_by(Fiducials(tuple(f"m{k}" for k in range(MARKS)), pixels, places), true_camera(view).lens)
