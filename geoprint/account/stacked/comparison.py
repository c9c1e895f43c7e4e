"""What is said of whole stacks that several backends planned: a row each, the best, and in words what it means."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from geoprint.account.records.rounding import listed
from geoprint.account.records.stack import StackRecord
from geoprint.account.records.stack_comparison import ComparedStackRecord, RefusedStackRecord
from geoprint.account.texts.stack import stack_warnings
from geoprint.quality import EVEN_ENOUGH, MOST_MISSED, Covering, equally_good, ranked


def compared_stack(backend: str, told: StackRecord | str, *, asked: bool) -> ComparedStackRecord | RefusedStackRecord:
    """Return the row of a backend.

    Args:
        backend: its name.
        told: what its stack.json says, or why it cannot plan a layer.
        asked: whether the robot was.
    """
    if isinstance(told, str):
        return RefusedStackRecord(backend=backend, refused=told)
    layers = told.layers
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
        finished=told.finished.printed,
        runs=sum(layer.runs for layer in layers),
        deposit_mm=sum(layer.deposit_mm for layer in layers),
        print_s=sum(times) if whole else None,
        clearance_mm=min((layer.clearance_mm for layer in layers if layer.clearance_mm is not None), default=None),
        printable=whole if asked else None,
        not_printable=refused[0] if refused else None,
        warnings=tuple(stack_warnings(told)),
        not_checked=tuple(dict.fromkeys(text for layer in layers for text in layer.not_checked)),
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
            f"With {row.backend} the finished thickness is {row.finished.mean:.1%} of what is wanted and varies by "
            f"{row.finished.cv:.2%}."
            for row in order
            if row.finished is not None
        ),
        *_printing(order),
        *(f"{row.backend} could not plan: {row.refused}" for row in rows if isinstance(row, RefusedStackRecord)),
    )


def _decision(order: Sequence[ComparedStackRecord], *, part: str) -> str:
    best, *others = order
    found = [_covering(row) for row in order]
    missed = f"{best.gap:.1%} of their area is missed and {best.overlap:.1%} covered twice"
    if not found[0].covers:
        return f"No backend covers the layers over {part}: at best, with {best.backend}, {missed}."
    if not others:
        return f"{best.backend} covers the layers over {part}: {missed}; their thickness varies by {found[0].cv:.1%}."
    spacings = " and ".join(f"{each.cv:.2%} with {row.backend}" for row, each in zip(order, found, strict=True))
    if any(not each.is_alike(found[0]) for each in found):
        shares = " and ".join(
            f"{each.fault:.1%} with {row.backend}{', which leaves holes,' if each.gap > MOST_MISSED else ''}"
            for row, each in zip(order, found, strict=True)
        )
        return (
            f"{best.backend} covers the layers over {part} best: missed or covered twice are {shares} of their area; "
            f"their thickness varies by {spacings}."
        )
    leading = [row.backend for row in order[: equally_good(found)]]
    how = "equally well" if len(leading) == len(order) else "most evenly"
    enough = " All of them are even enough to print." if all(each.cv <= EVEN_ENOUGH for each in found) else ""
    verb = "covers" if len(leading) == 1 else "cover"
    return f"{listed(leading)} {verb} the layers over {part} {how}: their thickness varies by {spacings}.{enough}"


def _printing(order: Sequence[ComparedStackRecord]) -> Iterator[str]:
    if order[0].printable is None:
        yield "Whether the robot can print them was not asked."
        return
    taken = [f"{row.print_s:.0f} s with {row.backend}" for row in order if row.print_s is not None]
    if taken:
        yield f"Printing takes {' and '.join(taken)}."
    yield from (f"{row.backend} cannot be printed: {row.not_printable}" for row in order if row.not_printable)


def _covering(row: ComparedStackRecord) -> Covering:
    return Covering(row.gap, row.overlap, row.thickness_cv)
