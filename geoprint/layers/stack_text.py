"""What stack.json, terminal and run sheet say of a stack of layers, cure included."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import PurePosixPath

import numpy as np

from geoprint.errors import how_many, percent
from geoprint.layers.records import (
    CureRecord,
    FinishedFlowsRecord,
    FinishedRecord,
    LayerCureRecord,
    StackedLayerRecord,
    StackProgramRecord,
    StackRecord,
)
from geoprint.layers.stack_thickness import FinishedStack
from geoprint.layers.targets import LayerTarget
from geoprint.model import Cell, Material
from geoprint.postprocessor import StackSettings
from geoprint.postprocessor.interface import Joining
from geoprint.postprocessor.registry import post_processor
from geoprint.process import bottom_doses, cured_depth
from geoprint.reporting.check import CheckedParts
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.run_sheet import entry
from geoprint.reporting.tables import marked_lines

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
        layer.model_copy(update={"cure": LayerCureRecord(own_mj_cm2=low, whole_mj_cm2=high)})
        for layer, low, high in zip(record.layers, own.tolist(), whole.tolist(), strict=True)
    )
    cure = CureRecord(
        needed_mj_cm2=needed,
        penetration_mm=penetration,
        speed_mm_s=record.layers[0].speed_mm_s,
        flood_s=None if cell.flood is None else cell.flood.duration,
    )
    return record.model_copy(update={"layers": layers, "cure": cure})


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
    *,
    folder: str,
    bottom: float,
    height: float,
    area: float,
    pattern: str,
    speed: float,
    deposited: float,
) -> StackedLayerRecord:
    """Return what is said of a planned layer.

    Args:
        record: what its plan.json says.
        folder: of its bundle.
        bottom: height over the part at which it begins [mm].
        height: its own [mm].
        area: of the surface in its middle [mm2].
        pattern: that its paths have.
        speed: at which it prints, before its missing volume is made up [mm/s].
        deposited: volume [mm3].
    """
    even, robots, planned = record.uniformity, record.robot, record.deposition
    followed = planned is not None and planned.flow != "constant"
    layer = None if even is None or planned is None else even.following if followed else even.thickness
    return StackedLayerRecord(
        folder=folder,
        bottom_mm=bottom,
        height_mm=height,
        area_mm2=area,
        pattern=pattern,
        runs=record.paths.runs,
        deposit_mm=record.paths.deposit_mm,
        gap=None if even is None else even.gap,
        overlap=None if even is None else even.overlap,
        thickness_cv=None if layer is None else layer.cv,
        helix_deg=None if record.paths.fibres is None else record.paths.fibres.helix_mean_deg,
        speed_mm_s=speed,
        laid_mm3=deposited,
        wanted_mm3=area * height,
        print_s=layer_seconds(record),
        attitudes=len(robots) if any(robot.table is not None for robot in robots) else None,
        clearance_mm=min((robot.clearance.smallest_mm for robot in robots), default=None),
        not_printable=record.not_printable,
        dose_mj_cm2=None if planned is None or planned.light is None else planned.light.all_passes,
        warnings=record.warnings,
        not_checked=tuple(dict.fromkeys(text for robot in robots for text in robot.clearance.not_checked)),
    )


def layer_seconds(record: PlanRecord) -> float | None:
    """Return how long a layer prints by its plan.json, with the motions of a table; None without a robot [s]."""
    if record.joined is not None:
        return record.joined.print_s
    return sum(robot.motion.duration_s for robot in record.robot) if record.robot else None


def wanted_volume(target: LayerTarget | None, layers: Sequence[StackedLayerRecord]) -> float:
    """Return the volume that a stack shall have [mm3]: that of its target where a formula has it."""
    volume = None if target is None else target.volume
    return sum(layer.wanted_mm3 for layer in layers) if volume is None else volume


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


# The run sheet of a whole stack: its layers in order, where it pauses, where it can be stopped and begun again.


# Label of the lines of the layers.
LAYERS = "layers"


def stack_sheet(record: StackRecord, program: CheckedParts) -> list[tuple[str, list[str]]]:
    """Return label and texts of what the page says of the program; none without one.

    Args:
        record: what stack.json says.
        program: how it is set to run.
    """
    if record.program is None:
        return []
    return [
        ("program", _program(record.program, record.layers)),
        (LAYERS, [_layer(number, layer, record) for number, layer in enumerate(record.layers, start=1)]),
        *_handling(record.program, record.layers, program.settings),
    ]


def stack_steps(record: StackRecord) -> list[str]:
    """Return the lines of that page behind those of the layers: what to load, to set and to do.

    Args:
        record: what stack.json says.
    """
    rows = (row for row in stack_sheet(record, CheckedParts()) if row[0] != LAYERS)
    return [line for label, texts in rows for line in entry(label, texts, width=None)]


def behind_layer(number: int, record: StackRecord) -> str:
    """Return what stands behind what a layer takes: its attitudes of a table, and a pause where one comes.

    Args:
        number: of the layer, from 1.
        record: what stack.json says.
    """
    pause = 0.0 if record.program is None else record.program.pause_s
    waits = f"; then {pause:g} s at home" if pause and number < len(record.layers) else ""
    attitudes = attitudes_of(number, record.layers)
    return (f", attitudes {attitudes}" if attitudes else "") + waits


def attitudes_of(number: int, layers: Sequence[StackedLayerRecord]) -> str:
    """Return in which attitudes of a table a layer is printed, counted on from layer to layer; nothing without one.

    Args:
        number: of the layer, from 1.
        layers: of the stack, the lowest first.
    """
    own = layers[number - 1].attitudes
    if own is None:
        return ""
    first = 1 + sum(layer.attitudes or 0 for layer in layers[: number - 1])
    return str(first) if own == 1 else f"{first} to {first + own - 1}"


def printed_parts(layers: Sequence[StackedLayerRecord]) -> tuple[str, int]:
    """Return what the program loads one after another, and how many: layers, or attitudes of a table.

    Args:
        layers: of the stack, the lowest first.
    """
    attitudes = sum(layer.attitudes or 0 for layer in layers)
    return ("attitude", attitudes) if attitudes else ("layer", len(layers))


def _handling(
    program: StackProgramRecord, layers: Sequence[StackedLayerRecord], settings: StackSettings | None
) -> list[tuple[str, list[str]]]:
    """Return how it is set, printed, stopped and begun again."""
    one, count = printed_parts(layers)
    table = "table" if one == "attitude" else ""
    return _joining(program).handling(one, count, settings, dry_only=program.runs_dry_only, table=table)


def _joining(program: StackProgramRecord) -> Joining:
    """Return how its parts became one program: the folder of the program is named after what wrote it."""
    joining = post_processor(PurePosixPath(program.file).parts[0]).joining
    assert joining is not None  # noqa: S101  # There is such a program.
    return joining


def _program(program: StackProgramRecord, layers: Sequence[StackedLayerRecord]) -> list[str]:
    count = len(layers)
    pauses = f", {count - 1} pauses of {program.pause_s:g} s included" if program.pause_s and count > 1 else ""
    dry = "; RUNS DRY ONLY" if program.runs_dry_only else ""
    first, last = layers[0].folder, layers[-1].folder
    folders = f"the folder {first}" if count == 1 else f"the folders {first} to {last}"
    runs, (one, parts) = sum(layer.runs for layer in layers), printed_parts(layers)
    tilted = f" and {parts} attitudes of the table" if one == "attitude" else ""
    return [
        (
            f"{how_many(runs, 'run')} in {how_many(count, 'layer')}{tilted}, {program.print_s:.0f} s at full "
            f"speed{pauses}{dry}"
        ),
        _joining(program).loading(f"{folders} of {PurePosixPath(program.file).parts[0]}/", program.file),
    ]


def _layer(number: int, layer: StackedLayerRecord, record: StackRecord) -> str:
    """Return the line of one layer: what it takes, and what comes behind it."""
    took = f"{how_many(layer.runs, 'run')}, {layer.print_s or 0.0:.0f} s, {layer.laid_mm3 / 1000.0:.3g} cm3"
    return f"{number}  {took}{behind_layer(number, record)}"


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
