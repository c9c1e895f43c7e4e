"""The figures of one planner on one part, and how they are kept: a CSV that anybody can add to."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Final, final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator
from scipy.stats import binom, norm

from benchmarks.parts.tables import row, rule
from geoprint.errors import percent
from geoprint.reporting.records.comparison import MeasurementRecord

KEPT = Path(__file__).with_name("figures.csv")
DECIMALS = 4
# Share of the intervals of medians.
CONFIDENCE: Final = 0.95


@final
@dataclass(frozen=True, slots=True)
class Figures:
    """What one planner's paths are like on one part.

    Attributes:
        part: its name.
        family: of the part.
        planner: its name.
        ours: whether the planner is geoprint's own.
        status: as of a cell of a study: 'done', 'refused', 'failed' or 'missing'.
        reason: why there are no figures; they are zero then.
        runs: starts of the bead.
        length_m: of the paths.
        thickness_cv: variation of the thickness that a constant flow leaves.
        following_cv: the same with a flow that follows the width.
        gap: share of the area farther than 0.55 spacings from every path.
        overlap: share within 0.45 spacings of two stretches.
        hole_mm2: largest connected gap.
    """

    part: str
    family: str
    planner: str
    ours: bool
    status: str = "done"
    reason: str = ""
    runs: int = 0
    length_m: float = 0.0
    thickness_cv: float = 0.0
    following_cv: float = 0.0
    gap: float = 0.0
    overlap: float = 0.0
    hole_mm2: float = 0.0

    @property
    def done(self) -> bool:
        """Whether there are figures."""
        return self.status == "done"

    @property
    def not_once(self) -> float:
        """Share of the area that is missed or covered twice."""
        return self.gap + self.overlap


def figures_of(measured: MeasurementRecord, asked: Figures) -> Figures:
    """Return the figures of a planner on a part, of which names and status are known."""
    (file,) = measured.files
    even = file.uniformity
    return replace(
        asked, runs=file.runs, length_m=file.length_mm / 1000.0, thickness_cv=even.thickness.cv,
        following_cv=even.following.cv, gap=even.gap, overlap=even.overlap, hole_mm2=even.largest_hole_mm2,
    )  # fmt: skip


def save(found: Iterable[Figures], path: Path) -> None:
    """Write a CSV with a row for each planner on each part."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [each.name for each in fields(Figures)], lineterminator="\n")
        writer.writeheader()
        for figures in found:
            values = asdict(figures)
            writer.writerow(
                {key: round(value, DECIMALS) if isinstance(value, float) else value for key, value in values.items()}
            )


def loaded(path: Path = KEPT) -> list[Figures]:
    """Return what such a CSV holds."""
    with path.open(encoding="utf-8", newline="") as file:
        return [
            Figures(
                part=kept["part"], family=kept["family"], planner=kept["planner"], ours=kept["ours"] == "True",
                status=kept["status"], reason=kept["reason"], runs=int(kept["runs"]),
                **{name: float(kept[name]) for name in _MEASURED},
            )
            for kept in csv.DictReader(file)
        ]  # fmt: skip


_MEASURED: Sequence[str] = [each.name for each in fields(Figures) if each.type == "float"]


def by_planner(found: Iterable[Figures]) -> dict[str, list[Figures]]:
    """Return the figures of each planner, in the order of their first."""
    grouped: dict[str, list[Figures]] = {}
    for each in found:
        grouped.setdefault(each.planner, []).append(each)
    return grouped


def median_interval(values: Sequence[float]) -> tuple[float, float, float]:
    """Return the lower end of the 95 % interval of a median, the median, and the upper end.

    The ends are values whose ranks follow from the binomial distribution, whatever the values are distributed like. A
    value may be infinite, as where a planner refused: the median is, too, where it refused half. Fewer than six values
    do not bound it.
    """
    order = sorted(values)
    count = len(order)
    middle = float(order[(count - 1) // 2] + order[count // 2]) / 2.0
    rank = int(binom.ppf((1.0 - CONFIDENCE) / 2.0, count, 0.5))
    return (order[rank - 1], middle, order[count - rank]) if rank else (-np.inf, middle, np.inf)


def share_interval(hits: int, count: int) -> tuple[float, float]:
    """Return the ends of Wilson's 95 % interval of a share."""
    z = float(norm.ppf(0.5 + CONFIDENCE / 2.0))
    middle, half = hits + z * z / 2.0, z * np.sqrt(hits * (count - hits) / count + z * z / 4.0)
    return float(middle - half) / (count + z * z), float(middle + half) / (count + z * z)


HEADS = (
    "planner", "parts", "refused", "failed", "thickness CV", "with a flow that follows", "missed or twice",
    "more even than the first",
)  # fmt: skip


# What the columns between show of a planner on a part.
VALUES: Sequence[Callable[[Figures], float]] = (
    lambda each: each.thickness_cv,
    lambda each: each.following_cv,
    lambda each: each.not_once,
)


def standings(found: Sequence[Figures]) -> Iterator[list[str]]:
    """Yield a row for each planner: medians with their intervals over all parts, on which a refusal is the worst.

    The last column is on how many parts of those that either planned it is more even than the first planner.
    """
    grouped = by_planner(found)
    first = {each.part: each for each in found if each.planner == found[0].planner}
    for name, some in grouped.items():
        counts = Counter(each.status for each in some)
        cells = [name, str(counts["done"]), str(counts["refused"]), str(counts["failed"])]
        cells += [_median_text(_figures(some, value)) for value in VALUES]
        pairs = [(each, first[each.part]) for each in some if each.part in first]
        judged = [(one, other) for one, other in pairs if one is not other and (one.done or other.done)]
        better = sum(one.done and (not other.done or one.thickness_cv < other.thickness_cv) for one, other in judged)
        low, high = share_interval(better, len(judged)) if judged else (0.0, 0.0)
        yield [*cells, f"{percent(better / len(judged), 0)} ({100 * low:.0f}-{100 * high:.0f})" if judged else ""]


def _median_text(values: Sequence[float]) -> str:
    low, middle, high = median_interval(values)
    if not np.isfinite(middle):
        return "refused half"
    if not np.isfinite(low):
        return percent(middle, 2)
    upper = f"{100 * high:.2f}" if np.isfinite(high) else "refused"
    return f"{percent(middle, 2)} ({100 * low:.2f}-{upper})"


def table(found: Sequence[Figures]) -> Iterator[str]:
    """Yield the standings as a Markdown table."""
    yield row(*HEADS)
    yield rule(len(HEADS))
    for cells in standings(found):
        yield row(*cells)


# Of Okabe and Ito, safe for colour-blind readers.
OURS, OTHERS = "#0072B2", "#D55E00"
TICKS = (0.02, 0.1, 0.5, 2.0, 10.0, 50.0)
LABELS = (
    "layer thickness, variation (CV), %", "the same with a flow that follows, %", "area missed + covered twice, %"
)  # fmt: skip
# What is less or more than this is drawn there [%].
LEAST, MOST = 0.02, 100.0
# Of a row, over which its dots are spread, and by how much of it from one to the next.
HEIGHT, GOLDEN = 0.5, 0.618
ROW_INCHES = 0.38
DOTS_PER_INCH = 110


def field_picture(found: Sequence[Figures]) -> bytes:
    """Return a PNG, the same bytes for the same figures; planners from the most even down."""
    grouped = by_planner(found)
    order = sorted(grouped, key=lambda name: (median_interval(_figures(grouped[name], VALUES[0]))[1], name))
    figure = Figure(figsize=(11.0, ROW_INCHES * len(order) + 1.2), dpi=DOTS_PER_INCH, layout="constrained")
    panels: Sequence[Axes] = figure.subplots(1, 3, sharey=True)
    for at, name in enumerate(order):
        colour = OURS if grouped[name][0].ours else OTHERS
        for axis, value in zip(panels, VALUES, strict=True):
            shares = np.array(_figures(grouped[name], value))
            # Dots of one row are spread over its height, evenly and always alike.
            heights = at + HEIGHT * (np.arange(shares.size) * GOLDEN % 1.0 - 0.5)
            shown = np.maximum(100.0 * shares[np.isfinite(shares)], LEAST)
            axis.plot(
                shown, heights[np.isfinite(shares)], "o", color=colour, alpha=0.4, markersize=3.0, markeredgewidth=0
            )
            low, middle, high = np.clip(100.0 * np.array(median_interval(shares.tolist())), LEAST, MOST)
            axis.plot([low, high], [at, at], "-", color="#202020", linewidth=4.0, solid_capstyle="butt")
            axis.plot([middle], [at], "|", color="#202020", markersize=15, markeredgewidth=2.0)
    for axis, label in zip(panels, LABELS, strict=True):
        axis.set_xscale("log")
        axis.xaxis.set_major_locator(FixedLocator(TICKS))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.xaxis.set_major_formatter(FixedFormatter([f"{tick:g}" for tick in TICKS]))
        axis.grid(axis="x", color="#e8e8e8", linewidth=0.7)
        axis.set_axisbelow(True)
        axis.set_xlabel(label, fontsize=10)
        axis.tick_params(axis="both", labelsize=9)
        axis.tick_params(axis="y", length=0)
        for side in ("top", "right", "left"):
            axis.spines[side].set_visible(False)
    served = [sum(each.done for each in grouped[name]) for name in order]
    panels[0].set_yticks(
        range(len(order)),
        [
            name if n == len(grouped[name]) else f"{name} ({n} of {len(grouped[name])} parts)"
            for name, n in zip(order, served, strict=True)
        ],
    )
    panels[0].set_ylim(len(order) - 0.4, -0.6)
    figure.suptitle(
        "geoprint (blue) and others (orange): a dot a part, a bar the median and its 95 % interval", fontsize=10
    )
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _figures(found: Sequence[Figures], value: Callable[[Figures], float]) -> list[float]:
    """Return one figure of each part, infinite where there is none."""
    return [value(each) if each.done else np.inf for each in found]
