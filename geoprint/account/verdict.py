"""What a comparison means, in plain words: which backend covers a part better, whether it matters, what prints."""

from __future__ import annotations

from collections.abc import Sequence

from geoprint.account.records.comparison import PlannedRecord, RefusedRecord

# Spacing that varies by less than this is even enough for any bead: its width varies by no more.
EVEN_ENOUGH = 0.02
# Backends whose variation differs by less than this are equally even.
SAME = 0.002
# Uncovered area below this share is not worth a word.
NOTABLE_GAP = 0.001


def verdict(part: str, rows: Sequence[PlannedRecord | RefusedRecord]) -> tuple[str, ...]:
    """Return sentences that say which backend covers the part more evenly, whether it matters, and what prints.

    The first one decides; the last ones name what is not comparable.

    Args:
        part: its name.
        rows: a backend each, at least one that planned.
    """
    planned = [row for row in rows if isinstance(row, PlannedRecord)]
    refused = [row for row in rows if isinstance(row, RefusedRecord)]
    ranked = sorted(planned, key=_cv)
    return (
        _evenness(part, ranked, alone=not refused),
        *_gaps(ranked),
        *_printing(ranked),
        *_levels(ranked),
        *(f"{row.backend} could not plan on this part: {row.refused}" for row in refused),
    )


def _cv(row: PlannedRecord) -> float:
    return row.uniformity.spacing.cv


def _evenness(part: str, ranked: Sequence[PlannedRecord], *, alone: bool) -> str:
    name, best, worst = ranked[0].backend, _cv(ranked[0]), _cv(ranked[-1])
    spread = f"its spacing varies by {best:.1%} (standard deviation over mean)"
    if len(ranked) == 1:
        # Alone, no other was asked.
        return f"{'' if alone else 'Only '}{name} covers {part}; {spread}."
    others = _listed([f"that of {row.backend} by {_cv(row):.1%}" for row in ranked[1:]])
    if worst - best < SAME:
        names = _listed([row.backend for row in ranked])
        first = f"the spacing of {name} varies by {best:.1%} (standard deviation over mean)"
        return f"{names} cover {part} equally evenly: {first}, {others}."
    enough = " All of them are even enough to print." if worst <= EVEN_ENOUGH else ""
    return f"{name} covers {part} most evenly: {spread}, {others}.{enough}"


def _gaps(ranked: Sequence[PlannedRecord]) -> list[str]:
    return [
        f"{row.backend} leaves {row.uniformity.gap:.1%} of the area farther than 0.55 spacings from every path."
        for row in ranked
        if row.uniformity.gap >= NOTABLE_GAP
    ]


def _printing(ranked: Sequence[PlannedRecord]) -> list[str]:
    if ranked[0].printable is None:
        return ["Whether the robot can print them was not asked."]
    taken = [f"{row.print_time_s:.0f} s with {row.backend}" for row in ranked if row.print_time_s is not None]
    said = [f"Printing takes {_listed(taken)}."] if taken else []
    unprinted = [row for row in ranked if row.not_printable is not None]
    return said + [f"{row.backend} cannot be printed: {row.not_printable}" for row in unprinted]


def _levels(ranked: Sequence[PlannedRecord]) -> list[str]:
    spacings = [row.spacing_mm for row in ranked]
    if len({row.paths.levels for row in ranked}) > 1:
        counted = _listed([f"{row.paths.levels} with {row.backend}" for row in ranked])
        why = "because each backend measures its own distance to the middle"
        return [f"The number of levels differs ({counted}), {why}; what is compared is evenness, not level by level."]
    if max(spacings) > 1.005 * min(spacings):
        wanted = _listed([f"{row.spacing_mm:.3g} mm with {row.backend}" for row in ranked])
        return [f"Equal rounds mean different spacings ({wanted}): figures are ratios to each one's own."]
    return []


def _listed(phrases: Sequence[str]) -> str:
    return phrases[0] if len(phrases) == 1 else f"{', '.join(phrases[:-1])} and {phrases[-1]}"
