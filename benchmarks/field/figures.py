"""The figures of one planner on one part, and how they are kept: a CSV that anybody can add to."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from statistics import median
from typing import final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

from benchmarks.parts.tables import row, rule
from geoprint.errors import percent
from geoprint.metrics import Uniformity
from geoprint.reporting.metrics import COVERED_ONCE, FOLLOWING, GAP, HOLE, OVERLAP, SPACING, THICKNESS, WITHIN_10

KEPT = Path(__file__).with_name("figures.csv")
DECIMALS = 5
# What the columns show behind starts and length.
METRICS = (THICKNESS, FOLLOWING, WITHIN_10, COVERED_ONCE, GAP, OVERLAP, HOLE, SPACING)


@final
@dataclass(frozen=True, slots=True)
class Figures:
    """What one planner's paths are like on one part.

    Attributes:
        part: its name.
        planner: its name.
        ours: whether the planner is geoprint's own.
        refused: why there are no paths, or an empty string; the figures are zero then.
        runs: starts of the bead.
        length_m: of the paths.
        thickness_cv: variation of the thickness that a constant flow leaves.
        following_cv: the same with a flow that follows the width.
        within_10: share of the area whose thickness is within 10 % of the wanted one, with a constant flow.
        covered_once: share of the area that is neither missed nor covered twice.
        gap: share of the area farther than 0.55 spacings from every path.
        overlap: share within 0.45 spacings of two stretches.
        hole_mm2: largest connected gap.
        spacing_cv: variation of the spacing to both sides.
    """

    part: str
    planner: str
    ours: bool
    refused: str = ""
    runs: int = 0
    length_m: float = 0.0
    thickness_cv: float = 0.0
    following_cv: float = 0.0
    within_10: float = 0.0
    covered_once: float = 0.0
    gap: float = 0.0
    overlap: float = 0.0
    hole_mm2: float = 0.0
    spacing_cv: float = 0.0


def figures_of(measured: Uniformity, *, part: str, planner: str, ours: bool) -> Figures:
    """Return the figures of paths that were measured."""
    return Figures(
        part, planner, ours, runs=measured.run_count, length_m=measured.length / 1000.0,
        thickness_cv=measured.thickness.cv, following_cv=measured.followed.cv,
        within_10=measured.thickness.within_10_percent, covered_once=measured.covered_once, gap=measured.gap,
        overlap=measured.overlap, hole_mm2=measured.hole, spacing_cv=measured.sides.both.cv,
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
                part=kept["part"], planner=kept["planner"], ours=kept["ours"] == "True", refused=kept["refused"],
                runs=int(kept["runs"]), **{name: float(kept[name]) for name in _MEASURED},
            )
            for kept in csv.DictReader(file)
        ]  # fmt: skip


_MEASURED: Sequence[str] = [each.name for each in fields(Figures) if each.type == "float"]


def table(found: Iterable[Figures]) -> Iterator[str]:
    """Yield a Markdown table."""
    yield row("part", "planner", "starts", "length", *(metric.column for metric in METRICS))
    yield rule(4 + len(METRICS))
    for each in found:
        yield line(each)


def line(found: Figures) -> str:
    """Return a planner's row on a part."""
    if found.refused:
        return row(
            found.part, found.planner, f"refused: {found.refused.replace('|', '/')[:90]}", *[""] * (1 + len(METRICS))
        )
    return row(
        found.part, found.planner, str(found.runs), f"{found.length_m:.2f} m", percent(found.thickness_cv, 2),
        percent(found.following_cv, 2), percent(found.within_10, 2), percent(found.covered_once, 2),
        percent(found.gap, 2), percent(found.overlap, 2), f"{found.hole_mm2:.2f}", percent(found.spacing_cv, 2),
    )  # fmt: skip


# Of Okabe and Ito, safe for colour-blind readers.
OURS, OTHERS = "#0072B2", "#D55E00"
TICKS = (0.02, 0.1, 0.5, 2.0, 10.0, 50.0)
LABELS = (
    "layer thickness, variation (CV), %", "the same with a flow that follows, %", "area missed + covered twice, %"
)  # fmt: skip
# What is less than this is drawn here [%].
LEAST = 0.02
ROW_INCHES = 0.3
DOTS_PER_INCH = 110


def field_picture(found: Sequence[Figures]) -> bytes:
    """Return a PNG, the same bytes for the same figures; planners from the most even down."""
    planned = [each for each in found if not each.refused]
    by_planner = {name: [each for each in planned if each.planner == name] for name in {e.planner for e in planned}}
    order = sorted(by_planner, key=lambda name: (median(_values(by_planner[name])[0]), name))
    figure = Figure(figsize=(11.0, ROW_INCHES * len(order) + 1.2), dpi=DOTS_PER_INCH, layout="constrained")
    panels: Sequence[Axes] = figure.subplots(1, 3, sharey=True)
    for at, name in enumerate(order):
        colour = OURS if by_planner[name][0].ours else OTHERS
        for axis, values in zip(panels, _values(by_planner[name]), strict=True):
            axis.plot(values, [at] * len(values), "o", color=colour, alpha=0.45, markersize=5, markeredgewidth=0)
            axis.plot([median(values)], [at], "|", color=colour, markersize=15, markeredgewidth=2.5)
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
    parts, served = len({each.part for each in found}), [len(by_planner[name]) for name in order]
    panels[0].set_yticks(
        range(len(order)),
        [f"{name}{'' if n == parts else f' ({n} of {parts} parts)'}" for name, n in zip(order, served, strict=True)],
    )
    panels[0].set_ylim(len(order) - 0.4, -0.6)
    figure.suptitle("geoprint (blue) and others (orange): a dot a part, a bar the median", fontsize=10)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _values(found: Sequence[Figures]) -> tuple[list[float], list[float], list[float]]:
    """Return variation of the thickness with a constant flow and with one that follows, and the area not once [%]."""
    shares = [(each.thickness_cv, each.following_cv, each.gap + each.overlap) for each in found]
    even, following, area = ([max(100.0 * share, LEAST) for share in column] for column in zip(*shares, strict=True))
    return even, following, area
