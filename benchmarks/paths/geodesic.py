"""How right, how even and how fast is the distance of each backend, beside its peer? Prints Markdown tables.

    python -m benchmarks.paths.geodesic [--table NAME ...] [--faces N] [--smoke]

The peer is potpourri3d (geometry-central), run in the same process where it is installed (`pip install potpourri3d
pygeodesic`): its heat method as published, and on its robust (tufted intrinsic) Laplacian. Its wheel uses Eigen's
simplicial solver; a build with SuiteSparse factorises several times faster on large meshes.

Exact means: the formula on planes, otherwise window propagation over the triangles (pygeodesic). Errors are in mean
edge lengths h. Spacing is the exact distance over the surface from samples on each level curve to the level before,
over the spacing (`geoprint.metrics`); all fields are traced by the same code, so that what differs is the field; the
excess is the CV beyond that of the exact field.
"""

from __future__ import annotations

import importlib
import importlib.util
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from benchmarks.parts.surfaces import SHAPES, STYLES, exact_distance, make
from benchmarks.parts.tables import row, rule, script_parser
from geoprint.distance import BACKENDS
from geoprint.distance.interface import level_distances
from geoprint.distance.isolines import isolines
from geoprint.errors import percent
from geoprint.geometry import boundary_loops, boundary_source, edge_lengths, positions
from geoprint.metrics.deposited import sampled
from geoprint.metrics.oracle.geodesic import GeodesicDistance
from geoprint.metrics.oracle.tracing import trace
from geoprint.metrics.oracle.unfolding import flat_mesh, flat_places
from geoprint.metrics.spacing import outer_distance
from geoprint.model import FloatArray, ScalarField, Source, Surface, SurfaceCurves, SurfacePoints

# Level curves between the border and the farthest point.
LEVELS = 20
TIMED_LEVELS = 100
# Small meshes are timed several times, and the least counts: the machine is rarely alone.
REPEATS = 3
LARGE = 500_000
SAMPLES_PER_SPACING = 4
SPACING_SHAPES = ("cap", "saddle", "bumpy", "half torus", "sheet with hole")

Field = Callable[[Surface], FloatArray]


def _own(name: str) -> Field:
    return lambda surface: BACKENDS[name](surface).distance(boundary_source(surface)).values


def _peer(*, robust: bool) -> Field:
    def distance(surface: Surface) -> FloatArray:
        library = importlib.import_module("potpourri3d")
        solver = library.MeshHeatMethodDistanceSolver(surface.vertices, surface.faces, use_robust=robust)
        return np.asarray(solver.compute_distance_multisource(np.concatenate(boundary_loops(surface))))

    return distance


PEER, ROBUST_PEER = "potpourri3d heat", "potpourri3d robust"
# Every field that is compared: a new backend is one line.
FIELDS: Mapping[str, Field] = MappingProxyType(
    {
        "heat": _own("heat"),
        "fast-marching": _own("fast-marching"),
        PEER: _peer(robust=False),
        ROBUST_PEER: _peer(robust=True),
    }
)


@dataclass(frozen=True, slots=True)
class Sizes:
    """How large the meshes of a run are, in faces."""

    accuracy: int
    spacing: int
    order: tuple[int, ...]
    timed: tuple[int, ...]


FULL = Sizes(accuracy=30_000, spacing=100_000, order=(5_000, 20_000, 80_000), timed=(10_000, 100_000, 1_000_000))
SMOKE = Sizes(accuracy=300, spacing=1_000, order=(200, 400, 800), timed=(200, 400))


def main() -> None:
    """Print the tables asked for, all of them by default."""
    parser = script_parser(__doc__, smoke="small meshes, to see that the script runs")
    parser.add_argument("--table", nargs="*", choices=sorted(TABLES), help="only these tables")
    parser.add_argument("--faces", type=int, help="faces of the accuracy and spacing tables")
    arguments = parser.parse_args()
    sizes = SMOKE if arguments.smoke else FULL
    if arguments.faces is not None:
        sizes = Sizes(arguments.faces, arguments.faces, sizes.order, sizes.timed)
    if PEER not in _present_fields():
        print("potpourri3d is not installed and left out.")
    for name in arguments.table or TABLES:
        print(f"\n### {name}\n")
        for line in TABLES[name](sizes):
            print(line, flush=True)


def accuracy(sizes: Sizes) -> Iterator[str]:
    """Mean, 99th percentile and maximum of the error on every shape and style, and the mean over the peer's."""
    fields = _present_fields()
    yield row("surface", "style", *(f"{name}: mean / p99 / max, h" for name in fields), f"heat / {PEER}", "/ robust")
    yield rule(4 + len(fields))
    ratios: list[tuple[float, float]] = []
    for style in STYLES:
        for shape in SHAPES:
            surface, exact = _with_exact(shape, sizes.accuracy, style)
            errors = {name: _errors(field(surface), exact, surface) for name, field in fields.items()}
            ratios.append((_ratio(errors, PEER), _ratio(errors, ROBUST_PEER)))
            shown = (f"{e.mean():.3f} / {np.percentile(e, 99):.2f} / {e.max():.2f}" for e in errors.values())
            yield row(shape, style, *shown, *(f"{ratio:.2f}" for ratio in ratios[-1]))
    means = np.exp(np.log(ratios).mean(axis=0)).tolist()
    yield row("geometric mean", "", *("" for _ in fields), *(f"{ratio:.2f}" for ratio in means))


def spacing(sizes: Sizes) -> Iterator[str]:
    """Spacing CV and p95 deviation of 20 levels from the border, and the excess over that of the exact field.

    Wanted: fast marching's excess at most 0.05 points and its p95 at most 0.2 %; heat's excess at most 0.7 of the
    robust peer's in the geometric mean, and nowhere above 0.9.
    """
    fields = _present_fields()
    yield row(
        "surface", *(f"{name}: CV / p95" for name in ("exact", *fields)),
        "fast-marching's excess, points", "heat's excess / robust peer's",
    )  # fmt: skip
    yield rule(4 + len(fields))
    ratios: list[float] = []
    for shape in SPACING_SHAPES:
        surface, exact = _with_exact(shape, sizes.spacing, "irregular")
        step = float(exact.max()) / LEVELS
        measured = {
            name: _spacing_ratios(surface, values, step)
            for name, values in (("exact", exact), *((name, field(surface)) for name, field in fields.items()))
        }
        cvs = {name: float(ratio.std() / ratio.mean()) for name, ratio in measured.items()}
        excess = {name: cv - cvs["exact"] for name, cv in cvs.items()}
        ratios.append(excess["heat"] / excess.get(ROBUST_PEER, np.nan))
        shown = (
            f"{percent(cvs[name], 3)} / {percent(np.percentile(np.abs(r - 1), 95), 3)}" for name, r in measured.items()
        )
        yield row(shape, *shown, f"{100 * excess['fast-marching']:+.4f}", f"{ratios[-1]:.2f}")
    # On coarse meshes a field may be as even as the exact one; a thousandth stands for less.
    mean = float(np.exp(np.log(np.maximum(ratios, 1e-3)).mean()))
    yield row("geometric mean", *("" for _ in range(2 + len(fields))), f"{mean:.2f}")


def order(sizes: Sizes) -> Iterator[str]:
    """Mean error in mm over three refinements and the order of convergence fitted to them."""
    fields = _present_fields()
    yield row("surface", *(f"{name}: mean error, mm; order; last in h" for name in fields))
    yield rule(1 + len(fields))
    for shape in SHAPES:
        cases = [_with_exact(shape, faces, "irregular") for faces in sizes.order]
        widths = [float(edge_lengths(surface).mean()) for surface, _ in cases]
        shown: list[str] = []
        for field in fields.values():
            errors = [float(np.abs(field(surface) - exact).mean()) for surface, exact in cases]
            slope = float(np.polyfit(np.log(widths), np.log(errors), 1)[0])
            listed = " ".join(f"{error:.2g}" for error in errors)
            shown.append(f"{listed}; {slope:.2f}; {errors[-1] / widths[-1]:.3f}")
        yield row(shape, *shown)


def timing(sizes: Sizes) -> Iterator[str]:
    """Seconds for each field on a cap, with and without 100 levels of curves, and their ratios to the peer's."""
    yield row("faces", "field", "seconds", "with 100 levels", f"over {PEER}'s")
    yield rule(5)
    own = [name for name in FIELDS if name in BACKENDS]
    for name in own:
        FIELDS[name](make("cap", faces=500))  # Compiles.
    for faces in sizes.timed:
        surface = make("cap", faces=faces)
        times = {name: _times(surface, FIELDS[name], _traced) for name in own}
        if PEER in _present_fields():
            times[PEER] = _times(surface, FIELDS[PEER], _traced_by_peer)
        for name, (field, traced) in times.items():
            beside = "-"
            if PEER in times:
                beside = f"{field / times[PEER][0]:.2f}, {traced / times[PEER][1]:.2f}"
            yield row(f"{len(surface.faces)}", name, f"{field:.3f}", f"{traced:.3f}", beside)


def sources(sizes: Sizes) -> Iterator[str]:
    """Seconds for the first source with all that is made once, for other values on it, and for another source.

    The first two sources are points in one triangle, so that they hold the same vertices at other distances.
    """
    yield row("faces", "first", "same vertices, other values", "another source", "ratios")
    yield rule(5)
    FIELDS["heat"](make("cap", faces=500))  # Compiles.
    for faces in sizes.timed[:2]:
        surface = make("cap", faces=faces)
        asked = [_point(0.4), _point(0.3), boundary_source(surface)]
        start = time.perf_counter()
        solver = BACKENDS["heat"](surface)
        stops = [start]
        for source in asked:
            solver.distance(source)
            stops.append(time.perf_counter())
        first, second, third = np.diff(stops).tolist()
        shown = (f"{seconds:.3f} s" for seconds in (first, second, third))
        yield row(f"{len(surface.faces)}", *shown, f"{second / first:.2f}, {third / first:.2f}")


def _point(weight: float) -> Source:
    """Return a point in the first triangle."""
    place = SurfacePoints(np.array([0]), np.array([[weight, 0.5 - weight / 2, 0.5 - weight / 2]]))
    return Source(SurfaceCurves(place, np.array([0, 1]), np.array([False])))


TABLES: Mapping[str, Callable[[Sizes], Iterator[str]]] = MappingProxyType(
    {"accuracy": accuracy, "spacing": spacing, "order": order, "time": timing, "sources": sources}
)


def _present_fields() -> dict[str, Field]:
    """Return the fields whose library is installed."""
    peers = importlib.util.find_spec("potpourri3d") is not None
    return {name: field for name, field in FIELDS.items() if peers or name in BACKENDS}


def _with_exact(shape: str, faces: int, style: str) -> tuple[Surface, FloatArray]:
    """Return a surface and its exact distance; the formulas of curved shapes hold for the smooth shape alone."""
    surface = make(shape, faces=faces, style=style)
    formula = SHAPES[shape]().distance
    return surface, formula(surface.vertices) if shape == "plate" and formula else exact_distance(surface)


def _errors(values: FloatArray, exact: FloatArray, surface: Surface) -> FloatArray:
    # Window propagation leaves infinity behind where it breaks down on slivers; the mean is over the others.
    known = np.isfinite(exact)
    return np.abs(values - exact)[known] / float(edge_lengths(surface).mean())


def _ratio(errors: dict[str, FloatArray], peer: str) -> float:
    return float(errors["heat"].mean() / errors[peer].mean()) if peer in errors else np.nan


def _times(
    surface: Surface, field: Field, trace: Callable[[Surface, FloatArray, float], object]
) -> tuple[float, float]:
    """Return the least seconds for a field, and for it and its level curves."""
    times: list[tuple[float, float]] = []
    for _ in range(REPEATS if len(surface.faces) < LARGE else 1):
        start = time.perf_counter()
        values = field(surface)
        solved = time.perf_counter()
        trace(surface, values, float(values.max()) / TIMED_LEVELS)
        times.append((solved - start, time.perf_counter() - start))
    field_seconds, traced_seconds = np.min(times, axis=0).tolist()
    return field_seconds, traced_seconds


def _traced(surface: Surface, values: FloatArray, step: float) -> list[list[FloatArray]]:
    """Return the level curves at (k + 1/2) steps as polylines, level by level."""
    field = ScalarField(np.maximum(values, 0.0))
    curves, curve_levels = isolines(surface, field, levels=level_distances(field, spacing=step))
    lines = np.split(positions(surface, curves.points), curves.offsets[1:-1])
    return [[lines[i] for i in np.flatnonzero(curve_levels == level)] for level in np.unique(curve_levels)]


def _traced_by_peer(surface: Surface, values: FloatArray, step: float) -> None:
    marching = importlib.import_module("potpourri3d").MeshMarchingTrianglesSolver(surface.vertices, surface.faces)
    for level in range(TIMED_LEVELS):
        marching.marching_triangles(values, (level + 0.5) * step)


def _spacing_ratios(surface: Surface, values: FloatArray, step: float) -> FloatArray:
    """Return the exact distance over the surface from samples on every level to the level before, over the step."""
    field = ScalarField(np.maximum(values, 0.0))
    curves, levels = isolines(surface, field, levels=level_distances(field, spacing=step))
    mesh = flat_mesh(surface)
    runs = np.repeat(np.arange(curves.count), np.diff(curves.offsets))
    path = trace(mesh, flat_places(mesh, curves.points), runs=runs, levels=levels, closed=curves.closed)
    samples = sampled(path, step=step / SAMPLES_PER_SPACING)
    samples = samples.some(levels[samples.runs] > levels.min())
    found = outer_distance(mesh, path, GeodesicDistance(mesh, path), samples, spacing=step)
    assert found.exact.all(), "the exact distance took too much work"
    return found.distances / step


if __name__ == "__main__":
    main()
