"""How a material flows, fitted to a few measured lines, with the interval in which each parameter lies.

Least squares of the logarithm of the flow: errors of weighing and measuring are shares. Parameters are fitted as
logarithms, so that they stay positive; their covariance is s^2 (J^T J)^-1 with the residual variance s^2 and the
Jacobian J at the solution, and the intervals use Student's t for the few lines that there are [Bates1988, ch. 2]. In
trials they hold the true parameter as often as they promise for Newtonian fluids and power laws; with a yield stress
the model is bent so much that they are somewhat too narrow and hold it about nine times in ten.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, final

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from geoprint.deposition.fitting.measured import MeasuredFlow
from geoprint.deposition.rheology import Bore, flow_through, starting_pressure
from geoprint.errors import InputError
from geoprint.model import FloatArray, Fluid, frozen

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
        bore: of the nozzle that laid them.
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
            "all lines were laid at one pressure: a Newtonian fluid and one that thins with shear fit them equally "
            "well; measure at two pressures at least, one twice the other.",
            pressures=1,
        )
    if pressures < FEWEST_PRESSURES[model] or lines <= parameters:
        raise InputError(
            f"the model {model} has {parameters} parameters and needs {FEWEST_PRESSURES[model]} different pressures "
            f"and {parameters + 1} lines at least, found {pressures} and {lines}: measure more, or choose a model "
            "with fewer parameters.",
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
