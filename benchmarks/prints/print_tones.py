"""Simulated photographs of prints on several parts, through tone curves, exposures and blurs drawn at random."""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np
from scipy.spatial import KDTree

from benchmarks.prints.print_outlines import (
    APEX,
    FLAT,
    HEIGHT,
    PLATE,
    ROWS,
    OutlinedPrint,
    outlined_print,
    true_camera,
)
from geoprint.errors import InputError
from geoprint.geometry import mean_normal
from geoprint.inspection import Held, held_against, in_sight, measured_stretches
from geoprint.model import FloatArray, frozen
from geoprint.simulation import (
    DepositedBeads,
    Development,
    Faults,
    Lighting,
    Viewpoint,
    deposited_beads,
    developed,
    looking_at,
    pictured,
)

PARTS = (PLATE, FLAT, ROWS, APEX)
SIZE, FILLED, AWAY = 900, 0.8, 10.0
# Allowed [mm].
WIDTH_OFF, OFFSET_OFF = 0.03, 0.02
# Of what is drawn: gammas (0 is sRGB's), exposures, blurs [px] and the largest slant [rad], gradient and grain.
GAMMAS, EXPOSURES, BLURS, SLANT, GRADIENT, GRAINS = (1.0, 2.4), (0.3, 2.0), (0.0, 4.0), 0.35, 0.4, (0.002, 0.02)
# How the picture is held: as it is, in so many of eight; else it is turned, mirrored, or negative. One in which a fault
# is to be found is not turned or mirrored, since such are refused.
HELD = ("", "", "", "", "", "negative", "turned", "mirrored")
# Errors that are planted: a run with so much volume, a break and a blob, so long [mm], so much wider.
PLANTED = ("0.6 of its volume", "1.5 of its volume", "break of 3 mm", "blob")
BREAK, BLOB, BLOB_WIDER = 3.0, 2.5, 0.8


@final
@frozen
class Judged:
    """A simulated photograph, and what was said of it.

    Attributes:
        part: its name.
        how: tone, exposure and blur, and how the picture was held.
        refused: why, or nothing.
        width: largest error of the mean width of a run that is given; NaN where none is [mm].
        offset: likewise of its offset [mm].
        runs: how many are given a width.
        faults: that were reported where there is none.
        found: whether the planted fault was found; True where none was planted.
    """

    part: str
    how: str
    refused: str
    width: float
    offset: float
    runs: int
    faults: int
    found: bool


@final
@frozen
class _Print:
    """Beads, how far they lie to the left [mm], and the run and where along it something is planted [mm]."""

    beads: DepositedBeads
    offset: float
    run: int
    at: tuple[float, float]


def judged_photograph(seed: int, *, planted: str = "") -> Judged:
    """Return what is said of a photograph that is drawn at random.

    Args:
        seed: of all that is drawn.
        planted: fault of `PLANTED`; nothing for none.
    """
    random = np.random.default_rng([seed, PLANTED.index(planted) + 1 if planted else 0])
    part = PARTS[seed % len(PARTS)]
    printed = outlined_print(part)
    print_ = _printed(printed, planted, random)
    view, up = _view(printed, random)
    grey, how = _developed(printed, print_.beads, view, up, random, upright=bool(planted))
    camera = true_camera(view)
    visible = in_sight(camera, printed.surface, printed.plan.places, size=view.size, margin=10.0)
    try:
        measured = measured_stretches(grey, printed.plan, camera, printed.surface, visible=visible)
        held = held_against(printed.plan, measured, visible=visible, height=HEIGHT)
    except InputError as error:
        return Judged(part, how, str(error), np.nan, np.nan, 0, 0, not planted)
    return _judged(part, how, held, print_, planted)


def _printed(printed: OutlinedPrint, planted: str, random: np.random.Generator) -> _Print:
    noise, offset = random.uniform(0.0, 0.05), random.uniform(-0.2, 0.2)
    faults = Faults(width_scale=random.uniform(0.35, 0.55), width_noise=noise, offset=offset)
    beads = deposited_beads(printed.poses, printed.surface, height=HEIGHT, faults=faults, random=random)
    plan = printed.plan
    # Of runs that are long enough to have a middle.
    lengths = {run: float(plan.lengths[plan.runs == run].sum()) for run in np.unique(plan.runs).tolist()}
    run = int(random.choice([run for run, length in lengths.items() if length > 25.0]))
    middle = float(random.uniform(0.3, 0.7) * lengths[run])
    own, widths = beads.runs == run, beads.widths.copy()
    if planted in PLANTED[:2]:
        widths[own] *= np.sqrt(float(planted.split()[0]))
    elif planted == PLANTED[2]:
        widths[own & (np.abs(beads.arcs - middle) <= 0.5 * BREAK)] = 0.0
    elif planted == PLANTED[3]:
        widths[own] *= 1.0 + BLOB_WIDER * np.exp(-0.5 * ((beads.arcs[own] - middle) / (0.5 * BLOB)) ** 2)
    return _Print(replace(beads, widths=widths), offset, run, (middle - 0.5 * BREAK, middle + 0.5 * BREAK))


def _view(printed: OutlinedPrint, random: np.random.Generator) -> tuple[Viewpoint, FloatArray]:
    vertices = printed.surface.vertices
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    radius = float(np.linalg.norm(vertices - middle, axis=1).max())
    up = mean_normal(printed.surface)
    across = random.standard_normal(3)
    across -= (across @ up) * up
    slant = random.uniform(0.0, SLANT)
    toward = np.cos(slant) * up + np.sin(slant) * across / np.linalg.norm(across)
    view = looking_at(
        middle, place=middle + AWAY * radius * toward, focal=FILLED * 0.5 * SIZE * AWAY, size=(SIZE, SIZE),
        turn=random.uniform(-np.pi, np.pi),
    )  # fmt: skip
    return view, up


def _developed(
    printed: OutlinedPrint,
    beads: DepositedBeads,
    view: Viewpoint,
    up: FloatArray,
    random: np.random.Generator,
    *,
    upright: bool,
) -> tuple[FloatArray, str]:
    """Return the (h, w) photograph, and how it was made."""
    tone = 0.0 if random.random() < 0.25 else random.uniform(*GAMMAS)
    exposure, blur = EXPOSURES[0] * (EXPOSURES[1] / EXPOSURES[0]) ** random.random(), random.uniform(*BLURS)
    light = Lighting(up + 0.15 * random.standard_normal(3))
    shown = pictured(printed.surface, beads, view, light, Development(blur=0.0, grain=0.0), random=random)
    slope = random.uniform(0.0, GRADIENT) * np.linspace(-0.5, 0.5, SIZE)
    development = Development(exposure=exposure, tone=tone, blur=blur, grain=random.uniform(*GRAINS))
    grey = developed(shown * (1.0 + slope), development, random=random)
    way = HELD[int(random.integers(len(HELD)))]
    way = "" if upright and way in ("turned", "mirrored") else way
    changed = {"": grey, "negative": 1.0 - grey, "turned": np.rot90(grey), "mirrored": np.fliplr(grey)}[way]
    how = f"{'sRGB' if tone == 0.0 else f'gamma {tone:.2f}'}, x {exposure:.2f}, {blur:.1f} px{way and f', {way}'}"
    return np.rint(255.0 * changed) / 255.0, how


def _judged(part: str, how: str, held: Held, print_: _Print, planted: str) -> Judged:
    plan, run, at = held.plan, print_.run, print_.at
    widths, offsets, faults, found = [0.0], [0.0], 0, False
    for number in np.unique(plan.runs).tolist():
        width, offset = held.width(number), held.offset(number)
        own = (plan.runs == number) & held.sized
        if width is not None and offset is not None:
            widths.append(width.value - _true_width(plan.places[own], print_.beads, number))
            offsets.append(offset.value - print_.offset)
        said = [*held.gaps(number), *held.blobs(number), *held.thin(number)]
        whole = held.whole(number)
        if number == run and planted:
            near = [each for each in said if each[1] > at[0] - 2.0 and each[0] < at[1] + 2.0]
            found = whole is not None if planted in PLANTED[:2] else bool(near)
            faults += len(said) - len(near) + (whole is not None and planted not in PLANTED[:2])
        else:
            faults += len(said) + (whole is not None)
    return Judged(
        part, how, "", float(np.abs(widths).max()), float(np.abs(offsets).max()), len(widths) - 1, faults,
        found or not planted,
    )  # fmt: skip


def _true_width(places: FloatArray, beads: DepositedBeads, run: int) -> float:
    """Return the mean width of the bead of a run beside places [mm]."""
    own = beads.runs == run
    return float(beads.widths[own][np.asarray(KDTree(beads.places[own]).query(places)[1])].mean())
