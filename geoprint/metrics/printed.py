"""How even a print is expected to be: the planned thickness, and what errors of flow, arm, placement and needle add.

Prints are sampled: each has its own errors, drawn from a fixed seed. They change the layer linearly, with s
the standard deviation of its spread over the spacing (`thickness`):

- the strip of a sample changes by half of what the spans to its left and right do (`straying`). Rows that are off
  each by itself, with the variance f^2 over the spacing, have strips of the variance f^2 / 2 and a layer of
  f^2 / (4 sqrt(pi) s^3), since the spread takes in several rows; rows that are off together have no more than strips;
- the flow of a run reaches its neighbours: flow that differs by q^2 from row to row varies the layer by
  q^2 / (2 sqrt(pi) s);
- what comes nearer to the rim by d leaves the volume d less there: d^2 / (sqrt(pi) s) spacings of rim.

Two prints in a row stand on the same cell: the part lies as it lay, the needle is as bent and the arm as inaccurate,
but it strays anew.
So two plans are compared by such pairs, a print of either.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from geoprint.metrics.evenness import Uniformity
from geoprint.metrics.oracle import FOUND
from geoprint.metrics.sides import SideSpacing
from geoprint.metrics.spacing import (
    OF_CELL,
    SOURCES,
    SpacingAt,
    Sparse,
    expected_variance,
    joined_spans,
    over,
    strays,
    together,
)
from geoprint.metrics.thickness import SPREAD_SHARE
from geoprint.model import FloatArray, IntArray, PoseStream, PrintErrors, freeze_arrays, frozen

# Prints: the ends of the interval that they tell hold between 94 and 96 % of all, at two standard deviations.
PRINTS = 2000
# Prints that are sampled at once.
BATCH = 250
# Samples beyond these tell no more of errors that are slower than the distance between them.
MOST_SAMPLES = 2000
# Errors of which all are drawn; of more only those that some sample has, as thousands of short runs have too many.
MOST_DRAWN = 20_000
# Percentiles between which 95 of 100 prints lie.
PERCENTILES = (2.5, 97.5)
# Share of the variance of the flow from run to run that the spread leaves.
FLOW_SHARE = 1.0 / (2.0 * np.sqrt(np.pi) * SPREAD_SHARE)
# Variance of the thickness over that of strips, where each run strays by itself.
MOVED_SHARE = 1.0 / (2.0 * np.sqrt(np.pi) * SPREAD_SHARE**3)
# Squares of the thickness that is missing along the rim, over those of what the path is farther from it.
RIM_SHARE = 1.0 / (np.sqrt(np.pi) * SPREAD_SHARE)
# Errors that each run has for itself.
OF_RUNS = {"repeatability", "path_repeatability"}
# Standard deviations to either side that hold 95 of 100 normal numbers.
NORMAL_95 = 1.96
SEED = 120
# Decimals of mm to which runs are alike that only rounding tells apart.
DRAWN_ALIKE = 4


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
    """The thickness that prints of a plan are expected to have.

    Attributes:
        planned: coefficient of variation of the thickness of the plan.
        cvs: (n,) that of each sampled print; two in a row stand on the same cell.
        variances: of the thickness over its mean, what the plan, the flow from run to run and each of `SOURCES` add.
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
        """Share of the expected variance by what makes it: 'plan', 'run_flow' and the names of `SOURCES`."""
        total = sum(self.variances)
        return {
            name: value / total if total > 0.0 else 0.0
            for name, value in zip(("plan", "run_flow", *SOURCES), self.variances, strict=True)
        }

    @property
    def largest_error(self) -> str | None:
        """The error to fix first; None where there is none, or the plan itself makes most of the variance."""
        shares = self.shares
        largest = max(shares, key=shares.__getitem__)
        return None if largest == "plan" or shares[largest] == 0.0 else largest


def printed(
    planned: float,
    along: FloatArray,
    measured: Uniformity,
    errors: PrintErrors,
    *,
    poses: PoseStream | None = None,
    wanted: SpacingAt | None = None,
) -> Printed:
    """Return the thickness that prints are expected to have.

    Args:
        planned: coefficient of variation of the planned thickness, with the flow that is printed.
        along: (k,) that thickness at the samples of the sides, over the wanted one.
        measured: how even the paths are; what has no neighbour on a side lies along the rim there.
        errors: what a print strays by.
        poses: how the tool stands; None where nobody knows, then a bent needle is left out.
        wanted: what the spacing shall be at each place, where that differs.
    """
    sides = measured.sides
    strips, rims, of_strips, of_rims = _strays(measured, errors, poses=poses, wanted=wanted)
    some = _some(len(along))
    (flow,) = _drawn(errors.run_flow * _flow_of_neighbours(sides, some))
    widened, nearer = _drawn(together(of_strips), together(of_rims))
    # Spacings of rim to a spacing of path.
    rim = sides.rims[1].count / len(along)
    added: list[FloatArray] = []
    for batch in range(PRINTS // BATCH):
        drawn = _normal(batch, widened.shape[1])
        flows = np.random.default_rng([SEED, batch, 1]).standard_normal((flow.shape[1], BATCH))
        varied = _varied(along[some], flow @ flows)
        if strips.size:
            varied += _varied(along[strips], -(widened @ drawn))
        if rims.size:
            missing = nearer @ drawn
            thicker = (along[rims] - along.mean())[:, None]
            varied += rim * (RIM_SHARE * missing**2 - 2.0 * thicker * missing).mean(axis=0)
        added.append(varied)
    return Printed(
        planned=planned,
        cvs=np.sqrt(np.maximum(planned**2 + np.concatenate(added), 0.0)),
        variances=(
            planned**2,
            expected_variance(flow),
            *(
                expected_variance(strip) + RIM_SHARE * rim * float((of_rim.data**2).sum()) / max(of_rim.shape[0], 1)
                for strip, of_rim in zip(of_strips, of_rims, strict=True)
            ),
        ),
    )


def _drawn(*maps: Sparse) -> tuple[Sparse, ...]:
    """Return maps of the same errors, of very many without those that no sample has; the cell's, the last, stay."""
    count = maps[0].shape[1]
    if count <= MOST_DRAWN:
        return maps
    of_cell = np.arange(count - OF_CELL, count)
    had = np.unique(np.concatenate([of_cell, *(each.indices for each in maps)]))
    return tuple(csr_array(each[:, had]) for each in maps)


def _varied(along: FloatArray, changes: FloatArray) -> FloatArray:
    """Return by how much (k, n) changes raise the variance of (k,) thicknesses in each of n prints."""
    return (along[:, None] + changes).var(axis=0) - along.var()


def _strays(
    measured: Uniformity, errors: PrintErrors, *, poses: PoseStream | None, wanted: SpacingAt | None
) -> tuple[IntArray, IntArray, tuple[Sparse, ...], tuple[Sparse, ...]]:
    """Return some samples with two neighbours and some along the rim, and what each error does to them.

    That is by how much their strips, and their ways to the rim, become wider, over the wanted spacing.
    """
    sides = measured.sides
    strips, left, right = sides.strips
    rims, to_rim = sides.rims
    some, others = _some(strips.size), _some(rims.size)
    spans = joined_spans(joined_spans(left.some(some), right.some(some)), to_rim.some(others))
    spans = replace(spans, runs=_drawn_order(sides)[spans.runs])
    local, count = np.full(spans.count, measured.spacing) if wanted is None else wanted(spans.places), some.size
    of_strips: list[Sparse] = []
    of_rims: list[Sparse] = []
    for name, each in zip(SOURCES, over(strays(spans, errors, poses=poses), local), strict=True):
        share = 0.5 * (np.sqrt(MOVED_SHARE) if name in OF_RUNS else 1.0)
        of_strips.append(csr_array(share * (each[:count] + each[count : 2 * count])))
        of_rims.append(csr_array(each[2 * count :]))
    return strips[some], rims[others], tuple(of_strips), tuple(of_rims)


def _drawn_order(sides: SideSpacing) -> IntArray:
    """Return for each run the place in which its errors are drawn: by its length, and how far out it lies.

    In whatever order the runs are printed the same ones stray alike in the same print; only mirror images may change.
    """
    steps = np.append(np.linalg.norm(np.diff(sides.places, axis=0), axis=1), 0.0)
    steps[sides.offsets[1:] - 1] = 0.0
    counts = np.diff(sides.offsets)
    lengths = np.add.reduceat(steps, sides.offsets[:-1])
    middles = np.add.reduceat(sides.places, sides.offsets[:-1], axis=0) / counts[:, None]
    away = np.linalg.norm(middles - sides.places.mean(axis=0), axis=1)
    places = np.empty(counts.size, dtype=np.int64)
    places[np.lexsort((away.round(DRAWN_ALIKE), lengths.round(DRAWN_ALIKE)))] = np.arange(counts.size)
    return places


def _some(count: int) -> IntArray:
    """Return which of so many samples are taken."""
    return np.arange(0, count, max(-(-count // MOST_SAMPLES), 1))


def _flow_of_neighbours(sides: SideSpacing, some: IntArray) -> Sparse:
    """Return the map from the flow of each stretch to the thickness at some samples: its own, and less of neighbours.

    Both together have the share of the variance that the spread leaves; beyond the rim the layer is as before it.
    """
    own = np.repeat(np.arange(sides.offsets.size - 1), np.diff(sides.offsets))[some]
    beside = np.where(sides.kinds[some] == FOUND, sides.nearest[some], own[:, None])
    reach = (4.0 - np.sqrt(16.0 - 24.0 * (1.0 - FLOW_SHARE))) / 12.0
    weights = np.tile([1.0 - 2.0 * reach, reach, reach], (some.size, 1))
    rows = np.repeat(np.arange(some.size), 3)
    columns = _drawn_order(sides)[np.column_stack([own, beside]).ravel()]
    return csr_array((weights.ravel(), (rows, columns)), shape=(some.size, sides.offsets.size - 1))


def interval(values: FloatArray) -> Interval:
    """Return the mean of prints, and what 95 of 100 of them lie between."""
    low, high = np.percentile(values, PERCENTILES).tolist()
    return Interval(float(values.mean()), low, high)


def difference(one: Printed, other: Printed) -> Interval:
    """Return by how much more the thickness of one plan varies than that of another, both printed on the same cell.

    With the arm's errors the same in both, too, plans whose paths are nearly the same would differ by nearly nothing in
    every print, and yet always by the same sign; nobody can print that.
    """
    return interval(one.cvs - other.cvs.reshape(-1, 2)[:, ::-1].ravel())


def alike(one: Printed, other: Printed) -> bool:
    """Return whether printing two plans once cannot distinguish them: neither is more even in 95 of 100 pairs."""
    apart = difference(one, other)
    return apart.low <= 0.0 <= apart.high


def thickness_within(errors: PrintErrors) -> float:
    """Return within which share of the planned mean thickness that of 95 of 100 prints lies."""
    return NORMAL_95 * errors.flow


def standoff_within(errors: PrintErrors) -> float | None:
    """Return within what the arm keeps the stand-off at 95 of 100 places [mm]; None without its path accuracy."""
    if errors.path_accuracy == 0.0:
        return None
    return NORMAL_95 * math.hypot(errors.run_deviation, errors.path_deviation, errors.accuracy_deviation)


def _normal(batch: int, columns: int) -> NDArray[np.float64]:
    """Return standard normal numbers, a row for each column of a map and a column a print.

    Those of placement, needle and accuracy, the last ones, are the same in every two prints.
    """
    rng = np.random.default_rng([SEED, batch])
    of_cell = np.repeat(rng.standard_normal((OF_CELL, BATCH // 2)), 2, axis=1)
    return np.concatenate([rng.standard_normal((columns - OF_CELL, BATCH)), of_cell])
