"""How often the paper's order comes out, over what its prints may plausibly have been."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import final

import numpy as np
from scipy.stats import beta

from benchmarks.paper.comparing import Compared, compared
from benchmarks.paper.printing import Printing, drawn_printing, fixed_printing
from benchmarks.paper.prints import GOOD, Studio
from geoprint.model import comparable

# Of the intervals that are told.
CONFIDENCE = 0.95


@final
@comparable
class Draw:
    """One printing that was drawn, and what came of it.

    Attributes:
        part: that was printed on.
        printing: as drawn.
        order: pairs of cases, the farthest apart first, as in 'A-C > A-B > B-C'.
        as_paper: whether it is the paper's order, each distance by more than nothing larger than the next.
        best: the case whose layer is nearest to the wanted one.
    """

    part: str
    printing: Printing
    order: str
    as_paper: bool
    best: str


@final
@comparable
class Share:
    """A share that was counted.

    Attributes:
        found: how many.
        of: how many there were.
        low: lower end of its exact interval of 95 % (Clopper, Pearson: Biometrika 26, 1934).
        high: upper end.
    """

    found: int
    of: int
    low: float
    high: float

    @property
    def text(self) -> str:
        """The share as it is told."""
        return (
            f"{self.found} of {self.of}, {self.found / self.of:.0%} (95 % interval {self.low:.0%} to {self.high:.0%})"
        )


def draws(studios: Sequence[Studio], *, count: int, seed: int, scale: float | None = None) -> Iterator[Draw]:
    """Yield printings drawn from all that is plausible, and what came of each; parts take turns.

    The first ones are the same however many are asked for.

    Args:
        studios: one a part.
        count: how many.
        seed: of what is drawn, and of the noise.
        scale: pixels for each mm, where it is not to be that of the printing.

    Raises:
        InputError: a photograph is of one colour.
    """
    for number in range(count):
        printing = drawn_printing(np.random.default_rng([seed, number]))
        yield _draw(studios[number % len(studios)], printing, seed=_noise(seed, number), scale=scale)


def repeats(studios: Sequence[Studio], *, count: int, seed: int, scale: float | None = None) -> Iterator[Draw]:
    """Yield the printing that is fixed beforehand again and again, each with other noise; parts take turns.

    Args:
        studios: one a part.
        count: how many.
        seed: of the noise.
        scale: pixels for each mm, where it is not to be that of the printing.
    """
    for number in range(count):
        yield _draw(studios[number % len(studios)], fixed_printing(), seed=_noise(seed, number), scale=scale)


def order_text(found: Compared) -> str:
    """Return pairs of cases, the farthest apart first; those at the same distance are joined by '='."""
    pairs = found.order
    text = "-".join(pairs[0])
    for farther, nearer in pairwise(pairs):
        same = found.distances[farther].hausdorff == found.distances[nearer].hausdorff
        text += (" = " if same else " > ") + "-".join(nearer)
    return text


def share(hits: Sequence[bool]) -> Share:
    """Return the share of what is true, with its exact interval."""
    found = sum(hits)
    # The limits at which what was found, or less, and what was found, or more, has half of what 95 % leave.
    tail, missed = 0.5 * (1.0 - CONFIDENCE), len(hits) - found
    low = float(beta.ppf(tail, found, missed + 1)) if found else 0.0
    high = float(beta.ppf(1.0 - tail, found + 1, missed)) if missed else 1.0
    return Share(found, len(hits), low, high)


def shares(several: Sequence[Draw]) -> dict[str, Share]:
    """Return by what is asked of a draw the share of those in which it holds."""
    return {
        "d(A, C) > d(A, B) > d(B, C)": share([each.as_paper for each in several]),
        f"{GOOD} is best": share([each.best == GOOD for each in several]),
        "both": share([each.as_paper and each.best == GOOD for each in several]),
    }


def orders(several: Sequence[Draw]) -> list[tuple[str, int]]:
    """Return every order that came out and how often, the most frequent first."""
    return sorted(Counter(each.order for each in several).items(), key=lambda each: (-each[1], each[0]))


def _draw(studio: Studio, printing: Printing, *, seed: int, scale: float | None) -> Draw:
    printing = printing if scale is None else replace(printing, scale=scale)
    found = compared(studio, printing, seed=seed)
    return Draw(studio.name, printing, order_text(found), found.as_paper, found.best)


def _noise(seed: int, number: int) -> int:
    """Return a seed of noise that is another for each draw."""
    return int(np.random.default_rng([seed, number, 1]).integers(2**31))
