"""Process settings: the fluid that measured lines fit, and what fits a pressure or compares with a good print."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from geoprint.config import Job, job_cell, load_cell
from geoprint.errors import UsageError
from geoprint.geometry import face_areas
from geoprint.geometry.files import load_file
from geoprint.model import PASCAL_PER_KPA, Cell, Material
from geoprint.process import bore_of
from geoprint.process_fitting.fitting import (
    PARAMETERS,
    Advice,
    Beside,
    FittedFluid,
    FluidModel,
    fit_fluid,
    read_measured_flow,
    recommend,
    relative_setting,
)
from geoprint.workflow.patches import prepared_part
from geoprint.workflow.workpiece import largest_distance

MILLIGRAMS_PER_GRAM = 1000.0


def recommendation(
    job: Job,
    *,
    part: bool,
    pressure_kpa: float | None,
    good: tuple[float, int] | None,
    observe: Callable[[str], None] = lambda _: None,
) -> Advice | Beside:
    """Find what fits a pressure, or how it compares with a print that worked.

    Args:
        job: cell, spacing or rounds, and the mesh of a part.
        part: whether there is a part; without one the job's surface does not count.
        pressure_kpa: of the air; that of the cell if not given.
        good: pressure [kPa] and rounds of a print that worked, to compare with instead of knowing the material; that
            of the cell where it names one and no material.
        observe: called with the name of each stage as it starts.

    Raises:
        UsageError: nobody names a pressure, the cell names no material and there is no good print, or rounds are asked
            for without what gives them a meaning.
        InputError: nothing flows, or the part cannot be used.
    """
    cell = job_cell(job)
    pressure_kpa = _pressure(cell, pressure_kpa)
    if good is None and cell.material is None and cell.good_print is not None:
        good = cell.good_print.pressure / PASCAL_PER_KPA, cell.good_print.rounds
    if good is not None:
        return _beside_good_print(pressure_kpa=pressure_kpa, rounds=job.rounds or cell.process.rounds, good=good)
    return _advice(job, cell, part=part, pressure_kpa=pressure_kpa, observe=observe)


def fit_flow(path: Path | str, *, cell: Path | str | None, density: float, model: str) -> FittedFluid:
    """Fit a material to measured lines deposited with a cell's nozzle.

    Args:
        path: table of lines (`geoprint.process.measured`).
        cell: cell file with the nozzle; a packaged one if not given.
        density: [g/cm3].
        model: 'newtonian', 'power-law' or 'herschel-bulkley'.

    Raises:
        UsageError: the density or the model has no meaning.
        InputError: the table cannot be used, or does not determine the model.
    """
    if not 0.0 < density < 25.0:
        raise UsageError(f"`--density {density:g}` must be above 0 and below 25 g/cm3, where every material is.")
    chosen = _model(model)
    return fit_fluid(read_measured_flow(path, density=density), bore_of(load_cell(cell).tool), model=chosen)


def _pressure(cell: Cell, asked_kpa: float | None) -> float:
    """Return the pressure [kPa] that is asked for, or that of the cell."""
    if asked_kpa is None and cell.process.pressure is None:
        raise UsageError(
            f"give `--pressure` in kPa, or process.pressure_kpa in the cell {cell.name}: what flows depends on it."
        )
    if asked_kpa is not None and asked_kpa <= 0.0:
        raise UsageError(f"`--pressure {asked_kpa:g}` must be above 0 kPa.")
    return (cell.process.pressure or 0.0) / PASCAL_PER_KPA if asked_kpa is None else asked_kpa


def _advice(job: Job, cell: Cell, *, part: bool, pressure_kpa: float, observe: Callable[[str], None]) -> Advice:
    material, process = _material(cell, pressure_kpa), cell.process
    depth = mass = None
    if part:
        observe("reading")
        surface = prepared_part(
            job, load_file(job.surface, unit=job.unit, label=job.label, threshold=job.threshold)
        ).surface
        observe("distance")
        depth = largest_distance(job, surface)
        mass = float(face_areas(surface).sum()) * process.layer_height * material.density / MILLIGRAMS_PER_GRAM
    asked = _asked_spacing(job, cell, depth=depth)
    pressure = pressure_kpa * PASCAL_PER_KPA
    found = recommend(material, tool=cell.tool, process=process, pressure=pressure, spacing=asked, flood=cell.flood)
    return Advice(found, process, pressure_kpa, asked, depth, mass)


def _asked_spacing(job: Job, cell: Cell, *, depth: float | None) -> float | None:
    """Return the spacing that job or cell ask for, or None; rounds divide the depth of a part [mm]."""
    if job.spacing is not None:
        return job.spacing
    if job.rounds is not None and depth is None:
        raise UsageError("rounds mean a spacing on a part only: give its mesh, or `--spacing`.")
    rounds = job.rounds or cell.process.rounds
    return None if rounds is None or depth is None else depth / rounds


def _beside_good_print(*, pressure_kpa: float, rounds: int | None, good: tuple[float, int]) -> Beside:
    if rounds is None:
        raise UsageError("`--good` compares rounds with rounds: give `--rounds` too, or process.rounds in the cell.")
    if good[0] <= 0.0 or good[1] < 1:
        raise UsageError(f"`--good {good[0]:g} {good[1]}` must be a pressure above 0 kPa and 1 round or more.")
    found = relative_setting(pressure=pressure_kpa, rounds=rounds, good_pressure=good[0], good_rounds=good[1])
    return Beside(found, pressure_kpa, rounds, *good)


def _material(cell: Cell, pressure_kpa: float) -> Material:
    if cell.material is None:
        raise UsageError(
            f"the cell {cell.name} has no [material], so the flow at {pressure_kpa:g} kPa is unknown. Weigh a few "
            "lines and run `geoprint fit-flow`, or compare with a good print: `--good KPA ROUNDS`, or [good_print] in "
            "the cell."
        )
    return cell.material


def _model(name: str) -> FluidModel:
    for model in PARAMETERS:
        if model == name:
            return model
    raise UsageError(f"there is no model named '{name}'; choose one of: {', '.join(PARAMETERS)}.")
