"""Which self-intersections does each test find, and how fast, beside other programs? Prints a Markdown table.

    python -m benchmarks.readers.crossings [--parts FILE ...] [--faces N] [--smoke]

Every test gets the same triangles, as preparing joins them. Install the peers with `pip install pymeshlab libigl`;
those that are missing are left out, and named.

- PyMeshLab (GPL) selects the faces that cross others, on its own copy of the mesh, which is not timed.
- libigl's detection is that of CGAL (GPL), in exact arithmetic; it lists CUTOFF pairs at most.
- Ours counts what passes through by more than the tolerance of joining, or lies on each other within it; it lists
  MOST_PAIRS at most.

Times are processor time of this process, the least of several.
"""

from __future__ import annotations

import importlib
import importlib.util
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from benchmarks.parts.surfaces import make
from benchmarks.parts.tables import row, rule, script_parser
from geoprint.errors import GeoprintError
from geoprint.geometry import join
from geoprint.geometry.crossings import crossings
from geoprint.geometry.files import load_file, suggested_unit
from geoprint.model import Surface

FACES, SMOKE_FACES = 200_000, 2_000
CUTOFF = 1_000_000
REPEATS = 3

# Makes ready what is not timed, and returns the search, which returns what it counts.
Test = Callable[[Surface, float], Callable[[], int]]


def _ours(surface: Surface, depth: float) -> Callable[[], int]:
    return lambda: len(crossings(surface, depth=depth)[0])


def _pymeshlab(surface: Surface, _: float) -> Callable[[], int]:
    library: Any = importlib.import_module("pymeshlab")
    meshes = library.MeshSet()
    meshes.add_mesh(library.Mesh(surface.vertices, surface.faces))

    def search() -> int:
        meshes.compute_selection_by_self_intersections_per_face()
        return int(meshes.current_mesh().selected_face_number())

    return search


def _libigl(surface: Surface, _: float) -> Callable[[], int]:
    library: Any = importlib.import_module("igl.copyleft.cgal")
    vertices, faces = surface.vertices.copy(), surface.faces.copy()
    return lambda: len(library.remesh_self_intersections(vertices, faces, detect_only=True, cutoff=CUTOFF)[2])


# The package that each test needs, what it counts, and the test.
TESTS: Mapping[str, tuple[str, str, Test]] = MappingProxyType(
    {
        "ours": ("geoprint", "pairs", _ours),
        "PyMeshLab": ("pymeshlab", "faces", _pymeshlab),
        "libigl (CGAL)": ("igl", "pairs", _libigl),
    }
)


def main() -> None:
    """Print the table."""
    parser = script_parser(__doc__, smoke="a small surface, to see that the script runs")
    parser.add_argument("--parts", type=Path, nargs="*", default=[], help="meshes, of which the unit is guessed")
    parser.add_argument("--faces", type=int, default=FACES, help="of the surface by formula")
    arguments = parser.parse_args()
    surfaces = [make("bumpy", faces=SMOKE_FACES if arguments.smoke else arguments.faces)]
    for path in arguments.parts:
        try:
            surfaces.append(load_file(path, unit=suggested_unit(path)[0]).surface)
        except GeoprintError as error:
            print(f"{path.name} is left out: {error}")
    for line in table(surfaces):
        print(line, flush=True)


def table(surfaces: list[Surface]) -> list[str]:
    """Return the lines of the table, and before it the peers that are missing."""
    found = {name: test for name, test in TESTS.items() if importlib.util.find_spec(test[0]) is not None}
    heads = [f"{name}: {counts}, time" for name, (_, counts, _) in found.items()]
    return [
        *(f"{name} is left out: {TESTS[name][0]} is not installed" for name in TESTS if name not in found),
        row("surface", "faces", *heads),
        rule(2 + len(heads)),
        *(row(surface.name, f"{len(surface.faces)}", *_cells(surface, list(found))) for surface in surfaces),
    ]


def _cells(surface: Surface, names: list[str]) -> list[str]:
    """Return what each test finds on a surface and how long it takes, those of others also over ours."""
    cells: list[str] = []
    try:
        joined = join(surface)
    except GeoprintError:
        return ["refused"] * len(names)
    ours = 0.0
    for name in names:
        search = TESTS[name][2](joined.surface, joined.tolerance)
        count, seconds = _timed(search)
        ours = ours or seconds
        cells.append(f"{count}, {1000 * seconds:.1f} ms" + ("" if name == "ours" else f" ({seconds / ours:.1f} x)"))
    return cells


def _timed(search: Callable[[], int]) -> tuple[int, float]:
    """Return what a search counts, and the least processor time it takes [s]."""
    count, times = search(), list[float]()
    for _ in range(REPEATS):
        start = time.process_time()
        search()
        times.append(time.process_time() - start)
    return count, max(min(times), 1e-6)


if __name__ == "__main__":
    main()
