"""What became of each patch of a plan: its size, its runs and how even they are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from geoprint.account.patches import patch_summary
from geoprint.account.rounding import all_rounded, rounded
from geoprint.export import Json
from geoprint.model import FloatArray
from geoprint.results import Plan
from geoprint.surfaces import component_labels, face_areas, middle_of, pieces


@final
@dataclass(frozen=True, slots=True, eq=False)
class PatchFigures:
    """One of several patches, or the whole part.

    Attributes:
        place: (3,) about its middle [mm].
        area: [mm2].
        runs: first and last run that lie on it; its runs follow each other.
        length: deposited on it [mm].
        mean: of its spacing over the wanted one, or None where it has but one level.
        cv: standard deviation over mean of its spacing, or None where it has but one level.
    """

    place: FloatArray
    area: float
    runs: tuple[int, int]
    length: float
    mean: float | None
    cv: float | None


def patch_figures(plan: Plan) -> tuple[PatchFigures, ...]:
    """Return what became of each piece of a plan's part, in the order of the job."""
    surface, curves, poses = plan.workpiece.surface, plan.toolpath.curves, plan.poses
    piece_of_run = component_labels(surface)[curves.points.faces[curves.offsets[:-1]]]
    lengths = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1) * poses.laid
    found: list[PatchFigures] = []
    for number, piece in enumerate(pieces(plan.workpiece.part)):
        runs = np.flatnonzero(piece_of_run == number)
        measured = plan.uniformity
        ratios = np.empty(0) if measured is None else measured.ratios[np.isin(measured.runs, runs)]
        found.append(
            PatchFigures(
                place=middle_of(piece.surface),
                area=float(face_areas(piece.surface).sum()),
                runs=(int(runs[0]), int(runs[-1])),
                length=float(lengths[np.isin(poses.runs[:-1], runs)].sum()),
                mean=float(ratios.mean()) if ratios.size else None,
                cv=float(ratios.std() / ratios.mean()) if ratios.size else None,
            )
        )
    return tuple(found)


def patches_summary(plan: Plan) -> list[Json]:
    """Return what plan.json says of each patch: how it was cut, and what became of it; lengths are mm."""
    return [
        {
            **patch_summary(patch),
            "place_mm": all_rounded(figures.place),
            "runs": list(figures.runs),
            "deposit_mm": rounded(figures.length),
            "spacing": {
                "mean": None if figures.mean is None else rounded(figures.mean),
                "cv": None if figures.cv is None else rounded(figures.cv),
            },
        }
        for patch, figures in zip(plan.workpiece.patches, patch_figures(plan), strict=True)
    ]


def patches_text(plan: Plan) -> list[str]:
    """Return a line for each of several patches."""
    if len(plan.workpiece.patches) < 2:
        return []
    return [
        f"patch {number}: {figures.area:.4g} mm2, runs {figures.runs[0] + 1} to {figures.runs[1] + 1}, spacing varies "
        f"by {evenness(figures)} (CV)"
        for number, figures in enumerate(patch_figures(plan), start=1)
    ]


def evenness(figures: PatchFigures) -> str:
    """Return how much the spacing of a patch varies, in words."""
    return "- with one level" if figures.cv is None else f"{figures.cv:.2%}"
