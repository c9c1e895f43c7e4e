"""What plan.json and a person are told of the nozzle's attitude: how it turns about itself, and where it leans."""

from __future__ import annotations

import numpy as np

from geoprint.export import Json
from geoprint.model import FloatArray, JointPath, PoseStream, Tool
from geoprint.motion.arm import is_axial, tilts

# A nozzle that leans less than this from the attitude of the path does not lean [rad].
NOTABLE_LEAN = float(np.radians(0.05))
# Places of lean that are listed, those with the largest lean first.
LISTED_PLACES = 20
# Decimals of angles [degrees] and lengths [mm].
DECIMALS = 3


def attitude_summary(path: JointPath, *, tool: Tool) -> dict[str, Json]:
    """Return what `motion` of plan.json says of turn and lean: angles in degrees, tilt from the surface normal."""
    lengths = _laid_lengths(path.poses)
    laid = lengths > 0.0
    tilt = tilts(path.poses)[laid]
    leaning = np.linalg.norm(path.leans, axis=1) > NOTABLE_LEAN
    total = max(float(lengths.sum()), np.finfo(np.float64).tiny)
    return {
        "rotation": {
            "axial_nozzle": is_axial(tool.T_flange_tool),
            "least_deg": _degrees(path.rotations.min()),
            "most_deg": _degrees(path.rotations.max()),
        },
        "joint_6_turns": round(path.turns_of_joint_6, DECIMALS),
        "tilt": {
            "largest_deg": _degrees(tilt.max(initial=0.0)),
            "mean_deg": _degrees(float(tilt @ lengths[laid]) / total),
        },
        "lean": {"deposit_share": round(float(lengths[leaning].sum()) / total, DECIMALS), "places": _places(path)},
    }


def attitude_text(path: JointPath, *, tool: Tool) -> str:
    """Return the line that a person reads of turn and lean."""
    if is_axial(tool.T_flange_tool):
        turn = "on the flange's axis, its turn stays constant because it would move joint 6 only"
    else:
        turn = f"turns about itself over {np.degrees(np.ptp(path.rotations)):.0f} degrees along the way"
    leans = np.linalg.norm(path.leans, axis=1)
    count = len(_stretches(path))
    lean = f"leans in {count} places, by up to {np.degrees(leans.max()):.1f} degrees" if count else "leans nowhere"
    return f"nozzle: {turn}; joint 6 makes {path.turns_of_joint_6:.1f} turns; {lean}"


def _places(path: JointPath) -> list[Json]:
    """Return where the nozzle leans, the largest leans first."""
    leans = np.linalg.norm(path.leans, axis=1)
    peaks = [int(rows[leans[rows].argmax()]) for rows in _stretches(path)]
    return [
        {
            "run": int(path.poses.runs[row]),
            "place_mm": [round(float(value), DECIMALS) for value in path.poses.tips[row]],
            "lean_deg": _degrees(leans[row]),
            "deposit": bool(path.poses.deposit[row]),
        }
        for row in sorted(peaks, key=lambda row: -leans[row])[:LISTED_PLACES]
    ]


def _stretches(path: JointPath) -> list[np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Return the rows of each stretch in which the nozzle leans."""
    rows = np.flatnonzero(np.linalg.norm(path.leans, axis=1) > NOTABLE_LEAN)
    return np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1) if rows.size else []


def _laid_lengths(poses: PoseStream) -> FloatArray:
    """Return the (p,) deposited length that belongs to each pose [mm]."""
    steps = np.where(poses.laid, np.linalg.norm(np.diff(poses.tips, axis=0), axis=1), 0.0) / 2.0
    return np.append(steps, 0.0) + np.append(0.0, steps)


def _degrees(angle: float | np.floating) -> float:
    return round(float(np.degrees(angle)), DECIMALS)
