"""What a person reads of a stack: a line a layer, and the whole."""

from __future__ import annotations

from collections.abc import Iterator

from geoprint.account.records.stack import StackedLayerRecord, StackRecord
from geoprint.account.texts.marks import marked_lines
from geoprint.account.texts.stack_cure import cure_notes, cure_warnings, dose_text


def stack_text(told: StackRecord, *, verbose: bool = False) -> str:
    """Return the lines that a person reads when all layers of a thickness are planned.

    Args:
        told: what stack.json says.
        verbose: whether to list all that was not checked.
    """
    laid = sum(layer.laid_mm3 for layer in told.layers)
    wanted = sum(layer.wanted_mm3 for layer in told.layers)
    first = (
        f"{told.part}: {told.thickness_mm:g} mm in {len(told.layers)} layers of {told.layers[0].height_mm:.3g} mm, "
        f"{laid / 1000.0:.4g} cm3 laid, {laid / wanted - 1.0:+.2%} of what they hold"
    )
    if told.target_mm3 is not None:
        first += f", which is {wanted / told.target_mm3:.1%} of {told.target}"
    times = [layer.print_s for layer in told.layers if layer.print_s is not None]
    lines = [first, *(_layer_line(number, layer) for number, layer in enumerate(told.layers, start=1))]
    if times:
        lines.append(
            f"printed one after another, {sum(times):.0f} s in all: load and run the program of each folder in turn; "
            "the print may end after any of them"
        )
    lines += [f"  left out: {each.reason}" for each in told.left_out]
    unchecked = [*told.not_checked, *(text for layer in told.layers for text in layer.not_checked)]
    warnings = [*_warnings(told), *cure_warnings(told)]
    lines += marked_lines(warnings=warnings, notes=cure_notes(told), not_checked=unchecked, verbose=verbose)
    return "\n".join(lines)


def _warnings(told: StackRecord) -> Iterator[str]:
    """Yield what to act on, each once, with the layers that it is said of where that is not all of them."""
    count = len(told.layers)
    for text in dict.fromkeys(text for layer in told.layers for text in layer.warnings):
        of = [str(number) for number, layer in enumerate(told.layers, start=1) if text in layer.warnings]
        whose = "" if len(of) == count else f"layer{'s' if len(of) > 1 else ''} {', '.join(of)}: "
        yield whose + text


def _layer_line(number: int, layer: StackedLayerRecord) -> str:
    """Return the line of one layer."""
    spacing = "one level" if layer.spacing_cv is None else f"spacing varies by {layer.spacing_cv:.2%}"
    gap = "" if layer.gap is None else f", uncovered {layer.gap:.2%}"
    time = "" if layer.print_s is None else f", {layer.print_s:.0f} s"
    clear = "" if layer.clearance_mm is None else f", {layer.clearance_mm:.2f} mm clear"
    return (
        f"  {number:2} from {layer.bottom_mm:.3g} mm: {layer.pattern}, {layer.runs} runs, {layer.deposit_mm:.0f} mm of "
        f"path, {spacing}{gap}{dose_text(layer)}{time}{clear}"
    )
