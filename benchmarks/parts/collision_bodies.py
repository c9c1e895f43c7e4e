"""What each body costs in the collision check: a table of `benchmarks.motion`."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TypeVar

import numpy as np

from benchmarks.parts.spirals import spiral
from benchmarks.parts.surfaces import make
from benchmarks.parts.tables import row, table
from geoprint import transforms
from geoprint.model import Cell, Lamp, Tool
from geoprint.motion.arm import Arm
from geoprint.motion.collision import clearance
from geoprint.motion.collision.arm_clearance import arm_motion
from geoprint.motion.collision.clearance import check_placements
from geoprint.motion.collision.link_solids import link_solids
from geoprint.motion.collision.tool_solids import tool_solids
from geoprint.motion.controller import controller_path, written_targets
from geoprint.motion.reach import reach
from geoprint.motion.timing import retime

Result = TypeVar("Result")


def bodies(cell: Cell, arm: Arm, *, count: int) -> Iterator[str]:
    """Yield a table of seconds and share of each body in the collision check of a spiral over the dome."""
    part, poses = make("cap", faces=20_000), spiral(count, standoff=cell.process.standoff)
    T_base_work = transforms.rigid(np.eye(3), cell.demo_position)
    joint_path = reach(poses, arm, T_base_work=T_base_work)
    targets = written_targets(joint_path, retime(joint_path, cell.robot, process=cell.process), process=cell.process)
    path, following = _timed(lambda: controller_path(joint_path, targets, arm))
    lamp = Lamp(transforms.rigid(np.eye(3), np.array([0.0, 45.0, 10.0])), length=60.0, diameter=20.0)
    links, T_work_base = link_solids(arm.robot.model), transforms.inverse(T_base_work)
    motion, placing = _timed(
        lambda: arm_motion(path, arm, tool=tool_solids(cell.tool), links=links, T_work_base=T_work_base)
    )

    def check_tool(tool: Tool) -> None:
        check_placements(
            motion.tool, tool=tool, process=cell.process, standoff=poses.standoff, part=part, body=None,
            obstacles=cell.obstacles, T_work_base=T_work_base,
        )  # fmt: skip

    def check_all() -> None:
        clearance(
            path, arm, tool=cell.tool, process=cell.process, T_base_work=T_base_work, poses=poses, part=part,
            body=None, obstacles=cell.obstacles,
        )  # fmt: skip

    _, tool = _timed(lambda: check_tool(cell.tool))
    _, with_lamp = _timed(lambda: check_tool(replace(cell.tool, lamp=lamp)))
    _, everything = _timed(check_all)
    names = ("controller's path", "where tool and links are", "tool", "lamp besides", "arm's links")
    seconds = (following, placing, tool, max(with_lamp - tool, 0.0), everything - placing - tool)
    yield from table(f"collision check of {count} poses, {motion.tool.count} placements", *names)
    yield row("s, share", *(f"{value:.2f} s, {value / sum(seconds):.0%}" for value in seconds))


def _timed(work: Callable[[], Result]) -> tuple[Result, float]:
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start
