"""How even are the paths of each backend? Prints the README's table and makes its pictures.

    python -m benchmarks.uniformity [--parts FILE ...] [--save FILE] [--picture [FOLDER]] [--smoke]
    python -m benchmarks.uniformity --compare A.json B.json

Parts are those in data/, surfaces by formula (irregular triangulations: structured ones flatter the heat method) and
any mesh files [mm]. All are planned `SPACING` apart and measured as `geoprint compare` does it by default; what the
columns mean stands in `geoprint.account.metrics`. The area scale is that of lscm's chart, chart over surface, 1 on
average: where its 1st and 99th percentile by area are near each other, a flat map loses little.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import isnan
from pathlib import Path
from types import MappingProxyType

from benchmarks.parts.evenness_picture import evenness_picture
from benchmarks.parts.surfaces import SHAPES, Shape, cap, triangulated
from geoprint.account.compared.pictures import comparison_picture
from geoprint.account.metrics import COVERED_ONCE, FOLLOWING, GAP, LEVELS, OVERLAP, THICKNESS, WIDTH, Metric
from geoprint.backends import distortion
from geoprint.config import job_of
from geoprint.pipeline import compare
from geoprint.quality import Uniformity
from geoprint.results import Comparison
from geoprint.surfaces.files import save_ply

DATA = Path(__file__).parents[1] / "data"
OWN: Mapping[str, str] = MappingProxyType(
    {
        "plate": "plate.ply",
        "heart, free wall": "heart_flat_patch.ply",
        "heart, apex": "heart_apex_patch.ply",
    }
)
PICTURED = "heart, apex"
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
IMAGES = Path(__file__).parents[1] / ".github" / "images"
# A chart whose area scale spreads by less than this factor from the 1st to the 99th percentile: nearly flat.
NEARLY_FLAT = 1.2


@dataclass(frozen=True, slots=True)
class Evenness:
    """One backend on one part; shares, as in `geoprint.quality.Uniformity`.

    Attributes:
        thickness_cv: variation of the thickness with a constant flow.
        following_cv: the same with a flow that follows the width.
        covered_once: of the area.
        gap: area missed.
        overlap: area covered twice.
        level_cv: variation of the spacing from level to level; NaN with a single level.
        width_cv: that of the width of the strips.
    """

    thickness_cv: float
    following_cv: float
    covered_once: float
    gap: float
    overlap: float
    level_cv: float
    width_cv: float


# What the columns show of it, in their order.
COLUMNS: tuple[tuple[Metric, Callable[[Evenness], float]], ...] = (
    (THICKNESS, lambda found: found.thickness_cv),
    (FOLLOWING, lambda found: found.following_cv),
    (COVERED_ONCE, lambda found: found.covered_once),
    (GAP, lambda found: found.gap),
    (OVERLAP, lambda found: found.overlap),
    (LEVELS, lambda found: found.level_cv),
    (WIDTH, lambda found: found.width_cv),
)


@dataclass(frozen=True, slots=True)
class Row:
    """One part.

    Attributes:
        part: what it is.
        area_scale: 1st and 99th percentile of the area scale of lscm's chart, or None where it has none.
        backends: evenness by name.
        refused: reason by name, of those that cannot plan on it.
    """

    part: str
    area_scale: tuple[float, float] | None
    backends: Mapping[str, Evenness]
    refused: Mapping[str, str]

    @property
    def spread(self) -> float:
        """99th over 1st percentile of the area scale; infinite without a chart."""
        return float("inf") if self.area_scale is None else self.area_scale[1] / self.area_scale[0]


def main() -> None:
    """Print the table, or the difference of two saved ones."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", type=Path, default=[], metavar="FILE", help="meshes [mm] besides")
    parser.add_argument("--save", type=Path, metavar="FILE", help="write the figures as JSON too")
    parser.add_argument("--compare", nargs=2, type=Path, metavar=("A", "B"), help="print what changed from A to B")
    parser.add_argument("--picture", type=Path, nargs="?", const=IMAGES, metavar="FOLDER", help="write both pictures")
    parser.add_argument("--smoke", action="store_true", help="the smallest case only, to see that the script runs")
    arguments = parser.parse_args()
    if arguments.compare is not None:
        first, second = (loaded(path) for path in arguments.compare)
        print("\n".join(differences(first, second)))
        return
    pictured: Path | None = arguments.picture
    with tempfile.TemporaryDirectory() as folder:
        parts = _smoke_parts() if arguments.smoke else _parts(Path(folder), arguments.parts)
        rows = [_measured(title, file, smoke=arguments.smoke, picture=pictured) for title, file in parts.items()]
    print("\n".join(table(rows)))
    if arguments.save is not None:
        arguments.save.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")
    if pictured is not None:
        (pictured / "evenness.png").write_bytes(picture(rows))


def table(rows: Sequence[Row]) -> Iterator[str]:
    """Return a Markdown table, from nearly flat parts to strongly curved ones."""
    names = " / ".join(BACKENDS)
    yield f"In each cell: {names}."
    yield ""
    yield f"| part | area scale p1 - p99 | {' | '.join(f'{metric.column}, %' for metric, _ in COLUMNS)} |"
    yield "|" + "---|" * (2 + len(COLUMNS))
    ordered = _sorted(rows)
    for title, chosen in (
        ("nearly flat", [row for row in ordered if row.spread <= NEARLY_FLAT]),
        ("curved", [row for row in ordered if row.spread > NEARLY_FLAT]),
    ):
        if chosen:
            yield f"| **{title}** |" + " |" * (1 + len(COLUMNS))
        yield from (_line(row) for row in chosen)
    for row in ordered:
        for name, reason in row.refused.items():
            yield f"{row.part}: {name} refuses: {reason}"


def picture(rows: Sequence[Row]) -> bytes:
    """Return a PNG of the thickness CV of each backend on each part, ordered as in the table."""
    cvs = {row.part: {name: found.thickness_cv for name, found in row.backends.items()} for row in _sorted(rows)}
    flat = sum(row.spread <= NEARLY_FLAT for row in rows)
    return evenness_picture(cvs, nearly_flat=flat, backends=BACKENDS)


def differences(first: Sequence[Row], second: Sequence[Row]) -> Iterator[str]:
    """Return a Markdown table of the figures that two saved tables do not share, to 1e-4."""
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
            for figure, value in asdict(old).items():
                change = asdict(new)[figure] - value
                if abs(change) > 1e-4:
                    yield f"| {part} | {name} | {figure} | {value:.4f} | {value + change:.4f} | {change:+.4f} |"


def _parts(folder: Path, files: Sequence[Path]) -> dict[str, Path]:
    """Return the file of each part; surfaces by formula are written into the folder."""
    parts = {title: DATA / name for title, name in OWN.items()}
    for title, shape in ANALYTIC.items():
        parts[title] = folder / f"{title.replace(', ', '_').replace(' ', '_')}.ply"
        save_ply(triangulated(shape(), name=title, faces=ANALYTIC_FACES), parts[title])
    return parts | {file.stem: file for file in files}


def _smoke_parts() -> dict[str, Path]:
    return {PICTURED: DATA / OWN[PICTURED]}


def _measured(title: str, file: Path, *, smoke: bool, picture: Path | None) -> Row:
    """Compare the backends on a part, and draw it where it is the one that is drawn."""
    spacing = SMOKE_SPACING if smoke else SPACING
    compared = compare(job_of(surface=file, unit="mm", spacing=spacing, robot=False), backends=BACKENDS)
    if picture is not None and title == PICTURED:
        picture.mkdir(parents=True, exist_ok=True)
        (picture / "apex.png").write_bytes(comparison_picture(compared))
    return _row(title, compared)


def _row(title: str, compared: Comparison) -> Row:
    found = {name: evenness_of(outcome.uniformity) for name, outcome in compared.planned}
    return Row(title, _area_scale(compared), found, dict(compared.refused))


def evenness_of(measured: Uniformity) -> Evenness:
    """Return what the table shows of a measurement."""
    return Evenness(
        thickness_cv=measured.thickness.cv,
        following_cv=measured.followed.cv,
        covered_once=measured.covered_once,
        gap=measured.gap,
        overlap=measured.overlap,
        level_cv=float("nan") if measured.levels is None else measured.levels.figures.cv,
        width_cv=measured.width_cv,
    )


def _area_scale(compared: Comparison) -> tuple[float, float] | None:
    for _, outcome in compared.planned:
        if outcome.plan.flattenings:
            scales = distortion(compared.workpiece.surface, outcome.plan.flattenings[0].flat)
            return scales.scale_percentile(1), scales.scale_percentile(99)
    return None


def loaded(path: Path) -> list[Row]:
    """Read what `--save` wrote."""
    return [
        Row(
            part=row["part"],
            area_scale=None if row["area_scale"] is None else tuple(row["area_scale"]),
            backends={name: Evenness(**found) for name, found in row["backends"].items()},
            refused=row["refused"],
        )
        for row in json.loads(path.read_text(encoding="utf-8"))
    ]


def _sorted(rows: Sequence[Row]) -> list[Row]:
    return sorted(rows, key=lambda row: row.spread)


def _line(row: Row) -> str:
    scale = "-" if row.area_scale is None else f"{row.area_scale[0]:.2f} - {row.area_scale[1]:.2f}"
    figures = (_cell(row, value) for _, value in COLUMNS)
    return " | ".join(("| " + row.part, scale, *figures)) + " |"


def _cell(row: Row, value: Callable[[Evenness], float]) -> str:
    shares = (value(row.backends[name]) if name in row.backends else float("nan") for name in BACKENDS)
    return " / ".join("-" if isnan(share) else f"{100 * share:.2f}" for share in shares)


if __name__ == "__main__":
    main()
