"""What a comparison means, in plain words: which backend covers a part best, whether that is enough, and what to do.

Coverage decides first and thickness second: a path that leaves holes is not even, whatever it leaves elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence

from geoprint.errors import how_many, percent
from geoprint.metrics import EVEN_ENOUGH, MOST_MISSED, Covering, equally_good, ranked as ranking
from geoprint.reporting.evenness import table_sentences
from geoprint.reporting.metrics import GAP, THICKNESS, cover_text
from geoprint.reporting.records.comparison import PlannedRecord, RefusedRecord
from geoprint.reporting.records.evenness import EvennessRecord
from geoprint.reporting.records.rounding import listed
from geoprint.results import TriedMedialAxis

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
        *_same_middle(order),
        *(text for row in order for text in medial_axis_sentences(row.middles, backend=row.backend)),
        *table_sentences(order),
        *_printing(order),
        *_levels(order),
        *(f"{row.backend} could not plan on this part: {row.refused}" for row in refused),
    )


def ranked(rows: Sequence[PlannedRecord | RefusedRecord]) -> list[PlannedRecord]:
    """Return the backends that planned, the best first, as coverings are ranked."""
    planned = [row for row in rows if isinstance(row, PlannedRecord)]
    return [planned[index] for index in ranking([covering(row.uniformity) for row in planned])]


def coverage_advice(measured: EvennessRecord, spacing: float) -> list[str]:
    """Return what to do where paths do not cover a part, or nothing where they do.

    Args:
        measured: how they cover it.
        spacing: that was wanted [mm].
    """
    if covering(measured).covers:
        return []
    what = f"`--spacing {spacing / 2.0:.3g}`, which reaches narrower places"
    return [f"Try {what}, or `--from best`, which looks for a source that covers more."]


def medial_axis_sentences(middles: Sequence[TriedMedialAxis], *, backend: str | None = None) -> list[str]:
    """Say what becomes of contours where fronts meet, and what would with the other kind; nothing where none was tried.

    Args:
        middles: that were tried.
        backend: whose they are, where there are several.
    """
    taken, other = ([each for each in middles if each.taken is wanted] for wanted in (True, False))
    if not taken or not other:
        return []
    found = [
        f"{percent(each[0].gap, 1)} + {percent(each[0].overlap, 1)} in {how_many(each[0].runs, 'run')}"
        for each in (taken, other)
    ]
    whose = "" if backend is None else f" with {backend}"
    covered = f"Area missed + covered twice: {found[0]}; with `--set middle={other[0].middle}`: {found[1]}"
    return [f"At the medial axis, contours{whose} are {taken[0].middle}. {covered}."]


def _same_middle(order: Sequence[PlannedRecord]) -> list[str]:
    """Say which middle backends have, where one was chosen for several of them."""
    chosen = [each.middle for row in order for each in row.middles if each.taken]
    if len(chosen) < 2:
        return []
    kept = [row.backend for row in order if not row.middles]
    besides = f"; {listed(kept)} had no choice" if kept else ""
    return [f"At the medial axis, the backends use {chosen[0]} contours, which suit the best of them{besides}."]


def covering(record: EvennessRecord) -> Covering:
    """Return that by which coverings are ranked."""
    return Covering(record.gap, record.overlap, record.thickness.cv)


def _decision(part: str, order: Sequence[PlannedRecord], *, alone: bool) -> str:
    best, others = order[0], order[1:]
    coverings = [covering(row.uniformity) for row in order]
    if not coverings[0].covers:
        missed = cover_text(best.uniformity)
        return (
            f"No backend covers {part}. The best, {best.backend}: {missed}."
            if others
            else f"{best.backend} does not cover {part}: {missed}."
        )
    if not others:
        # Alone, no other was asked.
        return f"{'' if alone else 'Only '}{best.backend} covers {part}. {_thicknesses(order)}."
    leading = order[: equally_good(coverings)]
    who = f"{listed([row.backend for row in leading])} {'covers' if len(leading) == 1 else 'cover'} {part}"
    leader = min(coverings, key=lambda each: (not each.covers, each.fault))
    worse = [row for row, each in zip(order, coverings, strict=True) if not each.is_alike(leader)]
    if worse:
        holes = {row.backend: ", with holes" for row in worse if row.uniformity.gap > MOST_MISSED}
        more = listed([f"{row.backend} {_faulty(row)}{holes.get(row.backend, '')}" for row in worse])
        shares = f"{_faulty(best)} of the area is missed or covered twice ({more})"
        return f"{who} best: {shares}. {_thicknesses(order)}.{_enough(order)}"
    how = "equally well" if len(leading) == len(order) else "most evenly"
    return f"{who} {how}. {_thicknesses(order)}.{_enough(order)}"


def _faulty(row: PlannedRecord) -> str:
    return percent(row.uniformity.gap + row.uniformity.overlap, 1)


def _thicknesses(order: Sequence[PlannedRecord]) -> str:
    """Return how much the thickness of the layer varies with the first backend, and in brackets with the others."""
    varies = [THICKNESS.text(row.uniformity, digits=1) for row in order]
    others = [f"{row.backend} {text}" for row, text in zip(order[1:], varies[1:], strict=True)]
    return f"With constant flow, layer thickness varies by {varies[0]}{f' ({listed(others)})' if others else ''}"


def _enough(order: Sequence[PlannedRecord]) -> str:
    """Return that all of them suffice, where they do and differ."""
    coverings = [covering(row.uniformity) for row in order]
    even = all(each.cv <= EVEN_ENOUGH and each.covers for each in coverings)
    whole = all(row.paths.fragments < NOTABLE_FRAGMENTS for row in order)
    return " All are even enough to print." if even and whole and coverings[-1].cv != coverings[0].cv else ""


def _faults(order: Sequence[PlannedRecord]) -> list[str]:
    """Say what each backend leaves, covers twice and tears apart, where that is worth a word."""
    said: list[str] = []
    for row in order:
        gap, overlap, fragments = row.uniformity.gap, row.uniformity.overlap, row.paths.fragments
        faults = [
            *([f"misses {percent(gap, 1)} of the area ({GAP.meaning})"] if gap >= NOTABLE else []),
            *([f"covers {percent(overlap, 1)} twice"] if overlap >= NOTABLE else []),
            *(
                [f"starts {how_many(row.paths.runs, 'run')}, {fragments} of them shorter than five spacings"]
                if fragments >= NOTABLE_FRAGMENTS
                else []
            ),
        ]
        said += [f"{row.backend} {listed(faults)}."] if faults else []
    return said


def _printing(ranked: Sequence[PlannedRecord]) -> list[str]:
    if ranked[0].printable is None:
        return ["The robot was left out: nothing says whether it can print these."]
    taken = [f"{row.print_time_s:.0f} s with {row.backend}" for row in ranked if row.print_time_s is not None]
    said = [f"Printing takes {listed(taken)}."] if taken else []
    unprinted = [row for row in ranked if row.not_printable is not None]
    return said + [f"The robot cannot print {row.backend}: {row.not_printable}" for row in unprinted]


def _levels(ranked: Sequence[PlannedRecord]) -> list[str]:
    spacings = [row.spacing_mm for row in ranked]
    if len({row.paths.levels for row in ranked}) > 1:
        counted = listed([f"{row.paths.levels} with {row.backend}" for row in ranked])
        why = "because each backend measures its own distance"
        return [f"The number of levels differs ({counted}), {why}. Evenness is compared over the whole area."]
    if max(spacings) > 1.005 * min(spacings):
        wanted = listed([f"{row.spacing_mm:.3g} mm with {row.backend}" for row in ranked])
        return [f"Equal rounds give different spacings ({wanted}): each figure is relative to its own spacing."]
    return []
