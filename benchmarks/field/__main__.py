"""The yardstick: every planner's paths on the same parts, by the same exact measure.

    python -m benchmarks.field [--parts FILE ...] [--spacing MM] [--keep] [--smoke]

Planners are geoprint's backends and patterns, and others that install by pip (`pip install potpourri3d libigl
shapely`): isolines of potpourri3d's and libigl's distances, traced by their own marching, on meshes with edges of half
a spacing; libigl's exact distance is what compas_slicer's curved slicing interpolates by default (it demands numpy 1.23
or older, and cannot stand beside geoprint); and the concentric infill of a slicer for flat layers, projected onto the
part. Those that are missing are left out, and named. Parts are patches by formula, those of data/, and any mesh files
[mm]. All are judged by `geoprint.measure_paths`, which knows nothing of who made the paths. `--keep` writes the table
of the parts by formula and of data/ to `benchmarks/field/figures.csv`, of which the guide's page draws its picture.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

from benchmarks import DATA
from benchmarks.field.figures import KEPT, Figures, figures_of, line, save, table
from benchmarks.field.planners import Planner, missing_libraries, present_planners
from benchmarks.parts.surfaces import SHAPES, Shape, cap, triangulated
from benchmarks.parts.tables import script_parser
from geoprint import measure_paths
from geoprint.errors import GeoprintError
from geoprint.geometry.files import load, save_ply

SPACING, SMOKE_SPACING = 1.0, 8.0
# Points of other planners' paths may lie so far beside the part, over the spacing: chords of curves do.
BESIDE = 0.2
FACES = 8_000
FORMULAS: Mapping[str, Shape] = MappingProxyType(
    {
        "half cylinder": SHAPES["cylinder"](),
        "cap, 45 degrees": cap(45.0),
        "cap, 70 degrees": cap(70.0),
        "saddle": SHAPES["saddle"](),
        "bumpy": SHAPES["bumpy"](),
        "sheet with hole": SHAPES["sheet with hole"](),
    }
)
OWN_PARTS = ("plate", "heart_flat_patch", "heart_apex_patch")


def main() -> None:
    """Print the table."""
    parser = script_parser(__doc__, smoke="the plate at 8 mm, to see that the script runs")
    parser.add_argument("--parts", nargs="+", type=Path, default=[], metavar="FILE", help="meshes [mm] besides")
    parser.add_argument("--spacing", type=float, default=SPACING, metavar="MM")
    parser.add_argument("--keep", action="store_true", help=f"write {KEPT.name}; not with --parts")
    arguments = parser.parse_args()
    spacing: float = SMOKE_SPACING if arguments.smoke else arguments.spacing
    if arguments.keep and (arguments.parts or arguments.smoke or spacing != SPACING):
        parser.error("--keep writes what everybody can make again: without --parts, --smoke and another --spacing")
    found: list[Figures] = []
    for text in table([]):
        print(text)
    with tempfile.TemporaryDirectory() as folder:
        parts = {"plate": DATA / "plate.ply"} if arguments.smoke else _parts(Path(folder), arguments.parts)
        for name, part in parts.items():
            for each in judged(name, part, spacing=spacing):
                found.append(each)
                print(line(each), flush=True)
    for library in missing_libraries():
        print(f"{'libigl' if library == 'igl' else library} is not installed and left out.")
    if arguments.keep:
        save(found, KEPT)


def judged(name: str, part: Path, *, spacing: float) -> Iterator[Figures]:
    """Yield the figures of every planner that is installed on a part."""
    for planner_name, planner in present_planners():
        yield _figures(name, part, planner_name, planner, spacing=spacing)


def _figures(name: str, part: Path, planner_name: str, planner: Planner, *, spacing: float) -> Figures:
    try:
        measured = measure_paths(
            load(part, unit="mm"), planner.paths(part, spacing), spacing=spacing, offset_up_to=BESIDE * spacing
        )
    except GeoprintError as error:
        return Figures(name, planner_name, planner.ours, refused=str(error))
    return figures_of(measured, part=name, planner=planner_name, ours=planner.ours)


def _parts(folder: Path, more: list[Path]) -> dict[str, Path]:
    """Return the parts, those by formula written to a folder."""
    parts: dict[str, Path] = {}
    for name, shape in FORMULAS.items():
        parts[name] = folder / f"{name.replace(' ', '_').replace(',', '')}.ply"
        save_ply(triangulated(shape, name=name, faces=FACES), parts[name])
    return parts | {name: DATA / f"{name}.ply" for name in OWN_PARTS} | {path.stem: path for path in more}


if __name__ == "__main__":
    main()
