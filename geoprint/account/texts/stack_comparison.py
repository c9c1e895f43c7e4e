"""What a person reads of compared stacks: a row a backend, and in words what it means."""

from __future__ import annotations

from geoprint.account.cautions import said_once
from geoprint.account.records.stack_comparison import ComparedStackRecord, RefusedStackRecord, StackComparisonRecord
from geoprint.account.texts.marks import marked_lines
from geoprint.account.texts.tables import Cells, fitting, grid, left_out

# What the columns show, and how much each matters: where the terminal is narrow, the highest numbers go first.
COLUMNS = {
    "backend": 0, "thickness CV": 3, "volume": 6, "layer CV": 1, "worst CV": 5, "gap": 2, "overlap": 4, "runs": 9,
    "length mm": 10, "print s": 7, "printable": 8, "clear mm": 11,
}  # fmt: skip
_LEFT = {"backend", "printable"}
_NONE = "-"


def stack_comparison_text(told: StackComparisonRecord, *, width: int | None = None, verbose: bool = False) -> str:
    """Return the table and, below it, what it means and what to mind.

    Layer CV is that of the layers' own thickness, of all by area; worst CV that of the layer where it is largest;
    thickness CV and volume are those of all layers together, as they are printed, over what is wanted.

    Args:
        told: what stacks.json says.
        width: letters in a line, where they are counted; columns that do not fit are left out.
        verbose: whether to list all that was not checked.
    """
    rows = [*map(stack_cells, told.backends)]
    names = fitting([*COLUMNS], rows, width=width, weights=COLUMNS)
    lines = [f"{told.part}: {told.thickness_mm:.3g} mm in {told.layers} layers, all of them compared", ""]
    lines += [*grid(names, [rows], left=_LEFT), ""]
    if len(names) < len(COLUMNS):
        lines += [f"left out at this width, told in stacks.json: {left_out([*COLUMNS], names, COLUMNS)}", ""]
    planned = [row for row in told.backends if isinstance(row, ComparedStackRecord)]
    warnings = said_once({row.backend: row.warnings for row in planned})
    unchecked = [text for row in planned for text in row.not_checked]
    return "\n".join([*lines, *told.verdict, *marked_lines(warnings=warnings, not_checked=unchecked, verbose=verbose)])


def stack_cells(row: ComparedStackRecord | RefusedStackRecord) -> Cells:
    """Return what the columns say of a backend."""
    if isinstance(row, RefusedStackRecord):
        return {**dict.fromkeys(COLUMNS, _NONE), "backend": row.backend, "printable": "refused"}
    finished = row.finished
    return {
        "backend": row.backend,
        "thickness CV": _NONE if finished is None else f"{finished.cv:.2%}",
        "volume": _NONE if finished is None else f"{finished.volume:.2%}",
        "layer CV": f"{row.thickness_cv:.2%}",
        "worst CV": f"{row.worst_cv:.2%}",
        "gap": f"{row.gap:.2%}",
        "overlap": f"{row.overlap:.2%}",
        "runs": str(row.runs),
        "length mm": f"{row.deposit_mm:.0f}",
        "print s": _NONE if row.print_s is None else f"{row.print_s:.0f}",
        "printable": "not asked" if row.printable is None else "yes" if row.printable else "no",
        "clear mm": _NONE if row.clearance_mm is None else f"{row.clearance_mm:.2f}",
    }
