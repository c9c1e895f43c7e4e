"""What is said of comparisons: the content of compare.json, the report page, and the picture beside it."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version

import numpy as np

from geoprint.account.coverage_picture import coverage_picture
from geoprint.account.part_report import part_report
from geoprint.account.summary import settings_summary, summary, uniformity_summary
from geoprint.account.verdict import verdict
from geoprint.export import Json
from geoprint.quality import agreement
from geoprint.report import html_report
from geoprint.results import Comparison, FailedPart, Planned, Refused

# Version of the layout of compare.json; a change that breaks a reader raises it.
SCHEMA = 1
# Faces that the report draws in all, and at least of each part: more are not seen, and make the file heavy.
VIEW_FACES = 100_000
FEWEST_VIEW_FACES = 10_000


def comparison_summary(parts: Sequence[Comparison | FailedPart]) -> dict[str, Json]:
    """Return the content of compare.json.

    `schema` is the version of this layout, `version` that of geoprint, `parts` has an object for each part in the order
    of the command. A part that failed has `part` (its file's name) and `failed` (why). Any other has

    - `part`, `input` (name, SHA-256 and unit of its file), `settings`, `surface`: as in plan.json;
    - `verdict`: sentences;
    - `backends`: for each in the order of the command either `backend` and `refused` (why), or `backend`,
      `spacing_mm`, `uniformity`, `paths`, `deposition` and `patches` as in plan.json, `printable` (null where it was
      not asked), `not_printable` (why), `not_reached` (share of the deposited length that the arm cannot reach, for
      each reason), `print_time_s`, `smallest_clearance_mm`, `planning_s`, `warnings`;
    - `path_distances_mm`: `backends` (names), `hausdorff` and `mean`, matrices in their order.
    """
    return {
        "schema": SCHEMA,
        "version": version("geoprint"),
        "parts": [_part(part) for part in parts],
    }


def _part(part: Comparison | FailedPart) -> dict[str, Json]:
    if isinstance(part, FailedPart):
        return {"part": part.job.surface.name, "failed": part.reason}
    first = part.planned[0][1].plan
    about = summary(first)
    names = [name for name, _ in part.planned]
    apart = agreement([outcome.plan.poses for _, outcome in part.planned], spacing=first.contours.spacing)
    return {
        "part": part.job.surface.name,
        "input": about["input"],
        "settings": {name: value for name, value in settings_summary(first).items() if name != "backend"},
        "surface": about["surface"],
        "verdict": list(verdict(part)),
        "backends": [_row(name, outcome) for name, outcome in part.outcomes],
        "path_distances_mm": {
            "backends": names,
            "hausdorff": np.round(apart.hausdorff, 6).tolist(),
            "mean": np.round(apart.mean, 6).tolist(),
        },
    }


def _row(name: str, outcome: Planned | Refused) -> dict[str, Json]:
    if isinstance(outcome, Refused):
        return {"backend": name, "refused": outcome.reason}
    plan, about = outcome.plan, summary(outcome.plan)
    robot = plan.robot
    return {
        "backend": name,
        "spacing_mm": plan.contours.spacing,
        "uniformity": uniformity_summary(outcome.uniformity),
        "paths": about["paths"],
        "deposition": about.get("deposition"),
        "patches": about.get("patches", []),
        "printable": robot is not None if plan.job.robot else None,
        "not_printable": outcome.not_printable,
        "not_reached": {reason: round(share, 6) for reason, share in outcome.lost},
        "print_time_s": None if robot is None else robot.trajectory.duration,
        "smallest_clearance_mm": None if robot is None else round(robot.clearance.smallest, 6),
        "planning_s": round(outcome.planning_time, 3),
        "warnings": about["warnings"],
    }


def comparison_picture(comparison: Comparison) -> bytes:
    """Return a PNG: the backends side by side, their paths coloured by local spacing."""
    spacing = comparison.planned[0][1].plan.contours.spacing
    title = f"{comparison.job.surface.name}, paths {spacing:.3g} mm apart, seen along the mean normal"
    return coverage_picture(comparison.workpiece, comparison.planned, title=title)


def comparison_report(parts: Sequence[Comparison | FailedPart]) -> bytes:
    """Return report.html: verdict, figures and a 3D scene for each part, in one file that opens offline."""
    compared = [part for part in parts if isinstance(part, Comparison)]
    named = compared[0].job.surface.name if len(parts) == 1 else f"{len(parts)} parts"
    faces = max(VIEW_FACES // len(compared), FEWEST_VIEW_FACES)
    return html_report(
        [part_report(part, faces=faces) for part in compared],
        title=f"geoprint compare: {named}",
        failed=[(part.job.surface.name, part.reason) for part in parts if isinstance(part, FailedPart)],
    )
