"""The cost of the same work by geoprint and by a peer, kept in a CSV of which the guide's picture is made."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator, StrMethodFormatter

KEPT = Path(__file__).with_name("figures.csv")


@final
@dataclass(frozen=True, slots=True)
class Pair:
    """Work of one size by geoprint and by a peer.

    Attributes:
        work: its name.
        library: of the peer.
        size: of the work: faces, poses, or pixels across.
        own: clock of geoprint [s].
        other: clock of the peer [s].
        own_memory: what geoprint took above the work's input [MB].
        other_memory: what the peer took [MB].
    """

    work: str
    library: str
    size: int
    own: float
    other: float
    own_memory: float
    other_memory: float


def save(found: Iterable[Pair], path: Path = KEPT) -> None:
    """Write a CSV with a row for each pair."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [each.name for each in fields(Pair)], lineterminator="\n")
        writer.writeheader()
        for pair in found:
            values = asdict(pair)
            writer.writerow({key: f"{v:.4g}" if isinstance(v, float) else v for key, v in values.items()})


def loaded(path: Path = KEPT) -> list[Pair]:
    """Return what such a CSV holds."""
    with path.open(encoding="utf-8", newline="") as file:
        return [
            Pair(
                kept["work"], kept["library"], int(kept["size"]), float(kept["own"]), float(kept["other"]),
                float(kept["own_memory"]), float(kept["other_memory"]),
            )
            for kept in csv.DictReader(file)
        ]  # fmt: skip


# What a work's name begins with, what is above its panel, and what its sizes count.
PANELS = (
    ("distance", "geodesic distance", "faces"),
    ("levels", "distance and 20 levels of an image", "pixels across"),
    ("speeds", "speeds along a path", "poses"),
)
# What is imported under another name than people know it by.
PEERS = {"igl": "libigl", "scipy + contourpy": "scipy and contourpy"}
# Of Okabe and Ito, safe for colour-blind readers; shapes tell the lines apart in grey.
OURS = (("#0072B2", "o-"), ("#009E73", "s-"))
OTHERS = (("#D55E00", "^--"), ("#E69F00", "v--"))
DOTS_PER_INCH = 130


def speed_picture(found: Sequence[Pair]) -> bytes:
    """Return a PNG, the same bytes for the same figures."""
    figure = Figure(figsize=(11.0, 3.4), dpi=DOTS_PER_INCH, layout="constrained")
    axes: Sequence[Axes] = figure.subplots(1, len(PANELS))
    for axis, (word, title, counted) in zip(axes, PANELS, strict=True):
        pairs = [pair for pair in found if pair.work.startswith(word)]
        ours = _lines((_name(pair), pair.size, pair.own) for pair in pairs)
        others = _lines((PEERS.get(pair.library, pair.library), pair.size, pair.other) for pair in pairs)
        for lines, styles in ((ours, OURS), (others, OTHERS)):
            for (name, seconds), (colour, style) in zip(lines.items(), styles, strict=False):
                axis.plot(
                    list(seconds), list(seconds.values()), style, color=colour, markersize=5, linewidth=1.4, label=name
                )
        axis.set(xscale="log", yscale="log")
        sizes = sorted({pair.size for pair in pairs})
        axis.xaxis.set_major_locator(FixedLocator(sizes))
        axis.xaxis.set_major_formatter(FixedFormatter([f"{size:,}".replace(",", " ") for size in sizes]))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_title(title, fontsize=10)
        axis.set_xlabel(counted, fontsize=9)
        axis.tick_params(labelsize=8)
        axis.grid(color="#e8e8e8", linewidth=0.7)
        axis.set_axisbelow(True)
        axis.legend(fontsize=8, frameon=False)
        for side in ("top", "right"):
            axis.spines[side].set_visible(False)
    axes[0].set_ylabel("seconds", fontsize=9)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _name(pair: Pair) -> str:
    """Return what geoprint's line is called: with the backend, where the work names one."""
    return ", ".join(["geoprint", *pair.work.split(", ")[1:]])


def _lines(points: Iterable[tuple[str, int, float]]) -> dict[str, dict[int, float]]:
    """Return the seconds of each size, line by line; the least where a size stands twice."""
    lines: dict[str, dict[int, float]] = {}
    for name, size, seconds in points:
        line = lines.setdefault(name, {})
        line[size] = min(seconds, line.get(size, seconds))
    return lines
