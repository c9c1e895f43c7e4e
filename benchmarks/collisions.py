"""Does the collision check find what is planted, and only that? Obstacles at known distances on real plans.

    python -m benchmarks.collisions [--cases N] [--layer-cases N] [--parts FILE ...] [--smoke]

On every part a path is planned, and then checked again with one obstacle besides: collisions from a graze of the
clearance, over a graze of the body itself, to deep ones, and halls around everything; and near misses, 0.1 mm beyond
the clearance. Obstacles are thin posts, plates and blocks at the sides of needle, cone, barrel, bracket, lamp and the
arm's links, at any moment from home to home (`benchmarks.parts.planted`). The nozzle leans where that serves the
speed. At last the tip is lowered by 0.05 mm on all deposit, where nothing must be reported.

The second table is of a layer on each part, where only what is printed below is in the way: a lump on it at a known
distance from whatever moves, or all of it so much too high that the tip goes through its top; and near misses of both.
Over the bare part, without the layers, the same path is clear.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import final

import numpy as np

from benchmarks.parts.planted import KINDS, Sweep, hall, near_miss
from benchmarks.parts.printed_layers import raised_layers, with_lump
from benchmarks.parts.tables import row, rule
from benchmarks.uniformity import DATA
from geoprint import transforms
from geoprint.config import job_of
from geoprint.errors import ClearanceError
from geoprint.model import Cell, Lamp, PoseStream, Surface
from geoprint.motion.arm import Arm
from geoprint.motion.collision import clearance
from geoprint.motion.controller import controller_path, written_targets
from geoprint.motion.reach import reach
from geoprint.motion.timing import retime
from geoprint.paths import largest_lean
from geoprint.pipeline import plan
from geoprint.results import Plan

PARTS = (DATA / "heart_flat_patch.ply", DATA / "heart_apex_patch.ply", DATA / "plate.ply")
SPACING = 3.0
SOLIDS = ("needle", "cone", "barrel", "bracket", "UV lamp", *(f"arm's link {joint}" for joint in range(2, 7)))
# How deep collisions go beyond the kept distance and into the solid itself [mm].
GRAZE = 0.05
DEPTHS = (0.05, 0.5, 4.0)
# How far near misses are beyond the kept distance [mm]: a tenth for the steps of the check, and a tenth for what the
# controller may round in a tight bend, where it need not do so.
BEYOND = 0.2
STANDOFF_ERROR = 0.05
# Which layer of half a millimetre is planned, and how deep the tip goes through the top of what lies below it [mm].
LAYERS = 3
TIP_DEPTHS = (0.05, 0.3, 1.0)
# The lamp's housing, which the packaged cells do not describe: beside the flange.
LAMP = Lamp(transforms.rigid(np.eye(3), np.array([0.0, 45.0, 10.0])), length=60.0, diameter=20.0)


@final
@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A planned part whose path is checked against planted bodies."""

    planned: Plan
    arm: Arm
    cell: Cell
    sweep: Sweep

    def is_refused(self, body: Surface) -> bool:
        """Say whether the check refuses the path for the body's sake."""
        return self._refused_for(f"body {body.name}", body, self.planned.workpiece.ground)

    def is_refused_by(self, ground: Surface) -> bool:
        """Say whether the check refuses the path of a layer for the sake of what is printed below it."""
        return self._refused_for(f"part {ground.name}", self.planned.workpiece.body, ground)

    def check_without_layers(self) -> None:
        """Check the path of a layer over the bare part, where nothing is printed; raise what the check raises."""
        place = self.planned.workpiece.place
        assert place is not None
        self.check(None, place.base, below=place.middle)

    def check(self, body: Surface | None, ground: Surface, *, below: float) -> None:
        """Check the path, whose tip counts its stand-off from so far over the ground; raise what the check raises."""
        (robot,) = self.planned.robot
        clearance(
            robot.controller_path, self.arm, tool=self.cell.tool, process=self.cell.process,
            T_base_work=robot.placement.T_base_work, poses=robot.joint_path.poses, part=ground,
            body=body, obstacles=self.cell.obstacles, below=below,
        )  # fmt: skip

    def _refused_for(self, name: str, body: Surface | None, ground: Surface) -> bool:
        try:
            self.check(body, ground, below=self.planned.workpiece.below)
        except ClearanceError as error:
            return error.details["against"] == name
        return False

    def check_lowered(self) -> None:
        """Check the path of a tip that is lower than it should be on all deposit; raise what the check raises."""
        (robot,) = self.planned.robot
        T_base_work = robot.placement.T_base_work
        low = reach(_lowered(robot.joint_path.poses, by=STANDOFF_ERROR), self.arm, T_base_work=T_base_work)
        process = self.cell.process
        targets = written_targets(low, retime(low, self.cell.robot, process=process), process=process)
        clearance(
            controller_path(low, targets, self.arm), self.arm, tool=self.cell.tool, process=process,
            T_base_work=T_base_work, poses=low.poses, part=self.planned.workpiece.part, body=None,
            obstacles=self.cell.obstacles,
        )  # fmt: skip


def main() -> None:
    """Print what was found of what was planted."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=200, help="collisions, and as many near misses, over all parts")
    parser.add_argument("--parts", nargs="+", type=Path, default=PARTS, metavar="FILE", help="meshes [mm]")
    parser.add_argument("--layer-cases", type=int, default=100, help="the same where printed layers are in the way")
    parser.add_argument("--smoke", action="store_true", help="a few cases on one part, to see that the script runs")
    arguments = parser.parse_args()
    if arguments.smoke:
        lines = [table([DATA / "plate.ply"], cases=6, spacing=12.0)]
        lines += [layer_table([DATA / "plate.ply"], cases=4, spacing=12.0)]
    else:
        lines = [
            table(arguments.parts, cases=arguments.cases),
            layer_table(arguments.parts, cases=arguments.layer_cases),
        ]
    for line in chain(*lines):
        print(line, flush=True)


def table(parts: Sequence[Path], *, cases: int, spacing: float = SPACING) -> Iterator[str]:
    """Yield a line for each part, and for what was missed or wrongly reported."""
    yield row("part", "largest lean", "collisions found", "near misses reported", "tip 0.05 mm low", "s a check")
    yield rule(6)
    for index, part in enumerate(parts):
        scene = scene_of(part, spacing=spacing)
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


def layer_table(parts: Sequence[Path], *, cases: int, spacing: float = SPACING) -> Iterator[str]:
    """Yield a line for each part, of which a layer is planned, and for what was missed or wrongly reported."""
    yield ""
    yield row("part, layer", "printed layers found", "near misses reported", "s a check")
    yield rule(4)
    for index, part in enumerate(parts):
        scene = scene_of(part, spacing=spacing, thickness=LAYERS * 0.5, layer=LAYERS)
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


def scene_of(part: Path, *, spacing: float = SPACING, **layer: object) -> Scene:
    """Plan a part, with the lamp on the tool; a thickness and a layer may be named."""
    job = job_of(surface=part, unit="mm", spacing=spacing, place="demo", backend="fast-marching", **layer)
    planned = plan(job)
    cell = planned.workpiece.cell
    cell = replace(cell, tool=replace(cell.tool, lamp=LAMP))
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    assert planned.robot
    T_work_base = transforms.inverse(planned.robot[0].placement.T_base_work)
    sweep = Sweep(planned.robot[0].controller_path, arm, tool=cell.tool, T_work_base=T_work_base)
    scene = Scene(planned, arm, cell, sweep)
    scene.check(planned.workpiece.body, planned.workpiece.ground, below=planned.workpiece.below)
    return scene


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
        obstacle = near_miss(scene.sweep, scene.sweep.spot(name, random), kind, distance=wanted)
        if obstacle is not None:
            case += 1
            yield f"{kind} beside the {name}", obstacle


def _lowered(poses: PoseStream, *, by: float) -> PoseStream:
    return replace(poses, tips=poses.tips - by * np.where(poses.deposit, 1.0, 0.0)[:, None] * poses.normals)


def _lowered_verdict(scene: Scene) -> str:
    try:
        scene.check_lowered()
    except ClearanceError as error:
        return f"alarm: {error}"
    return "no alarm"


if __name__ == "__main__":
    main()
