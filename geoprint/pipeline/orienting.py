"""Where a demonstration stands: with its mean normal up where that can be printed, else as a search turns it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from geoprint.errors import ClearanceError, PlanError, ReachError
from geoprint.model import Placement
from geoprint.motion.collision import tool_solids
from geoprint.motion.placing import ROUND_SOLIDS, OrientationSearch, Oriented, Scene, search_orientation
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.standing import UPRIGHT, arm_of, room_of, stand_placement, stood
from geoprint.results import Orientation, Plan, Workpiece

Chain = Callable[[Plan, Placement, Stages], Plan]


def placed(paths: Plan, placement: Placement, stage: Stages, *, chain: Chain) -> Plan:
    """Plan the robot where the part stands, and where that is refused and nobody stated it, where a search turns it.

    What prints with its mean normal up stays there.

    Args:
        paths: of the part as it stands.
        placement: where that is.
        stage: names and times the work.
        chain: plans the robot at a placement.

    Raises:
        PlanError: as the chain; where a search was of no use, it says so.
    """
    try:
        return chain(paths, placement, stage)
    except (ReachError, ClearanceError) as error:
        if not paths.workpiece.turnable or not _may_help(error, paths.workpiece):
            raise
        refusal = error
    with stage("orientation"):
        search = _search(paths)
    refused: list[str] = []
    alike = ""
    for oriented in search.found:
        turned, turned_placement = stood(paths, oriented.stand), stand_placement(paths.workpiece, oriented.stand)
        try:
            planned = chain(turned, turned_placement, stage)
        except PlanError as error:
            refused.append(str(error))
            if not _may_help(error, paths.workpiece):
                alike = f"; turned by {_in_words(oriented)} it fails at what turning hardly changes: {error}"
                break
            continue
        orientation = Orientation(
            rpy=oriented.stand.rpy,
            tilt=oriented.tilt,
            margin=oriented.margin,
            tried=search.tried,
            start=str(refusal),
            refused=tuple(refused),
        )
        return replace(planned, workpiece=replace(planned.workpiece, orientation=orientation))
    raise _refusal(refusal, search, paths.workpiece, alike=alike) from refusal


def _may_help(error: PlanError, workpiece: Workpiece) -> bool:
    """Say whether a part that is turned may be printed: needle, cone and barrel stand over it as they did."""
    solid, against = error.details.get("solid"), str(error.details.get("against", ""))
    around_the_axis = {each.name for each in tool_solids(workpiece.cell.tool)[:ROUND_SOLIDS]}
    of_the_part = against.startswith(("part ", "body "))
    return arm_of(workpiece).closed_form is not None and not (solid in around_the_axis and of_the_part)


def _search(paths: Plan) -> OrientationSearch:
    workpiece, cell = paths.workpiece, paths.workpiece.cell
    return search_orientation(
        paths.poses,
        arm_of(workpiece),
        T_fixture_work=stand_placement(workpiece, UPRIGHT).T_base_work,
        position=cell.demo_position,
        scene=Scene(cell.tool, cell.process, workpiece.part, workpiece.body, room_of(workpiece)),
    )


def _in_words(oriented: Oriented) -> str:
    roll, pitch, yaw = np.degrees(oriented.stand.rpy).tolist()
    return f"({roll:.4g}, {pitch:.4g}, {yaw:.4g}) degrees"


def _refusal(error: PlanError, search: OrientationSearch, workpiece: Workpiece, *, alike: str) -> PlanError:
    """Return the error of the start, with what was tried besides, and what is refused however it is turned."""
    if alike:
        return type(error)(f"{str(error).rstrip('.')}{alike}", **error.details)
    x, y, z = workpiece.cell.demo_position.tolist()
    planned = f", {len(search.found)} of them planned through" if search.found else ""
    return type(error)(
        f"{str(error).rstrip('.')}; so it is with its mean normal up, and of {search.tried} orientations about "
        f"({x:g}, {y:g}, {z:g}) mm none serves either{planned}.",
        **error.details,
    )
