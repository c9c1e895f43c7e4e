"""Histograms of what is measured over what is wanted, one above the other on one axis: HTML alone, so they print."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from geoprint.errors import percent
from geoprint.model import FloatArray
from geoprint.reporting.html import Markup, element

# The narrowest axis: ratios of the spacing to the wanted one, 61 bins of which one has its middle at 1, so that
# perfectly even paths fill one bin. What lies beyond is counted in the outermost bins.
HALF_WIDTH, TICK_STEP, BINS = 0.305, 0.1, 61
# An axis or a colour scale is wide enough for this share of what is measured ...
COVERED_SHARE = 0.99
# ... but at most so many times as wide as the narrowest one: a ratio of 0 is the end.
MOST_TIMES = 3
# What counts as even enough, shaded.
EVEN = (0.95, 1.05)


class RatioAxis(NamedTuple):
    """Ends of an axis of ratios about 1, and where its ticks stand."""

    low: float
    high: float
    ticks: tuple[float, ...]


def times_wider(shown: Iterable[FloatArray], *, half: float, most: int) -> int:
    """Return how many times as wide as from 1 - half to 1 + half a range is that covers what was measured.

    Args:
        shown: ratios on the same range; NaN is not counted.
        half: half the narrowest range.
        most: largest answer.
    """
    reaches = [
        float(np.quantile(np.abs(ratios[np.isfinite(ratios)] - 1.0), COVERED_SHARE))
        for ratios in shown
        if np.isfinite(ratios).any()
    ]
    return int(np.clip(np.ceil(max(reaches, default=0.0) / half), 1, most))


def ratio_axis(shown: Iterable[FloatArray]) -> RatioAxis:
    """Return the axis on which histograms of some ratios are drawn."""
    times = times_wider(shown, half=HALF_WIDTH, most=MOST_TIMES)
    ticks = tuple(round(1.0 + TICK_STEP * times * step, 3) for step in range(-3, 4))
    return RatioAxis(1.0 - HALF_WIDTH * times, 1.0 + HALF_WIDTH * times, ticks)


def spacing_shares(ratios: FloatArray, axis: RatioAxis | None = None) -> FloatArray:
    """Return the (61,) share of the measured samples in each bin; both outer bins hold what lies beyond the axis.

    Args:
        ratios: (k,) spacing over the wanted one; NaN is not counted.
        axis: with these bins; None for that of the ratios alone.

    Returns:
        Shares that sum to 1, or zeros where nothing was measured.

    Examples:
        >>> shares = spacing_shares(np.array([1.001, 1.002, 5.0, np.nan]), ratio_axis([]))
        >>> shares[[30, 60]]
        array([0.66666667, 0.33333333])
    """
    measured = ratios[~np.isnan(ratios)]
    low, high, _ = axis or ratio_axis([ratios])
    places = np.floor((measured - low) / (high - low) * BINS).astype(np.int64)
    counts = np.bincount(np.clip(places, 0, BINS - 1), minlength=BINS)
    return counts / max(len(measured), 1)


def histograms(shown: Sequence[tuple[str, FloatArray]], *, of: str, axis: str) -> Markup:
    """Return one row a name, on one axis; each row has its own height, which is written beside it.

    Args:
        shown: name and ratios of each; NaN is not counted.
        of: what the ratios are of: path, or area.
        axis: what they are.
    """
    range_of = ratio_axis([ratios for _, ratios in shown])
    rows = [_row(name, ratios, range_of, of=of) for name, ratios in shown]
    ticks = [
        element("span", text, class_="tick", style=f"left:{_percent(value, range_of)}%")
        for value, text in zip(range_of.ticks, tick_texts(range_of), strict=True)
    ]
    scale = element("div", element("div", *ticks, class_="ticks"), class_="histogram-axis", aria_hidden="true")
    return element("div", *rows, scale, element("p", axis, class_="axis-label"), class_="histograms")


def _row(name: str, ratios: FloatArray, axis: RatioAxis, *, of: str) -> Markup:
    shares = spacing_shares(ratios, axis)
    highest = float(shares.max()) or 1.0
    spread = _spread(ratios, of=of)
    bars = "".join(
        f"M{place} 100V{100 - 100 * share / highest:.2f}h1V100z" for place, share in enumerate(shares) if share
    )
    width = 100 * (EVEN[1] - EVEN[0]) / (axis.high - axis.low)
    band = element("div", class_="even", style=f"left:{_percent(EVEN[0], axis)}%;width:{width:.2f}%")
    drawing = element(
        "svg", element("path", d=bars), viewBox=f"0 0 {BINS} 100", preserveAspectRatio="none", aria_hidden="true",
    )  # fmt: skip
    said = element("div", element("strong", name), element("span", spread, class_="spread"), class_="histogram-name")
    height = element("span", percent(highest), class_="height", aria_hidden="true")
    plot = element(
        "div", band, drawing, height, class_="histogram-plot", role="img",
        aria_label=f"Histogram of {name}: {spread}; the largest bin holds {percent(highest)} of the {of}.",
    )  # fmt: skip
    return element("div", said, plot, class_="histogram")


def _spread(ratios: FloatArray, *, of: str) -> str:
    measured = ratios[~np.isnan(ratios)]
    if not measured.size:
        return "nothing measured"
    least, low, high, most = np.percentile(measured, (0, 5, 95, 100))
    return f"90 % of the {of} between {low:.3f} and {high:.3f}, all between {least:.3f} and {most:.3f}"


def _percent(value: float, axis: RatioAxis) -> str:
    return f"{100 * (value - axis.low) / (axis.high - axis.low):.2f}"


def tick_texts(axis: RatioAxis) -> tuple[str, ...]:
    """Return what stands at each tick; the outermost ones say that they hold what lies beyond."""
    texts = [f"{value:.1f}" for value in axis.ticks]
    return (f"≤ {texts[0]}", *texts[1:-1], f"≥ {texts[-1]}")
