"""The run sheet of a whole stack: its layers in order, where it pauses, where it can be stopped and begun again."""

from __future__ import annotations

from collections.abc import Sequence

from geoprint.account.checked import CheckedStack
from geoprint.account.evidence import seen_rows
from geoprint.account.records.stack import StackedLayerRecord, StackProgramRecord, StackRecord
from geoprint.account.texts.run_sheet import entry
from geoprint.export.rapid import StackSettings

_HOME = "the controller's HOME folder"


def stack_sheet(told: StackRecord, checked: CheckedStack, *, width: int | None = None) -> list[str]:
    """Return the lines of the page; where each layer has its own program, what is done with these, and none without.

    Args:
        told: what stack.json says.
        checked: how its program is set to run, and what people saw it do.
        width: letters in a line, where they are counted; the page is never wider than 100.
    """
    program = told.program
    if program is None:
        return stack_steps(told)
    layers = [_layer(number, layer, told) for number, layer in enumerate(told.layers, start=1)]
    before = [("program", _program(program, told.layers)), ("layers", layers)]
    now = [] if checked.settings is None else [("is set to", [_settings(program, checked.settings)])]
    seen = [f"{stage}: {what}" for stage, what in seen_rows(checked.seen, program_sha256=checked.program_sha256)]
    proven = (("executed", [_executed(program)]), ("evidence", seen))
    rows = (*before, *now, *_handling(program, len(told.layers)), *proven)
    return [line for label, texts in rows for line in entry(label, texts, width=width)]


def stack_steps(told: StackRecord) -> list[str]:
    """Return the lines of that page behind those of the layers: what to load, to set and to do; or how each is printed.

    Args:
        told: what stack.json says.
    """
    program = told.program
    if program is None:
        rows = [("programs", _own_programs(told.layers))] if told.layers[0].attitudes is not None else []
        return [line for label, texts in rows for line in entry(label, texts, width=None)]
    rows = (("program", _program(program, told.layers)), *_handling(program, len(told.layers)))
    return [line for label, texts in rows for line in entry(label, texts, width=None)]


def _own_programs(layers: Sequence[StackedLayerRecord]) -> list[str]:
    """Return what a person does with the programs of layers that are printed over a table."""
    first, last, moves = layers[0].folder, layers[-1].folder, sum(layer.attitudes or 0 for layer in layers)
    loading = (
        f"{len(layers)}, one a layer, in {moves} attitudes of the table; load that of {first}, and so on to {last}, as "
        "the run sheet of each says (`geoprint check` of its folder prints it)"
    )
    return [loading, "nothing but you notices when a layer is left out or comes twice"]


def behind_layer(number: int, told: StackRecord) -> str:
    """Return what comes behind a layer, to stand behind what it takes: nothing, or a pause.

    Args:
        number: of the layer, from 1.
        told: what stack.json says.
    """
    pause = 0.0 if told.program is None else told.program.pause_s
    return f"; then {pause:g} s at home" if pause and number < len(told.layers) else ""


def _handling(program: StackProgramRecord, count: int) -> list[tuple[str, list[str]]]:
    """Return how it is printed, stopped and begun again."""
    rows = [("to print", _printing(program))]
    if count > 1:
        rows.append(("to stop", [_stopping(count)]))
    if not program.runs_dry_only:
        rows.append(("to resume", _resuming()))
    return rows


def _program(program: StackProgramRecord, layers: Sequence[StackedLayerRecord]) -> list[str]:
    count = len(layers)
    pauses = f", {count - 1} pauses of {program.pause_s:g} s among them" if program.pause_s and count > 1 else ""
    dry = "; RUNS DRY ONLY" if program.runs_dry_only else ""
    first, last = layers[0].folder, layers[-1].folder
    folders = f"the folder {first}" if count == 1 else f"the folders {first} to {last}"
    runs = sum(layer.runs for layer in layers)
    return [
        f"{runs} runs in {count} layers, {program.print_s:.0f} s at full speed{pauses}{dry}",
        f"copy {folders} of rapid/ to {_HOME}, then load {program.file}",
    ]


def _settings(program: StackProgramRecord, settings: StackSettings) -> str:
    layers = f"layers {settings.first_layer} to {settings.last_layer}"
    if settings.dry_run or program.runs_dry_only:
        return f"run {layers} dry at {settings.speed_pct:g} % of the speed (geoDryRun {str(settings.dry_run).upper()})"
    return (
        f"PRINT {layers} at {settings.speed_pct:g} % of the speed, from run {settings.first_run} of the first on "
        "(geoDryRun FALSE)"
    )


def _layer(number: int, layer: StackedLayerRecord, told: StackRecord) -> str:
    """Return the line of one layer: what it takes, and what comes behind it."""
    took = f"{layer.runs} runs, {layer.print_s or 0.0:.0f} s, {layer.laid_mm3 / 1000.0:.3g} cm3"
    return f"{number}  {took}{behind_layer(number, told)}"


def _printing(program: StackProgramRecord) -> list[str]:
    texts = ["run it as written first: dry, 20 mm higher, at 25 % (geoDryRun TRUE, geoSpeedPct 25)"]
    if program.runs_dry_only:
        return texts
    return [*texts, "then geoDryRun FALSE, and at a fixed pressure geoSpeedPct 100 and the speed override 100 %"]


def _stopping(count: int) -> str:
    return (
        f"geoLastLayer, 1 to {count}, ends it behind that layer, at home, with everything shut off; it may be lowered "
        "while a layer is printed"
    )


def _resuming() -> list[str]:
    begun = (
        "geoFirstLayer stands at the layer that was begun and not finished: clean the nozzle, set geoFirstRun to the "
        "run that the pendant names, start from main"
    )
    return [begun, "behind the last layer geoFirstLayer stands beyond it: set it to 1 for a new part"]


def _executed(program: StackProgramRecord) -> str:
    return (
        f"{', '.join(program.scenarios)}; each layer moved and switched as its own program does; refused before "
        f"anything moved: {', '.join(program.refused)}"
    )
