"""The table and the page of a study: a row for each cell, how plans are distributed, and why cells have none."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from geoprint.errors import how_many
from geoprint.geometry.files import write_whole
from geoprint.reporting.figures import png_bytes
from geoprint.reporting.html import Markup, element, figure, joined, row_table
from geoprint.reporting.metrics import CATALOGUE, COVERED_ONCE, GAP, OVERLAP, THICKNESS, Metric
from geoprint.reporting.page import page
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.values import Picture
from geoprint.sweep.running import CELLS, Outcome

PAGE: Final = "study.html"
# Worst cells and reasons that are listed.
MOST_WORST, MOST_REASONS = 10, 20
METRICS: Final = (THICKNESS, COVERED_ONCE, GAP, OVERLAP)
TABLE: Final = "study.csv"
_ASKED: Final = ("cell", "part", "site", "setting", "backend", "pattern", "robot_cell", "status", "reason")
_FOUND: Final = (
    "faces", "area_mm2", "spacing_mm", "runs", "deposit_mm", "speed_mm_s", "time_s", "clearance_mm", "deposited_share",
)  # fmt: skip
_DIGITS: Final = re.compile(r"\(?-?\d[\d., ()x-]*")


def save_study_page(found: Sequence[Outcome], folder: Path, *, name: str) -> Path:
    """Write study.html.

    Raises:
        ExportError: it cannot be written.
    """
    write_whole(folder / PAGE, study_page(found, name=name))
    return folder / PAGE


def study_page(found: Sequence[Outcome], *, name: str) -> bytes:
    """Return the page of a study, which opens offline."""
    counts = Counter(outcome.status for outcome in found)
    done = [outcome for outcome in found if _value(outcome, THICKNESS) is not None]
    said = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
    body = [element("h1", f"geoprint sweep: {name}"), element("p", f"{how_many(len(found), 'cell')}: {said}.")]
    if done:
        body += [element("h2", "Ways to plan, over all parts"), _medians(done), figure(distributions(done))]
        body += [element("h2", "The least even"), _worst(done)]
    if len(done) < len(found):
        body += [element("h2", "What could not be planned"), reasons(found)]
    return page(f"geoprint sweep: {name}", body, {})


def way_of(outcome: Outcome) -> str:
    """Return how a cell is planned, in the words that differ within its study."""
    cell, job = outcome.cell, outcome.cell.job
    robot_cell = "" if job.cell is None else job.cell.stem
    pattern = "" if job.pattern == "contours" else job.pattern
    return ", ".join(word for word in (cell.site, robot_cell, cell.setting, pattern, job.backend) if word)


def save_study_table(found: Iterable[Outcome], folder: Path) -> Path:
    """Write study.csv, the same bytes whoever has planned the cells.

    Raises:
        ExportError: it cannot be written.
    """
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    metrics = [metric.key.replace(".", "_") for metric in CATALOGUE]
    rows.writerow([*_ASKED, *_FOUND, *metrics])
    for outcome in found:
        rows.writerow(row_of(outcome))
    write_whole(folder / TABLE, text.getvalue().encode())
    return folder / TABLE


def row_of(outcome: Outcome) -> Sequence[str]:
    """Return the row of a cell; what it does not have is empty."""
    cell, job = outcome.cell, outcome.cell.job
    robot_cell = "" if job.cell is None else job.cell.stem
    asked = [
        cell.name, cell.part, cell.site, cell.setting, job.backend, job.pattern, robot_cell, outcome.status,
        outcome.reason,
    ]  # fmt: skip
    if outcome.record is None:
        return [*asked, *[""] * (len(_FOUND) + len(CATALOGUE))]
    return [*asked, *map(_text, _found(outcome.record)), *_metrics(outcome.record)]


def _value(outcome: Outcome, metric: Metric) -> float | None:
    measured = None if outcome.record is None else outcome.record.uniformity
    return None if measured is None else metric.of(measured)


def _by_way(done: Sequence[Outcome]) -> dict[str, list[Outcome]]:
    ways: dict[str, list[Outcome]] = {}
    for outcome in done:
        ways.setdefault(way_of(outcome), []).append(outcome)
    return ways


def _medians(done: Sequence[Outcome]) -> Markup:
    rows: list[list[str]] = []
    for way, some in _by_way(done).items():
        cells = [way, str(len(some))]
        for metric in METRICS:
            values = np.array([_value(outcome, metric) for outcome in some], dtype=np.float64)
            low, middle, high = np.nanquantile(values, [0.25, 0.5, 0.75]) * (100.0 if metric.percent else 1.0)
            cells.append(f"{middle:.2f} ({low:.2f}-{high:.2f})")
        rows.append(cells)
    heads = [f"{metric.label} [%]" if metric.percent else metric.label for metric in METRICS]
    return row_table(["way", "parts", *heads], rows, label="median, and in brackets the quartiles")


def distributions(done: Sequence[Outcome]) -> Picture:
    """Return a picture with a small plot for each way: thickness against coverage, a dot a part."""
    from matplotlib.figure import Figure

    ways = _by_way(done)
    columns = min(4, len(ways))
    rows = -(-len(ways) // columns)
    drawn = Figure(figsize=(2.6 * columns, 2.3 * rows + 0.4), layout="constrained", dpi=110)
    axes = np.atleast_1d(drawn.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)).ravel()
    for axis, (way, some) in zip(axes, ways.items(), strict=False):
        x = [100.0 * (_value(outcome, COVERED_ONCE) or 0.0) for outcome in some]
        y = [100.0 * (_value(outcome, THICKNESS) or 0.0) for outcome in some]
        axis.scatter(x, y, s=14, color="#2f76b5", alpha=0.7, linewidths=0.0)
        axis.set_title(way, fontsize=9)
        axis.grid(color="#e4e8eb", linewidth=0.6)
        axis.tick_params(labelsize=8)
    for axis in axes[len(ways) :]:
        axis.set_visible(False)
    drawn.supxlabel("area covered once [%]", fontsize=9)
    drawn.supylabel("variation of thickness (CV) [%]", fontsize=9)
    caption = "Each dot is a part: to the right what is covered once, upwards how much thickness varies."
    return Picture(caption, "png", png_bytes(drawn))


def _worst(done: Sequence[Outcome]) -> Markup:
    order = sorted(done, key=lambda outcome: -(_value(outcome, THICKNESS) or 0.0))[:MOST_WORST]
    rows = [
        [
            element("a", outcome.cell.name, href=f"{CELLS}/{outcome.cell.name}/plan.json"),
            outcome.cell.part,
            *("" if (record := outcome.record) is None or record.uniformity is None else metric.text(record.uniformity)
              for metric in METRICS),
        ]
        for outcome in order
    ]  # fmt: skip
    return row_table(["cell", "part", *(metric.label for metric in METRICS)], rows, label="least even cells")


def reasons(found: Sequence[Outcome]) -> Markup:
    """Return how often cells failed for each reason, which differs in more than its numbers, with the first of them."""
    shapes: dict[str, list[Outcome]] = {}
    for outcome in found:
        if outcome.status != "done":
            name = Path(outcome.cell.part).name
            shape = _DIGITS.sub("# ", outcome.reason.replace(name, "PART"))
            shapes.setdefault(f"{outcome.status}: {shape}"[:80], []).append(outcome)
    order = sorted(shapes.values(), key=lambda some: -len(some))[:MOST_REASONS]
    rows = [[str(len(some)), some[0].status, some[0].reason, some[0].cell.name] for some in order]
    return joined(row_table(["cells", "status", "reason of the first", "first"], rows, label="reasons"))


def _found(record: PlanRecord) -> Iterable[float | None]:
    """Yield the values of the columns that are no metrics of evenness."""
    robots = record.robot
    yield record.surface.prepared.faces
    yield record.surface.area_mm2
    yield record.settings.spacing_mm
    yield record.paths.runs
    yield record.paths.deposit_mm
    yield record.settings.speed_mm_s if robots else None
    yield sum(robot.motion.duration_s for robot in robots) if robots else None
    yield min(robot.clearance.smallest_mm for robot in robots) if robots else None
    shares = [robot.motion.deposited.share for robot in robots if robot.motion.deposited is not None]
    yield sum(shares) / len(shares) if shares else None


def _metrics(record: PlanRecord) -> list[str]:
    measured = record.uniformity
    return [_text(None if measured is None else metric.of(measured)) for metric in CATALOGUE]


def _text(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"
