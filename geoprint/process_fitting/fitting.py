"""A material fitted to measured lines; pressure, nozzle, speed and spacing that fit each other."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Literal, final

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from geoprint.delimited import MOST_ROWS, read_columns, refuse
from geoprint.errors import InputError
from geoprint.model import (
    PASCAL_PER_KPA,
    FloatArray,
    Flood,
    Fluid,
    Material,
    Process,
    Tool,
    comparable,
    freeze_arrays,
    frozen,
)
from geoprint.process.bead import bead_width, segment_area, strand_diameter
from geoprint.process.curing import Exposure, exposure
from geoprint.process.rheology import Bore, bore_of, flow_through, pressure_for, starting_pressure

# Measured flow: a small table of lines that were weighed, or whose width and height were measured.
#
# A table (`geoprint.delimited`) with one of two headings, one row a line that was deposited:
#
#     pressure_kpa,duration_s,mass_g                 valve open for so long, weighed
#     pressure_kpa,speed_mm_s,width_mm,height_mm     a straight line, its section taken as a circular segment
#
# Every value is a number above 0.


WEIGHED = ("pressure_kpa", "duration_s", "mass_g")
GAUGED = ("pressure_kpa", "speed_mm_s", "width_mm", "height_mm")
# Nobody measures more, in any of these units.
LARGEST = 1e12
MILLIGRAMS_PER_GRAM = 1000.0


@final
@frozen
class MeasuredFlow:
    """Flow at several pressures.

    Attributes:
        pressures: (k,) [Pa].
        flows: (k,) [mm3/s].
    """

    pressures: FloatArray
    flows: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, pressures="float: k", flows="float: k")


def read_measured_flow(path: Path | str, *, density: float) -> MeasuredFlow:
    """Read a table of measured lines.

    Args:
        path: the CSV file.
        density: of the material [g/cm3].

    Raises:
        InputError: the file cannot be read, or has another heading or a value that is not a number above 0; the
            sentence names row and column.
    """
    found = read_columns(path, [WEIGHED, GAUGED], what="lines", bare=False, farthest=LARGEST, unit="")
    name = Path(path).name
    if not found.lines:
        raise InputError(f"{name} must have 1 to {MOST_ROWS} rows below its heading.")
    for line, row in zip(found.lines, found.numbers.tolist(), strict=True):
        for column, value in zip(found.names, row, strict=True):
            if not value > 0.0:
                refuse(name, line, f"found {value:g}, needed is a number above 0", column=column)
    columns = dict(zip(found.names, found.numbers.T, strict=True))
    return MeasuredFlow(columns["pressure_kpa"] * PASCAL_PER_KPA, _flows(columns, density=density))


def _flows(columns: dict[str, FloatArray], *, density: float) -> FloatArray:
    if "mass_g" not in columns:
        sections = [
            segment_area(width, height=height)
            for width, height in zip(columns["width_mm"].tolist(), columns["height_mm"].tolist(), strict=True)
        ]
        return columns["speed_mm_s"] * np.array(sections)
    # g/cm3 is mg/mm3.
    return columns["mass_g"] * MILLIGRAMS_PER_GRAM / density / columns["duration_s"]


# How a material flows, fitted to a few measured lines, with the interval in which each parameter lies.
#
# Least squares of the logarithm of the flow: errors of weighing and measuring are shares. Parameters are fitted as
# logarithms, so that they stay positive; their covariance is s^2 (J^T J)^-1 with the residual variance s^2 and the
# Jacobian J at the solution, and the intervals use Student's t for the few lines that there are [Bates1988, ch. 2].
# In trials they hold the true parameter as often as they promise for Newtonian fluids and power laws; with a yield
# stress the model is bent so much that they are somewhat too narrow and hold it about nine times in ten.


FluidModel = Literal["newtonian", "power-law", "herschel-bulkley"]
PARAMETERS: Mapping[FluidModel, tuple[str, ...]] = MappingProxyType(
    {
        "newtonian": ("consistency",),
        "power-law": ("consistency", "index"),
        "herschel-bulkley": ("consistency", "index", "yield_stress"),
    }
)
# Different pressures that a model needs: one more line than parameters always stays to judge it by.
FEWEST_PRESSURES = MappingProxyType({"newtonian": 2, "power-law": 2, "herschel-bulkley": 3})
CONFIDENCE = 0.95
# A parameter whose interval spans more than this factor is not determined by the data.
WIDEST_INTERVAL = 10.0
# Pressures nearer together than this share are one pressure.
SAME_PRESSURE = 0.02
# Beyond these consistencies [Pa s^index] and indices is no material: who gets there is not determined.
LEAST = (1e-3, 0.05)
MOST = (1e8, 4.0)
# Shares of the largest possible yield stress from which the fit starts.
YIELD_STARTS = (0.05, 0.4, 0.8)
# A yield stress below this share of that largest one changes no flow that was measured.
NO_YIELD = 1e-6
# A singular value that stands for none: what it divides is beyond every interval, but finite.
SMALLEST = 1e-100


@final
@frozen
class FittedFluid:
    """A fluid and how well the data determine it.

    Attributes:
        model: that was fitted.
        fluid: the best parameters.
        intervals: name, lower and upper end of the 95 % confidence interval of each fitted parameter.
        residuals: (k,) natural logarithm of measured over fitted flow at each line.
    """

    model: FluidModel
    fluid: Fluid
    intervals: tuple[tuple[str, float, float], ...]
    residuals: FloatArray

    @property
    def scatter(self) -> float:
        """Standard deviation of the measured flow about the fitted one, as a share of it."""
        freedom = self.residuals.size - len(self.intervals)
        return float(np.sqrt((self.residuals**2).sum() / freedom))


def fit_fluid(measured: MeasuredFlow, bore: Bore, *, model: FluidModel) -> FittedFluid:
    """Fit a fluid to measured flows.

    Args:
        measured: k lines.
        bore: of the nozzle that deposited them.
        model: 'newtonian' (consistency), 'power-law' (and index) or 'herschel-bulkley' (and yield stress).

    Raises:
        InputError: the data cannot determine the parameters: too few lines or different pressures, no rise of the
            flow with pressure, or an interval wider than a factor of 10; the sentence says which and what to measure.
    """
    names = PARAMETERS[model]
    _require_enough(measured, model)
    largest = float(measured.pressures.min()) / starting_pressure(Fluid(1.0, 1.0, 1.0), bore)
    bounds: FloatArray = np.log([(*LEAST, NO_YIELD * largest), (*MOST, (1.0 - NO_YIELD) * largest)])[:, : len(names)]

    def residuals(logarithms: FloatArray) -> FloatArray:
        flows = flow_through(Fluid(*np.exp(logarithms)), bore, pressures=measured.pressures)
        return np.log(measured.flows / np.maximum(flows, np.finfo(np.float64).tiny))

    fits = [
        least_squares(residuals, np.clip(start, *bounds), bounds=(bounds[0], bounds[1]), x_scale="jac")
        for start in _starts(measured, bore, model, largest_yield=largest)
    ]
    best = min(fits, key=lambda fit: float(fit.cost))
    found = np.asarray(best.x, dtype=np.float64)
    errors = _half_intervals(np.asarray(best.jac, dtype=np.float64), residuals(found))
    errors[np.asarray(best.active_mask) != 0] = np.inf
    for name, half in zip(names, errors.tolist(), strict=True):
        _require_determined(name, half, model=model)
    intervals = tuple(zip(names, np.exp(found - errors).tolist(), np.exp(found + errors).tolist(), strict=True))
    return FittedFluid(model, Fluid(*np.exp(found)), intervals, residuals(found))


def _require_enough(measured: MeasuredFlow, model: FluidModel) -> None:
    lines, parameters = measured.flows.size, len(PARAMETERS[model])
    logs = np.sort(np.log(measured.pressures))
    pressures = 1 + int((np.diff(logs) > SAME_PRESSURE).sum())
    if pressures == 1:
        raise InputError(
            "all lines were deposited at one pressure, which Newtonian and shear-thinning fluids fit equally well. "
            "Measure at two or more pressures, one twice the other.",
            pressures=1,
        )
    if pressures < FEWEST_PRESSURES[model] or lines <= parameters:
        raise InputError(
            f"the model {model} has {parameters} parameters and needs at least {FEWEST_PRESSURES[model]} pressures "
            f"and {parameters + 1} lines, found {pressures} and {lines}. Measure more, or choose a model with fewer "
            "parameters.",
            pressures=pressures,
            lines=lines,
        )


def _starts(measured: MeasuredFlow, bore: Bore, model: FluidModel, *, largest_yield: float) -> list[FloatArray]:
    """Return the logarithms to start from: the line of log flow over log pressure, and several yield stresses."""
    logs, flows = np.log(measured.pressures), np.log(measured.flows)
    slope = float(np.polyfit(logs, flows, 1)[0])
    if slope <= 0.0:
        raise InputError(
            "the flow does not rise with the pressure in these lines: check that columns and units are right.",
            slope=slope,
        )
    index = 1.0 if model == "newtonian" else 1.0 / slope
    middle = float(np.exp(logs.mean()))
    unit = flow_through(Fluid(1.0, index), bore, pressures=np.array([middle]))[0]
    # Flow falls with the consistency as its power -1 / index.
    consistency = float((unit / np.exp(flows.mean())) ** index)
    start: FloatArray = np.log(np.array([consistency, index]))[: min(len(PARAMETERS[model]), 2)]
    if model != "herschel-bulkley":
        return [start]
    return [np.concatenate([start, [np.log(share * largest_yield)]]) for share in YIELD_STARTS]


def _half_intervals(jacobian: FloatArray, residuals: FloatArray) -> FloatArray:
    """Return half the width of the confidence interval of each logarithm; infinity where nothing determines it."""
    lines, parameters = jacobian.shape
    freedom = lines - parameters
    variance = float((residuals**2).sum()) / freedom
    _, sizes, directions = np.linalg.svd(jacobian, full_matrices=False)
    # A direction that changes nothing leaves its parameters without bound.
    sizes = np.where(sizes > np.finfo(np.float64).eps * sizes[0] * lines, sizes, SMALLEST)
    spread = np.sqrt(((directions / sizes[:, None]) ** 2).sum(axis=0) * variance)
    return np.asarray(spread * student.ppf(0.5 + 0.5 * CONFIDENCE, freedom), dtype=np.float64)


def _require_determined(name: str, half: float, *, model: FluidModel) -> None:
    if half <= 0.5 * np.log(WIDEST_INTERVAL):
        return
    remedy = {
        "newtonian": "measure more lines, more exactly",
        "power-law": "measure at pressures farther apart, and more lines",
        "herschel-bulkley": "measure nearer to where the flow begins, or fit the model power-law",
    }[model]
    factor = "without bound" if not half < 100.0 else f"by a factor of {np.exp(2 * half):.3g}"
    raise InputError(
        f"the lines do not determine the {name.replace('_', ' ')}: its 95 % interval spreads {factor}, at most "
        f"{WIDEST_INTERVAL:g} is allowed; {remedy}.",
        parameter=name,
    )


# Do pressure, nozzle, speed and number of rounds fit together? What a layer needs against what flows.
#
# A layer of height h between paths a distance w apart needs w * h of material per length of path; flow / speed is
# what gets there. More is over-dispensing, less leaves the layer thin, and where the bead pressed to the stand-off
# is narrower than the spacing there are gaps. Who does not know the material can still compare with a print that
# worked: a fluid that does not thicken flows at least as much faster as the pressure rises.


# A layer that gets this share more or less than it needs still fits.
FITTING_SHARE = 0.1


@final
@comparable
class Recommendation:
    """What flows at a pressure, and the settings that fit it.

    Attributes:
        flow: [mm3/s].
        starting_pressure: below which nothing flows [Pa].
        needle_share: share of the pressure that is lost in the needle; the rest in the taper.
        shear_rate: at the wall of the needle [1/s].
        strand: diameter of a round strand at the set speed [mm].
        bead_width: of a line pressed down to the stand-off [mm], or None where the strand is thinner than that.
        spacing: between paths that makes a full layer at the set speed [mm].
        standoff: that neither ploughs through the layer nor lets the strand fall [mm].
        fill: material over what the layer needs at the asked spacing, or None where none was asked.
        speed: that fits the asked spacing [mm/s], or None.
        pressure: that fits the asked spacing at the set speed [Pa], or None.
        light: doses of the lamp, or None where nobody has measured its spot.
        warnings: sentences, what does not fit first.
    """

    flow: float
    starting_pressure: float
    needle_share: float
    shear_rate: float
    strand: float
    bead_width: float | None
    spacing: float
    standoff: float
    fill: float | None
    speed: float | None
    pressure: float | None
    light: Exposure | None
    warnings: tuple[str, ...]


def recommend(
    material: Material,
    *,
    tool: Tool,
    process: Process,
    pressure: float,
    spacing: float | None,
    flood: Flood | None = None,
) -> Recommendation:
    """Say what flows at a pressure, which spacing, speed and stand-off fit it, and whether an asked spacing does.

    Args:
        material: what the syringe holds.
        tool: with the nozzle.
        process: speed, stand-off and layer height of the cell.
        pressure: of the air [Pa].
        spacing: that is asked for [mm], or None.
        flood: final exposure of the whole part, or None where there is none.

    Raises:
        InputError: nothing flows at this pressure.
    """
    bore, fluid = bore_of(tool), material.fluid
    start = starting_pressure(fluid, bore)
    flow = _flow_at(pressure, fluid=fluid, bore=bore, start=start)
    needle, taper = (float(share[0]) for share in pressure_for(fluid, bore, flows=np.array([flow])))
    area, layer = flow / process.speed, process.layer_height
    strand = strand_diameter(area)
    width = _bead_width(flow, strand, process=process)
    fitting, meant = (None, area / layer) if spacing is None else (process.speed * spacing * layer, spacing)
    light = exposure(material, speed=process.speed, spacing=meant, flood=flood)
    return Recommendation(
        flow=flow,
        starting_pressure=start,
        needle_share=needle / (needle + taper),
        shear_rate=_wall_shear_rate(fluid, needle * bore.radius / (2.0 * bore.length)),
        strand=strand,
        bead_width=width,
        spacing=area / layer,
        standoff=min(layer, strand),
        fill=None if fitting is None else flow / fitting,
        speed=None if spacing is None else flow / (spacing * layer),
        pressure=None if fitting is None else float(pressure_for(fluid, bore, flows=np.array([fitting])).total[0]),
        light=light,
        warnings=(
            *_fit_warnings(area, strand if width is None else width, spacing=spacing, layer=layer),
            *_standoff_warnings(strand, process, tool=tool, spacing=meant),
            *([] if light is None or light.lacking is None else [light.lacking]),
        ),
    )


def _bead_width(flow: float, strand: float, *, process: Process) -> float | None:
    """Return the width of the bead that the nozzle presses [mm], or None where the strand is thinner than the gap."""
    if strand < process.standoff:
        return None
    return bead_width(flow=flow, speed=process.speed, standoff=process.standoff)


def _flow_at(pressure: float, *, fluid: Fluid, bore: Bore, start: float) -> float:
    """Return the flow at a pressure [mm3/s]; none below the pressure at which it starts is refused."""
    flow = float(flow_through(fluid, bore, pressures=np.array([pressure]))[0])
    if flow <= 0.0:
        raise InputError(
            f"nothing flows at {pressure / PASCAL_PER_KPA:g} kPa: the yield stress holds the material in this nozzle "
            f"up to {start / PASCAL_PER_KPA:.3g} kPa. Raise the pressure, or use a wider or shorter needle.",
            starting_pressure=start,
        )
    return flow


def _wall_shear_rate(fluid: Fluid, stress: float) -> float:
    return max((stress - fluid.yield_stress) / fluid.consistency, 0.0) ** (1.0 / fluid.index)


def _fit_warnings(area: float, width: float, *, spacing: float | None, layer: float) -> list[str]:
    """Say whether the rounds fit what flows."""
    if spacing is None:
        return []
    fill = area / (spacing * layer)
    found: list[str] = []
    if width < spacing:
        found.append(
            f"gaps: a bead is {width:.3g} mm wide, its neighbours are {spacing:.3g} mm away. More rounds, more "
            "pressure or a lower speed close them."
        )
    if fill > 1.0 + FITTING_SHARE:
        found.append(
            f"over-dispensing: {fill:.2f} times what a layer of {layer:g} mm needs. Fewer rounds, less pressure or a "
            "higher speed."
        )
    if fill < 1.0 - FITTING_SHARE:
        found.append(
            f"too little: {fill:.2f} times what a layer of {layer:g} mm needs. More rounds, more pressure or a lower "
            "speed."
        )
    return found


def _standoff_warnings(strand: float, process: Process, *, tool: Tool, spacing: float) -> list[str]:
    """Say whether the tip is too high to press the strand on, or scrapes what lies beside its path.

    A tip below the top of its own bead irons it, which is usual. Only where the needle is wider than the paths are
    apart does it reach into its neighbours' beads, which the lamp has cured.
    """
    if strand < process.standoff:
        fallen = "nothing presses it on, it falls and coils. Lower the tip or the speed."
        return [f"the strand is {strand:.3g} mm thick, less than the stand-off of {process.standoff:g} mm: {fallen}"]
    reach, depth = 0.5 * (tool.needle_diameter - spacing), process.layer_height - process.standoff
    if reach > 0.0 and depth > 0.0:
        needle = f"the needle is {tool.needle_diameter:g} mm wide and the paths are {spacing:.3g} mm apart"
        ploughs = f"its tip ploughs {reach:.2g} mm into the layer beside it, {depth:.2g} mm below the top"
        return [f"{needle}: {ploughs}. Set standoff_mm to {process.layer_height:g}, or take a thinner needle."]
    return []


@final
@comparable
class RelativeSetting:
    """A setting beside one that printed well, with the same part, material, nozzle and speed; ratios to the good one.

    Nothing is assumed of the material but that it does not thicken with shear.

    Attributes:
        flow: bounds of the flow, lowest and highest.
        layer: bounds of the material per area.
        spacing: of the paths, exactly.
        verdict: one sentence.
    """

    flow: tuple[float, float]
    layer: tuple[float, float]
    spacing: float
    verdict: str


def relative_setting(*, pressure: float, rounds: int, good_pressure: float, good_rounds: int) -> RelativeSetting:
    """Compare pressure and rounds with those of a print that worked.

    Args:
        pressure: in the same unit as the good one.
        rounds: of the same part.
        good_pressure: of the print that worked.
        good_rounds: of the print that worked.
    """
    ratio, denser = pressure / good_pressure, rounds / good_rounds
    low, high = (1.0, 1.0) if ratio == 1.0 else (ratio, np.inf) if ratio > 1.0 else (0.0, ratio)
    layer = (low * denser, high * denser)
    return RelativeSetting((low, high), layer, 1.0 / denser, _verdict(layer, spacing=1.0 / denser))


def _verdict(layer: tuple[float, float], *, spacing: float) -> str:
    low, high = layer
    if high < 1.0 - FITTING_SHARE:
        bound = "" if low == high else "at most "
        return f"too little: {bound}{high:.2f} times the material, on paths {spacing:.2g} times as far apart: gaps."
    if low > 1.0 + FITTING_SHARE:
        bound = "" if low == high else "at least "
        return f"over-dispensing: {bound}{low:.2f} times the material of the good print."
    if low == high:
        return "as the good print: the same material on the same paths." if spacing == 1.0 else "fits the good print."
    if low >= 1.0 - FITTING_SHARE:
        return (
            f"over-dispensing, unless the material is Newtonian: at least {low:.2f} times the material, more if it is "
            f"shear-thinning, in beads {spacing:.2g} times as far apart."
        )
    if high <= 1.0 + FITTING_SHARE:
        return (
            f"too little, unless the material is Newtonian: at most {high:.2f} times the material, less if it is "
            f"shear-thinning, in beads {spacing:.2g} times as far apart."
        )
    return "unknown for this material: measure it (`geoprint fit-flow`)."


# Settings that fit a pressure, for a material that is known or beside a print that worked.


@final
@comparable
class Advice:
    """A recommendation for a known material, for a part if one was given.

    Attributes:
        record: what fits.
        process: speed, stand-off and layer height that it is for.
        pressure_kpa: that was asked.
        spacing: that was asked [mm], or None.
        depth: largest distance from the seed over the part [mm], or None without one.
        mass_g: of one layer on the part, or None without one.
    """

    record: Recommendation
    process: Process
    pressure_kpa: float
    spacing: float | None
    depth: float | None
    mass_g: float | None


@final
@comparable
class Beside:
    """Pressure and rounds beside those of a print that worked.

    Attributes:
        record: how they compare.
        pressure_kpa: that was asked.
        rounds: that were asked.
        good_pressure_kpa: of the print that worked.
        good_rounds: of the print that worked.
    """

    record: RelativeSetting
    pressure_kpa: float
    rounds: int
    good_pressure_kpa: float
    good_rounds: int
