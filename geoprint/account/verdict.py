"""What a comparison means, in plain words: which backend covers a part best, whether that is enough, and what to do.

Coverage decides first and spacing second: a path that leaves holes is not even, however equal its distances are.
"""

from __future__ import annotations

from collections.abc import Sequence

from geoprint.account.prints.overhang import table_sentences
from geoprint.account.prints.sides import variation_text
from geoprint.account.records.comparison import PlannedRecord, RefusedRecord
from geoprint.account.records.plan import EvennessRecord
from geoprint.account.records.tried import MiddleRecord
from geoprint.quality import EVEN_ENOUGH, MOST_MISSED, SAME_SPACING, Covering, ranked as ranking

# Uncovered or overlapped area below this share is not worth a word.
NOTABLE = 0.001
# So many runs that are shorter than five spacings are worth a word.
NOTABLE_FRAGMENTS = 3


def verdict(
    part: str, rows: Sequence[PlannedRecord | RefusedRecord], *, printed: Sequence[str] = ()
) -> tuple[str, ...]:
    """Return sentences that say which backend covers the part best, whether that is enough, and what prints.

    The first one decides; where it finds no print, the second says what to do; the last ones name what is not
    comparable.

    Args:
        part: its name.
        rows: a backend each, at least one that planned.
        printed: sentences on what the cell makes of the paths; they follow what decides.
    """
    refused = [row for row in rows if isinstance(row, RefusedRecord)]
    order = ranked(rows)
    return (
        _decision(part, order, alone=not refused),
        *coverage_advice(order[0].uniformity, order[0].spacing_mm),
        *printed,
        *_faults(order),
        *(text for row in order for text in middle_sentences(row.middles, backend=row.backend)),
        *table_sentences(order),
        *_printing(order),
        *_levels(order),
        *(f"{row.backend} could not plan on this part: {row.refused}" for row in refused),
    )


def ranked(rows: Sequence[PlannedRecord | RefusedRecord]) -> list[PlannedRecord]:
    """Return the backends that planned, the best first, as coverings are ranked."""
    planned = [row for row in rows if isinstance(row, PlannedRecord)]
    return [planned[index] for index in ranking([_covering(row) for row in planned])]


def coverage_advice(measured: EvennessRecord, spacing: float) -> list[str]:
    """Return what to do where paths do not cover a part, or nothing where they do.

    Args:
        measured: how they cover it.
        spacing: that was wanted [mm].
    """
    if covers(measured):
        return []
    what = f"a smaller spacing, such as `--spacing {spacing / 2.0:.3g}`, reaches into narrower places"
    return [f"What to do: {what}, and `--from best` looks for a source that covers more."]


def middle_sentences(middles: Sequence[MiddleRecord], *, backend: str | None = None) -> list[str]:
    """Say what becomes of contours where fronts meet, and what would with the other kind; nothing where none was tried.

    Args:
        middles: that were tried.
        backend: whose they are, where there are several.
    """
    taken, other = ([each for each in middles if each.taken is wanted] for wanted in (True, False))
    if not taken or not other:
        return []
    found = [f"{each[0].gap:.1%} + {each[0].overlap:.1%} in {each[0].runs} runs" for each in (taken, other)]
    whose = "" if backend is None else f" with {backend}"
    covered = f"area missed + laid twice: {found[0]}, {found[1]} if {other[0].middle}"
    return [f"Where fronts meet, contours{whose} are {taken[0].middle}; {covered} (`--middle {other[0].middle}`)."]


def covers(measured: EvennessRecord) -> bool:
    """Return whether paths leave no holes and lay little twice."""
    return Covering(measured.gap, measured.overlap, 0.0).covers


def _covering(row: PlannedRecord) -> Covering:
    return Covering(row.uniformity.gap, row.uniformity.overlap, _cv(row))


def _fault(row: PlannedRecord) -> float:
    return _covering(row).fault


def _cv(row: PlannedRecord) -> float:
    return 0.0 if row.uniformity.spacing is None else row.uniformity.spacing.cv


def _decision(part: str, order: Sequence[PlannedRecord], *, alone: bool) -> str:
    best, others = order[0], order[1:]
    if not covers(best.uniformity):
        missed = f"{best.uniformity.gap:.1%} of the area is missed and {best.uniformity.overlap:.1%} laid twice"
        return (
            f"No backend covers {part}: at best, with {best.backend}, {missed}."
            if others
            else f"{best.backend} does not cover {part}: {missed}."
        )
    if not others:
        # Alone, no other was asked.
        return f"{'' if alone else 'Only '}{best.backend} covers {part}; {_spacing(best)}."
    leader = min((_covering(row) for row in order), key=lambda each: (not each.covers, each.fault))
    worse = [row for row in others if not _covering(row).is_alike(leader)]
    if worse:
        holes = {row.backend: " and leaves holes" for row in worse if row.uniformity.gap > MOST_MISSED}
        more = _listed([f"{row.backend} {_fault(row):.1%}{holes.get(row.backend, '')}" for row in worse])
        missed = f"it misses or lays twice {_fault(best):.1%} of the area, {more}"
        return f"{best.backend} covers {part} best: {missed}; {_spacings(order)}.{_enough(order)}"
    if _cv(order[-1]) - _cv(best) < SAME_SPACING:
        names = _listed([row.backend for row in order])
        return f"{names} cover {part} equally well: {_spacings(order)}.{_enough(order)}"
    return f"{best.backend} covers {part} most evenly: {_spacings(order)}.{_enough(order)}"


def _spacing(row: PlannedRecord) -> str:
    varies = variation_text(row.uniformity, digits=1)
    if varies is None:
        return "there is one level of paths, and so no spacing to measure"
    return f"its spacing varies by {varies} (standard deviation over mean)"


def _spacings(order: Sequence[PlannedRecord]) -> str:
    """Return how much the spacing of several backends varies, that of the first in full."""
    varies = {row.backend: variation_text(row.uniformity, digits=1) for row in order}
    if any(text is None for text in varies.values()):
        return "with one level of paths there is no spacing to compare, only what is covered, runs and time"
    others = _listed([f"that of {row.backend} by {varies[row.backend]}" for row in order[1:]])
    first = order[0].backend
    return f"the spacing of {first} varies by {varies[first]} (standard deviation over mean), {others}"


def _enough(order: Sequence[PlannedRecord]) -> str:
    """Return that all of them suffice, where they do."""
    even = all(
        _cv(row) <= EVEN_ENOUGH and covers(row.uniformity) and row.paths.fragments < NOTABLE_FRAGMENTS for row in order
    )
    return " All of them are even enough to print." if even and _cv(order[-1]) != _cv(order[0]) else ""


def _faults(order: Sequence[PlannedRecord]) -> list[str]:
    """Say what each backend leaves, lays twice and tears apart, where that is worth a word."""
    said: list[str] = []
    for row in order:
        gap, overlap, fragments = row.uniformity.gap, row.uniformity.overlap, row.paths.fragments
        faults = [
            *([f"leaves {gap:.1%} of the area farther than 0.55 spacings from every path"] if gap >= NOTABLE else []),
            *([f"lays {overlap:.1%} twice"] if overlap >= NOTABLE else []),
            *(
                [f"starts {row.paths.runs} runs, {fragments} of them shorter than five spacings"]
                if fragments >= NOTABLE_FRAGMENTS
                else []
            ),
        ]
        said += [f"{row.backend} {_listed(faults)}."] if faults else []
    return said


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
