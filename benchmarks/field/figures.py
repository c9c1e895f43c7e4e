"""The figures of one planner on one part, and how they are kept: a CSV that anybody can add to."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import final

from benchmarks.parts.tables import row, rule
from geoprint.quality import PathMeasure

KEPT = Path(__file__).with_name("figures.csv")
DECIMALS = 5


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
        left_cv: variation of the spacing to the left.
        right_cv: the same to the right.
        p1: 1st percentile of the spacing of both sides, over the wanted one.
        p99: 99th percentile.
        gap: share of the area farther than 0.55 spacings from every path.
        overlap: share within 0.45 spacings of two stretches.
        hole_mm2: largest connected gap.
    """

    part: str
    planner: str
    ours: bool
    refused: str = ""
    runs: int = 0
    length_m: float = 0.0
    left_cv: float = 0.0
    right_cv: float = 0.0
    p1: float = 0.0
    p99: float = 0.0
    gap: float = 0.0
    overlap: float = 0.0
    hole_mm2: float = 0.0


def figures_of(measured: PathMeasure, *, part: str, planner: str, ours: bool) -> Figures:
    """Return the figures of paths that were measured."""
    sides = measured.sides
    both = sides.both
    return Figures(
        part, planner, ours, runs=measured.runs, length_m=measured.length / 1000.0, left_cv=sides.left.cv,
        right_cv=sides.right.cv, p1=both.percentile(1.0), p99=both.percentile(99.0), gap=measured.gap,
        overlap=measured.overlap, hole_mm2=measured.hole,
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
    yield row("part", "planner", "starts", "length", "left CV", "right CV", "p1 - p99", "gap", "overlap", "hole")
    yield rule(10)
    for each in found:
        yield line(each)


def line(found: Figures) -> str:
    """Return a planner's row on a part."""
    if found.refused:
        return row(found.part, found.planner, f"refused: {found.refused.replace('|', '/')[:90]}", *[""] * 7)
    return row(
        found.part, found.planner, str(found.runs), f"{found.length_m:.2f} m", f"{found.left_cv:.2%}",
        f"{found.right_cv:.2%}", f"{found.p1:.3f} - {found.p99:.3f}", f"{found.gap:.2%}", f"{found.overlap:.2%}",
        f"{found.hole_mm2:.2f} mm2",
    )  # fmt: skip
