"""A refusal that is a proof: the worst poses are searched for any attitude, and what would change it is tried.

The work is counted, not timed, so that the same part gets the same words everywhere: no more motions are planned to
try changes than the refused plan itself took, or LEAST_MOTIONS. Asking the changes before that is not counted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import zip_longest
from typing import final

import numpy as np

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
from geoprint.errors import ClearanceError, PlanError, ReachError, UsageError
from geoprint.model import Cell, FloatArray, Placement, frozen
from geoprint.positioner import obstacles_at
from geoprint.reporting.placement import refusal_details, refusal_sentence, shortfall
from geoprint.results import Moved, Plan, Refusal, TriedChange
from geoprint.robot.arm import Arm
from geoprint.robot.collision import SMALLEST_ROOM, SinglePoses
from geoprint.robot.placing import LEAST_MEAN_NORMAL, FixturePose, demo_placement
from geoprint.robot.reach import COARSE_TURN_STEP, Exhausted, Exhaustion, Grid, Worst, reach
from geoprint.workflow.covering import cover, taken_job
from geoprint.workflow.placement import (
    Chain,
    arm_of,
    demo_rpy,
    leaning_of,
    moved,
    placed,
    pose_stream,
    room_of,
    scene_at,
    with_flow_of,
)
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import stack_cell

# What might make a refused part printable: another needle, more lean, the other cell, another place.
#
# The clearance that is stated is never touched, nor what the part asks for: spacing, paths and speed. The stand-off
# is raised only where a needle is thin enough to reach everywhere but for its rim, and only by what the rim lacks.


# Kinds of changes.
NEEDLE, STANDOFF, LEAN, CELL, PLACE = "needle", "stand-off", "lean", "cell", "place"
# The gauge that goes with a change of another kind where only the needle is too wide then.
THINNER = 21
# Leans that are tried where the nozzle may not lean so far [degrees].
LARGER_TILTS = (20.0, 25.0, 30.0, 45.0)
# A stand-off is stated in steps of this, and raised by no more altogether [mm]: what falls far lies where it likes.
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
        found = demo_placement(paths.workpiece.base, position=at, rotation=turn, least=LEAST_MEAN_NORMAL)
        return replace(found, flow_unstated=self.cell.signals.flow_unstated)


def placement_of(paths: Plan) -> Placement:
    """Return where the part of a plan stands.

    Raises:
        UsageError: nobody asked for a robot.
    """
    if paths.workpiece.placement is None:
        raise UsageError("place the part before asking what the robot refuses.")
    return paths.workpiece.placement


def changes(paths: Plan) -> tuple[Change, ...]:
    """Return what might help, what asks least of a person first: needle, lean, cell, place.

    A part whose place was measured stays where it is, in its cell.
    """
    found = [*_needles(paths), *_leans(paths)]
    if paths.job.place == "demo":
        found += [*_cells(paths), *_place_changes(paths)]
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
            yield Change(LEAN, f"`--set max_tilt={tilt:g}`", "", job, paths.workpiece.cell)


def _cells(paths: Plan) -> Iterator[Change]:
    now = paths.workpiece.cell
    for name in PACKAGED_CELLS:
        cell = cell_of(packaged_cell_text(name), name=f"{name}.toml")
        if now.robot.urdf is not None or cell.robot.model != now.robot.model:
            continue
        same_tip = np.array_equal(cell.tool.T_flange_tool, now.tool.T_flange_tool)
        if not (same_tip and needle_of(cell.tool) == needle_of(now.tool)):
            cell = stack_cell(replace(cell, demo_rotation=cell.demo_turn), paths.workpiece.place)
            yield Change(CELL, f"`--cell {name}.toml`", "`geoprint init` writes it", paths.job, cell)


def _place_changes(paths: Plan) -> Iterator[Change]:
    """Yield places above the obstacles, clear of the arm and below the tip at home."""
    cell, room = paths.workpiece.cell, room_of(paths.workpiece)
    rpy = demo_rpy(cell)
    away = cell.demo_position[:2] / max(float(np.hypot(*cell.demo_position[:2])), np.finfo(float).tiny)
    for ahead, up in MOVES:
        position = (cell.demo_position + np.array([*(ahead * away), up])).round()
        if not room.permits(FixturePose(position, rpy)):
            continue
        x, y, z = position.tolist()
        key = f"[work] demo_position_mm = [{x:g}, {y:g}, {z:g}]"
        moved = replace(cell, demo_position=position)
        yield Change(PLACE, f"the part at ({x:g}, {y:g}, {z:g}) mm", key, paths.job, moved)


# Changes that are taken through the whole chain at most.
LARGEST_TRIED = 4
# A change whose nozzle has room in this share of the cone at the narrowest pose is as good as any with more.
ENOUGH_ROOM = 0.3
# Directions are so far apart where changes are asked at the worst poses [degrees]; the chain decides.
SCREEN_LEAN_STEP = 4.0
# Motions that may be planned to try changes, however few the refused plan took: those of one placement.
LEAST_MOTIONS = 6
# Where the nozzle has room as it is, changes of these kinds are tried in turn.
KINDS = (PLACE, CELL, LEAN)
# The stage that every motion begins with: counting it counts motions.
MOTION = "reach"


def printed(paths: Plan, placement: Placement, stage: Stages, *, chain: Chain) -> Plan:
    """Plan the robot as `placed` does; where that is refused, prove it and say what would change it.

    A demonstration that prints in another place is moved there, and says why.

    Args:
        paths: of the part as it stands.
        placement: where that is.
        stage: names and times the work.
        chain: plans the robot at a placement.

    Raises:
        PlanError: as `placed`, with what an exhaustive search at the worst poses says, and a change that was tried.
    """
    before = stage.begun(MOTION)
    try:
        return placed(paths, placement, stage, chain=chain)
    except (ReachError, ClearanceError) as error:
        if arm_of(paths.workpiece).closed_form is None or not paths.poses.deposit.any():
            raise
        refused = error
    try:
        return _elsewhere(moved(paths, refused, stage, chain=chain), refused)
    except (ReachError, ClearanceError) as error:
        refused = error
    worst, exhausted = _exhausted(refused, paths, placement, stage)
    budget = _Budget(stage, motions=stage.begun(MOTION) - before)
    refusal, planned = _tried(paths, exhausted, worst, budget, chain=chain)
    if planned is None:
        raise _with_proof(refused, refusal) from refused
    return _elsewhere(planned, refused)


def _elsewhere(planned: Plan, refused: PlanError) -> Plan:
    """Return a plan of a demonstration that was moved, with what refuses it where the cell puts it."""
    cell = planned.workpiece.cell
    there = Moved(cell.demo_position, demo_rpy(cell), str(refused))
    return replace(planned, workpiece=replace(planned.workpiece, moved=there))


def proven(error: PlanError, paths: Plan, placement: Placement, stage: Stages) -> PlanError:
    """Return a refusal with what an exhaustive search at the worst poses says; no change is tried.

    Args:
        error: of the chain.
        paths: that it refuses.
        placement: where the part stands.
        stage: names and times the work.
    """
    if arm_of(paths.workpiece).closed_form is None or not paths.poses.deposit.any():
        return error
    return _with_proof(error, Refusal(_exhausted(error, paths, placement, stage)[1], screened=0, freeing=0, tried=()))


def _exhausted(error: PlanError, paths: Plan, placement: Placement, stage: Stages) -> tuple[Worst, Exhausted]:
    """Search the worst poses of a plan that is refused for any attitude."""
    with stage("exhaustive search"):
        search, cone = _search(paths, paths.workpiece.cell, placement), float(np.radians(paths.job.max_tilt))
        worst = search.worst(_places(error), cone=cone)
        return worst, search.judged(worst.rows, Grid(cone))


@final
class _SpentError(Exception):
    """No more motions are planned."""


@final
class _Budget:
    """Stages that tell whoever watches what is tried, and stop where too many motions were planned.

    Args:
        stage: names the work.
        motions: that may be planned, LEAST_MOTIONS at least.
    """

    __slots__ = ("_left", "_stage")

    def __init__(self, stage: Stages, *, motions: int) -> None:
        self._stage = stage
        self._left = max(motions, LEAST_MOTIONS)

    def stages(self, trying: str) -> Stages:
        """Return stages that name what is tried."""

        def observe(name: str) -> None:
            self._left -= name == MOTION
            if self._left < 0:
                raise _SpentError
            self._stage.observe(f"trying {trying}: {name}")

        return Stages(observe, timings=self._stage.timings)

    @property
    def spent(self) -> bool:
        """Whether no motion may be planned any more."""
        return self._left <= 0

    def screening(self) -> None:
        """Say that changes are asked at the worst poses."""
        self._stage.observe("looking for what would change it")


def _search(paths: Plan, cell: Cell, placement: Placement) -> Exhaustion:
    """Return the search at the poses of a plan, with a cell and where the part stands in it."""
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    around = SinglePoses(
        arm,
        tool=cell.tool,
        process=cell.process,
        standoff=paths.poses.standoff + paths.workpiece.below,
        part=paths.workpiece.ground,
        body=paths.workpiece.body,
        obstacles=obstacles_at(cell, placement),
        T_base_work=placement.T_base_work,
    )
    # The turn of a round nozzle on the flange's axis moves joint 6 alone; only a lamp beside it turns along.
    turned = not arm.sense_of_turn or cell.tool.lamp is not None
    return Exhaustion(paths.poses, arm, around=around, T_base_work=placement.T_base_work, turned=turned)


def _places(error: PlanError) -> list[FloatArray]:
    """Return where a refusal says that motions fail, in the work frame [mm]."""
    named = [error.details.get(key) for key in ("place", "work_mm", "turned_place")]
    return [np.array(place) for place in named if isinstance(place, tuple)]


def _tried(
    paths: Plan, exhausted: Exhausted, worst: Worst, budget: _Budget, *, chain: Chain
) -> tuple[Refusal, Plan | None]:
    """Ask every change at the worst poses, and take those that free them through the chain, until one prints.

    Returns its plan as well where nobody has to do anything for it: that of a demonstration in another place.

    A place or a lean with which only the needle is too wide is tried with a thinner one next, and the roomiest needle,
    which comes second, with a stand-off that is higher by what it lacks.
    """
    budget.screening()
    offered = changes(paths)
    rooms = {change: _room(change, paths, worst) for change in offered}
    freeing = [change for change in offered if rooms[change] > 0.0]
    waiting = _ordered(freeing, rooms, paths, exhausted)
    tried: list[TriedChange] = []
    planned: Plan | None = None
    while waiting and len(tried) < LARGEST_TRIED and not budget.spent:
        change = waiting.pop(0)
        refused = _refused(change, paths, budget, chain=chain)
        if refused is None:
            break
        if isinstance(refused, Plan):
            tried.append(TriedChange(change.name, change.keys, ""))
            planned = refused if change.kind == PLACE and paths.workpiece.turnable else None
            break
        tried.append(TriedChange(change.name, change.keys, shortfall(refused)))
        if of_the_needle(refused):
            waiting[:0] = _next(change, refused, last=len(tried) > 1 or not waiting)
    return Refusal(exhausted, screened=len(offered), freeing=len(freeing), tried=tuple(tried)), planned


def _next(change: Change, refused: PlanError, *, last: bool) -> list[Change]:
    """Return what is tried next where only the needle refuses a change; none with more room comes after the last."""
    if change.kind not in {NEEDLE, STANDOFF}:
        return [change.with_thinner_needle()]
    raised = change.raised(refused) if change.kind == NEEDLE and last else None
    return [] if raised is None else [raised]


def _room(change: Change, paths: Plan, worst: Worst) -> float:
    """Return in which share of its directions the nozzle has room at the narrowest of the worst poses with a change.

    None, where the arm has no branch that serves all of them; it is not asked where the part may be turned, because the
    chain turns it.
    """
    search = _search(paths, change.cell, change.placement(paths))
    cone = float(np.radians(change.job.max_tilt))
    grid = Grid(cone, float(np.radians(SCREEN_LEAN_STEP)), float(np.radians(COARSE_TURN_STEP)))
    room = 1.0
    for row in worst.narrow.tolist():
        room = min(room, search.room(row, grid))
        if room == 0.0:
            return 0.0
    served = paths.workpiece.turnable or bool(search.judged(worst.rows, grid).served_by)
    return room if served else 0.0


def _ordered(freeing: list[Change], rooms: Mapping[Change, float], paths: Plan, exhausted: Exhausted) -> list[Change]:
    """Return changes in the order in which they are tried.

    Where the nozzle has no room as it is, the first that is offered and has enough; then the roomiest of all: where
    that is refused too, there is little hope for what lies between. Else what the arm follows, one of each kind in
    turn, and the needle last.
    """
    if exhausted.narrow:
        enough = sorted(freeing, key=lambda change: -min(rooms[change], ENOUGH_ROOM))
        roomiest = sorted(freeing, key=lambda change: -rooms[change])
        return list(dict.fromkeys([*enough[:1], *roomiest[:1], *enough]))
    moving = [change for change in freeing if change.kind != NEEDLE]
    followed = [change for change in moving if _follows(change, paths)]
    kinds = sorted({change.kind for change in followed}, key=KINDS.index)
    of_kind = [[change for change in followed if change.kind == kind] for kind in kinds]
    in_turn = [change for each in zip_longest(*of_kind) for change in each if change is not None]
    return [*in_turn, *(change for change in freeing if change.kind == NEEDLE)]


def _follows(change: Change, paths: Plan) -> bool:
    """Say whether the arm follows the whole stream with a change, leaning; a larger lean has to be tried."""
    if change.kind == LEAN:
        return True
    changed = change.paths(paths)
    workpiece, placement = changed.workpiece, change.placement(paths)
    with suppress(ReachError):
        reach(
            changed.poses,
            arm_of(workpiece),
            T_base_work=placement.T_base_work,
            weights=workpiece.cell.search,
            leaning=leaning_of(changed, placement, scene_at(workpiece, placement)),
        )
        return True
    return False


def _refused(change: Change, paths: Plan, budget: _Budget, *, chain: Chain) -> PlanError | Plan | None:
    """Return why a part does not print with a change, or its plan; None where no motion is left to tell."""
    changed = change.paths(paths)
    try:
        return placed(changed, placement_of(changed), budget.stages(change.name), chain=chain)
    except _SpentError:
        return None
    except PlanError as error:
        return error


def _with_proof(error: PlanError, refusal: Refusal) -> PlanError:
    advice = str(error.details.get("advice") or "")
    found = str(error).replace(f": {advice}", "").rstrip(".") if advice else str(error).rstrip(".")
    said = refusal_sentence(refusal)
    return type(error)(f"{found}; {said}", **(error.details | refusal_details(refusal)))
