"""The three prints of Table I: planned from their cell files, simulated, and photographed by one camera.

A run gets what the air drives through the needle [Rabinowitsch1929], at the set speed, and keeps it. Its section is a
circular segment with chord w that meets the part at an angle a, of area w^2 (a - sin a cos a) / (4 sin^2 a) and height
w tan(a / 2) / 2: so spreading makes a bead wider and lower. The valve opens late, which leaves the start of a run bare;
and it closes late, which lays what still flows over the end of the run, as far as the tip moved in that time. The 60 s
of final exposure are the same for all three and change nothing here. Neighbouring beads do not push each other aside:
where they overlap, the photograph shows the nearer one, and thickness adds up.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Literal, TypeAlias, final

import numpy as np
from scipy.spatial import KDTree

from benchmarks import DATA
from geoprint.config import job_of
from geoprint.geometry import face_areas, mean_normal
from geoprint.geometry.files import load
from geoprint.model import Cell, FloatArray, Fluid, PoseStream, PrintErrors, Surface, comparable, freeze_arrays, frozen
from geoprint.process import bore_of, flow_through, starting_pressure
from geoprint.simulation import (
    Break,
    DepositedBeads,
    Development,
    Faults,
    Lighting,
    Viewpoint,
    deposited_beads,
    looking_at,
    pictured,
)
from geoprint.workflow import plan

BODY = DATA / "heart.ply"
CASES = ("A", "B", "C")
GOOD = "C"
# The paper flattens its patch, so its own way of planning counts here.
BACKEND = "lscm"
# The camera: how far from the part [mm], how much of it the picture shows, which holds either patch of data/ [mm], and
# how much more than a larger patch.
FAR, ACROSS, MARGIN = 300.0, 60.0, 1.1
# Any consistency does: flows count only beside each other, and it cancels out [Pa s^n].
CONSISTENCY = 100.0


@final
@frozen
class Case:
    """One row of Table I, planned.

    Attributes:
        name: A, B or C.
        pressure: of the air [Pa].
        rounds: one over the step.
        spacing: of its paths on the part [mm].
        cell: as its file states it.
        poses: of its plan.
    """

    name: str
    pressure: float
    rounds: int
    spacing: float
    cell: Cell
    poses: PoseStream


@final
@frozen
class Studio:
    """The three cases on one part, and where the camera stands still.

    Attributes:
        name: of the part.
        patch: that is printed on, as it was planned on.
        body: that the camera sees: the patch is a part of it.
        cases: A, B and C.
        middle: (3,) of the patch, which the camera looks at [mm].
        place: (3,) where it stands [mm].
        across: what the picture shows of a plane through that middle [mm].
    """

    name: str
    patch: Surface
    body: Surface
    cases: tuple[Case, ...]
    middle: FloatArray
    place: FloatArray
    across: float

    def __post_init__(self) -> None:
        freeze_arrays(self, middle="float: 3", place="float: 3")

    def view(self, scale: float) -> Viewpoint:
        """Return the camera, with so many pixels for each mm in the middle of the patch."""
        pixels = round(scale * self.across)
        return looking_at(self.middle, place=self.place, focal=scale * FAR, size=(pixels, pixels))


@final
@frozen
class Print:
    """One case as it was laid and photographed.

    Attributes:
        case: of Table I.
        beads: as laid.
        area: section of a bead, without noise [mm2].
        grey: (h, w) the photograph.
    """

    case: Case
    beads: DepositedBeads
    area: float
    grey: FloatArray


def studio_of(part: Path, *, body: Path) -> Studio:
    """Plan the three cases on a part, and put a camera before it.

    Args:
        part: file of a patch [mm].
        body: file of what the camera sees [mm], in the patch's coordinates.

    Raises:
        GeoprintError: the part cannot be planned on.
    """
    plans = {
        name: plan(
            job_of(surface=part, unit="mm", cell=DATA / f"paper_case_{name.lower()}.toml", backend=BACKEND, robot=False)
        )
        for name in CASES
    }
    cases: list[Case] = []
    for name, planned in plans.items():
        cell, poses = planned.workpiece.cell, planned.poses
        process = cell.process
        if process.pressure is None or process.rounds is None:
            raise SystemExit(f"data/paper_case_{name.lower()}.toml names no pressure or no rounds: make it anew.")
        spacing = float(poses.flow[poses.deposit].mean()) / process.layer_height
        cases.append(Case(name, process.pressure, process.rounds, spacing, cell, poses))
    patch = plans[CASES[0]].workpiece.surface
    middle = 0.5 * (patch.vertices.min(axis=0) + patch.vertices.max(axis=0))
    normal = mean_normal(patch)
    up = normal / np.linalg.norm(normal)
    place = middle + FAR * up
    # As the camera sees it: what is nearer lies farther aside.
    aside = np.linalg.norm(np.cross(patch.vertices - place, up), axis=1) / ((place - patch.vertices) @ up)
    across = max(ACROSS, MARGIN * 2.0 * FAR * float(aside.max()))
    return Studio(part.stem, patch, load(body, unit="mm"), tuple(cases), middle, place, across)


def prints_of(studio: Studio, printing: Printing, *, seed: int) -> tuple[Print, ...]:
    """Lay and photograph the three cases.

    Args:
        studio: what is planned, and the camera.
        printing: how it is laid and photographed.
        seed: of every noise; each case has its own.
    """
    sections = bead_sections(studio.cases, printing)
    view = studio.view(printing.scale)
    light = _lighting(view, printing)
    found: list[Print] = []
    for number, (case, area) in enumerate(zip(studio.cases, sections, strict=True)):
        random = np.random.default_rng([seed, number])
        beads = _deposited(case, studio.patch, printing, area=area, random=random)
        development = Development(grain=printing.grain, blur=printing.blur)
        grey = pictured(studio.body, beads, view, light, development, random=random)
        found.append(Print(case, beads, area, grey))
    return tuple(found)


def bead_sections(cases: tuple[Case, ...], printing: Printing) -> tuple[float, ...]:
    """Return the section of a bead of each case [mm2]: what flows at its pressure, over the speed.

    Args:
        cases: of Table I; the flow of case C is the one that `fill` tells.
        printing: fill, flow index and yield stress.
    """
    (good,) = (case for case in cases if case.name == GOOD)
    bore = bore_of(good.cell.tool)
    yields = printing.yield_share * good.pressure / starting_pressure(Fluid(CONSISTENCY, yield_stress=1.0), bore)
    fluid = Fluid(CONSISTENCY, index=printing.index, yield_stress=yields)
    own = flow_through(fluid, bore, pressures=np.array([good.pressure, *(case.pressure for case in cases)]))
    filled = printing.fill * good.spacing * good.cell.process.layer_height
    return tuple((filled * own[1:] / own[0]).tolist())


def bead_size(area: float, *, angle: float) -> tuple[float, float]:
    """Return width and height of a circular segment [mm] from its section [mm2] and the angle at its foot [rad]."""
    width = 2.0 * np.sqrt(area / _section(angle))
    return float(width), float(0.5 * width * np.tan(0.5 * angle))


def thickness(surface: Surface, beads: DepositedBeads, *, angle: float) -> FloatArray:
    """Return the (m,) thickness of the layer over the middle of every face [mm]: beads of all runs, added up.

    Args:
        surface: m faces.
        beads: on it.
        angle: at the foot of a bead [rad]; its section is kept, and shared out as a parabola.
    """
    middles = surface.vertices[surface.faces].mean(axis=1)
    total = np.zeros(len(middles))
    for run in np.unique(beads.runs).tolist():
        own = beads.runs == run
        widths = beads.widths[own]
        # Nothing lies farther from a bead than half of its largest width; what does is told as place len(widths).
        away, nearest = KDTree(beads.places[own]).query(middles, distance_upper_bound=0.5 * float(widths.max()))
        half = 0.5 * np.append(widths, 0.0)[nearest]
        share = np.divide(away, half, out=np.full(len(middles), np.inf), where=half > 0.0)
        # A parabola of this height has the section of the segment: two thirds of width times height.
        crest = 1.5 * (2.0 * half) * _section(angle) / 4.0
        total += np.where(share < 1.0, crest * (1.0 - np.minimum(share, 1.0) ** 2), 0.0)
    return total


def unevenness(surface: Surface, deposited: FloatArray, *, layer: float) -> float:
    """Return how far (m,) thicknesses of faces lie from the wanted layer, on average over the area, over that layer."""
    return over_area(surface, np.abs(deposited - layer)) / layer


def over_area(surface: Surface, values: FloatArray) -> float:
    """Return the mean over the area of a surface of (m,) values of its faces."""
    return float(np.average(values, weights=face_areas(surface)))


def _section(angle: float) -> float:
    """Return four times the area of a segment over its chord squared."""
    return float((angle - np.sin(angle) * np.cos(angle)) / np.sin(angle) ** 2)


def _deposited(
    case: Case, patch: Surface, printing: Printing, *, area: float, random: np.random.Generator
) -> DepositedBeads:
    """Lay one case: its flow differs from print to print and from run to run, its valve follows late."""
    poses, speed = case.poses, case.cell.process.speed
    angle = np.radians(printing.angle_deg)
    errors = case.cell.errors or PrintErrors()
    runs = np.unique(poses.runs[poses.deposit]).tolist()
    print_flow = 1.0 + errors.flow * random.standard_normal()
    run_flow: FloatArray = 1.0 + errors.run_flow * random.standard_normal(int(poses.runs.max()) + 1)
    width, height = bead_size(area, angle=angle)
    # A bead is as wide as the root of its section; `deposited_beads` takes it as flow over height.
    wide = width * np.sqrt(np.maximum(print_flow * run_flow[np.maximum(poses.runs, 0)], 0.0))
    late = speed * printing.valve_open
    faults = Faults(
        width_noise=printing.width_noise,
        breaks=tuple(Break(run, 0.0, late) for run in runs) if late > 0.0 else (),
    )
    beads = deposited_beads(replace(poses, flow=wide * height), patch, height=height, faults=faults, random=random)
    return _with_ends(beads, reach=speed * printing.valve_close)


def _with_ends(beads: DepositedBeads, *, reach: float) -> DepositedBeads:
    """Return beads with twice the material on the last stretch of each run, so long as the tip moves in that time."""
    widths = beads.widths.copy()
    for run in np.unique(beads.runs).tolist():
        own = beads.runs == run
        last = own & (beads.arcs > beads.arcs[own].max() - reach)
        widths[last] *= np.sqrt(2.0)
    return replace(beads, widths=widths)


def _lighting(view: Viewpoint, printing: Printing) -> Lighting:
    """Return light that comes from a slant off the line of sight."""
    slant, turn = np.radians(printing.slant_deg), np.radians(printing.turn_deg)
    right, down, ahead = view.axes
    aside = np.cos(turn) * right + np.sin(turn) * down
    toward = np.sin(slant) * aside - np.cos(slant) * ahead
    return Lighting(toward, part=printing.part, bead=printing.bead)


Drawn: TypeAlias = Literal["evenly", "by factors"]


@final
@comparable
class Printing:
    """How three prints are laid and photographed, beyond what Table I says.

    Attributes:
        fill: what case C lays, over what its layer holds.
        index: flow index of the material.
        yield_share: of case C's pressure, which the material's yield stress holds back.
        angle_deg: at which a bead meets the part as it is cured; the smaller, the more it has spread [deg].
        valve_open: time from the command until material flows [s].
        valve_close: time from the command until none flows [s].
        width_noise: standard deviation of the width along a bead, over its mean.
        slant_deg: of the light from the line of sight [deg].
        turn_deg: of the light about the line of sight [deg].
        part: share of light that the part gives back.
        bead: share of light that a bead gives back.
        grain: standard deviation of the noise of each pixel.
        blur: standard deviation of the unsharpness [pixels].
        scale: pixels of the photograph for each mm in the middle of the part.
    """

    fill: float
    index: float
    yield_share: float
    angle_deg: float
    valve_open: float
    valve_close: float
    width_noise: float
    slant_deg: float
    turn_deg: float
    part: float
    bead: float
    grain: float
    blur: float
    scale: float


@final
@comparable
class Plausible:
    """One value of a printing: what it is fixed at, and the range of what it may be.

    Attributes:
        fixed: beforehand.
        low: least that is plausible.
        high: most that is plausible.
        why: source of the fixed value, and why the range is that.
        drawn: evenly between both, or evenly in the logarithm.
    """

    fixed: float
    low: float
    high: float
    why: str
    drawn: Drawn = "evenly"

    def at(self, share: float) -> float:
        """Return the value that a share of the range lies below."""
        if self.drawn == "by factors":
            return float(self.low * (self.high / self.low) ** share)
        return self.low + share * (self.high - self.low)


PLAUSIBLE: Mapping[str, Plausible] = MappingProxyType(
    {
        "fill": Plausible(
            1.0, 0.5, 2.0, "the paper calls C the best print, so the flow is taken to fill its layer: ASSUMED; half "
            "to twice as much, as a print that fails by less still looks whole", "by factors",
        ),
        "index": Plausible(
            0.6, 0.4, 1.0, "the packaged cell's example; 1 is Newtonian, below 0.4 a paste would hardly flow at half "
            "the pressure: ASSUMED",
        ),
        "yield_share": Plausible(
            0.0, 0.0, 0.3, "the packaged cell's example; what holds back more than a third stops at small changes: "
            "ASSUMED",
        ),
        "angle_deg": Plausible(
            55.0, 22.0, 90.0, "a bead of case C is then about as high as the cell's layer, 0.5 mm; 22: pressed wholly "
            "to the stand-off of 0.3 mm; 90: cured as a half round",
        ),
        "valve_open": Plausible(0.05, 0.0, 0.1, "the packaged cell's example; up to twice that: ASSUMED"),
        "valve_close": Plausible(0.08, 0.0, 0.16, "the packaged cell's example; up to twice that: ASSUMED"),
        "width_noise": Plausible(0.05, 0.02, 0.15, "ASSUMED: as its flow errors; beads that vary more look torn"),
        "slant_deg": Plausible(0.0, 0.0, 45.0, "from the camera, as the guide asks; a lamp beside it"),
        "turn_deg": Plausible(0.0, 0.0, 360.0, "any side"),
        "part": Plausible(0.35, 0.15, 0.5, "of `geoprint.simulation`; a dark to a light model of a heart: ASSUMED"),
        "bead": Plausible(0.9, 0.6, 0.95, "of `geoprint.simulation`; a milky to a white silicone: ASSUMED"),
        "grain": Plausible(
            0.01, 0.003, 0.03, "of `geoprint.simulation`; bright light to a dim room: ASSUMED", "by factors"
        ),
        "blur": Plausible(0.7, 0.5, 2.0, "of `geoprint.simulation`; sharp to slightly out of focus: ASSUMED"),
        "scale": Plausible(
            8.0, 4.0, 12.0, "480 pixels then hold either patch; a needle 3 to 10 pixels wide, as nobody knows the "
            "paper's camera: ASSUMED", "by factors",
        ),
    }
)  # fmt: skip


def fixed_printing() -> Printing:
    """Return the printing whose every value is fixed beforehand."""
    return Printing(**{name: each.fixed for name, each in PLAUSIBLE.items()})


def drawn_printing(random: np.random.Generator) -> Printing:
    """Return a printing whose values are drawn from their ranges, each by itself."""
    return Printing(**{each.name: PLAUSIBLE[each.name].at(float(random.uniform())) for each in fields(Printing)})
