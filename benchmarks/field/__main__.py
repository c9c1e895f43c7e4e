"""The yardstick of the field: every planner's paths on the same parts, by the same measure.

    python -m benchmarks.field --out FOLDER [--each N] [--workers N] [--submission FOLDER ...] [--keep] [--smoke]
    python -m benchmarks.field --out FOLDER --parts FILE ...

Planners are geoprint's backends and patterns, and others that install by pip (`pip install potpourri3d libigl
shapely`): isolines of potpourri3d's and libigl's distances, traced by their own marching, on meshes with edges of half
a spacing; libigl's exact distance is what compas_slicer's curved slicing interpolates by default (it demands numpy 1.23
or older, and cannot stand beside geoprint); the concentric infill of a slicer for flat layers, projected onto the part;
and slices by planes one spacing apart. Those that are missing are left out, and named. Parts are surfaces by formula,
patches of a synthetic cohort of hearts and shells of robots' links (`pip install example-robot-data rtb-data`), a third
each, from one random seed; or any mesh files [mm]. All are judged by what `geoprint measure` says of a file of their
paths. `--submission` takes such files from a folder, one for each part, called as the part: its name is the planner's.

A planner on a part is a cell of a study, as `geoprint sweep` runs them: one thread a process, limits of time and
memory, refusals are rows, and the same command goes on where it was stopped. Tables and the page, FOLDER/field.html,
are of the parts that all planners have been asked about; `--table` makes them without running more. `--keep` writes
`benchmarks/field/figures.csv`, of which the guide's page draws its picture.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

from benchmarks import DATA
from benchmarks.field.figures import KEPT, Figures, save, table
from benchmarks.field.page import field_page
from benchmarks.field.parts import EACH, FAMILIES, LISTED, listed_parts, make_parts, taken_parts
from benchmarks.field.planners import PLANNERS, missing_libraries, present_planners
from benchmarks.field.study import field_study, figures_in, finished, hours, run
from benchmarks.parts.tables import script_parser
from geoprint.errors import how_many

PAGE, PARTS = "field.html", "parts"
# Area over squared spacing in the smoke run: wide spacings are quick.
SMOKE_SQUARES = 40.0


def main() -> None:
    """Run what is left of the study, print the table and write the page."""
    parser = script_parser(__doc__, smoke="the plate at a wide spacing, to see that the script runs")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="of parts, cells and page; required")
    parser.add_argument("--each", type=int, default=EACH, metavar="N", help="parts of each family")
    parser.add_argument("--parts", nargs="+", type=Path, default=[], metavar="FILE", help="meshes [mm] instead")
    parser.add_argument("--submission", nargs="+", type=Path, default=[], metavar="FOLDER", help="toolpaths of others")
    parser.add_argument("--workers", type=int, metavar="N", help="processes; by default one for each processor")
    parser.add_argument("--table", action="store_true", help="of what has been run, without running more")
    parser.add_argument(
        "--keep", action="store_true", help=f"write {KEPT.name}; of the parts of its own and all planners"
    )
    arguments = parser.parse_args()
    if arguments.smoke:
        with tempfile.TemporaryDirectory() as folder:
            taken_parts([DATA / "plate.ply"], Path(folder, PARTS), squares=SMOKE_SQUARES)
            judged(Path(folder), {}, workers=1)
        return
    if arguments.out is None:
        parser.error("--out names the folder")
    if arguments.keep and (arguments.parts or arguments.submission or missing_libraries()):
        parser.error("--keep writes what everybody can make again: all parts and planners, and nothing else")
    out: Path = arguments.out
    folder = out / PARTS
    if arguments.parts:
        taken_parts(arguments.parts, folder)
    elif not (folder / LISTED).is_file():
        for reason in make_parts(folder, each=arguments.each):
            print(f"another part was taken: {reason}")
    if arguments.keep and {part.family for part in listed_parts(folder)} - {*FAMILIES}:
        parser.error(f"--keep: {folder} holds parts of somebody's own; name another --out")
    submissions = {given.name: given for given in arguments.submission}
    taken = [name for name in submissions if name in PLANNERS]
    if taken or len(submissions) < len(arguments.submission):
        parser.error("--submission: each folder needs a name of its own, and none of the planners here")
    found = judged(out, submissions, workers=arguments.workers, more=not arguments.table)
    if arguments.keep:
        save(found, KEPT)


def judged(out: Path, submissions: Mapping[str, Path], *, workers: int | None, more: bool = True) -> list[Figures]:
    """Judge what has not been judged, if more is wanted; print the table, write the page, and return the figures."""
    parts = out / PARTS
    study = field_study(listed_parts(parts), parts, dict(present_planners()), submissions)
    if more:
        run(study, out, submissions=submissions, workers=workers)
    study = finished(study, out)
    found, spent = list(figures_in(study, out)), hours(study, out)
    for text in table(found):
        print(text)
    print(f"{how_many(len({each.part for each in found}), 'part')}, {spent:.2f} h of processor time")
    for library in missing_libraries():
        print(f"{'libigl' if library == 'igl' else library} is not installed and left out.")
    (out / PAGE).write_bytes(field_page(found, study, hours=spent))
    return found


if __name__ == "__main__":
    main()
