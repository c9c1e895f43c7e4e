"""Do pressure, nozzle, speed and number of rounds fit together? What a layer needs against what flows.

A layer of height h between paths a distance w apart needs w * h of material per length of path; flow / speed is what
gets there. More is over-dispensing, less leaves the layer thin, and where the bead pressed to the stand-off is narrower
than the spacing there are gaps. Who does not know the material can still compare with a print that worked: a fluid
that does not thicken flows at least as much faster as the pressure rises.
"""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.deposition.bead import bead, strand_diameter
from geoprint.deposition.curing import Exposure, exposure
from geoprint.deposition.rheology import Bore, bore_of, flow_through, pressure_for, starting_pressure
from geoprint.errors import InputError
from geoprint.model import PASCAL_PER_KPA, Flood, Fluid, Material, Process, Tool, comparable

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
    return bead(flow=flow, speed=process.speed, standoff=process.standoff).width


def _flow_at(pressure: float, *, fluid: Fluid, bore: Bore, start: float) -> float:
    """Return the flow at a pressure [mm3/s]; none below the pressure at which it starts is refused."""
    flow = float(flow_through(fluid, bore, pressures=np.array([pressure]))[0])
    if flow <= 0.0:
        raise InputError(
            f"nothing flows at {pressure / PASCAL_PER_KPA:g} kPa: the yield stress holds the material in this nozzle "
            f"up to {start / PASCAL_PER_KPA:.3g} kPa; raise the pressure or take a wider or shorter needle.",
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
            f"over-dispensing, unless the material is Newtonian: at least {low:.2f} times the material, more the more "
            f"it thins with shear; and beads {spacing:.2g} times as far apart."
        )
    if high <= 1.0 + FITTING_SHARE:
        return (
            f"too little, unless the material is Newtonian: at most {high:.2f} times the material, less the more it "
            f"thins with shear; and beads {spacing:.2g} times as far apart."
        )
    return "cannot be told without the material: measure it (`geoprint fit-flow`)."
