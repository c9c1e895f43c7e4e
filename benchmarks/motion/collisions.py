"""Does the collision check find what is planted, and only that? Obstacles at known distances on real plans.

    python -m benchmarks.motion.collisions [--cases N] [--layer-cases N] [--table-cases N] [--parts FILE ...]
        [--cell FILE] [--smoke]

On every part a path is planned, and then checked again with one obstacle besides: collisions from a graze of the
clearance, over a graze of the body itself, to deep ones, and halls around everything; and near misses, 0.2 mm beyond
the clearance. Obstacles are thin posts, plates and blocks at the sides of needle, cone, barrel, bracket, lamp and the
arm's links, at any moment from home to home (`benchmarks.motion.planted`). The nozzle leans where that serves the
speed. At last the tip is lowered by 0.05 mm on all deposit, where nothing must be reported.

The second table is of a layer on each part, where only what is printed below is in the way: a lump on it at a known
distance from whatever moves, or all of it so much too high that the tip goes through its top; and near misses of both.
Over the bare part, without the layers, the same path is clear.

The third table is of a part on each kind of table that tilts it, in two of its attitudes: the same obstacles where the
part stands then; and the table itself, shifted under the part so that a point of plate, leg, hub or stand is at a known
distance from a spot of what moves, whatever else of it is nearer; and near misses, in which the nearest of all of it is
0.2 mm beyond the clearance (`benchmarks.motion.planted`). One column is of the arm at home while the shifted
table goes to the attitude: what then comes within the clearance must be refused. There are no near misses of that,
because a proof for all that moves at once keeps some millimetres more.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType

import numpy as np

from benchmarks.motion.attitudes import APEX, TABLES, cell_with
from benchmarks.motion.planted import KINDS, hall, near_miss
from benchmarks.motion.planted_scenes import (
    BEYOND,
    DEPTHS,
    GRAZE,
    SOLIDS,
    STANDOFF_ERROR,
    Scene,
    is_refused_in_motion,
    is_refused_over,
    raised_layers,
    scene_at,
    tables_at_home,
    tables_beside,
    tables_in_the_way,
    with_lump,
)
from benchmarks.parts.tables import row, rule
from benchmarks.paths.uniformity import DATA
from geoprint.config import job_of
from geoprint.errors import ClearanceError
from geoprint.model import Surface
from geoprint.toolpath import largest_lean
from geoprint.workflow import plan

PARTS = (DATA / "heart_flat_patch.ply", DATA / "heart_apex_patch.ply", DATA / "plate.ply")
SPACING = 3.0
# In the smoke run: a small disc of the plate [mm].
SMOKE_DISC: Mapping[str, object] = MappingProxyType(
    {
        "patch": {"at": [0.0, 0.0, 0.0], "radius": 4.0},
        "spacing": 4.0,
        "max_tilt": 0.0,
        "on_slowdown": "follow",
        "accept_flow": True,
    }
)
# How parts are planned.
PLANNED: Mapping[str, object] = MappingProxyType({"spacing": SPACING})
# Which layer of half a millimetre is planned, and how deep the tip goes through the top of what lies below it [mm].
LAYERS = 3
TIP_DEPTHS = (0.05, 0.3, 1.0)


def main() -> None:
    """Print what was found of what was planted."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=200, help="collisions, and as many near misses, over all parts")
    parser.add_argument("--parts", nargs="+", type=Path, default=PARTS, metavar="FILE", help="meshes [mm]")
    parser.add_argument("--layer-cases", type=int, default=100, help="the same where printed layers are in the way")
    parser.add_argument("--table-cases", type=int, default=48, help="the same over tables, of obstacles and of tables")
    parser.add_argument("--cell", type=Path, help="cell of the first two tables, with another arm for example")
    parser.add_argument(
        "--smoke", action="store_true", help="a case of the first two tables, to see that the script runs"
    )
    arguments = parser.parse_args()
    keys = {**PLANNED, "cell": arguments.cell}
    if arguments.smoke:
        # Tables that tilt are planned and tried by tests/benchmarks/test_planted_tables.py.
        lines = [of([DATA / "plate.ply"], cases=1, keys=SMOKE_DISC) for of in (table, layer_table)]
    else:
        lines = [
            table(arguments.parts, cases=arguments.cases, keys=keys),
            layer_table(arguments.parts, cases=arguments.layer_cases, keys=keys),
            tilted_table(TABLES, cases=arguments.table_cases),
        ]
    for line in chain(*lines):
        print(line, flush=True)


def table(parts: Sequence[Path], *, cases: int, keys: Mapping[str, object] = PLANNED) -> Iterator[str]:
    """Yield a line for each part, planned by keys of a job, and for what was missed or wrongly reported."""
    yield row("part", "largest lean", "collisions found", "near misses reported", "tip 0.05 mm low", "s a check")
    yield rule(6)
    for index, part in enumerate(parts):
        scene = scene_of(part, **keys)
        random = np.random.default_rng(index)
        count = cases // len(parts) + (index < cases % len(parts))
        start = time.perf_counter()
        missed = [name for name, body in collisions(scene, count=count, random=random) if not scene.is_refused(body)]
        wrong = [name for name, body in near_misses(scene, count=count, random=random) if scene.is_refused(body)]
        seconds = (time.perf_counter() - start) / (2 * count)
        found = f"{count - len(missed)} of {count}"
        lean = f"{np.degrees(largest_lean(scene.planned.poses)):.1f} deg"
        yield row(part.stem, lean, found, f"{len(wrong)} of {count}", _lowered_verdict(scene), f"{seconds:.1f}")
        yield from (f"  missed: {name} x{times}" for name, times in Counter(missed).items())
        yield from (f"  wrongly reported: {name} x{times}" for name, times in Counter(wrong).items())


def layer_table(parts: Sequence[Path], *, cases: int, keys: Mapping[str, object] = PLANNED) -> Iterator[str]:
    """Yield a line for each part, of which a layer is planned, and for what was missed or wrongly reported."""
    yield ""
    yield row("part, layer", "printed layers found", "near misses reported", "s a check")
    yield rule(4)
    for index, part in enumerate(parts):
        scene = scene_of(part, thickness=LAYERS * 0.5, layer=LAYERS, **keys)
        scene.check_without_layers()
        random = np.random.default_rng(100 + index)
        count = cases // len(parts) + (index < cases % len(parts))
        start = time.perf_counter()
        planted = list(layers_in_the_way(scene, count=count, random=random))
        missed = [name for name, ground in planted if not scene.is_refused_by(ground)]
        wrong = [
            name for name, ground in layers_beside(scene, count=count, random=random) if scene.is_refused_by(ground)
        ]
        seconds = (time.perf_counter() - start) / (2 * count)
        found = f"{count - len(missed)} of {count}"
        yield row(f"{part.stem}, {LAYERS}", found, f"{len(wrong)} of {count}", f"{seconds:.1f}")
        yield from (f"  missed: {name} x{times}" for name, times in Counter(missed).items())
        yield from (f"  wrongly reported: {name} x{times}" for name, times in Counter(wrong).items())


def layers_in_the_way(scene: Scene, *, count: int, random: np.random.Generator) -> Iterator[tuple[str, Surface]]:
    """Yield what of the layers below is in the way, and they; one in five is all of them, too high by so much."""
    for case, (name, obstacle) in enumerate(collisions(scene, count=count, random=random)):
        if case % 5 == 4:
            depth = TIP_DEPTHS[case // 5 % len(TIP_DEPTHS)]
            over = scene.planned.poses.standoff + scene.planned.workpiece.below
            yield f"tip {depth:g} mm within", raised_layers(scene.planned, by=over + depth)
        else:
            yield name, with_lump(scene.planned.workpiece.ground, obstacle)


def layers_beside(scene: Scene, *, count: int, random: np.random.Generator) -> Iterator[tuple[str, Surface]]:
    """Yield what of the layers below is nearly in the way, and they; one in five is all of them, a little off."""
    for case, (name, obstacle) in enumerate(near_misses(scene, count=count, random=random)):
        if case % 5 == 4:
            by = (STANDOFF_ERROR, -STANDOFF_ERROR)[case // 5 % 2]
            yield f"layers {by:+g} mm higher", raised_layers(scene.planned, by=by)
        else:
            yield name, with_lump(scene.planned.workpiece.ground, obstacle)


def tilted_table(kinds: Sequence[str], *, cases: int, keys: Mapping[str, object] = PLANNED) -> Iterator[str]:
    """Yield a line for each attitude of each kind of table, and for what was missed or wrongly reported."""
    yield ""
    yield row(
        "table, attitude", "obstacles found", "near misses reported", "tables found", "near misses reported",
        "tables found in motion", "s a check",
    )  # fmt: skip
    yield rule(7)
    for kind in kinds:
        scenes = scenes_over(kind, **keys)
        for index, scene in enumerate(scenes):
            random = np.random.default_rng(200 + index)
            share = len(kinds) * len(scenes)
            count = cases // share + (index < cases % share)
            start = time.perf_counter()
            bodies, beside = (list(of(scene, count=count, random=random)) for of in (collisions, near_misses))
            tables, off = (list(of(scene, count=count, random=random)) for of in (tables_in_the_way, tables_beside))
            passing = list(tables_at_home(scene, count=count, random=random))
            missed = [name for name, body in bodies if not scene.is_refused(body)]
            wrong = [name for name, body in beside if scene.is_refused(body)]
            missed_tables = [name for name, table in tables if not is_refused_over(scene, table)]
            wrong_tables = [name for name, table in off if is_refused_over(scene, table)]
            unnoticed = [name for name, table in passing if not is_refused_in_motion(scene.over(table))]
            seconds = (time.perf_counter() - start) / (5 * count)
            number = scene.planned.robot.index(scene.robot) + 1
            found = (count - len(each) for each in (missed, missed_tables, unnoticed))
            a, b, c = (f"{each} of {count}" for each in found)
            yield row(
                f"{kind}, {number} of {len(scene.planned.robot)}", a, f"{len(wrong)} of {count}", b,
                f"{len(wrong_tables)} of {count}", c, f"{seconds:.1f}",
            )  # fmt: skip
            lost = Counter(missed + missed_tables + unnoticed)
            yield from (f"  missed: {name} x{times}" for name, times in lost.items())
            yield from (f"  wrongly reported: {name} x{times}" for name, times in Counter(wrong + wrong_tables).items())


def scene_of(part: Path, **keys: object) -> Scene:
    """Plan a part by keys of a job, with the lamp on the tool."""
    job = job_of(surface=part, unit="mm", place="demo", backend="fast-marching", **keys)
    planned = plan(job)
    return scene_at(planned, planned.robot[0])


def scenes_over(kind: str, **keys: object) -> tuple[Scene, Scene]:
    """Plan the apex over a kind of table, and return it as it stands in the first attitude and in a middle one.

    Args:
        kind: of table.
        keys: of the job.
    """
    with TemporaryDirectory() as folder:
        cell = cell_with(kind, Path(folder))
        job = job_of(surface=APEX, unit="mm", place="demo", backend="fast-marching", cell=cell, **keys)
        planned = plan(job)
    return scene_at(planned, planned.robot[0]), scene_at(planned, planned.robot[len(planned.robot) // 2])


def collisions(scene: Scene, *, count: int, random: np.random.Generator) -> Iterator[tuple[str, Surface]]:
    """Yield what is planted where and how deep, and the obstacle; one in twenty is a hall around everything."""
    for case in range(count):
        if case % 20 == 19:
            yield "hall around everything", hall(scene.sweep)
            continue
        distance = (scene.cell.process.clearance - GRAZE, *(-depth for depth in DEPTHS))[case % (len(DEPTHS) + 1)]
        name, kind = SOLIDS[case % len(SOLIDS)], list(KINDS)[int(random.integers(len(KINDS)))]
        spot = scene.sweep.spot(name, random)
        # A plate deeper than the needle is thick would lie beyond it.
        deepest = -0.5 if name == "needle" else distance
        yield f"{kind} {distance:g} mm from the {name}", spot.obstacle(kind, distance=max(distance, deepest))


def near_misses(scene: Scene, *, count: int, random: np.random.Generator) -> Iterator[tuple[str, Surface]]:
    """Yield what is planted beside what, and the obstacle."""
    wanted = scene.cell.process.clearance + BEYOND
    case = 0
    while case < count:
        name, kind = SOLIDS[case % len(SOLIDS)], list(KINDS)[int(random.integers(len(KINDS)))]
        spot = scene.sweep.spot(name, random)
        obstacle = near_miss(
            lambda at, spot=spot, kind=kind: spot.obstacle(kind, distance=at), scene.sweep.distance, distance=wanted
        )
        if obstacle is not None:
            case += 1
            yield f"{kind} beside the {name}", obstacle


def _lowered_verdict(scene: Scene) -> str:
    try:
        scene.check_lowered()
    except ClearanceError as error:
        return f"alarm: {error}"
    return "no alarm"


if __name__ == "__main__":
    main()
