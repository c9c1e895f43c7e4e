"""What might make a refused part printable: another needle, more lean, the other cell, another place.

The clearance that is stated is never touched, nor what the part asks for: spacing, paths and speed. The stand-off is
raised only where a needle is thin enough to reach everywhere but for its rim, and only by what the rim lacks.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.config import (
    PACKAGED_CELLS,
    Job,
    Needle,
    cell_of,
    common_needles,
    needle_keys,
    needle_of,
    packaged_cell_text,
    with_needle,
)
from geoprint.errors import PlanError, UsageError
from geoprint.model import Cell, Placement, frozen
from geoprint.motion.collision import SMALLEST_ROOM
from geoprint.motion.placing import LEAST_MEAN_NORMAL, Stand, demo_placement
from geoprint.pipeline.covering import cover
from geoprint.pipeline.middles import taken_job
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.standing import pose_stream, room_of, with_flow_of
from geoprint.pipeline.workpiece.layering import stack_cell
from geoprint.results import Plan

# Kinds of changes.
NEEDLE, STANDOFF, LEAN, CELL, PLACE = "needle", "stand-off", "lean", "cell", "place"
# The gauge that goes with a change of another kind where only the needle is too wide then.
THINNER = 21
# Leans that are tried where the nozzle may not lean so far [degrees].
LARGER_TILTS = (20.0, 25.0, 30.0, 45.0)
# A stand-off is told in steps of this, and raised by no more altogether [mm]: what falls far lies where it likes.
STANDOFF_STEP = 0.1
LARGEST_RAISE = 0.5
# How far a demonstration is moved: along x, towards the arm and away from it, and upwards [mm].
MOVES = ((0.0, 50.0), (0.0, 100.0), (50.0, 0.0), (50.0, 100.0), (-50.0, 100.0))
# A needle that differs less from that of the cell is the same [mm]: makers round.
SAME_WIDTH = 0.05
SAME_LENGTH = 0.1


@frozen
class Change:
    """A change of job or cell.

    Attributes:
        kind: of change: needle, stand-off, lean, cell or place.
        name: what changes, as a sentence begins with it.
        keys: what a person writes or types for it.
        job: with it.
        cell: with it.
    """

    kind: str
    name: str
    keys: str
    job: Job
    cell: Cell

    def paths(self, paths: Plan) -> Plan:
        """Return a plan of paths with the change: the deposits stay, attitudes and travel may not.

        Where the stand-off differs, lines turn elsewhere, and the part is covered again, with constant flow.
        """
        changed = replace(paths.workpiece, cell=self.cell, placement=self.placement(paths))
        if self.cell.process.standoff != paths.workpiece.cell.process.standoff:
            return cover(taken_job(replace(paths, job=self.job)), changed, Stages(lambda _: None))
        stream = pose_stream(paths.toolpath, changed, max_tilt_deg=self.job.max_tilt)
        return replace(paths, job=self.job, workpiece=changed, poses=with_flow_of(stream, paths.poses))

    def with_thinner_needle(self) -> Change:
        """Return the change together with a needle of the same length that is THINNER gauge."""
        tool = self.cell.tool
        now = needle_of(tool)
        gauge = next(each for each in common_needles() if each.gauge == THINNER)
        tool = with_needle(tool, replace(now, outer=gauge.outer, inner=gauge.inner, gauge=THINNER))
        name = f"{self.name} with a {needle_of(tool).length:g} mm needle of {THINNER} gauge"
        keys = "; ".join(part for part in (self.keys, needle_keys(self.cell.tool, tool)) if part)
        return Change(NEEDLE, name, keys, self.job, replace(self.cell, tool=tool))

    def raised(self, error: PlanError) -> Change | None:
        """Return the change with a stand-off higher by what a refusal of its needle lacks; None where that is too far.

        Args:
            error: as `of_the_needle` tells.
        """
        process = self.cell.process
        steps = math.floor((process.standoff + lacking(error)) / STANDOFF_STEP) + 1
        standoff = round(steps * STANDOFF_STEP, 6)
        if standoff > process.standoff + LARGEST_RAISE:
            return None
        keys = "; ".join(part for part in (self.keys, f"[process] standoff_mm = {standoff:g}") if part)
        cell = replace(self.cell, process=replace(process, standoff=standoff))
        return Change(STANDOFF, f"{self.name} {standoff:g} mm above the part", keys, self.job, cell)

    def placement(self, paths: Plan) -> Placement:
        """Return where the part stands with it."""
        if self.job.place != "demo":
            return placement_of(paths)
        at, turn = self.cell.demo_position, self.cell.demo_turn
        return demo_placement(paths.workpiece.base, position=at, rotation=turn, least=LEAST_MEAN_NORMAL)


def placement_of(paths: Plan) -> Placement:
    """Return where the part of a plan stands.

    Raises:
        UsageError: nobody asked for a robot.
    """
    if paths.workpiece.placement is None:
        raise UsageError("a part that is not placed cannot be refused by a robot.")
    return paths.workpiece.placement


def changes(paths: Plan) -> tuple[Change, ...]:
    """Return what might help, what asks least of a person first: needle, lean, cell, place.

    A part whose place was measured stays where it is, in its cell.
    """
    found = [*_needles(paths), *_leans(paths)]
    if paths.job.place == "demo":
        found += [*_cells(paths), *_places(paths)]
    return tuple(found)


def of_the_needle(error: PlanError) -> bool:
    """Say whether a refusal is about the needle beside the part."""
    solid, against = error.details.get("solid"), str(error.details.get("against", ""))
    return solid in {"needle's tip", "needle"} and against.startswith(("part ", "body "))


def lacking(error: PlanError) -> float:
    """Return what a refusal of the needle lacks [mm]."""
    found, wanted = (error.details.get(key) for key in ("distance", "wanted"))
    room = error.details.get("room")
    if isinstance(room, float):
        return SMALLEST_ROOM - room
    return wanted - found if isinstance(found, float) and isinstance(wanted, float) else 0.0


def _needles(paths: Plan) -> Iterator[Change]:
    """Yield needles no wider than that of the cell: those of its length first, of these the widest."""
    job, cell = paths.job, paths.workpiece.cell
    now = needle_of(cell.tool)
    for needle in sorted(common_needles(), key=lambda each: (_is_longer_or_shorter(each, now), -each.outer)):
        same_width = abs(needle.outer - now.outer) < SAME_WIDTH
        if needle.outer > now.outer + SAME_WIDTH or (same_width and not _is_longer_or_shorter(needle, now)):
            continue
        kept = _with_width_of(needle, now) if same_width else needle
        tool = with_needle(cell.tool, kept)
        if tool.needle_length + tool.cone_length < tool.barrel_top:
            yield Change(NEEDLE, needle.words, needle_keys(cell.tool, tool), job, replace(cell, tool=tool))


def _with_width_of(needle: Needle, now: Needle) -> Needle:
    """Return a needle with the diameters that a cell states for its gauge."""
    return Needle(needle.length, now.outer, now.inner, needle.gauge)


def _is_longer_or_shorter(needle: Needle, now: Needle) -> float:
    away = abs(needle.length - now.length)
    return away if away > SAME_LENGTH else 0.0


def _leans(paths: Plan) -> Iterator[Change]:
    for tilt in LARGER_TILTS:
        if tilt > paths.job.max_tilt:
            job = paths.job.model_copy(update={"max_tilt": tilt})
            yield Change(LEAN, f"`--max-tilt {tilt:g}`", "", job, paths.workpiece.cell)


def _cells(paths: Plan) -> Iterator[Change]:
    now = paths.workpiece.cell
    for name in PACKAGED_CELLS:
        cell = cell_of(packaged_cell_text(name), name=f"{name}.toml")
        same_tip = np.array_equal(cell.tool.T_flange_tool, now.tool.T_flange_tool)
        if not (same_tip and needle_of(cell.tool) == needle_of(now.tool)):
            cell = stack_cell(replace(cell, demo_rotation=cell.demo_turn), paths.workpiece.place)
            yield Change(CELL, f"`--cell {name}.toml`", "`geoprint init` writes it", paths.job, cell)


def _places(paths: Plan) -> Iterator[Change]:
    """Yield places above the obstacles, clear of the arm and below the tip at home."""
    cell, room = paths.workpiece.cell, room_of(paths.workpiece)
    rpy = Rotation.from_matrix(cell.demo_turn).as_euler("xyz")
    away = cell.demo_position[:2] / max(float(np.hypot(*cell.demo_position[:2])), np.finfo(float).tiny)
    for ahead, up in MOVES:
        position = (cell.demo_position + np.array([*(ahead * away), up])).round()
        if not room.permits(Stand(position, rpy)):
            continue
        x, y, z = position.tolist()
        key = f"[work] demo_position_mm = [{x:g}, {y:g}, {z:g}]"
        moved = replace(cell, demo_position=position)
        yield Change(PLACE, f"the part at ({x:g}, {y:g}, {z:g}) mm", key, paths.job, moved)
