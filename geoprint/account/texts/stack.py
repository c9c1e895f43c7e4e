"""What a person reads of a stack: a line a layer, and the whole."""

from __future__ import annotations

from geoprint.account.records.stack import StackedLayerRecord, StackRecord


def stack_text(told: StackRecord) -> str:
    """Return the lines that a person reads when all layers of a thickness are planned."""
    laid, wanted = (sum(getattr(layer, name) for layer in told.layers) for name in ("laid_mm3", "wanted_mm3"))
    first = (
        f"{told.part}: {told.thickness_mm:g} mm in {len(told.layers)} layers of {told.layers[0].height_mm:.3g} mm, "
        f"{laid / 1000.0:.4g} cm3 laid, {laid / wanted - 1.0:+.2%} of what they hold"
    )
    times = [layer.print_s for layer in told.layers if layer.print_s is not None]
    lines = [first, *(_layer_line(number, layer) for number, layer in enumerate(told.layers, start=1))]
    if times:
        lines.append(
            f"printed one after another, {sum(times):.0f} s in all: load and run the program of each folder in turn; "
            "the print may end after any of them"
        )
    return "\n".join(lines)


def _layer_line(number: int, layer: StackedLayerRecord) -> str:
    """Return the line of one layer."""
    spacing = "one level" if layer.spacing_cv is None else f"spacing varies by {layer.spacing_cv:.2%}"
    gap = "" if layer.gap is None else f", uncovered {layer.gap:.2%}"
    time = "" if layer.print_s is None else f", {layer.print_s:.0f} s"
    clear = "" if layer.clearance_mm is None else f", {layer.clearance_mm:.2f} mm clear"
    return (
        f"  {number:2} from {layer.bottom_mm:.3g} mm: {layer.runs} runs, {layer.deposit_mm:.0f} mm of path, "
        f"{spacing}{gap}{time}{clear}"
    )
