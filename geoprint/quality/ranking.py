"""Which of several coverings of a part is best: coverage decides first, and thickness second."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile
from typing import NamedTuple

# A layer whose thickness varies by less than this is even enough: the flow from run to run varies it by half as much.
EVEN_ENOUGH = 0.04
# A thickness that varies by less than this more is as even: what is simulated is as uncertain.
SAME_THICKNESS = 0.002
# Coverings that miss or cover twice shares of the area that differ by less than this cover a part alike.
SAME_COVERAGE = 0.005
# Where more of the area than this is missed, or covered twice, that is no cover; seams where fronts meet make up to
# about as much.
MOST_MISSED = 0.02
MOST_TWICE = 0.05


class Covering(NamedTuple):
    """What paths make of a part.

    Attributes:
        gap: share of the area that is missed.
        overlap: share of it that is covered twice.
        cv: variation of the thickness that a constant flow leaves.
    """

    gap: float
    overlap: float
    cv: float

    @property
    def covers(self) -> bool:
        """Whether paths leave no holes and lay little twice."""
        return self.gap <= MOST_MISSED and self.overlap <= MOST_TWICE

    @property
    def fault(self) -> float:
        """Share of the area that is not covered once."""
        return self.gap + self.overlap

    def is_alike(self, other: Covering) -> bool:
        """Return whether both cover a part alike."""
        return abs(self.fault - other.fault) <= SAME_COVERAGE and self.covers == other.covers


def ranked(coverings: Sequence[Covering]) -> list[int]:
    """Return the indices of some coverings of one part, the best first.

    Those that cover it come before those that do not. Of those that cover it alike (uncovered and overlapped area
    together), the one with the most even thickness is the best.
    """
    order = sorted(range(len(coverings)), key=lambda index: (not coverings[index].covers, coverings[index].fault))
    alike = sum(coverings[index].is_alike(coverings[order[0]]) for index in order)
    return [*sorted(order[:alike], key=lambda index: coverings[index].cv), *order[alike:]]


def equally_good(ordered: Sequence[Covering]) -> int:
    """Return how many of some coverings, the best first, cannot be distinguished from the best one; that counts too."""
    best = ordered[0]
    same = takewhile(lambda each: each.is_alike(best) and 0.0 <= each.cv - best.cv < SAME_THICKNESS, ordered)
    return len(list(same))
