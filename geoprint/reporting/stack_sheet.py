"""The run sheet of a whole stack: its layers in order, where it pauses, where it can be stopped and begun again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePosixPath

from geoprint.errors import how_many
from geoprint.postprocessor import StackSettings
from geoprint.postprocessor.interface import Joining
from geoprint.postprocessor.registry import post_processor
from geoprint.reporting.check import CheckedParts
from geoprint.reporting.records.stack import StackedLayerRecord, StackProgramRecord, StackRecord
from geoprint.reporting.run_sheet import entry

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
