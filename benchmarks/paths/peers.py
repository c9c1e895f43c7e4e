"""How even and how fast are isolines of the distance from the border, beside other programs? Prints a Markdown table.

    python -m benchmarks.paths.peers [--parts FILE ...] [--faces N] [--smoke]

Every method gets the same mesh, in this process, and ends in polylines; `geoprint.metrics.uniformity` measures all of
them: the thickness of the layer that a constant flow leaves, what is covered, and as a detail that tells distances
apart the exact spacing from level to level. Install the peers with `pip install potpourri3d libigl`; those that are
missing are left out, and named.

- potpourri3d (geometry-central): the heat method as published, and on the tufted intrinsic Laplacian; its marching
  triangles. Its wheel uses Eigen's simplicial solver; a build with SuiteSparse factorises several times faster on large
  meshes.
- libigl: the heat method and `exact_geodesic` (window propagation); its isolines. Both measure from the vertices of the
  border, not from its edges, as potpourri3d does, so that distances near the border are too long by up to an eighth of
  a squared edge length over the distance.
- compas_slicer 0.7 demands numpy 1.23 or older and libigl 2.4, so that it cannot stand beside geoprint (numpy 1.26 or
  newer). By default its curved slicing interpolates libigl's `exact_geodesic` from vertices: the row of that name shows
  its distance, traced by libigl. (Its own heat method diffuses in 250 steps, each a new sparse solve.)

Times are the least of several runs, for the distance with all that it needs, and with the isolines. They are of one
source: who asks again pays less, with every method.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from benchmarks import DATA
from benchmarks.parts.surfaces import SHAPES, Shape, cap, triangulated
from benchmarks.parts.tables import least_seconds, script_parser
from geoprint.distance import BACKENDS
from geoprint.distance.heat import Heat
from geoprint.errors import GeoprintError, percent
from geoprint.geometry import boundary_loops, boundary_source, positions, prepare, refine
from geoprint.geometry.files import load
from geoprint.metrics import uniformity
from geoprint.model import FloatArray, IntArray, PoseStream, Surface
from geoprint.reporting.metrics import COVERED_ONCE, GAP, LEVELS, OVERLAP, THICKNESS

SPACING = 1.0
SMOKE_SPACING = 4.0
FACES = 20_000
SMOKE_FACES = 1_000
# Surfaces by formula and the style of their triangles; slivers are what spoils most methods.
CASES: tuple[tuple[str, Callable[[], Shape], str], ...] = (
    ("cap, 70 degrees", lambda: cap(70.0), "irregular"),
    ("saddle", SHAPES["saddle"], "irregular"),
    ("saddle", SHAPES["saddle"], "sliver"),
    ("bumpy", SHAPES["bumpy"], "irregular"),
)

Distance = Callable[[Surface], FloatArray]
# Polylines on the surface [mm] and the level of each.
Isolines = tuple[list[FloatArray], list[int]]


@dataclass(frozen=True, slots=True)
class Method:
    """A method that goes from a surface to isolines at (k + 1/2) spacings from its border.

    Attributes:
        library: that must be installed.
        distance: of every vertex [mm].
        isolines: from nothing, the distance included.
    """

    library: str
    distance: Distance
    isolines: Callable[[Surface, float], Isolines]


def main() -> None:
    """Print the table."""
    parser = script_parser(__doc__, smoke="one small mesh, to see that the script runs")
    parser.add_argument("--parts", nargs="+", type=Path, default=[DATA / "heart_apex_patch.ply"], metavar="FILE")
    parser.add_argument("--faces", type=int, default=FACES, help="of the surfaces by formula")
    arguments = parser.parse_args()
    spacing = SMOKE_SPACING if arguments.smoke else SPACING
    surfaces = [
        triangulated(shape(), name=name, faces=SMOKE_FACES if arguments.smoke else arguments.faces, style=style)
        for name, shape, style in CASES[: 1 if arguments.smoke else None]
    ]
    surfaces += [] if arguments.smoke else [_refined(path) for path in arguments.parts]
    for line in table(surfaces, spacing=spacing):
        print(line, flush=True)


def table(surfaces: list[Surface], *, spacing: float) -> Iterator[str]:
    """Return one row a method on each surface."""
    present = {name: method for name, method in METHODS.items() if importlib.util.find_spec(method.library)}
    missing = sorted({method.library for method in METHODS.values()} - {method.library for method in present.values()})
    record = " | ".join(metric.column for metric in (THICKNESS, COVERED_ONCE, GAP, OVERLAP, LEVELS))
    yield f"| surface | faces | method | distance, s | with isolines, s | {record} |"
    yield "|" + "---|" * 10
    for surface in surfaces:
        for name, method in present.items():
            method.isolines(surface, spacing)  # Compiles.
            found = least_seconds(lambda method=method, surface=surface: method.distance(surface))
            traced = least_seconds(lambda method=method, surface=surface: method.isolines(surface, spacing))
            named = f"| {surface.name} | {len(surface.faces)} | {name} | {found:.3f} | {traced:.3f} |"
            try:
                measured = uniformity(_stream(*method.isolines(surface, spacing)), surface, spacing=spacing)
            except GeoprintError as error:
                yield f"{named} not measured: {error} | | | | |"
                continue
            assert measured.levels is not None
            yield (
                f"{named} {percent(measured.thickness.cv, 2)} | {percent(measured.covered_once, 2)} | "
                f"{percent(measured.gap, 2)} | {percent(measured.overlap, 2)} | "
                f"{percent(measured.levels.figures.cv, 2)} |"
            )
    for library in missing:
        yield f"{'igl (pip install libigl)' if library == 'igl' else library} is not installed and left out."


def _own(name: str) -> Method:
    def distance(surface: Surface) -> FloatArray:
        return BACKENDS[name](surface).distance(boundary_source(surface)).values

    def isolines(surface: Surface, spacing: float) -> Isolines:
        contours = BACKENDS[name](surface).contours(boundary_source(surface), spacing=spacing)
        places = positions(surface, contours.curves.points)
        return np.split(places, contours.curves.offsets[1:-1]), contours.levels.tolist()

    return Method("geoprint", distance, isolines)


def _potpourri(*, robust: bool) -> Method:
    def distance(surface: Surface) -> FloatArray:
        library = importlib.import_module("potpourri3d")
        solver = library.MeshHeatMethodDistanceSolver(surface.vertices, surface.faces, use_robust=robust)
        return np.asarray(solver.compute_distance_multisource(_border(surface)), dtype=np.float64)

    def isolines(surface: Surface, spacing: float) -> Isolines:
        library = importlib.import_module("potpourri3d")
        values = distance(surface)
        marching = library.MeshMarchingTrianglesSolver(surface.vertices, surface.faces)
        ends = surface.vertices[np.asarray(library.edges(surface.vertices, surface.faces), dtype=np.int64)]
        lines: list[FloatArray] = []
        levels: list[int] = []
        for level, value in enumerate(_level_values(values, spacing)):
            for curve in marching.marching_triangles(values, value):
                lines.append(_on_mesh(curve, ends, surface.vertices))
                levels.append(level)
        return lines, levels

    return Method("potpourri3d", distance, isolines)


def _libigl(distance: Distance) -> Method:
    def isolines(surface: Surface, spacing: float) -> Isolines:
        library = importlib.import_module("igl")
        values = distance(surface)
        found = library.isolines(surface.vertices, surface.faces, values, _level_values(values, spacing))
        places, segments, numbers = (np.asarray(array) for array in found)
        return chained(places, segments.astype(np.int64), numbers.astype(np.int64))

    return Method("igl", distance, isolines)


def _libigl_heat(surface: Surface) -> FloatArray:
    library = importlib.import_module("igl")
    solver = library.HeatGeodesicsData()
    library.heat_geodesics_precompute(surface.vertices, surface.faces, solver)
    return np.asarray(library.heat_geodesics_solve(solver, _border(surface)), dtype=np.float64)


def _libigl_exact(surface: Surface) -> FloatArray:
    library = importlib.import_module("igl")
    nothing, everywhere = np.zeros(0, dtype=np.int64), np.arange(len(surface.vertices))
    found = library.exact_geodesic(surface.vertices, surface.faces, _border(surface), nothing, everywhere)
    return np.asarray(found, dtype=np.float64)


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "geoprint heat": _own("heat"),
        "geoprint fast-marching": _own("fast-marching"),
        "potpourri3d heat": _potpourri(robust=False),
        "potpourri3d robust": _potpourri(robust=True),
        "libigl heat": _libigl(_libigl_heat),
        "libigl exact": _libigl(_libigl_exact),
    }
)


def _refined(path: Path) -> Surface:
    """Return a part [mm] as the default backend plans on it."""
    part, _ = prepare(load(path, unit="mm"))
    return refine(part, edge_length=Heat.edge_length(part, spacing=SPACING))


def _border(surface: Surface) -> IntArray:
    return np.concatenate(boundary_loops(surface)).astype(np.int64)


def _level_values(values: FloatArray, spacing: float) -> FloatArray:
    """Return the distances (k + 1/2) * spacing that lie on the surface [mm]."""
    return np.arange(0.5 * spacing, float(values.max()), spacing)


def _on_mesh(curve: list[tuple[int, list[float]]], ends: FloatArray, vertices: FloatArray) -> FloatArray:
    """Return the places of potpourri3d's curve: points on edges, or vertices."""
    places = [
        (1.0 - share[0]) * ends[number, 0] + share[0] * ends[number, 1] if share else vertices[number]
        for number, share in curve
    ]
    return np.array(places)


def chained(places: FloatArray, segments: IntArray, numbers: IntArray) -> Isolines:
    """Join libigl's directed segments to polylines; a closed one repeats its first place."""
    following = dict(zip(segments[:, 0].tolist(), segments[:, 1].tolist(), strict=True))
    level_of = dict(zip(segments[:, 0].tolist(), numbers.tolist(), strict=True))
    lines: list[FloatArray] = []
    levels: list[int] = []
    # Open lines start where no segment ends; what is left are closed ones.
    for start in [*np.setdiff1d(segments[:, 0], segments[:, 1]).tolist(), *segments[:, 0].tolist()]:
        if start not in following:
            continue
        levels.append(level_of[start])
        line = [start]
        while line[-1] in following:
            line.append(following.pop(line[-1]))
        lines.append(places[line])
    return lines, levels


def _stream(lines: list[FloatArray], levels: list[int]) -> PoseStream:
    """Return polylines as a stream that deposits along them; its attitudes mean nothing."""
    counts = [len(line) for line in lines]
    points = np.concatenate(lines)
    return PoseStream(
        tips=points,
        quaternions=np.tile([0.0, 1.0, 0.0, 0.0], (len(points), 1)),
        normals=np.tile([0.0, 0.0, 1.0], (len(points), 1)),
        runs=np.repeat(np.arange(len(lines)), counts),
        levels=np.repeat(np.array(levels), counts),
        layers=np.zeros(len(points), dtype=np.int64),
        deposit=np.ones(len(points), dtype=np.bool_),
        stops=np.zeros(len(points), dtype=np.bool_),
        arcs=np.zeros(len(points)),
        flow=np.ones(len(points)),
        standoff=0.0,
    )


if __name__ == "__main__":
    main()
