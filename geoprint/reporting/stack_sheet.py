"""The run sheet of a whole stack, and what a person reads of a check."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePosixPath

from geoprint.errors import how_many
from geoprint.postprocessor import StackSettings
from geoprint.postprocessor.interface import Joining
from geoprint.postprocessor.registry import post_processor
from geoprint.reporting.check import Checked, CheckedComparison, CheckedStack, Finding
from geoprint.reporting.metrics import THICKNESS
from geoprint.reporting.records.stack import StackedLayerRecord, StackProgramRecord, StackRecord
from geoprint.reporting.run_sheet import entry, proof_rows, repeated_texts, run_sheet, underived_texts

# The run sheet of a whole stack: its layers in order, where it pauses, where it can be stopped and begun again.


def stack_sheet(record: StackRecord, checked: CheckedStack, *, width: int | None = None) -> list[str]:
    """Return the lines of the page; none without a program.

    Args:
        record: what stack.json says.
        checked: how its program is set to run, and what people saw it do.
        width: letters in a line, where they are counted; the page is never wider than 100.
    """
    program = record.program
    if program is None:
        return []
    layers = [_layer(number, layer, record) for number, layer in enumerate(record.layers, start=1)]
    one, now = _parts(record.layers)[0], checked.program
    rows = (
        ("program", _program(program, record.layers)),
        ("layers", layers),
        *_handling(program, record.layers, now.settings),
        *proof_rows(one, program.scenarios, program.refused, checked.seen, program_sha256=now.program_sha256),
    )
    return [line for label, texts in rows for line in entry(label, texts, width=width)]


def stack_steps(record: StackRecord) -> list[str]:
    """Return the lines of that page behind those of the layers: what to load, to set and to do.

    Args:
        record: what stack.json says.
    """
    program = record.program
    if program is None:
        return []
    rows = (("program", _program(program, record.layers)), *_handling(program, record.layers, None))
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


def _parts(layers: Sequence[StackedLayerRecord]) -> tuple[str, int]:
    """Return what the program loads one after another, and how many: layers, or attitudes of a table."""
    attitudes = sum(layer.attitudes or 0 for layer in layers)
    return ("attitude", attitudes) if attitudes else ("layer", len(layers))


def _handling(
    program: StackProgramRecord, layers: Sequence[StackedLayerRecord], settings: StackSettings | None
) -> list[tuple[str, list[str]]]:
    """Return how it is set, printed, stopped and begun again."""
    one, count = _parts(layers)
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
    runs, (one, parts) = sum(layer.runs for layer in layers), _parts(layers)
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


# What a person reads of a check: a run sheet, the page of a bundle without a program, a line a bundle of several.


def check_text(checked: Checked | CheckedComparison, *, width: int | None = None) -> str:
    """Return the page; of a bundle in which something was found only that.

    Args:
        checked: a bundle, or a comparison with its bundles.
        width: letters in a line, where they are counted.
    """
    if isinstance(checked, CheckedComparison):
        return _comparison(checked, width=width)
    if checked.findings or checked.program:
        return run_sheet(checked, width=width)
    return _paths(checked, width=width)


def _paths(checked: Checked, *, width: int | None) -> str:
    """Return the page of a bundle that has paths alone."""
    record = checked.record
    if record is None:
        return ""
    why = (
        "the robot was left out"
        if record.not_printable is None
        else f"the robot cannot print it: {record.not_printable}"
    )
    paths, even = record.paths, record.uniformity
    spread = "" if even is None else f", thickness CV {THICKNESS.text(even)}"
    spacing = f"{record.settings.spacing_mm:.3g}"
    lines = [f"PATHS ONLY  {record.input.name}  ({checked.folder.name})", ""]
    for label, texts in (
        ("program", [f"NONE: {why}"]),
        (
            "paths",
            [f"{how_many(paths.runs, 'run')}, {paths.deposit_mm:.0f} mm at {spacing} mm{spread}"],
        ),
        ("checked", ["files unchanged, paths on their surface, number and length as in plan.json"]),
        ("checked again", repeated_texts(checked)),
        ("not derived", underived_texts(checked)),
    ):
        lines += entry(label, texts, width=width) if texts else []
    return "\n".join(lines)


def _comparison(checked: CheckedComparison, *, width: int | None) -> str:
    """Return a line for each bundle, the best of a part or the lowest layer first, and below it what is wrong.

    A stack in which nothing is wrong has its run sheet below.
    """
    if checked.stacks:
        head = f"COMPARISON  {checked.folder.name}: {how_many(len(checked.stacks), 'stack')}"
        pages = [page for _, stack in checked.stacks for page in ("", _comparison(stack, width=width))]
        return "\n".join([head, "", *(f"  {_line(one)}" for one in checked.own), *pages])
    longest = max((len(name) for name, _ in checked.bundles), default=0)
    count = len(checked.bundles)
    stack = checked.stack
    word, what = ("STACK", "layers, the lowest") if stack else ("COMPARISON", "bundles, the best of a part")
    lines = [f"{word}  {checked.folder.name}: {count} {what} first", ""]
    lines += [f"  {_line(one)}" for one in checked.own]
    for name, bundle in checked.bundles:
        lines.append(f"{name:<{longest}}  {_outcome(bundle)}")
        lines += [f"  {name}/{_line(one)}" for one in bundle.findings]
    if stack is not None and stack.record is not None and not checked.findings:
        sheet = stack_sheet(stack.record, stack, width=width)
        lines += (
            ["", f"RUN SHEET  {stack.record.part}, layer upon layer  ({checked.folder.name})", "", *sheet]
            if sheet
            else []
        )
    return "\n".join(lines)


def _outcome(bundle: Checked) -> str:
    """Return what is said of one of several bundles."""
    if bundle.findings:
        return f"differs from the plan that was made: {how_many(len(bundle.findings), 'finding')}"
    record, again = bundle.record, "".join(f"; {text}" for text in repeated_texts(bundle)[:1])
    if record is None or not bundle.program or bundle.setup is None:
        why = "" if record is None or record.not_printable is None else f": {record.not_printable}"
        return f"as planned{again}; holds no program{why}"
    dry = ", runs dry only" if bundle.setup.placement.missing else ""
    of_it = [one.stage for one in bundle.seen if one.program_sha256 == bundle.program_sha256]
    seen = f"; seen {', '.join(dict.fromkeys(of_it))}" if of_it else ""
    targets = sum(robot.program.targets for robot in record.robot)
    tilted = f" in {how_many(len(record.robot), 'attitude')}" if len(record.robot) > 1 else ""
    return f"as planned{again}; {how_many(targets, 'target')}{tilted}{dry}{seen}"


def _line(one: Finding) -> str:
    return f"{one.file}, line {one.line}: {one.reason}"
