"""How even are the paths of each backend? Writes the full table and the README's rows of it.

    python -m benchmarks.paths.uniformity [--parts FILE ...] [--write] [--smoke]
    python -m benchmarks.paths.uniformity --compare A.csv B.csv

Parts are those in data/, surfaces by formula (irregular triangulations: structured ones flatter the heat method) and
any mesh files [mm]. All are planned `SPACING` apart and measured as `geoprint compare` does it by default; what the
columns mean stands in `geoprint.reporting.metrics`. The area scale is that of lscm's chart, chart over surface, 1 on
average: where its 1st and 99th percentile by area are near each other, a flat map loses little.

With --write the figures are kept beside this file, in uniformity.csv and as a page in uniformity.md, and README gets
its rows. `python -m benchmarks.guide --draw evenness.png` draws them; a test notices a picture that is older.
"""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import csv
import io
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from types import MappingProxyType

from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

from benchmarks import DATA, ROOT
from benchmarks.parts.surfaces import SHAPES, Shape, cap, triangulated
from benchmarks.parts.tables import script_parser
from geoprint.config import job_of
from geoprint.distance import distortion
from geoprint.geometry.files import save_ply
from geoprint.reporting import record_evenness
from geoprint.reporting.metrics import (
    COVERED_ONCE,
    FOLLOWING,
    GAP,
    LEVELS,
    NONE,
    OFF,
    OFF_MOST,
    OVERLAP,
    THICKNESS,
    WIDTH,
    Metric,
)
from geoprint.reporting.records.evenness import EvennessRecord
from geoprint.results import Comparison
from geoprint.workflow import compare

OWN: Mapping[str, str] = MappingProxyType(
    {
        "plate": "plate.ply",
        "heart, free wall": "heart_flat_patch.ply",
        "heart, apex": "heart_apex_patch.ply",
    }
)
SMALLEST = "heart, apex"
ANALYTIC: Mapping[str, Callable[[], Shape]] = MappingProxyType(
    {
        "plate by formula": SHAPES["plate"],
        "half cylinder": SHAPES["cylinder"],
        "cone": SHAPES["cone"],
        "cap, 20 degrees": lambda: cap(20.0),
        "cap, 45 degrees": lambda: cap(45.0),
        "cap, 70 degrees": lambda: cap(70.0),
        "saddle": SHAPES["saddle"],
        "bumpy": SHAPES["bumpy"],
    }
)
ANALYTIC_FACES = 4_000
BACKENDS = ("lscm", "heat", "fast-marching")
SPACING = 1.0
SMOKE_SPACING = 4.0
# A chart whose area scale spreads by less than this factor from the 1st to the 99th percentile: nearly flat.
NEARLY_FLAT = 1.2


# What the columns show, in their order; README shows few.
COLUMNS = (THICKNESS, FOLLOWING, COVERED_ONCE, GAP, OVERLAP, OFF, OFF_MOST, LEVELS, WIDTH)
README_COLUMNS = (THICKNESS, FOLLOWING, COVERED_ONCE, OFF)
KEPT, PAGE = (Path(__file__).with_name(f"uniformity.{suffix}") for suffix in ("csv", "md"))
README = ROOT / "README.md"
# The lines of README between which its rows stand.
ROWS = ("<!-- evenness -->\n", "<!-- /evenness -->\n")


@dataclass(frozen=True, slots=True)
class Row:
    """One part.

    Attributes:
        part: what it is.
        area_scale: 1st and 99th percentile of the area scale of lscm's chart, or None where it has none.
        backends: by name the figure of each column, by its key; without those that were not measured.
        refused: reason by name, of those that cannot plan on it.
    """

    part: str
    area_scale: tuple[float, float] | None
    backends: Mapping[str, Mapping[str, float]]
    refused: Mapping[str, str]

    @property
    def spread(self) -> float:
        """99th over 1st percentile of the area scale; infinite without a chart."""
        return float("inf") if self.area_scale is None else self.area_scale[1] / self.area_scale[0]


def main() -> None:
    """Print the table, or the difference of two kept ones."""
    parser = script_parser(__doc__, smoke="the smallest case only, to see that the script runs")
    parser.add_argument("--parts", nargs="+", type=Path, default=[], metavar="FILE", help="meshes [mm] besides")
    parser.add_argument("--write", action="store_true", help="keep the figures, write their page and README's rows")
    parser.add_argument("--compare", nargs=2, type=Path, metavar=("A", "B"), help="print what changed from A to B")
    arguments = parser.parse_args()
    if arguments.compare is not None:
        first, second = (loaded(path.read_text(encoding="utf-8")) for path in arguments.compare)
        print("\n".join(differences(first, second)))
        return
    with tempfile.TemporaryDirectory() as folder:
        parts = _smoke_parts() if arguments.smoke else _parts(Path(folder), arguments.parts)
        spacing = SMOKE_SPACING if arguments.smoke else SPACING
        compared = {title: measured(file, spacing=spacing) for title, file in parts.items()}
    # As they are kept, so that whatever is written agrees to the last digit.
    rows = loaded(kept([row_of(title, found) for title, found in compared.items()]))
    print("\n".join(table(rows)))
    if arguments.write:
        KEPT.write_text(kept(rows), encoding="utf-8")
        PAGE.write_text(page(rows), encoding="utf-8")
        README.write_text(with_rows(README.read_text(encoding="utf-8"), rows), encoding="utf-8")


def kept(rows: Sequence[Row]) -> str:
    """Return the text of the kept file: a line a part and backend, shares to six digits."""
    text = StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(["part", "area_scale_p1", "area_scale_p99", "backend", *(each.key for each in COLUMNS), "refused"])
    for row in rows:
        scale = ("", "") if row.area_scale is None else tuple(f"{each:.4f}" for each in row.area_scale)
        for name in (*row.backends, *row.refused):
            found = row.backends.get(name, {})
            figures = [f"{found[each.key]:.6f}" if each.key in found else "" for each in COLUMNS]
            lines.writerow([row.part, *scale, name, *figures, row.refused.get(name, "")])
    return text.getvalue()


def loaded(text: str) -> list[Row]:
    """Read the text of a kept file."""
    rows: dict[str, Row] = {}
    for line in csv.DictReader(StringIO(text)):
        scale = line["area_scale_p1"], line["area_scale_p99"]
        area_scale = (float(scale[0]), float(scale[1])) if scale[0] else None
        row = rows.get(line["part"], Row(line["part"], area_scale, {}, {}))
        name, figures = line["backend"], {each.key: float(line[each.key]) for each in COLUMNS if line[each.key]}
        backends = {**row.backends, name: figures} if figures else row.backends
        refused = {**row.refused, name: line["refused"]} if line["refused"] else row.refused
        rows[row.part] = Row(row.part, row.area_scale, backends, refused)
    return list(rows.values())


def page(rows: Sequence[Row]) -> str:
    """Return the page of the full table."""
    meanings = [f"- {each.column}: {each.label}; {each.meaning}." for each in COLUMNS]
    words = (
        f"Paths {SPACING:g} mm apart, planned and measured as `geoprint compare` does it by default. Written by "
        "`python -m benchmarks.paths.uniformity --write`; the same figures to six digits are in uniformity.csv."
    )
    return "\n".join(["# How even is each backend?", "", words, "", *table(rows), "", *meanings, ""])


def with_rows(readme: str, rows: Sequence[Row]) -> str:
    """Return README with the rows of the parts in data/."""
    before, after = readme.split(ROWS[0])[0], readme.split(ROWS[1])[1]
    names = " | ".join(f"{each.column}, %" for each in README_COLUMNS)
    head = f"| part | {names} |", "|" + "---|" * (1 + len(README_COLUMNS))
    lines = [" | ".join((f"| {row.part}", *_cells(row, README_COLUMNS))) + " |" for row in rows if row.part in OWN]
    return f"{before}{ROWS[0]}" + "\n".join([*head, *lines]) + f"\n{ROWS[1]}{after}"


def table(rows: Sequence[Row]) -> Iterator[str]:
    """Return a Markdown table, from nearly flat parts to strongly curved ones."""
    names = " / ".join(BACKENDS)
    yield f"In each cell: {names}."
    yield ""
    yield f"| part | area scale p1 - p99 | {' | '.join(f'{metric.column}, %' for metric in COLUMNS)} |"
    yield "|" + "---|" * (2 + len(COLUMNS))
    ordered = _sorted(rows)
    for title, chosen in (
        ("nearly flat", [row for row in ordered if row.spread <= NEARLY_FLAT]),
        ("curved", [row for row in ordered if row.spread > NEARLY_FLAT]),
    ):
        if chosen:
            yield f"| **{title}** |" + " |" * (1 + len(COLUMNS))
        yield from (_line(row) for row in chosen)
    yield ""
    for row in ordered:
        for name, reason in row.refused.items():
            yield f"{row.part}: {name} refuses: {reason}"


def picture(rows: Sequence[Row]) -> bytes:
    """Return a PNG of the thickness CV of each backend on each part, ordered as in the table."""
    cvs = {row.part: {name: found[THICKNESS.key] for name, found in row.backends.items()} for row in _sorted(rows)}
    flat = sum(row.spread <= NEARLY_FLAT for row in rows)
    return evenness_picture(cvs, nearly_flat=flat, backends=BACKENDS)


def differences(first: Sequence[Row], second: Sequence[Row]) -> Iterator[str]:
    """Return a Markdown table of the figures that two kept tables do not share, to 1e-4."""
    before, after = ({row.part: row for row in rows} for rows in (first, second))
    yield "| part | backend | figure | A | B | B - A |"
    yield "|" + "---|" * 6
    for part in dict.fromkeys([*before, *after]):
        if part not in before or part not in after:
            yield f"| {part} | | only in {'A' if part in before else 'B'} | | | |"
            continue
        for name in dict.fromkeys([*before[part].backends, *after[part].backends]):
            old, new = before[part].backends.get(name), after[part].backends.get(name)
            if old is None or new is None:
                yield f"| {part} | {name} | planned only in {'B' if old is None else 'A'} | | | |"
                continue
            for key in old.keys() & new.keys():
                if abs(new[key] - old[key]) > 1e-4:
                    yield f"| {part} | {name} | {key} | {old[key]:.4f} | {new[key]:.4f} | {new[key] - old[key]:+.4f} |"


def _parts(folder: Path, files: Sequence[Path]) -> dict[str, Path]:
    """Return the file of each part; surfaces by formula are written into the folder."""
    parts = {title: DATA / name for title, name in OWN.items()}
    for title, shape in ANALYTIC.items():
        parts[title] = folder / f"{title.replace(', ', '_').replace(' ', '_')}.ply"
        save_ply(triangulated(shape(), name=title, faces=ANALYTIC_FACES), parts[title])
    return parts | {file.stem: file for file in files}


def _smoke_parts() -> dict[str, Path]:
    return {SMALLEST: DATA / OWN[SMALLEST]}


def measured(file: Path, *, spacing: float = SPACING) -> Comparison:
    """Compare the backends on a part as the command does."""
    return compare(job_of(surface=file, unit="mm", spacing=spacing, robot=False), backends=BACKENDS)


def row_of(title: str, compared: Comparison) -> Row:
    """Return what the table shows of a comparison."""
    found = {name: record_evenness(each.uniformity, distance=each.plan.distance) for name, each in compared.planned}
    backends = {name: _figures(record) for name, record in found.items()}
    return Row(title, _area_scale(compared), backends, dict(compared.refused))


def _figures(record: EvennessRecord) -> dict[str, float]:
    return {each.key: value for each in COLUMNS if (value := each.of(record)) is not None}


def _area_scale(compared: Comparison) -> tuple[float, float] | None:
    for _, outcome in compared.planned:
        if outcome.plan.flattenings:
            scales = distortion(compared.workpiece.surface, outcome.plan.flattenings[0].flat)
            return scales.scale_percentile(1), scales.scale_percentile(99)
    return None


def _sorted(rows: Sequence[Row]) -> list[Row]:
    return sorted(rows, key=lambda row: row.spread)


def _line(row: Row) -> str:
    scale = "-" if row.area_scale is None else f"{row.area_scale[0]:.2f} - {row.area_scale[1]:.2f}"
    return " | ".join(("| " + row.part, scale, *_cells(row, COLUMNS))) + " |"


def _cells(row: Row, columns: Sequence[Metric]) -> Iterator[str]:
    for metric in columns:
        shares = (row.backends.get(name, {}).get(metric.key) for name in BACKENDS)
        yield " / ".join(NONE if share is None else f"{100 * share:.2f}" for share in shares)


# Of Okabe and Ito, safe for colour-blind readers; shapes tell the backends apart in grey.
STYLES = (("#D55E00", "o"), ("#0072B2", "s"), ("#009E73", "^"))
TICKS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
ROW_INCHES = 0.24
DOTS_PER_INCH = 160


def evenness_picture(cvs: Mapping[str, Mapping[str, float]], *, nearly_flat: int, backends: Sequence[str]) -> bytes:
    """Return a PNG, the same bytes for the same input.

    Args:
        cvs: part to backend to coefficient of variation of the thickness; from nearly flat to strongly curved.
        nearly_flat: how many of the first parts are nearly flat; a line divides them from the others.
        backends: which to draw, at most three.
    """
    figure = Figure(figsize=(7.2, ROW_INCHES * len(cvs) + 1.1), dpi=DOTS_PER_INCH, layout="constrained")
    axis = figure.subplots()
    for row, found in enumerate(cvs.values()):
        shown = [100.0 * found[name] for name in backends if name in found]
        axis.plot([min(shown), max(shown)], [row, row], color="#c8c8c8", linewidth=1.0, zorder=1)
    for name, (colour, marker) in zip(backends, STYLES, strict=False):
        rows = [row for row, found in enumerate(cvs.values()) if name in found]
        values = [100.0 * found[name] for found in cvs.values() if name in found]
        axis.plot(values, rows, marker, color=colour, markersize=6, label=name, markeredgecolor="white", zorder=2)
        for row, found in enumerate(cvs.values()):
            if name not in found:
                axis.annotate(
                    f"{name} refuses", (1.0, row), xycoords=("axes fraction", "data"), xytext=(-4, 0),
                    textcoords="offset points", ha="right", va="center", fontsize=9, color=colour,
                )  # fmt: skip
    axis.set_yticks(range(len(cvs)), [part.replace("_", " ") for part in cvs], fontsize=9, parse_math=False)
    axis.set_ylim(len(cvs) - 0.4, -0.6)
    if 0 < nearly_flat < len(cvs):
        axis.axhline(nearly_flat - 0.5, color="#808080", linewidth=0.8, linestyle="--")
        for place, side, text in ((nearly_flat - 0.5, "bottom", "nearly flat"), (nearly_flat - 0.45, "top", "curved")):
            axis.annotate(
                text, (1.0, place), xycoords=("axes fraction", "data"), xytext=(-4, 0), textcoords="offset points",
                ha="right", va=side, fontsize=9, color="#606060",
            )  # fmt: skip
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(FixedLocator(TICKS))
    axis.xaxis.set_minor_locator(NullLocator())
    axis.xaxis.set_major_formatter(FixedFormatter([f"{tick:g}" for tick in TICKS]))
    axis.tick_params(axis="x", labelsize=9)
    axis.tick_params(axis="y", length=0)
    axis.grid(axis="x", color="#e8e8e8", linewidth=0.7)
    axis.set_axisbelow(True)
    axis.set_xlabel("layer thickness, variation (CV), % (less is more even)", fontsize=10)
    figure.legend(loc="outside upper center", ncols=len(backends), fontsize=10, frameon=False)
    for side in ("top", "right", "left"):
        axis.spines[side].set_visible(False)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


if __name__ == "__main__":
    main()
