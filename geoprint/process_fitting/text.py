"""What is said of material and pressure: the settings that fit, a print that worked beside them, a fitted fluid."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict

from geoprint.errors import percent
from geoprint.model import PASCAL_PER_KPA
from geoprint.postprocessor import Json
from geoprint.process_fitting.fitting import Advice, Beside, FittedFluid
from geoprint.reporting.records.rounding import Record, as_json
from geoprint.reporting.tables import marked_lines

# Name of each parameter of a fluid in the cell file, with its unit.
KEYS = {"consistency": "consistency_pa_sn", "index": "flow_index", "yield_stress": "yield_stress_pa"}


class FitRecord(Record):
    """What `geoprint fit-flow` says; the fields are the keys of `--json` in their order.

    Attributes:
        model: that was fitted.
        density_g_cm3: as given.
        consistency_pa_sn: as in the cell file, and so
        flow_index: and
        yield_stress_pa: too.
        intervals_95: lower and upper end for each of them that was fitted.
        lines: how many were measured.
        scatter: standard deviation of the measured flow about the fitted one, as a share of it.
        residuals: natural logarithm of measured over fitted flow at each line.
    """

    model: str
    density_g_cm3: float
    consistency_pa_sn: float
    flow_index: float
    yield_stress_pa: float
    intervals_95: dict[str, tuple[float, float]]
    lines: int
    scatter: float
    residuals: tuple[float, ...]


def recommendation_summary(found: Advice | Beside) -> dict[str, Json]:
    """Return what `geoprint recommend --json` prints: mm, s, Pa, mm3/s, and what names another unit."""
    record: dict[str, Json] = asdict(found.record)
    if isinstance(found, Beside):
        return {**record, "flow": _json_bounds(found.record.flow), "layer": _json_bounds(found.record.layer)}
    return {
        "pressure_kpa": found.pressure_kpa,
        "asked_spacing": found.spacing,
        "depth": found.depth,
        "mass_g": found.mass_g,
        **record,
    }


def recommendation_text(found: Advice | Beside) -> str:
    """Return the lines that a person reads of a recommendation."""
    return "\n".join(_beside_lines(found) if isinstance(found, Beside) else _advice_lines(found))


def fit_summary(fit: FittedFluid, *, density: float) -> dict[str, Json]:
    """Return what `geoprint fit-flow --json` prints."""
    return as_json(_fit_record(fit, density=density))


def material_table(fit: FittedFluid, *, density: float, source: str) -> str:
    """Return the [material] table for a cell file, the intervals as comments.

    Args:
        fit: the fluid.
        density: [g/cm3].
        source: name of the table of lines.
    """
    record = _fit_record(fit, density=density)
    values = dict(record)
    intervals = {key: f"  # 95 %: {low:.4g} to {high:.4g}" for key, (low, high) in record.intervals_95.items()}
    return "\n".join([
        f"# {record.model}, fitted to {record.lines} lines of {source}; they scatter by {percent(record.scatter, 1)}",
        "[material]",
        f"density_g_cm3 = {record.density_g_cm3:g}",
        *(f"{key} = {values[key]:.6g}{intervals.get(key, '')}" for key in KEYS.values()),
    ])  # fmt: skip


def _fit_record(fit: FittedFluid, *, density: float) -> FitRecord:
    return FitRecord(
        model=fit.model,
        density_g_cm3=density,
        consistency_pa_sn=fit.fluid.consistency,
        flow_index=fit.fluid.index,
        yield_stress_pa=fit.fluid.yield_stress,
        intervals_95={KEYS[name]: (low, high) for name, low, high in fit.intervals},
        lines=fit.residuals.size,
        scatter=fit.scatter,
        residuals=tuple(fit.residuals.tolist()),
    )


def _advice_lines(advice: Advice) -> Iterator[str]:
    found, process = advice.record, advice.process
    yield (
        f"flow: {found.flow:.3g} mm3/s at {advice.pressure_kpa:g} kPa (flow begins at "
        f"{found.starting_pressure / PASCAL_PER_KPA:.3g} kPa; {percent(found.needle_share)} of the pressure is lost in "
        f"the needle, shear rate {found.shear_rate:.3g} 1/s)"
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
    yield from marked_lines(warnings=found.warnings)
    yield "assumed: no slip at the wall, no losses but in needle and taper, a taper as thick-walled as the needle."


def _beside_lines(beside: Beside) -> Iterator[str]:
    found = beside.record
    yield (
        f"{beside.pressure_kpa:g} kPa and {beside.rounds} rounds compared with {beside.good_pressure_kpa:g} kPa "
        f"and {beside.good_rounds}: ratio of flow {_bounds(found.flow)}, of material {_bounds(found.layer)}, of "
        f"spacing {found.spacing:.3g}"
    )
    yield found.verdict
    yield "assumed: same part, material, nozzle and speed, and a material that does not thicken with shear."


def _json_bounds(bounds: tuple[float, float]) -> list[Json]:
    """Return bounds with null for no upper one: JSON has no infinity."""
    return [bounds[0], bounds[1] if bounds[1] < float("inf") else None]


def _bounds(bounds: tuple[float, float]) -> str:
    low, high = bounds
    if low == high:
        return f"{low:.2f}"
    return f"at least {low:.2f}" if low > 0.0 else f"at most {high:.2f}"
