"""How even a print is expected to be: the planned spacing, and what the errors of arm, placement and needle make of it.

Prints are sampled: each has its own errors, drawn from a fixed seed, and every span from a sample to its foot becomes
longer by what the errors at both ends do (`straying`). Two prints in a row stand on the same cell: the part lies as it
lay and the needle is as bent, but the arm strays anew. So two plans are compared by such pairs, a print of either.
"""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from geoprint.model import FloatArray, PoseStream, PrintErrors, freeze_arrays, frozen
from geoprint.quality.spacing import SpacingAt
from geoprint.quality.spans import Spans
from geoprint.quality.straying import OF_CELL, SOURCES, expected_variance, over, strays, together

# Prints: the ends of the interval that they tell hold between 94 and 96 % of all, at two standard deviations.
PRINTS = 2000
# Prints that are sampled at once.
BATCH = 250
# Samples beyond these tell no more of errors that are slower than the distance between them.
MOST_SAMPLES = 2000
# Percentiles between which 95 of 100 prints lie.
PERCENTILES = (2.5, 97.5)
# Standard deviations to either side that hold 95 of 100 normal numbers.
NORMAL_95 = 1.96
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
        cvs: (n,) that of each sampled print; two in a row stand on the same cell.
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


def printed(
    spans: Spans,
    errors: PrintErrors,
    *,
    spacing: float,
    poses: PoseStream | None = None,
    wanted: SpacingAt | None = None,
) -> Printed | None:
    """Return the spacing that prints are expected to have, or None where there is no spacing.

    Args:
        spans: from where to where the planned spacings were measured.
        errors: what a print strays by.
        spacing: wanted [mm].
        poses: how the tool stands; None where nobody knows, then a bent needle is left out.
        wanted: what the spacing shall be at each place, where that differs.
    """
    if not spans.count:
        return None
    ratios = spans.ratios
    step = -(-spans.count // MOST_SAMPLES)
    some = spans.some(np.arange(0, spans.count, step))
    local = np.full(some.count, spacing) if wanted is None else wanted(some.places)
    maps = over(strays(some, errors, poses=poses), local)
    everything = together(maps)
    cvs: list[FloatArray] = []
    for batch in range(PRINTS // BATCH):
        changes = everything @ _normal(batch, everything.shape[1])
        # What errors do is told by some of the samples; what the plan does, by all of them.
        variances = ratios.var() + (some.ratios[:, None] + changes).var(axis=0) - some.ratios.var()
        cvs.append(np.sqrt(np.maximum(variances, 0.0)) / (ratios.mean() + changes.mean(axis=0)))
    return Printed(
        planned=float(ratios.std() / ratios.mean()),
        cvs=np.concatenate(cvs),
        variances=(float(ratios.var()), *(expected_variance(one) for one in maps)),
    )


def interval(values: FloatArray) -> Interval:
    """Return the mean of prints, and what 95 of 100 of them lie between."""
    low, high = np.percentile(values, PERCENTILES).tolist()
    return Interval(float(values.mean()), low, high)


def difference(one: Printed, other: Printed) -> Interval:
    """Return by how much more the spacing of one plan varies than that of another, both printed on the same cell.

    With the arm's errors the same in both, too, plans whose paths are nearly the same would differ by nearly nothing in
    every print, and yet always by the same sign; nobody can print that.
    """
    return interval(one.cvs - other.cvs.reshape(-1, 2)[:, ::-1].ravel())


def alike(one: Printed, other: Printed) -> bool:
    """Return whether two plans cannot be told apart by printing each once: neither is more even in 95 of 100 pairs."""
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


def thickness_within(errors: PrintErrors) -> float:
    """Return within which share of the planned mean thickness that of 95 of 100 prints lies."""
    return NORMAL_95 * errors.flow


def _normal(batch: int, columns: int) -> NDArray[np.float64]:
    """Return standard normal numbers, a row for each column of a map and a column a print.

    Those of placement and needle, the last ones, are the same in every two prints.
    """
    rng = np.random.default_rng([SEED, batch])
    of_cell = np.repeat(rng.standard_normal((OF_CELL, BATCH // 2)), 2, axis=1)
    return np.concatenate([rng.standard_normal((columns - OF_CELL, BATCH)), of_cell])
