"""A refusal that is a proof: the worst poses are searched for any attitude, and what would change it is tried.

The work is counted, not timed, so that the same part gets the same words everywhere: no more motions are planned to
try changes than the refused plan itself took, or LEAST_MOTIONS. Asking the changes before that is not counted.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from itertools import zip_longest
from typing import final

import numpy as np

from geoprint.account.texts.refusal import refusal_details, refusal_sentence, shortfall
from geoprint.errors import ClearanceError, PlanError, ReachError
from geoprint.model import Cell, FloatArray, Placement
from geoprint.motion.arm import Arm
from geoprint.motion.collision import SinglePoses
from geoprint.motion.machine import obstacles_at
from geoprint.motion.reach import COARSE_TURN_STEP, Exhausted, Exhaustion, Grid, Worst, reach
from geoprint.pipeline.refusals.changes import (
    CELL,
    LEAN,
    NEEDLE,
    PLACE,
    STANDOFF,
    Change,
    changes,
    of_the_needle,
    placement_of,
)
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.standing import Chain, arm_of, leaning_of, placed, scene_at
from geoprint.results import Plan, Refusal, TriedChange

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
    worst, exhausted = _exhausted(refused, paths, placement, stage)
    budget = _Budget(stage, motions=stage.begun(MOTION) - before)
    raise _with_proof(refused, _tried(paths, exhausted, worst, budget, chain=chain)) from refused


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

        return Stages(observe)

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


def _tried(paths: Plan, exhausted: Exhausted, worst: Worst, budget: _Budget, *, chain: Chain) -> Refusal:
    """Ask every change at the worst poses, and take those that free them through the chain, until one prints.

    A place or a lean with which only the needle is too wide is tried with a thinner one next, and the roomiest needle,
    which comes second, with a stand-off that is higher by what it lacks.
    """
    budget.screening()
    offered = changes(paths)
    rooms = {change: _room(change, paths, worst) for change in offered}
    freeing = [change for change in offered if rooms[change] > 0.0]
    waiting = _ordered(freeing, rooms, paths, exhausted)
    tried: list[TriedChange] = []
    while waiting and len(tried) < LARGEST_TRIED and not budget.spent:
        change = waiting.pop(0)
        refused = _refused(change, paths, budget, chain=chain)
        if refused is None or not isinstance(refused, PlanError):
            tried += [] if refused is None else [TriedChange(change.name, change.keys, "")]
            break
        tried.append(TriedChange(change.name, change.keys, shortfall(refused)))
        if of_the_needle(refused):
            waiting[:0] = _next(change, refused, last=len(tried) > 1 or not waiting)
    return Refusal(exhausted, screened=len(offered), freeing=len(freeing), tried=tuple(tried))


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
