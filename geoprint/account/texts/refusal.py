"""A refusal in words and numbers: what the search at the worst poses found, and which change was tried."""

from __future__ import annotations

import numpy as np

from geoprint.errors import Detail, PlanError
from geoprint.motion.reach import Exhausted, JudgedPose
from geoprint.results import Refusal, TriedChange
from geoprint.surfaces import in_words

# What refuses a pose, in words.
CAUSES = {
    "nozzle": "the nozzle has no room",
    "reach": "the arm is at a limit",
    "bracket": "bracket or lamp have no room",
    "arm": "the arm's links have no room in any of the attitudes sampled for them",
}


def refusal_sentence(refusal: Refusal) -> str:
    """Return what follows the finding: the proof, and a change that was tried where any could be."""
    if not refusal.screened:
        return f"{_proof(refusal.exhausted)}."
    return f"{_proof(refusal.exhausted)}. {_help(refusal)}"


def refusal_details(refusal: Refusal) -> dict[str, Detail]:
    """Return the numbers of a refusal for programs."""
    exhausted, change = refusal.exhausted, refusal.help
    return {
        "cone_deg": round(float(np.degrees(exhausted.grid.cone)), 6),
        "lean_step_deg": round(float(np.degrees(exhausted.grid.lean_step)), 6),
        "turn_step_deg": round(float(np.degrees(exhausted.grid.turn_step)), 6),
        "poses_searched": len(exhausted.poses),
        "poses_blocked": len(exhausted.blocked),
        "attitudes_tried": exhausted.tried,
        "changes_asked": refusal.screened,
        "changes_freeing": refusal.freeing,
        "changes_tried": "; ".join(_outcome(tried) for tried in refusal.tried),
        "change": None if change is None else change.name,
        "change_keys": None if change is None else change.keys,
    }


def shortfall(error: PlanError) -> str:
    """Return by how much a change that was tried misses."""
    details = error.details
    distance, wanted, room = details.get("distance"), details.get("wanted"), details.get("room")
    if isinstance(distance, float) and isinstance(wanted, float):
        return f"{details.get('solid')} {max(wanted - distance, 0.0):.2f} mm short"
    if isinstance(room, float):
        return f"the needle's rim has {room:.2f} mm of room"
    lost = details.get("lost")
    return f"the arm loses {lost:.2%} of the deposit" if isinstance(lost, float) else str(error)


def _proof(exhausted: Exhausted) -> str:
    count, grid = len(exhausted.poses), exhausted.grid
    steps = f"{np.degrees(grid.lean_step):g} and {np.degrees(grid.turn_step):g} degrees apart"
    blocked = exhausted.blocked
    cone = f"within {np.degrees(grid.cone):.3g} degrees of the normal"
    if blocked:
        first = blocked[0]
        also = f", nor {len(blocked) - 1} more of the {count} worst poses" if len(blocked) > 1 else ""
        return (
            f"no direction {cone}, turn or branch ({exhausted.tried} tried, {steps}) serves {_where(first)}{also}: "
            f"{CAUSES[first.cause]}"
        )
    if not exhausted.served_by:
        return (
            f"each of the {count} worst poses is free by itself, but no branch was found that serves all "
            f"({exhausted.tried} tried)"
        )
    return (
        f"each of the {count} worst poses is free by itself ({exhausted.tried} attitudes tried, {steps}), but no "
        "continuous motion was found"
    )


def _help(refusal: Refusal) -> str:
    change = refusal.help
    if change is not None:
        keys = f": {change.keys}" if change.keys else ""
        name = change.name[0].upper() + change.name[1:]
        return f"{name} prints it (tried: the whole program is checked){keys}."
    tried = "; ".join(_outcome(each) for each in refusal.tried)
    named = f", tried through: {tried}" if tried else ""
    asked = f"Of {refusal.screened} changes of needle, lean, cell and place"
    if refusal.exhausted.narrow:
        return f"{asked} {refusal.freeing} free the worst poses{named}."
    return f"{asked} none was found with which it prints{named}."


def _outcome(tried: TriedChange) -> str:
    return f"{tried.name} ({tried.missing or 'prints'})"


def _where(pose: JudgedPose) -> str:
    return f"run {pose.run + 1} at tip {in_words(np.array(pose.place))}"
