"""What is said of the cure of a stack: doses at the bottoms of its layers, who lacks light, and what nobody knows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.config import load_cell
from geoprint.model import Cell, Flood, Fluid, Material
from geoprint.reporting import stack_text
from geoprint.reporting.records.stack import FinishedFlowsRecord, StackedLayerRecord, StackRecord
from geoprint.reporting.stack import with_cure

SILICONE = Material(1.1, Fluid(20.0, 0.6), irradiance=100.0, spot_diameter=6.0, dose=100.0, penetration=0.5)


def _cell(material: Material | None = SILICONE, flood: Flood | None = None) -> Cell:
    return replace(load_cell(None), material=material, flood=flood)


def _stack(dose: float | None, *, count: int = 3, target_mm3: float | None = None) -> StackRecord:
    layers = tuple(
        StackedLayerRecord(
            folder=f"layer-{number:02}", bottom_mm=0.5 * (number - 1), height_mm=0.5, area_mm2=100.0, runs=4,
            deposit_mm=80.0, gap=0.0, overlap=0.0, thickness_cv=None, speed_mm_s=20.0, laid_mm3=50.0, wanted_mm3=50.0,
            print_s=None, clearance_mm=None, not_printable=None, dose_mj_cm2=dose, warnings=(), not_checked=(),
        )
        for number in range(1, count + 1)
    )  # fmt: skip
    return StackRecord(
        schema=3, version="0", part="a.ply", thickness_mm=0.5 * count, target=None, target_mm3=target_mm3,
        finished=FinishedFlowsRecord(constant_flow=None, following_flow=None, printed=None), layers=layers,
        program=None, left_out=(),
    )  # fmt: skip


def test_layers_that_lack_light_are_named_with_what_they_get_need_and_what_to_do() -> None:
    record = with_cure(_stack(200.0), _cell())
    assert record.cure is not None
    assert (record.cure.needed_mj_cm2, record.cure.penetration_mm, record.cure.speed_mm_s) == (100.0, 0.5, 20.0)
    doses = [layer.cure.whole_mj_cm2 for layer in record.layers if layer.cure is not None]
    np.testing.assert_allclose(doses, 200.0 * np.cumsum(np.exp([-1.0, -2.0, -3.0]))[::-1])
    text = stack_text(record)
    assert "missed 0.00%, 73.6 then 111 mJ/cm2 at its bottom" in text
    assert (
        "warning: layer 3 is not cured through: at its bottom all passes give 73.6 of 100 mJ/cm2: print "
        "at up to 14.7 mm/s, in layers up to 0.35 mm high, or name a final exposure ([flood])."
    ) in text
    assert (
        "note: layers 1, 2 are soft at the bottom until the passes for layers above: their own give 73.6 of 100" in text
    )
    # As slow as that, and as thin as that, the highest layer gets what it needs.
    slower = with_cure(_stack(200.0 * 20.0 / 14.7), _cell())
    assert "not cured through" not in stack_text(slower)


def test_a_stack_with_light_enough_is_not_warned_of() -> None:
    text = stack_text(with_cure(_stack(300.0), _cell()))
    assert "cured" not in text
    assert "soft" not in text


def test_within_a_target_a_layer_may_be_the_topmost_and_its_own_passes_must_do() -> None:
    text = stack_text(with_cure(_stack(200.0, target_mm3=140.0).model_copy(update={"target": "lens.stl"}), _cell()))
    assert "layers 1, 2, 3 are not cured through: at the bottom of layer 1 its own passes give, where it is" in text
    assert "soft" not in text


def test_the_final_exposure_is_named_and_not_counted() -> None:
    text = stack_text(with_cure(_stack(50.0), _cell(flood=Flood(60.0))))
    assert "print at up to 3.68 mm/s, or trust the final exposure of 60 s, which is not counted" in text


@pytest.mark.parametrize(
    ("material", "lacking"),
    [
        (None, "uv_irradiance_mw_cm2, uv_spot_mm, uv_dose_mj_cm2, uv_penetration_mm"),
        (replace(SILICONE, penetration=None), "needs uv_penetration_mm"),
        (replace(SILICONE, irradiance=None, spot_diameter=None), "needs uv_irradiance_mw_cm2, uv_spot_mm"),
    ],
)
def test_what_nobody_knows_of_the_light_is_said_as_not_checked(material: Material | None, lacking: str) -> None:
    known = material is not None and material.irradiance is not None
    record = with_cure(_stack(200.0 if known else None), _cell(material))
    assert record.cure is None
    assert f"{lacking}" in stack_text(record, verbose=True).split("not checked: whether layers are cured through")[1]
