"""Are evenness figures of paths and part alone, and not of how these are written, and how fine must elements be?

    python -m benchmarks.paths.invariance [--csv FILE] [--smoke]

Five kinds of paths on twelve parts are measured as they are and again after every change of `CHANGES`, which leaves
paths and part what they are, and on a finer mesh of the same shape. The first table has the largest change of any
figure for each part and kind, with the same mesh and with the finer one; the second has for each change the largest one
of every figure, and where. All are in points: 1 % of the area, or 1 % of CV.

The third table has the thickness CV of the same paths for elements of other sizes: the order that is observed from the
sizes 1/4, 1/8 and 1/16 of a spacing, the CV that they tend to, and how far the default is from it. The last one has the
CV of even rows on a plate over many random triangulations, with what it is by formula, and from which variation on it
can be distinguished from that by two standard deviations: what varies by itself adds in squares.
"""

from __future__ import annotations

import csv
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import log2, pi, sqrt
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, TypeAlias
from unittest.mock import patch

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks import DATA
from benchmarks.parts.streams import deposited
from benchmarks.parts.surfaces import SHAPES, Shape, cap, circle, rectangle, triangulated
from benchmarks.parts.tables import row, script_parser, table
from geoprint import job_of, measure_paths, plan
from geoprint.distance import isolines
from geoprint.errors import GeoprintError
from geoprint.geometry import edge_lengths, face_areas, refine, united
from geoprint.geometry.files import load, save_ply
from geoprint.metrics import Uniformity, thickness
from geoprint.model import FloatArray, Polylines, ScalarField, Surface
from geoprint.reporting.metrics import FOLLOWING, GAP, OVERLAP, THICKNESS

OWN = ("plate.ply", "heart_flat_patch.ply", "heart_apex_patch.ply")
FACES = 1_500
# Spacings on the side of a square as large as the part.
ACROSS = 12
# Slices rise along this direction, which no part has an edge along.
SLICED = np.array([0.4, 0.9, 0.17]) / np.linalg.norm([0.4, 0.9, 0.17])
# Sizes of elements over the spacing; the order is that of those which halve.
SHARES = (1 / 4, 1 / 6, 1 / 8, 1 / 12, 1 / 16)
HALVING = (1 / 4, 1 / 8, 1 / 16)
CONVERGING = ("plate", "dome", "saddle", "heart_apex_patch")
# Rows on a plate [mm], random triangulations of it, and lengths of their edges over the spacing.
ROWS_ON, ROWS_APART = (24.0, 16.0), 2.0
TRIANGULATIONS = 20
EDGES = (1.0, 0.125)
COLUMNS = tuple(metric.column for metric in (THICKNESS, FOLLOWING, GAP, OVERLAP))


class Paths(NamedTuple):
    """Lines on a part, one wanted spacing apart [mm]."""

    part: Surface
    lines: tuple[FloatArray, ...]
    spacing: float


Change: TypeAlias = Callable[[Paths], Paths]


class Kind(NamedTuple):
    """A kind of paths that geoprint plans."""

    pattern: str
    backend: str
    source: Mapping[str, object] | None = None


# None stands for slices by parallel planes, which are nobody's plan.
KINDS: Mapping[str, Kind | None] = MappingProxyType(
    {
        "contours, heat": Kind("contours", "heat"),
        "contours, lscm": Kind("contours", "lscm"),
        "spiral, heat": Kind("spiral", "heat"),
        "guided rows, heat": Kind("guided", "heat", {"angle": 30.0}),
        "slices": None,
    }
)


class Case(NamedTuple):
    """One kind of paths on one part.

    Attributes:
        part: its name.
        kind: one of `KINDS`.
        spacing: [mm].
        plain: (4,) figures in percent, in the order of `COLUMNS`.
        changed: the same by the name of each change.
        refused: why there are none.
    """

    part: str
    kind: str
    spacing: float
    plain: FloatArray
    changed: Mapping[str, FloatArray]
    refused: str = ""

    def off(self, change: str) -> FloatArray:
        """Return by how much each figure differs after a change [points]; 0 where it changes nothing."""
        return np.abs(self.changed.get(change, self.plain) - self.plain)


def main() -> None:
    """Print the tables."""
    parser = script_parser(__doc__, smoke="slices on a plate, to see that the script runs")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write all figures too")
    arguments = parser.parse_args()
    cases: list[Case] = []
    with tempfile.TemporaryDirectory() as folder:
        files, kinds, converging = part_files(Path(folder)), list(KINDS), CONVERGING
        if arguments.smoke:
            files, kinds, converging = {"plate": files["plate"]}, ["slices"], CONVERGING[:1]
        for lines in (
            by_part(files, cases, kinds=kinds),
            by_change(cases),
            convergence({name: files[name] for name in converging}, kinds=sorted({kinds[0], kinds[-1]})),
            floor(count=2 if arguments.smoke else TRIANGULATIONS, edges=EDGES[: 1 if arguments.smoke else None]),
        ):
            for line in lines:
                print(line, flush=True)
    if arguments.csv is not None:
        save(cases, arguments.csv)


def part_files(folder: Path) -> dict[str, Path]:
    """Return the file of each part by its name; those that are made by formula are written to a folder."""
    flat = SHAPES["plate"]().lift
    sides = np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 16.0], [16.0, 16.0], [16.0, 34.0], [0.0, 34.0]])
    shapes: Mapping[str, Shape] = {
        "cylinder": SHAPES["cylinder"](),
        "cone": SHAPES["cone"](),
        "dome": cap(45.0),
        "saddle": SHAPES["saddle"](),
        "bumpy": SHAPES["bumpy"](),
        "half torus": SHAPES["half torus"](),
        "sheet with hole": SHAPES["sheet with hole"](),
        "annulus": Shape((circle(20.0), circle(8.0)), flat),
        "L": Shape((sides,), flat),
    }
    files = {Path(name).stem: DATA / name for name in OWN}
    for name, shape in shapes.items():
        files[name] = folder / f"{name}.ply"
        save_ply(triangulated(shape, name=name, faces=FACES), files[name])
    return files


def by_part(files: Mapping[str, Path], cases: list[Case], *, kinds: Sequence[str]) -> Iterator[str]:
    """Yield the table of parts while their cases are measured, which are added to a list."""
    yield from table("points, same mesh / finer", "mm", *kinds)
    refused: list[str] = []
    for name, file in files.items():
        cells: list[str] = []
        for kind in kinds:
            cases.append(case := measured_case(name, file, kind))
            same = max(float(case.off(change.__name__).max()) for change in CHANGES)
            cells.append("refused" if case.refused else f"{same:.4f} / {case.off(refined.__name__).max():.3f}")
            refused += [f"{name}: {kind}: {case.refused}"] if case.refused else []
        yield row(name, f"{cases[-1].spacing:g}", *cells)
    yield from refused


def by_change(cases: Sequence[Case]) -> Iterator[str]:
    """Yield the table of changes: the largest of every figure over all cases."""
    yield from table("change", "cases", *(f"{column}, points" for column in COLUMNS), "most at")
    for change in (*CHANGES, refined):
        name = change.__name__
        those = [case for case in cases if name in case.changed]
        off = np.array([case.off(name) for case in those]).reshape(-1, len(COLUMNS))
        at = those[int(off.max(axis=1).argmax())] if those else None
        yield row(
            name.replace("_", " "), str(len(those)), *(f"{most:.4f}" for most in off.max(axis=0, initial=0.0)),
            "" if at is None else f"{at.part}: {at.kind}",
        )  # fmt: skip


def convergence(files: Mapping[str, Path], *, kinds: Sequence[str]) -> Iterator[str]:
    """Yield the table of the thickness CV over the size of elements."""
    yield from table(
        "thickness CV, %: elements of", *(f"1/{1 / share:g}" for share in SHARES), "order", "tends to", "default off by"
    )
    for name, file in files.items():
        for kind in kinds:
            paths, found = paths_of(file, kind), dict[float, float]()
            for share in SHARES:
                with patch.object(thickness, "EDGE_SHARE", share):
                    found[share] = float(figures(paths)[0])
            order, limit = extrapolated([found[share] for share in HALVING])
            yield row(
                f"{name}: {kind}", *(f"{found[share]:.4f}" for share in SHARES),
                "-" if order is None else f"{order:.2f}", f"{limit:.4f}", f"{found[thickness.EDGE_SHARE] - limit:+.4f}",
            )  # fmt: skip


def extrapolated(values: Sequence[float]) -> tuple[float | None, float]:
    """Return the order of values for three sizes that halve, and what they tend to.

    Where they do not approach one another steadily there is no order, and the last is what they tend to.
    """
    first, second = values[1] - values[0], values[2] - values[1]
    if first * second <= 0.0 or abs(second) >= abs(first):
        return None, values[2]
    return log2(first / second), values[2] + second**2 / (first - second)


def floor(*, count: int, edges: Sequence[float]) -> Iterator[str]:
    """Yield the table of even rows on a plate over random triangulations."""
    yield from table(
        "triangles", "edges, spacings", "triangulations", "CV of even rows, %", "standard deviation", "largest",
        "distinguishable above",
    )  # fmt: skip
    yield row("by formula", "0", "", f"{100.0 * even_rows_cv():.4f}", "", "", "")
    width, height = ROWS_ON
    rows = [np.array([[0.0, y, 0.0], [width, y, 0.0]]) for y in np.arange(0.5 * ROWS_APART, height, ROWS_APART)]
    shape = Shape((rectangle(width, height),), SHAPES["plate"]().lift)
    for style in ("irregular", "sliver"):
        for edge in edges:
            faces = round(width * height / (np.sqrt(3.0) / 4.0 * (edge * ROWS_APART) ** 2))
            found = np.array(
                [
                    figures(Paths(triangulated(shape, name="plate", faces=faces, style=style, random_seed=seed),
                                  tuple(rows), ROWS_APART))[0]
                    for seed in range(count)
                ]
            )  # fmt: skip
            mean, deviation = float(found.mean()), float(found.std(ddof=1))
            yield row(
                style, f"{edge:g}", str(count), f"{mean:.4f}", f"{deviation:.4f}", f"{found.max():.4f}",
                f"{sqrt((mean + 2.0 * deviation) ** 2 - mean**2):.3f}",
            )  # fmt: skip


def even_rows_cv() -> float:
    """Return the CV of the layer that even rows leave, without elements: their first harmonic after implicit steps."""
    step = 0.5 * (2.0 * pi * thickness.SPREAD_SHARE) ** 2 / thickness.STEPS
    return sqrt(2.0) * (1.0 + step) ** -thickness.STEPS


def save(cases: Sequence[Case], path: Path) -> None:
    """Write all figures in percent, one line for each change."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["part", "kind", "spacing_mm", "change", *COLUMNS, *(f"off: {column}" for column in COLUMNS)])
        for case in cases:
            head = [case.part, case.kind, f"{case.spacing:g}"]
            if case.refused:
                writer.writerow([*head, f"refused: {case.refused}"])
                continue
            for change, after in {"": case.plain, **case.changed}.items():
                values = [*after, *(after - case.plain)]
                writer.writerow([*head, change, *(f"{value:.6f}" for value in values)])


def measured_case(name: str, file: Path, kind: str) -> Case:
    """Return one kind of paths on one part, measured after all changes."""
    try:
        paths = paths_of(file, kind)
    except GeoprintError as error:
        return Case(name, kind, spacing_on(load(file, unit="mm")), np.zeros(len(COLUMNS)), {}, str(error))
    changed = {change.__name__: change(paths) for change in (*CHANGES, refined)}
    return Case(
        name, kind, paths.spacing, figures(paths),
        {change: figures(after) for change, after in changed.items() if after is not paths},
    )  # fmt: skip


def paths_of(file: Path, kind: str) -> Paths:
    """Return one kind of paths on a part.

    Raises:
        GeoprintError: they cannot be planned.
    """
    spacing, asked = spacing_on(part := load(file, unit="mm")), KINDS[kind]
    if asked is None:
        heights = part.vertices @ SLICED
        levels = np.arange(heights.min() + 0.5 * spacing, heights.max(), spacing)
        curves, _ = isolines(part, ScalarField(heights), levels=levels)
        return Paths(part, tuple(curves.xyz(part, curve) for curve in range(curves.count)), spacing)
    planned = plan(
        job_of(surface=file, unit="mm", spacing=spacing, backend=asked.backend, pattern=asked.pattern, robot=False,
               **({} if asked.source is None else {"source": asked.source}))
    )  # fmt: skip
    curves = deposited(planned.poses)
    return Paths(planned.workpiece.part, tuple(np.split(curves.points, curves.offsets[1:-1])), spacing)


def spacing_on(part: Surface) -> float:
    """Return a spacing that gives few paths [mm]."""
    return round(sqrt(float(face_areas(part).sum())) / ACROSS, 2)


def measured(paths: Paths) -> Uniformity:
    """Measure paths."""
    ends = np.cumsum([0, *(len(line) for line in paths.lines)])
    return measure_paths(paths.part, Polylines(np.concatenate(paths.lines), ends), spacing=paths.spacing)


def figures(paths: Paths) -> FloatArray:
    """Return the (4,) figures of paths in percent, in the order of `COLUMNS`."""
    found = measured(paths)
    return 100.0 * np.array([found.thickness.cv, found.followed.cv, found.gap, found.overlap])


def turned_back(paths: Paths) -> Paths:
    """Turn every other line back, the first one too."""
    return paths._replace(lines=tuple(line[:: -1 if k % 2 == 0 else 1] for k, line in enumerate(paths.lines)))


def in_another_order(paths: Paths) -> Paths:
    """Shuffle the lines."""
    order: list[int] = np.random.default_rng(3).permutation(len(paths.lines)).tolist()
    return paths._replace(lines=tuple(paths.lines[k] for k in order)) if len(order) > 1 else paths


def begun_elsewhere(paths: Paths) -> Paths:
    """Begin closed lines a third of their points later; the same paths where none is closed."""

    def shifted(line: FloatArray) -> FloatArray:
        around, by = line[:-1], len(line) // 3
        return np.concatenate([around[by:], around[:by], around[by : by + 1]])

    is_closed = [np.allclose(line[0], line[-1]) for line in paths.lines]
    if not any(is_closed):
        return paths
    return paths._replace(
        lines=tuple(shifted(line) if closed else line for line, closed in zip(paths.lines, is_closed, strict=True))
    )


def cut(paths: Paths) -> Paths:
    """Cut lines into three runs each, of which the next begins where the last ends."""

    def pieces(line: FloatArray) -> list[FloatArray]:
        first, second = len(line) // 3, 3 * len(line) // 4
        whole = [line[: first + 1], line[first : second + 1], line[second:]]
        return [piece for piece in whole if len(piece) > 1]

    return paths._replace(lines=tuple(piece for line in paths.lines for piece in pieces(line)))


def subdivided(paths: Paths) -> Paths:
    """Put a point in the middle of each two."""

    def halved(line: FloatArray) -> FloatArray:
        return np.concatenate([np.stack([line[:-1], (line[:-1] + line[1:]) / 2.0], axis=1).reshape(-1, 3), line[-1:]])

    return paths._replace(lines=tuple(halved(line) for line in paths.lines))


def moved(paths: Paths) -> Paths:
    """Move paths and part by a rigid motion."""
    turn, shift = Rotation.from_rotvec([0.3, -0.8, 1.1]).as_matrix(), np.array([5.0, -70.0, 12.0])
    part = Surface(paths.part.vertices @ turn.T + shift, paths.part.faces)
    return paths._replace(part=part, lines=tuple(line @ turn.T + shift for line in paths.lines))


def mirrored(paths: Paths) -> Paths:
    """Mirror paths and part; faces turn, so that outside stays outside."""
    flip = np.array([-1.0, 1.0, 1.0])
    part = Surface(paths.part.vertices * flip, paths.part.faces[:, ::-1])
    return paths._replace(part=part, lines=tuple(line * flip for line in paths.lines))


def renumbered(paths: Paths) -> Paths:
    """Shuffle vertices and faces."""
    rng, vertices, faces = np.random.default_rng(5), paths.part.vertices, paths.part.faces
    order = rng.permutation(len(vertices))
    place = np.argsort(order)
    return paths._replace(part=Surface(vertices[order], place[faces[rng.permutation(len(faces))]]))


def in_another_unit(paths: Paths) -> Paths:
    """Write all lengths in a unit of which an inch has one."""
    part = Surface(paths.part.vertices * 25.4, paths.part.faces)
    return Paths(part, tuple(line * 25.4 for line in paths.lines), paths.spacing * 25.4)


def twice(paths: Paths) -> Paths:
    """Put a second part with the same paths beside the first."""
    away = np.array([2.0 * np.ptp(paths.part.vertices[:, 0]) + paths.spacing, 0.0, 0.0])
    part = united([paths.part, Surface(paths.part.vertices + away, paths.part.faces)])
    return paths._replace(part=part, lines=(*paths.lines, *(line + away for line in paths.lines)))


CHANGES: Sequence[Change] = (
    turned_back, in_another_order, begun_elsewhere, cut, subdivided, moved, mirrored, renumbered, in_another_unit,
    twice,
)  # fmt: skip


def refined(paths: Paths) -> Paths:
    """Halve the edges of the part."""
    return paths._replace(part=refine(paths.part, edge_length=0.5 * float(edge_lengths(paths.part).mean())))


if __name__ == "__main__":
    main()
