"""What a comparison means, in plain words."""

from __future__ import annotations

from geoprint.results import Comparison, Planned

# Spacing that varies by less than this is even enough for any bead: its width varies by no more.
EVEN_ENOUGH = 0.02
# Backends whose variation differs by less than this are equally even.
SAME = 0.002
# Uncovered area below this share is not worth a word.
NOTABLE_GAP = 0.001


def verdict(comparison: Comparison) -> tuple[str, ...]:
    """Return sentences that say which backend covers the part more evenly, whether it matters, and what prints.

    The first one decides; the last ones name what is not comparable.
    """
    ranked = sorted(comparison.planned, key=lambda pair: pair[1].uniformity.cv)
    return (
        _evenness(comparison.job.surface.name, ranked, alone=not comparison.refused),
        *_gaps(ranked),
        *_printing(ranked),
        *_levels(ranked),
        *(f"{name} could not plan on this part: {reason}" for name, reason in comparison.refused),
    )


def _evenness(part: str, ranked: list[tuple[str, Planned]], *, alone: bool) -> str:
    name, best = ranked[0]
    spread = f"its spacing varies by {best.uniformity.cv:.1%} (standard deviation over mean)"
    if len(ranked) == 1:
        # Alone, no other was asked.
        return f"{'' if alone else 'Only '}{name} covers {part}; {spread}."
    others = _listed([f"that of {other} by {outcome.uniformity.cv:.1%}" for other, outcome in ranked[1:]])
    worst = ranked[-1][1].uniformity.cv
    if worst - best.uniformity.cv < SAME:
        names = _listed([other for other, _ in ranked])
        first = f"the spacing of {name} varies by {best.uniformity.cv:.1%} (standard deviation over mean)"
        return f"{names} cover {part} equally evenly: {first}, {others}."
    enough = " All of them are even enough to print." if worst <= EVEN_ENOUGH else ""
    return f"{name} covers {part} most evenly: {spread}, {others}.{enough}"


def _gaps(ranked: list[tuple[str, Planned]]) -> list[str]:
    return [
        f"{name} leaves {outcome.uniformity.uncovered:.1%} of the area farther than 0.55 spacings from every path."
        for name, outcome in ranked
        if outcome.uniformity.uncovered >= NOTABLE_GAP
    ]


def _printing(ranked: list[tuple[str, Planned]]) -> list[str]:
    if not ranked[0][1].plan.job.robot:
        return ["Whether the robot can print them was not asked."]
    times = {name: outcome.plan.robot.trajectory.duration for name, outcome in ranked if outcome.plan.robot is not None}
    taken = [f"{time:.0f} s with {name}" for name, time in times.items()]
    said = [f"Printing takes {_listed(taken)}."] if taken else []
    return said + [
        f"{name} cannot be printed: {outcome.not_printable}"
        for name, outcome in ranked
        if outcome.not_printable is not None
    ]


def _levels(ranked: list[tuple[str, Planned]]) -> list[str]:
    levels = {name: int(outcome.plan.toolpath.levels.max()) + 1 for name, outcome in ranked}
    spacings = {name: outcome.plan.contours.spacing for name, outcome in ranked}
    if len(set(levels.values())) > 1:
        counted = _listed([f"{count} with {name}" for name, count in levels.items()])
        why = "because each backend measures its own distance to the middle"
        return [f"The number of levels differs ({counted}), {why}; what is compared is evenness, not level by level."]
    if max(spacings.values()) > 1.005 * min(spacings.values()):
        wanted = _listed([f"{spacing:.3g} mm with {name}" for name, spacing in spacings.items()])
        return [f"Equal rounds mean different spacings ({wanted}): figures are ratios to each one's own."]
    return []


def _listed(phrases: list[str]) -> str:
    return phrases[0] if len(phrases) == 1 else f"{', '.join(phrases[:-1])} and {phrases[-1]}"
