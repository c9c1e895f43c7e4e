"""What stacks.json, the terminal and the report page say of stacks that several backends planned."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from geoprint.config import Job
from geoprint.errors import percent
from geoprint.layers.records import ComparedStackRecord, RefusedStackRecord, StackComparisonRecord, StackRecord
from geoprint.layers.stack_page import (
    base_view,
    cautions_of,
    printed_view,
    sliced_pictures,
    stack_paths,
    thickness_settings,
)
from geoprint.layers.stack_text import stack_warnings
from geoprint.layers.stack_thickness import FinishedStack
from geoprint.metrics import EVEN_ENOUGH, MOST_MISSED, Covering, equally_good, ranked
from geoprint.reporting.cautions import said_once
from geoprint.reporting.records.rounding import listed, stamp
from geoprint.reporting.tables import Cells, fitting, grid, left_out, marked_lines
from geoprint.reporting.thickness_page import ThicknessReport, ThicknessWords, thickness_report

# What is said of whole stacks that several backends planned: a row each, the best, and in words what it means.


def compared_stack(backend: str, record: StackRecord | str, *, asked: bool) -> ComparedStackRecord | RefusedStackRecord:
    """Return the row of a backend.

    Args:
        backend: its name.
        record: what its stack.json says, or why it cannot plan a layer.
        asked: whether the robot was.
    """
    if isinstance(record, str):
        return RefusedStackRecord(backend=backend, refused=record)
    layers = record.layers
    areas = np.array([layer.area_mm2 for layer in layers])
    uneven = np.array([layer.thickness_cv or 0.0 for layer in layers])
    refused = [
        f"layer {number}: {text}" for number, text in enumerate((each.not_printable for each in layers), 1) if text
    ]
    times = [layer.print_s for layer in layers if layer.print_s is not None]
    whole = len(times) == len(layers)
    return ComparedStackRecord(
        backend=backend,
        gap=float(np.average([layer.gap or 0.0 for layer in layers], weights=areas)),
        overlap=float(np.average([layer.overlap or 0.0 for layer in layers], weights=areas)),
        thickness_cv=float(np.sqrt(np.average(uneven**2, weights=areas))),
        worst_cv=float(uneven.max()),
        finished=record.finished.printed,
        runs=sum(layer.runs for layer in layers),
        deposit_mm=sum(layer.deposit_mm for layer in layers),
        print_s=sum(times) if whole else None,
        clearance_mm=min((layer.clearance_mm for layer in layers if layer.clearance_mm is not None), default=None),
        printable=whole if asked else None,
        not_printable=refused[0] if refused else None,
        warnings=tuple(stack_warnings(record)),
        not_checked=tuple(dict.fromkeys(text for layer in layers for text in layer.not_checked)),
    )


def comparison_record(
    rows: Sequence[ComparedStackRecord | RefusedStackRecord], first: StackRecord
) -> StackComparisonRecord:
    """Return what stacks.json says.

    Args:
        rows: a backend each, at least one that planned.
        first: what stack.json of one of these says.
    """
    return StackComparisonRecord(
        **stamp(StackComparisonRecord),
        part=first.part,
        thickness_mm=first.thickness_mm,
        layers=len(first.layers),
        verdict=stack_verdict(rows, part=first.part),
        best=best_stack(rows)[0].backend,
        backends=tuple(rows),
    )


def best_stack(rows: Sequence[ComparedStackRecord | RefusedStackRecord]) -> list[ComparedStackRecord]:
    """Return the backends that planned, the best first, as coverings of a part are ranked."""
    planned = [row for row in rows if isinstance(row, ComparedStackRecord)]
    return [planned[index] for index in ranked([_covering(row) for row in planned])]


def stack_verdict(rows: Sequence[ComparedStackRecord | RefusedStackRecord], *, part: str) -> tuple[str, ...]:
    """Return sentences that say which backend covers all layers best, how the stack comes out, and what prints.

    Args:
        rows: a backend each, at least one that planned.
        part: its name.
    """
    order = best_stack(rows)
    return (
        _decision(order, part=part),
        *(
            f"With {row.backend} the finished thickness is {percent(row.finished.mean, 1)} of the target and varies by "
            f"{percent(row.finished.cv, 2)}."
            for row in order
            if row.finished is not None
        ),
        *_printing(order),
        *(f"{row.backend} could not plan: {row.refused}" for row in rows if isinstance(row, RefusedStackRecord)),
    )


def _decision(order: Sequence[ComparedStackRecord], *, part: str) -> str:
    best, *others = order
    found = [_covering(row) for row in order]
    missed = f"{percent(best.gap, 1)} of their area is missed and {percent(best.overlap, 1)} is covered twice"
    if not found[0].covers:
        return f"No backend covers the layers over {part}. The best, {best.backend}: {missed}."
    if not others:
        varies = percent(found[0].cv, 1)
        return f"{best.backend} covers the layers over {part}: {missed}; their thickness varies by {varies}."
    spacings = " and ".join(f"{percent(each.cv, 2)} with {row.backend}" for row, each in zip(order, found, strict=True))
    if any(not each.is_alike(found[0]) for each in found):
        shares = " and ".join(
            f"{percent(each.fault, 1)} with {row.backend}{', which leaves holes' if each.gap > MOST_MISSED else ''}"
            for row, each in zip(order, found, strict=True)
        )
        return (
            f"{best.backend} covers the layers over {part} best. Area missed or covered twice: {shares}. "
            f"Their thickness varies by {spacings}."
        )
    leading = [row.backend for row in order[: equally_good(found)]]
    how = "equally well" if len(leading) == len(order) else "most evenly"
    enough = " All are even enough to print." if all(each.cv <= EVEN_ENOUGH for each in found) else ""
    verb = "covers" if len(leading) == 1 else "cover"
    return f"{listed(leading)} {verb} the layers over {part} {how}: their thickness varies by {spacings}.{enough}"


def _printing(order: Sequence[ComparedStackRecord]) -> Iterator[str]:
    if order[0].printable is None:
        yield "The robot was left out: nothing says whether it can print these."
        return
    taken = [f"{row.print_s:.0f} s with {row.backend}" for row in order if row.print_s is not None]
    if taken:
        yield f"Printing takes {' and '.join(taken)}."
    yield from (f"The robot cannot print {row.backend}: {row.not_printable}" for row in order if row.not_printable)


def _covering(row: ComparedStackRecord) -> Covering:
    return Covering(row.gap, row.overlap, row.thickness_cv)


# What a person reads of compared stacks: a row a backend, and in words what it means.


# What the columns show, and how much each matters: where the terminal is narrow, the highest numbers go first.
COLUMNS = {
    "backend": 0, "thickness CV": 3, "volume": 6, "layer CV": 1, "worst CV": 5, "gap": 2, "overlap": 4, "runs": 9,
    "length mm": 10, "print s": 7, "printable": 8, "clear mm": 11,
}  # fmt: skip
_LEFT = {"backend", "printable"}
_NONE = "-"


def stack_comparison_text(record: StackComparisonRecord, *, width: int | None = None, verbose: bool = False) -> str:
    """Return the table and, below it, what it means and what to mind.

    Layer CV is that of the layers' own thickness, of all by area; worst CV that of the layer where it is largest;
    thickness CV and volume are those of all layers together, as they are printed, over what is wanted.

    Args:
        record: what stacks.json says.
        width: letters in a line, where they are counted; columns that do not fit are left out.
        verbose: whether to list all that was not checked.
    """
    rows = [*map(stack_cells, record.backends)]
    names = fitting([*COLUMNS], rows, width=width, weights=COLUMNS)
    lines = [f"{record.part}: {record.thickness_mm:.3g} mm in {record.layers} layers, all of them compared", ""]
    lines += [*grid(names, [rows], left=_LEFT), ""]
    if len(names) < len(COLUMNS):
        lines += [f"columns left out at this width, see stacks.json: {left_out([*COLUMNS], names, COLUMNS)}", ""]
    planned = [row for row in record.backends if isinstance(row, ComparedStackRecord)]
    warnings = said_once({row.backend: row.warnings for row in planned})
    unchecked = [text for row in planned for text in row.not_checked]
    return "\n".join(
        [*lines, *record.verdict, *marked_lines(warnings=warnings, not_checked=unchecked, verbose=verbose)]
    )


def stack_cells(row: ComparedStackRecord | RefusedStackRecord) -> Cells:
    """Return what the columns say of a backend."""
    if isinstance(row, RefusedStackRecord):
        return {**dict.fromkeys(COLUMNS, _NONE), "backend": row.backend, "printable": "refused"}
    finished = row.finished
    return {
        "backend": row.backend,
        "thickness CV": _NONE if finished is None else percent(finished.cv, 2),
        "volume": _NONE if finished is None else percent(finished.volume, 2),
        "layer CV": percent(row.thickness_cv, 2),
        "worst CV": percent(row.worst_cv, 2),
        "gap": percent(row.gap, 2),
        "overlap": percent(row.overlap, 2),
        "runs": str(row.runs),
        "length mm": f"{row.deposit_mm:.0f}",
        "print s": _NONE if row.print_s is None else f"{row.print_s:.0f}",
        "printable": "not asked" if row.printable is None else "yes" if row.printable else "no",
        "clear mm": _NONE if row.clearance_mm is None else f"{row.clearance_mm:.2f}",
    }


# The report page of compared stacks: how that of each backend comes out, side by side.


OF_BACKENDS = ThicknessWords(
    "Backend",
    "Backend by backend",
    "Backends",
    "best",
    "covers the layers best; shown where there is room for only one",
)


def compared_stacks_page(
    stacks: Mapping[str, tuple[StackRecord, FinishedStack]], recorded: StackComparisonRecord, job: Job, *, page: str
) -> bytes:
    """Return report.html of compared stacks, in one page that opens offline beside their folders.

    Args:
        stacks: what stack.json of each backend that planned says, and how its stack comes out.
        recorded: what stacks.json says.
        job: that was planned.
        page: name of the page in the folder of each stack.
    """
    names = [recorded.best, *(name for name in stacks if name != recorded.best)]
    record, first = stacks[recorded.best]
    planned = [row for row in recorded.backends if isinstance(row, ComparedStackRecord)]
    view = base_view(first, count=len(names))
    shown = ThicknessReport(
        name=recorded.part,
        verdict=recorded.verdict,
        cautions=cautions_of(
            said_once({row.backend: row.warnings for row in planned}),
            (text for row in planned for text in row.not_checked),
        ),
        surface=view.surface,
        R_view_work=first.upright,
        spacing=first.layers[0].spacing,
        words=OF_BACKENDS,
        flows=tuple(printed_view(stacks[name][1], stacks[name][0], view, backend=name) for name in names),
        paths=tuple(stack_paths(stacks[name][1]) for name in names),
        columns=tuple(COLUMNS),
        rows=tuple(tuple(stack_cells(row)[column] for column in COLUMNS) for row in recorded.backends),
        pages=tuple((name, f"{name}/{page}") for name in names),
        pictures=tuple((f"Sliced open: {name}", tuple(sliced_pictures(stacks[name][1]))) for name in names),
        settings=thickness_settings(job, record),
        inputs=first.inputs,
    )
    return thickness_report(shown, title=f"geoprint compare: {recorded.part}, {recorded.thickness_mm:g} mm")
