"""Histograms of what is measured over what is wanted, one above the other on one axis: HTML alone, so they print."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geoprint.model import FloatArray
from geoprint.report.markup import Markup, element

# The axis: ratios of the spacing to the wanted one. What lies beyond is counted in the outermost bins.
# A bin has its middle at 1, so that perfectly even paths fill one bin.
LOWEST, HIGHEST, BINS = 0.695, 1.305, 61
TICKS = (0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3)
# What counts as even enough, shaded.
EVEN = (0.95, 1.05)


def spacing_shares(ratios: FloatArray) -> FloatArray:
    """Return the (61,) share of the measured samples in each bin; both outer bins hold what lies beyond the axis.

    Args:
        ratios: (k,) spacing over the wanted one; NaN is not counted.

    Returns:
        Shares that sum to 1, or zeros where nothing was measured.

    Examples:
        >>> shares = spacing_shares(np.array([1.001, 1.002, 5.0, np.nan]))
        >>> shares[[30, 60]]
        array([0.66666667, 0.33333333])
    """
    measured = ratios[~np.isnan(ratios)]
    places = np.floor((measured - LOWEST) / (HIGHEST - LOWEST) * BINS).astype(np.int64)
    counts = np.bincount(np.clip(places, 0, BINS - 1), minlength=BINS)
    return counts / max(len(measured), 1)


def histograms(shown: Sequence[tuple[str, FloatArray]], *, of: str, axis: str) -> Markup:
    """Return one row a name, on one axis; each row has its own height, which is written beside it.

    Args:
        shown: name and ratios of each; NaN is not counted.
        of: what the ratios are of: path, or area.
        axis: what they are.
    """
    rows = [_row(name, ratios, of=of) for name, ratios in shown]
    ticks = [element("span", tick_text(value), class_="tick", style=f"left:{_percent(value)}%") for value in TICKS]
    scale = element("div", element("div", *ticks, class_="ticks"), class_="histogram-axis", aria_hidden="true")
    return element("div", *rows, scale, element("p", axis, class_="axis-label"), class_="histograms")


def _row(name: str, ratios: FloatArray, *, of: str) -> Markup:
    shares = spacing_shares(ratios)
    highest = float(shares.max()) or 1.0
    spread = _spread(ratios, of=of)
    bars = "".join(
        f"M{place} 100V{100 - 100 * share / highest:.2f}h1V100z" for place, share in enumerate(shares) if share
    )
    within = 100 * (EVEN[0] - LOWEST) / (HIGHEST - LOWEST)
    band = element(
        "div", class_="even", style=f"left:{within:.2f}%;width:{100 * (EVEN[1] - EVEN[0]) / (HIGHEST - LOWEST):.2f}%"
    )
    drawing = element(
        "svg", element("path", d=bars), viewBox=f"0 0 {BINS} 100", preserveAspectRatio="none", aria_hidden="true",
    )  # fmt: skip
    said = element("div", element("strong", name), element("span", spread, class_="spread"), class_="histogram-name")
    height = element("span", f"{highest:.0%}", class_="height", aria_hidden="true")
    plot = element(
        "div", band, drawing, height, class_="histogram-plot", role="img",
        aria_label=f"Histogram of {name}: {spread}; the fullest bin holds {highest:.0%} of the {of}.",
    )  # fmt: skip
    return element("div", said, plot, class_="histogram")


def _spread(ratios: FloatArray, *, of: str) -> str:
    measured = ratios[~np.isnan(ratios)]
    if not measured.size:
        return "nothing measured"
    low, high = np.percentile(measured, (5, 95))
    return f"90% of the {of} between {low:.3f} and {high:.3f}"


def _percent(value: float) -> str:
    return f"{100 * (value - LOWEST) / (HIGHEST - LOWEST):.2f}"


def tick_text(value: float) -> str:
    """Return what stands at a tick; the outermost ones say that they hold what lies beyond."""
    beyond = {TICKS[0]: "≤ ", TICKS[-1]: "≥ "}.get(value, "")
    return f"{beyond}{value:.1f}"
