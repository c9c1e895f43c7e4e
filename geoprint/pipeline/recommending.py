"""What `geoprint recommend` says: settings that fit each other, for a material that is known or beside a good print."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import final

from geoprint.config import Job, load_cell
from geoprint.deposition.fitting import Recommendation, recommend, relative_setting
from geoprint.errors import UsageError
from geoprint.export import Json
from geoprint.model import PASCAL_PER_KPA, Cell, Material
from geoprint.pipeline.several_patches import prepared_part
from geoprint.pipeline.workpiece import largest_distance
from geoprint.surfaces import face_areas
from geoprint.surfaces.files import load_file

MILLIGRAMS_PER_GRAM = 1000.0


def recommendation(
    job: Job, *, part: bool, pressure_kpa: float | None, good: tuple[float, int] | None
) -> tuple[dict[str, Json], str]:
    """Say what fits a pressure, as JSON and as the lines that a person reads.

    Args:
        job: cell, spacing or rounds, and the mesh of a part.
        part: whether there is a part; without one the job's surface does not count.
        pressure_kpa: of the air; that of the cell if not given.
        good: pressure [kPa] and rounds of a print that worked, to compare with instead of knowing the material; that
            of the cell where it names one and no material.

    Raises:
        UsageError: nobody names a pressure, the cell names no material and there is no good print, or rounds are asked
            for without what gives them a meaning.
        InputError: nothing flows, or the part cannot be used.
    """
    cell = load_cell(job.cell)
    pressure_kpa = _pressure(cell, pressure_kpa)
    if good is None and cell.material is None and cell.good_print is not None:
        good = cell.good_print.pressure / PASCAL_PER_KPA, cell.good_print.rounds
    if good is not None:
        return _beside_good_print(pressure_kpa=pressure_kpa, rounds=job.rounds or cell.process.rounds, good=good)
    advice = _advice(job, cell, part=part, pressure_kpa=pressure_kpa)
    return _summary(advice), "\n".join(_lines(advice, cell))


def _pressure(cell: Cell, asked_kpa: float | None) -> float:
    """Return the pressure [kPa] that is asked for, or that of the cell."""
    if asked_kpa is None and cell.process.pressure is None:
        raise UsageError(
            f"give `--pressure` in kPa, or process.pressure_kpa in the cell {cell.name}: what flows depends on it."
        )
    if asked_kpa is not None and asked_kpa <= 0.0:
        raise UsageError(f"`--pressure {asked_kpa:g}` must be above 0 kPa.")
    return (cell.process.pressure or 0.0) / PASCAL_PER_KPA if asked_kpa is None else asked_kpa


@final
@dataclass(frozen=True, slots=True)
class _Advice:
    """A recommendation, for a part if one was given.

    Attributes:
        found: what fits.
        pressure_kpa: that was asked.
        spacing: that was asked [mm], or None.
        depth: largest distance from the seed over the part [mm], or None without one.
        mass_g: of one layer on the part, or None without one.
    """

    found: Recommendation
    pressure_kpa: float
    spacing: float | None
    depth: float | None
    mass_g: float | None


def _advice(job: Job, cell: Cell, *, part: bool, pressure_kpa: float) -> _Advice:
    material, process = _material(cell, pressure_kpa), cell.process
    depth = mass = None
    if part:
        surface = prepared_part(job, load_file(job.surface, unit=job.unit, label=job.label)).surface
        depth = largest_distance(job, surface)
        mass = float(face_areas(surface).sum()) * process.layer_height * material.density / MILLIGRAMS_PER_GRAM
    asked = _asked_spacing(job, cell, depth=depth)
    pressure = pressure_kpa * PASCAL_PER_KPA
    found = recommend(material, tool=cell.tool, process=process, pressure=pressure, spacing=asked, flood=cell.flood)
    return _Advice(found, pressure_kpa, asked, depth, mass)


def _asked_spacing(job: Job, cell: Cell, *, depth: float | None) -> float | None:
    """Return the spacing that job or cell ask for, or None; rounds divide the depth of a part [mm]."""
    if job.spacing is not None:
        return job.spacing
    if job.rounds is not None and depth is None:
        raise UsageError("rounds mean a spacing on a part only: give its mesh, or `--spacing`.")
    rounds = job.rounds or cell.process.rounds
    return None if rounds is None or depth is None else depth / rounds


def _summary(advice: _Advice) -> dict[str, Json]:
    """Return advice as JSON: mm, s, Pa, mm3/s, and the two that name another unit."""
    return {
        "pressure_kpa": advice.pressure_kpa,
        "asked_spacing": advice.spacing,
        "depth": advice.depth,
        "mass_g": advice.mass_g,
        **asdict(advice.found),
        "warnings": list(advice.found.warnings),
    }


def _beside_good_print(
    *, pressure_kpa: float, rounds: int | None, good: tuple[float, int]
) -> tuple[dict[str, Json], str]:
    if rounds is None:
        raise UsageError(
            "`--good` compares rounds with rounds: give `--rounds` or `--step` too, or process.rounds in the cell."
        )
    if good[0] <= 0.0 or good[1] < 1:
        raise UsageError(f"`--good {good[0]:g} {good[1]}` must be a pressure above 0 kPa and 1 round or more.")
    found = relative_setting(pressure=pressure_kpa, rounds=rounds, good_pressure=good[0], good_rounds=good[1])
    text = (
        f"{pressure_kpa:g} kPa and {rounds} rounds beside {good[0]:g} kPa and {good[1]}: flow {_bounds(found.flow)}, "
        f"material {_bounds(found.layer)}, spacing {found.spacing:.3g} times\n{found.verdict}\n"
        "assumed: same part, material, nozzle and speed, and a material that does not thicken with shear."
    )
    return {
        "flow": _json_bounds(found.flow),
        "layer": _json_bounds(found.layer),
        "spacing": found.spacing,
        "verdict": found.verdict,
    }, text


def _json_bounds(bounds: tuple[float, float]) -> list[Json]:
    """Return bounds with null for no upper one: JSON has no infinity."""
    return [bounds[0], bounds[1] if bounds[1] < float("inf") else None]


def _material(cell: Cell, pressure_kpa: float) -> Material:
    if cell.material is None:
        raise UsageError(
            f"the cell {cell.name} names no [material], so nobody knows how much flows at {pressure_kpa:g} kPa: weigh "
            "a few lines and let `geoprint fit-flow` write the table, or compare with a print that worked: `--good KPA "
            "ROUNDS`, or [good_print] in the cell."
        )
    return cell.material


def _lines(advice: _Advice, cell: Cell) -> Iterator[str]:
    found, process = advice.found, cell.process
    yield (
        f"flow: {found.flow:.3g} mm3/s at {advice.pressure_kpa:g} kPa (flow begins at "
        f"{found.starting_pressure / PASCAL_PER_KPA:.3g} kPa; {found.needle_share:.0%} of the pressure is lost in the "
        f"needle, shear rate {found.shear_rate:.3g} 1/s)"
    )
    width = "not pressed on" if found.bead_width is None else f"bead {found.bead_width:.3g} mm wide"
    yield f"at {process.speed:g} mm/s: strand of {found.strand:.3g} mm, {width} at {process.standoff:g} mm stand-off"
    rounds = "" if advice.depth is None else f", {max(round(advice.depth / found.spacing), 1)} rounds on this part"
    yield (
        f"fits: spacing {found.spacing:.3g} mm{rounds}, stand-off {found.standoff:.3g} mm, for a layer of "
        f"{process.layer_height:g} mm"
    )
    if advice.mass_g is not None:
        yield f"one layer on this part takes {advice.mass_g:.3g} g"
    if advice.spacing is not None and found.speed is not None and found.pressure is not None:
        yield (
            f"asked: spacing {advice.spacing:.3g} mm; it gets {found.fill:.2f} times what the layer needs. It fits "
            f"{found.speed:.3g} mm/s, or {found.pressure / PASCAL_PER_KPA:.3g} kPa at {process.speed:g} mm/s"
        )
    if found.light is not None:
        yield (
            f"light: one pass gives {found.light.one_pass:.3g} mJ/cm2, all passes together {found.light.all_passes:.3g}"
        )
    for warning in found.warnings:
        yield f"note: {warning}"
    yield "assumed: no slip at the wall, no losses but in needle and taper, a taper as thick-walled as the needle."


def _bounds(bounds: tuple[float, float]) -> str:
    low, high = bounds
    if low == high:
        return f"{low:.2f} times"
    return f"at least {low:.2f} times" if low > 0.0 else f"at most {high:.2f} times"
