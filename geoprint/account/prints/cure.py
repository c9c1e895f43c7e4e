"""What is said of the light within a stack: the dose at the bottom of each layer, and what nobody knows of it."""

from __future__ import annotations

import numpy as np

from geoprint.account.records.stack import CureRecord, LayerCureRecord, StackedLayerRecord, StackRecord
from geoprint.deposition import bottom_doses
from geoprint.model import Cell, Material


def with_cure(told: StackRecord, cell: Cell) -> StackRecord:
    """Return what is said of a stack with the light within it, or with what must be known of the material for that.

    Args:
        told: without a word of it.
        cell: that prints the stack.
    """
    found = cell.material
    needed, penetration = (None, None) if found is None else (found.dose, found.penetration)
    doses = [layer.dose_mj_cm2 for layer in told.layers if layer.dose_mj_cm2 is not None]
    if needed is None or penetration is None or len(doses) < len(told.layers):
        lacking = ", ".join(_lacking(found))
        text = f"whether layers are cured through: for that the cell's [material] needs {lacking}"
        return told.model_copy(update={"not_checked": (*told.not_checked, text)})
    heights = np.array([layer.height_mm for layer in told.layers])
    own, whole = bottom_doses(np.array(doses), heights, penetration=penetration)
    layers = tuple(
        _lit(layer, *pair)
        for layer, pair in zip(told.layers, zip(own.tolist(), whole.tolist(), strict=True), strict=True)
    )
    cure = CureRecord(
        needed_mj_cm2=needed,
        penetration_mm=penetration,
        speed_mm_s=told.layers[0].speed_mm_s,
        flood_s=None if cell.flood is None else cell.flood.duration,
    )
    return told.model_copy(update={"layers": layers, "cure": cure})


def _lit(layer: StackedLayerRecord, own: float, whole: float) -> StackedLayerRecord:
    return layer.model_copy(update={"cure": LayerCureRecord(own_mj_cm2=own, whole_mj_cm2=whole)})


def _lacking(material: Material | None) -> list[str]:
    """Return the keys of a material, as a cell file has them, without which nobody knows the light within it."""
    keys = {
        "uv_irradiance_mw_cm2": None if material is None else material.irradiance,
        "uv_spot_mm": None if material is None else material.spot_diameter,
        "uv_dose_mj_cm2": None if material is None else material.dose,
        "uv_penetration_mm": None if material is None else material.penetration,
    }
    return [key for key, value in keys.items() if value is None]
