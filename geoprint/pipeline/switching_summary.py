"""Valve, material, lamp and vacuum in time, as plan.json and `geoprint check --json` carry them."""

from __future__ import annotations

from geoprint.export import Json
from geoprint.export.rapid import Timeline


def switching_summary(switching: Timeline) -> dict[str, Json]:
    """Return what flows and shines when, as plan.json carries it."""
    return {
        "largest_error_mm": round(float(switching.errors.max(initial=0.0)), 6),
        "lamp_alone_s": round(switching.lamp_alone, 6),
        "runs": [
            {"run": int(run), "deposit_s": deposit.round(4).tolist(), "material_s": material.round(4).tolist()}
            for run, deposit, material in zip(switching.runs, switching.deposits, switching.material, strict=True)
        ],
        "lamp_s": switching.lamp.round(4).tolist(),
        "vacuum_s": switching.vacuum.round(4).tolist(),
    }
