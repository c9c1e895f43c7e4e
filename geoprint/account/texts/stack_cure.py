"""What a person reads of the cure of a stack: doses at the bottoms of layers, and what to do where they are too low."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from geoprint.account.records.stack import CureRecord, StackedLayerRecord, StackRecord
from geoprint.deposition import cured_depth


def cure_warnings(told: StackRecord) -> Iterator[str]:
    """Yield which layers are not cured through, and what to do.

    Within a target layers end below others, so that a layer is the topmost somewhere: there its own passes must do.
    """
    if told.cure is None:
        return
    needed, alone = told.cure.needed_mj_cm2, told.target_mm3 is not None
    doses = [(layer.cure.own_mj_cm2 if alone else layer.cure.whole_mj_cm2) for layer in told.layers if layer.cure]
    lacking = [number for number, dose in enumerate(doses, start=1) if dose < needed]
    if not lacking:
        return
    worst = min(lacking, key=lambda number: doses[number - 1])
    where = "its bottom" if len(lacking) == 1 else f"the bottom of layer {worst}"
    passes = "its own passes give, where it is the topmost," if alone else "all passes give"
    yield (
        f"{_which(lacking)} not cured through: at {where} {passes} {doses[worst - 1]:.3g} of "
        f"{needed:.3g} mJ/cm2: {_remedy(told.cure, told.layers[worst - 1], doses[worst - 1])}."
    )


def cure_notes(told: StackRecord) -> Iterator[str]:
    """Yield which layers are cured through only by the passes for those above them."""
    if told.cure is None or told.target_mm3 is not None:
        return
    needed = told.cure.needed_mj_cm2
    cures = [(number, layer.cure) for number, layer in enumerate(told.layers, start=1) if layer.cure is not None]
    later = [(number, cure) for number, cure in cures if cure.own_mj_cm2 < needed <= cure.whole_mj_cm2]
    if later:
        least = min(cure.own_mj_cm2 for _, cure in later)
        yield (
            f"{_which([number for number, _ in later])} soft at the bottom until the passes for layers above: "
            f"their own give {least:.3g} of {needed:.3g} mJ/cm2 there."
        )


def dose_text(layer: StackedLayerRecord) -> str:
    """Return the light at the bottom of a layer, as its line says it; nothing where nobody knows it."""
    if layer.cure is None:
        return ""
    return f", {layer.cure.own_mj_cm2:.3g} then {layer.cure.whole_mj_cm2:.3g} mJ/cm2 at its bottom"


def _which(numbers: Sequence[int]) -> str:
    return (
        f"layer{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers))} {'are' if len(numbers) > 1 else 'is'}"
    )


def _remedy(cure: CureRecord, layer: StackedLayerRecord, dose: float) -> str:
    """Return what to do about a layer whose bottom gets a dose that is too low [mJ/cm2]."""
    slower = f"print at up to {cure.speed_mm_s * dose / cure.needed_mj_cm2:.3g} mm/s"
    top = layer.dose_mj_cm2 or 0.0
    height = cured_depth(top, needed=cure.needed_mj_cm2, penetration=cure.penetration_mm)
    thinner = f", in layers up to {height:.2g} mm high" if height > 0.0 else ""
    flooded = (
        "or name a final exposure ([flood])"
        if cure.flood_s is None
        else f"or trust the final exposure of {cure.flood_s:g} s, which is not counted"
    )
    return f"{slower}{thinner}, {flooded}"
