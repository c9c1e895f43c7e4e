"""What the paper does with its photographs: edges of each, and Hausdorff distances between them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from types import MappingProxyType
from typing import final

import numpy as np
from scipy import ndimage
from scipy.stats import beta

from benchmarks.paper.prints import (
    GOOD,
    Print,
    Printing,
    Studio,
    drawn_printing,
    fixed_printing,
    over_area,
    prints_of,
    thickness,
    unevenness,
)
from geoprint.errors import percent
from geoprint.inspection import SetDistances, apart, edges
from geoprint.model import BoolArray, FloatArray, comparable, frozen

# Table II of the paper [pixels].
PAPER: Mapping[tuple[str, str], float] = MappingProxyType(
    {("A", "B"): 62.2254, ("A", "C"): 72.8354, ("B", "C"): 47.3814}
)
PAPER_ORDER = tuple(sorted(PAPER, key=lambda pair: -PAPER[pair]))
# Edges of fewer pixels, over the outline of a drop as wide as the needle, are grain.
_WHOLE_OUTLINE = np.pi
# Pixels that touch at a corner belong together.
_ROUND = np.ones((3, 3), dtype=np.int64)


@final
@frozen
class Compared:
    """Three prints, analysed as in the paper.

    Attributes:
        prints: A, B and C.
        edges: (h, w) edge image of each.
        distances: of each pair of cases [pixels].
        thickness: mean of each layer over the patch, over the layer that was wanted.
        bare: share of the patch without material.
        unevenness: mean distance of the thickness from the wanted layer, over that.
    """

    prints: tuple[Print, ...]
    edges: tuple[BoolArray, ...]
    distances: Mapping[tuple[str, str], SetDistances]
    thickness: tuple[float, ...]
    bare: tuple[float, ...]
    unevenness: tuple[float, ...]

    @property
    def order(self) -> tuple[tuple[str, str], ...]:
        """Pairs of cases, the farthest apart first."""
        return tuple(sorted(self.distances, key=lambda pair: -self.distances[pair].hausdorff))

    @property
    def as_paper(self) -> bool:
        """Whether d(A, C) > d(A, B) > d(B, C), each by more than nothing."""
        sizes = [self.distances[pair].hausdorff for pair in PAPER_ORDER]
        return all(larger > smaller for larger, smaller in pairwise(sizes))

    @property
    def best(self) -> str:
        """The case whose layer is nearest to the wanted one."""
        return self.prints[int(np.argmin(self.unevenness))].case.name


def compared(studio: Studio, printing: Printing, *, seed: int) -> Compared:
    """Print, photograph and compare the three cases.

    Args:
        studio: what is planned, and the camera.
        printing: how it is laid and photographed.
        seed: of every noise.

    Raises:
        InputError: a photograph is of one colour.
    """
    prints = prints_of(studio, printing, seed=seed)
    width = printing.scale * prints[0].case.cell.tool.inner_diameter
    shown = tuple(edge_image(each.grey, width=width) for each in prints)
    named = {each.case.name: picture for each, picture in zip(prints, shown, strict=True)}
    angle = np.radians(printing.angle_deg)
    layers = [each.case.cell.process.layer_height for each in prints]
    deposited = [thickness(studio.patch, each.beads, angle=angle) for each in prints]
    return Compared(
        prints=prints,
        edges=shown,
        distances={(one, other): apart(_pixels(named[one]), _pixels(named[other])) for one, other in PAPER},
        thickness=tuple(over_area(studio.patch, each) / layer for each, layer in zip(deposited, layers, strict=True)),
        bare=tuple(over_area(studio.patch, (each == 0.0).astype(np.float64)) for each in deposited),
        unevenness=tuple(
            unevenness(studio.patch, each, layer=layer) for each, layer in zip(deposited, layers, strict=True)
        ),
    )


def edge_image(grey: FloatArray, *, width: float) -> BoolArray:
    """Return the edges of a photograph as in the paper: G(I) of the remapped picture, threshold, clean-up.

    Args:
        grey: (h, w).
        width: of the needle's inside in the picture [pixels], known before anything is printed and the same for all.

    Raises:
        InputError: the picture is of one colour.
    """
    found = edges(grey, width=width)
    labels, count = ndimage.label(found, structure=_ROUND)
    sizes = ndimage.sum_labels(found, labels, np.arange(count + 1))
    return np.asarray(found & (sizes >= _WHOLE_OUTLINE * width)[labels])


def _pixels(shown: BoolArray) -> FloatArray:
    """Return the (n, 2) pixels (u, v) of an edge image."""
    rows, columns = np.nonzero(shown)
    return np.column_stack([columns, rows]).astype(np.float64)


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
            f"{self.found} of {self.of}, {percent(self.found / self.of)} (95 % interval {percent(self.low)} to "
            f"{percent(self.high)})"
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
