"""What stack.json and a person's terminal say of a stack of layers, cure included."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from geoprint.errors import how_many, percent
from geoprint.model import Cell, Material
from geoprint.process import bottom_doses, cured_depth
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.stack import (
    CureRecord,
    FinishedFlowsRecord,
    FinishedRecord,
    LayerCureRecord,
    StackedLayerRecord,
    StackRecord,
)
from geoprint.reporting.stack_sheet import behind_layer, stack_steps
from geoprint.reporting.tables import marked_lines
from geoprint.results import FinishedStack, StackedLayer

# What is said of the light within a stack: the dose at the bottom of each layer, and what nobody knows of it.


def with_cure(record: StackRecord, cell: Cell) -> StackRecord:
    """Return what is said of a stack with the light within it, or with what must be known of the material for that.

    Args:
        record: without a word of it.
        cell: that prints the stack.
    """
    found = cell.material
    needed, penetration = (None, None) if found is None else (found.dose, found.penetration)
    doses = [layer.dose_mj_cm2 for layer in record.layers if layer.dose_mj_cm2 is not None]
    if needed is None or penetration is None or len(doses) < len(record.layers):
        lacking = ", ".join(_lacking(found))
        text = f"curing through the layers: the cell's [material] needs {lacking}"
        return record.model_copy(update={"not_checked": (*record.not_checked, text)})
    heights = np.array([layer.height_mm for layer in record.layers])
    own, whole = bottom_doses(np.array(doses), heights, penetration=penetration)
    layers = tuple(
        _lit(layer, *pair)
        for layer, pair in zip(record.layers, zip(own.tolist(), whole.tolist(), strict=True), strict=True)
    )
    cure = CureRecord(
        needed_mj_cm2=needed,
        penetration_mm=penetration,
        speed_mm_s=record.layers[0].speed_mm_s,
        flood_s=None if cell.flood is None else cell.flood.duration,
    )
    return record.model_copy(update={"layers": layers, "cure": cure})


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


# What stack.json says of the layers of a stack and of all of them together.


def layer_record(
    record: PlanRecord,
    kept: StackedLayer,
    *,
    folder: str,
    area: float,
    pattern: str,
    speed: float,
    not_printable: str | None,
) -> StackedLayerRecord:
    """Return what is said of a planned layer.

    Args:
        record: what its plan.json says.
        kept: what is kept of it.
        folder: of its bundle.
        area: of the surface in its middle [mm2].
        pattern: that its paths have.
        speed: at which it prints, before its missing volume is made up [mm/s].
        not_printable: why the robot cannot print it, or None.
    """
    even, robots, deposited = record.uniformity, record.robot, record.deposition
    followed = deposited is not None and deposited.flow != "constant"
    layer = None if even is None or deposited is None else even.following if followed else even.thickness
    return StackedLayerRecord(
        folder=folder,
        bottom_mm=kept.bottom,
        height_mm=kept.height,
        area_mm2=area,
        pattern=pattern,
        runs=record.paths.runs,
        deposit_mm=record.paths.deposit_mm,
        gap=None if even is None else even.gap,
        overlap=None if even is None else even.overlap,
        thickness_cv=None if layer is None else layer.cv,
        helix_deg=None if record.paths.fibres is None else record.paths.fibres.helix_mean_deg,
        speed_mm_s=speed,
        laid_mm3=float(kept.volumes[kept.printed]),
        wanted_mm3=area * kept.height,
        print_s=_seconds(record),
        attitudes=len(robots) if any(robot.table is not None for robot in robots) else None,
        clearance_mm=min((robot.clearance.smallest_mm for robot in robots), default=None),
        not_printable=not_printable,
        dose_mj_cm2=None if deposited is None or deposited.light is None else deposited.light.all_passes,
        warnings=record.warnings,
        not_checked=tuple(dict.fromkeys(text for robot in robots for text in robot.clearance.not_checked)),
    )


def _seconds(record: PlanRecord) -> float | None:
    """Return how long a layer prints, with the motions of a table; None without a robot [s]."""
    if record.joined is not None:
        return record.joined.print_s
    return sum(robot.motion.duration_s for robot in record.robot) if record.robot else None


def finished_record(stack: FinishedStack, *, wanted: float) -> FinishedFlowsRecord:
    """Return how a stack comes out.

    Args:
        stack: all of its layers.
        wanted: the volume that it shall have [mm3].
    """
    record = [
        None
        if found is None
        else FinishedRecord.of(found, volume=sum(float(layer.volumes[flow]) for layer in stack.layers) / wanted)
        for flow, found in enumerate(stack.flows)
    ]
    return FinishedFlowsRecord(constant_flow=record[0], following_flow=record[1], printed=record[stack.printed])


# What a person reads of the cure of a stack: doses at the bottoms of layers, and what to do where they are too low.


def cure_warnings(record: StackRecord) -> Iterator[str]:
    """Yield which layers are not cured through, and what to do.

    Within a target layers end below others, so that a layer is the topmost somewhere: there its own passes must do.
    """
    if record.cure is None:
        return
    needed, alone = record.cure.needed_mj_cm2, record.target_mm3 is not None
    doses = [(layer.cure.own_mj_cm2 if alone else layer.cure.whole_mj_cm2) for layer in record.layers if layer.cure]
    lacking = [number for number, dose in enumerate(doses, start=1) if dose < needed]
    if not lacking:
        return
    worst = min(lacking, key=lambda number: doses[number - 1])
    where = "its bottom" if len(lacking) == 1 else f"the bottom of layer {worst}"
    passes = "its own passes give, where it is the topmost," if alone else "all passes give"
    yield (
        f"{_which(lacking)} not cured through: at {where} {passes} {doses[worst - 1]:.3g} of "
        f"{needed:.3g} mJ/cm2: {_remedy(record.cure, record.layers[worst - 1], doses[worst - 1])}."
    )


def cure_notes(record: StackRecord) -> Iterator[str]:
    """Yield which layers are cured through only by the passes for those above them."""
    if record.cure is None or record.target_mm3 is not None:
        return
    needed = record.cure.needed_mj_cm2
    cures = [(number, layer.cure) for number, layer in enumerate(record.layers, start=1) if layer.cure is not None]
    later = [(number, cure) for number, cure in cures if cure.own_mj_cm2 < needed <= cure.whole_mj_cm2]
    if later:
        least = min(cure.own_mj_cm2 for _, cure in later)
        yield (
            f"{_which([number for number, _ in later])} soft at the bottom until the layers above are cured: their "
            f"own passes give {least:.3g} of {needed:.3g} mJ/cm2 there."
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
    thinner = f", with layers up to {height:.2g} mm high" if height > 0.0 else ""
    flooded = (
        "or name a final exposure ([flood])"
        if cure.flood_s is None
        else f"or rely on the final exposure of {cure.flood_s:g} s, which is not counted"
    )
    return f"{slower}{thinner}, {flooded}"


# What a person reads of a stack: a line a layer, and the whole.


# Less of the area than this is not worth a line.
REPORTED_SHARE = 0.0005


def stack_text(record: StackRecord, *, verbose: bool = False) -> str:
    """Return the lines that a person reads when all layers of a thickness are planned.

    Args:
        record: what stack.json says.
        verbose: whether to list all that was not checked.
    """
    lines = [
        stack_sentence(record),
        *finished_sentences(record),
        *(
            _layer_line(number, layer) + behind_layer(number, record)
            for number, layer in enumerate(record.layers, start=1)
        ),
    ]
    lines += [f"  left out: {each.reason}" for each in record.left_out]
    unchecked = [*record.not_checked, *(text for layer in record.layers for text in layer.not_checked)]
    warnings = [*stack_warnings(record), *cure_warnings(record)]
    lines += stack_steps(record)
    lines += marked_lines(warnings=warnings, notes=cure_notes(record), not_checked=unchecked, verbose=verbose)
    return "\n".join(lines)


def stack_sentence(record: StackRecord) -> str:
    """Return what was planned and how much of it is deposited, without a stop."""
    deposited = sum(layer.laid_mm3 for layer in record.layers)
    wanted = sum(layer.wanted_mm3 for layer in record.layers)
    said = (
        f"{record.part}: {record.thickness_mm:.3g} mm in {how_many(len(record.layers), 'layer')} of "
        f"{record.layers[0].height_mm:.3g} mm, {deposited / 1000.0:.4g} cm3 deposited, "
        f"{percent(deposited / wanted - 1.0, 2, signed=True)} against their volume"
    )
    return (
        said
        if record.target_mm3 is None
        else f"{said}; their volume is {percent(wanted / record.target_mm3, 1)} of {record.target} above the part"
    )


def finished_sentences(record: StackRecord) -> Iterator[str]:
    """Yield how all layers together come out, without stops; nothing where nobody can say."""
    found = record.finished
    if found.printed is None or found.constant_flow is None or found.following_flow is None:
        return
    yield (
        f"finished thickness {percent(found.printed.mean, 1)} of the target, varies by {percent(found.printed.cv, 2)} "
        f"(following flow {percent(found.following_flow.cv, 2)}, constant flow {percent(found.constant_flow.cv, 2)}); "
        f"98 of 100 points have {percent(found.printed.p1, 1)} to {percent(found.printed.p99, 1)}"
    )
    if found.printed.judged < 1.0:
        low = max(1.0 - found.printed.judged - found.printed.creased, 0.0)
        parts = [(found.printed.creased, "closes a hollow below that height"), (low, "is thinner than a layer")]
        said = " and ".join(f"{percent(share, 1)} of the area {why}" for share, why in parts if share >= REPORTED_SHARE)
        if said:
            yield f"  not judged: {said}"
    if found.printed.under_sides >= REPORTED_SHARE:
        yield f"  judged up to overhanging sides: {percent(found.printed.under_sides, 1)} of the area"


def stack_warnings(record: StackRecord) -> Iterator[str]:
    """Yield what to act on, each once, with the layers that it is said of where that is not all of them."""
    count = len(record.layers)
    for text in dict.fromkeys(text for layer in record.layers for text in layer.warnings):
        of = [str(number) for number, layer in enumerate(record.layers, start=1) if text in layer.warnings]
        whose = "" if len(of) == count else f"layer{'s' if len(of) > 1 else ''} {', '.join(of)}: "
        yield whose + text


def _layer_line(number: int, layer: StackedLayerRecord) -> str:
    """Return the line of one layer."""
    even = "" if layer.thickness_cv is None else f", thickness CV {percent(layer.thickness_cv, 2)}"
    gap = "" if layer.gap is None else f", missed {percent(layer.gap, 2)}"
    helix = "" if layer.helix_deg is None else f", fibres at {layer.helix_deg:+.1f} degrees"
    time = "" if layer.print_s is None else f", {layer.print_s:.0f} s"
    clear = "" if layer.clearance_mm is None else f", {layer.clearance_mm:.2f} mm clear"
    return (
        f"  {number:2} from {layer.bottom_mm:.3g} mm: {layer.pattern}, {how_many(layer.runs, 'run')}, "
        f"{layer.deposit_mm:.0f} mm of path, {layer.laid_mm3 / 1000.0:.3g} "
        f"cm3{even}{gap}{helix}{dose_text(layer)}{time}{clear}"
    )
