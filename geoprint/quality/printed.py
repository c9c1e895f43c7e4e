"""How even a print is expected to be: the planned spacing, and what the errors of arm, placement and needle make of it.

Prints are sampled: each has its own errors, drawn from a fixed seed, and every way from a sample to its foot becomes
longer by what the errors at both ends do (`straying`). The same number of a print means the same errors wherever runs
are as many and as long, so that two plans are compared print by print.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from geoprint.model import FloatArray, IntArray, PoseStream, PrintErrors, freeze_arrays, frozen
from geoprint.quality.spans import Spans
from geoprint.quality.straying import SOURCES, expected_variance, node_counts, strays, together

# Prints: the ends of the interval that they tell hold between 94 and 96 % of all, at two standard deviations.
PRINTS = 2000
# Prints that are sampled at once.
BATCH = 250
# Samples beyond these tell no more of errors that are slower than the distance between them.
MOST_SAMPLES = 2000
# Percentiles between which 95 of 100 prints lie.
PERCENTILES = (2.5, 97.5)
SEED = 120


class Interval(NamedTuple):
    """A mean, and what 95 of 100 prints lie between.

    Attributes:
        mean: of all prints.
        low: lower end.
        high: upper end.
    """

    mean: float
    low: float
    high: float


@final
@frozen
class Printed:
    """The spacing that prints of a plan are expected to have.

    Attributes:
        planned: coefficient of variation of the plan.
        cvs: (n,) that of each sampled print.
        variances: mean variance of the ratios that the plan and each of `SOURCES` contribute, the plan first.
    """

    planned: float
    cvs: FloatArray
    variances: tuple[float, ...]

    def __post_init__(self) -> None:
        freeze_arrays(self, cvs="float: n")

    @property
    def cv(self) -> Interval:
        """The coefficient of variation in print."""
        return interval(self.cvs)

    @property
    def shares(self) -> dict[str, float]:
        """Share of the expected variance by what makes it: 'plan' and the names of `SOURCES`."""
        total = sum(self.variances)
        return {
            name: value / total if total > 0.0 else 0.0
            for name, value in zip(("plan", *SOURCES), self.variances, strict=True)
        }

    @property
    def largest_error(self) -> str | None:
        """The error to mend first; None where there is none, or the plan itself makes most of the variance."""
        shares = self.shares
        largest = max(shares, key=shares.__getitem__)
        return None if largest == "plan" or shares[largest] == 0.0 else largest


def printed(spans: Spans, errors: PrintErrors, *, spacing: float, poses: PoseStream | None = None) -> Printed | None:
    """Return the spacing that prints are expected to have, or None where there is no spacing.

    Args:
        spans: the ways whose lengths the planned spacings are.
        errors: what a print strays by.
        spacing: wanted [mm].
        poses: how the tool stands; None where nobody knows, then a bent needle is left out.
    """
    if not spans.count:
        return None
    ratios = spans.ratios
    step = -(-spans.count // MOST_SAMPLES)
    some = spans.some(np.arange(0, spans.count, step))
    maps = strays(some, errors, poses=poses)
    everything, nodes = together(maps), node_counts(some, errors)
    cvs: list[FloatArray] = []
    for batch in range(PRINTS // BATCH):
        changes = everything @ _normal(batch, nodes) / spacing
        # What errors do is told by some of the samples; what the plan does, by all of them.
        variances = ratios.var() + (some.ratios[:, None] + changes).var(axis=0) - some.ratios.var()
        cvs.append(np.sqrt(np.maximum(variances, 0.0)) / (ratios.mean() + changes.mean(axis=0)))
    return Printed(
        planned=float(ratios.std() / ratios.mean()),
        cvs=np.concatenate(cvs),
        variances=(float(ratios.var()), *(expected_variance(one) / spacing**2 for one in maps)),
    )


def interval(values: FloatArray) -> Interval:
    """Return the mean of prints, and what 95 of 100 of them lie between."""
    low, high = np.percentile(values, PERCENTILES).tolist()
    return Interval(float(values.mean()), low, high)


def difference(one: Printed, other: Printed) -> Interval:
    """Return by how much more the spacing of one plan varies than that of another, printed with the same errors."""
    return interval(one.cvs - other.cvs)


def alike(one: Printed, other: Printed) -> bool:
    """Return whether two plans cannot be told apart in print: neither is more even in 95 of 100 prints."""
    apart = difference(one, other)
    return apart.low <= 0.0 <= apart.high


def thickness_cv(planned: float, errors: PrintErrors, spacing: Printed | None) -> float:
    """Return how much the layer's thickness is expected to vary in print (coefficient of variation).

    The flow from run to run varies it as it is; the flow of the whole print does not, it moves the mean. A strip lies
    between two spacings, whose errors are opposite halves: a quarter of the variance of a spacing is one of its width.

    Args:
        planned: how much it varies without errors.
        errors: what a print strays by.
        spacing: in print, or None where there is none.
    """
    added = 0.0 if spacing is None else sum(spacing.variances[1:]) / 4.0
    return float(np.sqrt(planned**2 + errors.run_flow**2 + added))


def _normal(batch: int, nodes: IntArray) -> NDArray[np.float64]:
    """Return standard normal numbers, a column a print: for the runs, their nodes, the placement and the needle.

    Every run has numbers of its own, so that it has the same ones in another plan whose runs before it are longer.

    Args:
        batch: number of the batch of prints.
        nodes: (r,) nodes of each run.
    """
    shifts: list[FloatArray] = []
    along: list[FloatArray] = []
    for run, count in enumerate(nodes.tolist()):
        drawn = np.random.default_rng([SEED, batch, run + 1]).standard_normal((3 * (1 + count), BATCH))
        shifts.append(drawn[:3])
        along.append(drawn[3:])
    whole = np.random.default_rng([SEED, batch, 0]).standard_normal((8, BATCH))
    parts: Sequence[FloatArray] = (*shifts, *along, whole)
    return np.concatenate(parts)
