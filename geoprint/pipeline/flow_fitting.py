"""From measured lines to the [material] table of a cell file."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from geoprint.config import load_cell
from geoprint.deposition import bore_of
from geoprint.deposition.fitting import PARAMETERS, FittedFluid, FluidModel, fit_fluid, read_measured_flow
from geoprint.errors import UsageError
from geoprint.export import Json

# Name of each parameter in the cell file, with its unit.
KEYS = {"consistency": "consistency_pa_sn", "index": "flow_index", "yield_stress": "yield_stress_pa"}


def fit_flow(path: Path, *, cell: Path | None, density: float, model: str) -> FittedFluid:
    """Fit a material to measured lines laid with a cell's nozzle.

    Args:
        path: table of lines (`geoprint.deposition.fitting.measured`).
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


def material_table(fit: FittedFluid, *, density: float, source: str) -> str:
    """Return the [material] table for a cell file, the intervals as comments.

    Args:
        fit: the fluid.
        density: [g/cm3].
        source: name of the table of lines.
    """
    intervals = {name: f"  # 95 %: {low:.4g} to {high:.4g}" for name, low, high in fit.intervals}
    values = asdict(fit.fluid)
    return "\n".join([
        f"# {fit.model}, fitted to {fit.residuals.size} lines of {source}; they scatter by {fit.scatter:.1%}",
        "[material]",
        f"density_g_cm3 = {density:g}",
        *(f"{key} = {values[name]:.6g}{intervals.get(name, '')}" for name, key in KEYS.items()),
    ])  # fmt: skip


def fit_summary(fit: FittedFluid, *, density: float) -> dict[str, Json]:
    """Return a fit as JSON: units as in the cell file."""
    return {
        "model": fit.model,
        "density_g_cm3": density,
        **{KEYS[name]: value for name, value in asdict(fit.fluid).items()},
        "intervals_95": {KEYS[name]: [low, high] for name, low, high in fit.intervals},
        "lines": int(fit.residuals.size),
        "scatter": fit.scatter,
        "residuals": [float(value) for value in fit.residuals],
    }


def _model(name: str) -> FluidModel:
    for model in PARAMETERS:
        if model == name:
            return model
    raise UsageError(f"there is no model named '{name}'; choose one of: {', '.join(PARAMETERS)}.")
