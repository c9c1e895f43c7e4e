"""What a person reads of a stack: a line a layer, and the whole."""

from __future__ import annotations

from collections.abc import Iterator

from geoprint.account.records.stack import StackedLayerRecord, StackRecord
from geoprint.account.texts.marks import marked_lines
from geoprint.account.texts.stack_cure import cure_notes, cure_warnings, dose_text
from geoprint.account.texts.stack_sheet import behind_layer, stack_steps

# Less of the area than this is not worth a line.
TOLD_SHARE = 0.0005


def stack_text(told: StackRecord, *, verbose: bool = False) -> str:
    """Return the lines that a person reads when all layers of a thickness are planned.

    Args:
        told: what stack.json says.
        verbose: whether to list all that was not checked.
    """
    lines = [
        stack_sentence(told),
        *finished_sentences(told),
        *(_layer_line(number, layer) + behind_layer(number, told) for number, layer in enumerate(told.layers, start=1)),
    ]
    lines += [f"  left out: {each.reason}" for each in told.left_out]
    unchecked = [*told.not_checked, *(text for layer in told.layers for text in layer.not_checked)]
    warnings = [*stack_warnings(told), *cure_warnings(told)]
    lines += stack_steps(told)
    lines += marked_lines(warnings=warnings, notes=cure_notes(told), not_checked=unchecked, verbose=verbose)
    return "\n".join(lines)


def stack_sentence(told: StackRecord) -> str:
    """Return what was planned and how much of it is laid, without a stop."""
    laid = sum(layer.laid_mm3 for layer in told.layers)
    wanted = sum(layer.wanted_mm3 for layer in told.layers)
    said = (
        f"{told.part}: {told.thickness_mm:.3g} mm in {len(told.layers)} layers of {told.layers[0].height_mm:.3g} mm, "
        f"{laid / 1000.0:.4g} cm3 laid, {laid / wanted - 1.0:+.2%} of what they hold"
    )
    return (
        said
        if told.target_mm3 is None
        else f"{said}, which is {wanted / told.target_mm3:.1%} of what {told.target} has over the part"
    )


def finished_sentences(told: StackRecord) -> Iterator[str]:
    """Yield how all layers together come out, without stops; nothing where nobody can say."""
    found = told.finished
    if found.printed is None or found.constant_flow is None or found.following_flow is None:
        return
    yield (
        f"finished thickness {found.printed.mean:.1%} of what is wanted, varies by {found.printed.cv:.2%}: 98 of 100 "
        f"places have {found.printed.p1:.1%} to {found.printed.p99:.1%} of it (variation with flow that follows "
        f"{found.following_flow.cv:.2%}, constant {found.constant_flow.cv:.2%})"
    )
    if found.printed.judged < 1.0:
        low = max(1.0 - found.printed.judged - found.printed.creased, 0.0)
        parts = [(found.printed.creased, "fills a hollow before it is so high"), (low, "is lower than a layer")]
        said = " and ".join(f"{share:.1%} of the area {why}" for share, why in parts if share >= TOLD_SHARE)
        if said:
            yield f"  not judged: {said}"
    if found.printed.under_sides >= TOLD_SHARE:
        yield f"  judged up to sides that lean in over it: {found.printed.under_sides:.1%} of the area"


def stack_warnings(told: StackRecord) -> Iterator[str]:
    """Yield what to act on, each once, with the layers that it is said of where that is not all of them."""
    count = len(told.layers)
    for text in dict.fromkeys(text for layer in told.layers for text in layer.warnings):
        of = [str(number) for number, layer in enumerate(told.layers, start=1) if text in layer.warnings]
        whose = "" if len(of) == count else f"layer{'s' if len(of) > 1 else ''} {', '.join(of)}: "
        yield whose + text


def _layer_line(number: int, layer: StackedLayerRecord) -> str:
    """Return the line of one layer."""
    even = "" if layer.thickness_cv is None else f", thickness CV {layer.thickness_cv:.2%}"
    gap = "" if layer.gap is None else f", missed {layer.gap:.2%}"
    helix = "" if layer.helix_deg is None else f", fibres at {layer.helix_deg:+.1f} degrees"
    time = "" if layer.print_s is None else f", {layer.print_s:.0f} s"
    clear = "" if layer.clearance_mm is None else f", {layer.clearance_mm:.2f} mm clear"
    return (
        f"  {number:2} from {layer.bottom_mm:.3g} mm: {layer.pattern}, {layer.runs} runs, {layer.deposit_mm:.0f} mm of "
        f"path, {layer.laid_mm3 / 1000.0:.3g} cm3{even}{gap}{helix}{dose_text(layer)}{time}{clear}"
    )
