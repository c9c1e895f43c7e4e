"""The finished stack: the thickness of all layers together over the part, against what was wanted there."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.model import BoolArray, FloatArray, frozen

# A thickness this near to the wanted one, as a share of it, is within.
WITHIN = 0.05


@final
@frozen
class Finished:
    """The thickness of a stack on columns that stand for equal areas, over the one that was wanted.

    Attributes:
        ratios: (k,) thickness over the wanted one; NaN where it is not judged.
        mean: of these.
        cv: their standard deviation over the mean.
        p1: 1 of 100 is thinner.
        p99: 1 of 100 is thicker.
        within_5_percent: share that is so near to the wanted one.
        judged: share of the wanted area that these stand for.
        creased: share of it whose columns meet others before they are as high as wanted.
        under_sides: share of it whose columns leave the stack through a side before: they are judged up to there.
    """

    ratios: FloatArray
    mean: float
    cv: float
    p1: float
    p99: float
    within_5_percent: float
    judged: float
    creased: float
    under_sides: float

    def __post_init__(self) -> None:
        ratios = np.array(self.ratios, dtype=np.float64)
        ratios.setflags(write=False)
        object.__setattr__(self, "ratios", ratios)


def finished(
    laid: FloatArray, wanted: FloatArray, *, met: BoolArray, within: BoolArray, bottoms: FloatArray, height: float
) -> Finished | None:
    """Return how a stack comes out.

    Whole layers cannot fill a target that is lower than one of them: such places are not judged, and what a target
    leaves out is not wanted. Layers are cut upright where the sides pass their middles, so that a column which leaves
    through a side is wanted to have the whole layers below that, and nothing higher counts.

    Args:
        laid: (l, k) thickness of each layer on each column [mm].
        wanted: (k,) thickness that the stack shall have there [mm].
        met: (l, k) whether a column has met others below the top of each layer.
        within: (l, k) whether it is between the sides in the middle of each layer.
        bottoms: (l,) height at which each layer begins [mm].
        height: of a layer [mm].

    Returns:
        The figures, or None where nothing can be judged.
    """
    asked = wanted > 0.0
    standing = np.logical_and.accumulate(within, axis=0)
    leaving = np.where(standing.all(axis=0), np.inf, bottoms[standing.argmin(axis=0)])
    under_sides = leaving + WITHIN * height < wanted
    wanted = np.minimum(wanted, leaving)
    creased = (met & (bottoms[:, None] + WITHIN * height < wanted)).any(axis=0)
    judged = asked & ~creased & (wanted >= (1.0 - WITHIN) * height)
    if not judged.any():
        return None
    ratios = np.full(wanted.size, np.nan)
    ratios[judged] = np.where(standing, laid, 0.0)[:, judged].sum(axis=0) / wanted[judged]
    found = ratios[judged]
    p1, p99 = np.percentile(found, (1.0, 99.0)).tolist()
    return Finished(
        ratios=ratios,
        mean=float(found.mean()),
        cv=float(found.std() / found.mean()) if found.mean() > 0.0 else 0.0,
        p1=p1,
        p99=p99,
        within_5_percent=float((np.abs(found - 1.0) <= WITHIN).mean()),
        judged=float(judged.sum() / asked.sum()),
        creased=float((asked & creased).sum() / asked.sum()),
        under_sides=float((asked & under_sides & ~creased).sum() / asked.sum()),
    )
