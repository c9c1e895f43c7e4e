"""Another mesh of a part: smoother, more even or with fewer triangles, and proof that it is still the same part."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from geoprint.account.rounding import all_rounded, rounded
from geoprint.errors import InputError, MeshError, UsageError
from geoprint.export import Json
from geoprint.model import Surface
from geoprint.surfaces import edge_lengths, in_words, smallest_angles
from geoprint.surfaces.files import load_file
from geoprint.surfaces.remesh import Deviation, Distances, decimate, deviation, remesh, smooth
from geoprint.surfaces.repair import PreparationReport, prepare

# Without another word the surface may move by this share of the part's diagonal: 0.1 mm for a patch of 50 mm.
DEVIATION_SHARE = 1.0 / 500.0
ADVICE = "ask for shorter edges, more faces or less smoothing"


@final
@dataclass(frozen=True, slots=True, eq=False)
class Remeshed:
    """A part with another mesh.

    Attributes:
        before: the part as prepared.
        preparation: what preparing changed.
        after: the part with its new mesh.
        steps: what was done, in words.
        deviation: how far the two lie apart.
        allowed: how far they may [mm].
    """

    before: Surface
    preparation: PreparationReport
    after: Surface
    steps: tuple[str, ...]
    deviation: Deviation
    allowed: float


def remesh_file(
    path: Path,
    *,
    unit: str | None = None,
    label: int | None = None,
    wavelength: float | None = None,
    edge_length: float | None = None,
    faces: int | None = None,
    max_deviation: float | None = None,
) -> Remeshed:
    """Prepare a part, smooth it and give it other triangles, as far as asked for; then measure what that has changed.

    Args:
        path: of the part's file.
        unit: of its coordinates.
        label: of a label volume, which one.
        wavelength: as for `surfaces.smooth` [mm]; None leaves the noise.
        edge_length: as for `surfaces.remesh` [mm].
        faces: as for `surfaces.decimate`, instead.
        max_deviation: how far old and new surface, and their rims, may lie apart [mm]; by default DEVIATION_SHARE of
            the part's diagonal.

    Raises:
        UsageError: nothing is asked for, or edge length and faces both.
        InputError: the file cannot be used; or the new surface lies farther off than allowed, or cannot be planned on.
    """
    if wavelength is None and edge_length is None and faces is None:
        raise UsageError(
            "say what to change: `--edge-length MM` or `--faces N`, `--smooth MM`, or one of them with it."
        )
    if edge_length is not None and faces is not None:
        raise UsageError("give either `--edge-length` or `--faces`, not both: either follows from the other.")
    before, preparation = prepare(load_file(path, unit=unit, label=label).surface)
    allowed = max_deviation
    if allowed is None:
        allowed = DEVIATION_SHARE * float(np.linalg.norm(np.ptp(before.vertices, axis=0)))
    after, steps = before, list[str]()
    if wavelength is not None:
        after = smooth(after, wavelength=wavelength)
        steps.append(f"smoothed below {wavelength:g} mm")
    if edge_length is not None:
        after = remesh(after, edge_length=edge_length)
        steps.append(f"remeshed to edges of {edge_length:g} mm")
    if faces is not None:
        after = decimate(after, faces=faces)
        steps.append(f"decimated to {faces} faces")
    _check_topology(after, preparation)
    found = Remeshed(before, preparation, after, tuple(steps), deviation(before, after), allowed)
    _check_deviation(found)
    return found


def remeshing_summary(found: Remeshed) -> dict[str, Json]:
    """Return what `geoprint remesh --json` prints; lengths are mm."""
    return {
        "name": found.before.name,
        "steps": list(found.steps),
        "topology": found.preparation.topology,
        "preparation": list(found.preparation.changes()),
        "before": _mesh_summary(found.before),
        "after": _mesh_summary(found.after),
        "deviation": {
            "old_to_new": _distances_summary(found.deviation.forward),
            "new_to_old": _distances_summary(found.deviation.backward),
            "rim_max_mm": rounded(found.deviation.rim),
            "allowed_mm": rounded(found.allowed),
        },
    }


def remeshing_text(found: Remeshed) -> str:
    """Return the lines that a person reads."""
    changes = found.preparation.changes()
    rim = f"; rims at most {_length(found.deviation.rim)} mm" if found.preparation.boundary_lengths else ""
    return "\n".join(
        [
            f"{found.before.name}: {'; '.join([*changes, *found.steps])}",
            f"before: {_mesh_text(found.before)}",
            f"after:  {_mesh_text(found.after)}",
            f"old surface to new: {_distances_text(found.deviation.forward)}",
            f"new surface to old: {_distances_text(found.deviation.backward)}{rim}; {found.allowed:.3g} mm allowed",
        ]
    )


def _check_topology(after: Surface, preparation: PreparationReport) -> None:
    """Refuse a mesh that planning would refuse, or repair into another kind of surface."""
    try:
        topology = prepare(after)[1].topology
    except MeshError as error:
        raise InputError(f"the new mesh cannot be planned on: {str(error).rstrip('.')}; {ADVICE}.") from error
    if topology != preparation.topology:
        raise InputError(
            f"the new mesh of {after.name} would read as {topology}, the part is {preparation.topology}: the "
            f"smallest of its holes, handles or walls do not survive; {ADVICE}."
        )


def _check_deviation(found: Remeshed) -> None:
    """Refuse a mesh that lies farther from the part than is allowed."""
    worst, rim = found.deviation.largest, found.deviation.rim
    deviates = max(worst.bound, rim)
    if deviates <= found.allowed:
        return
    where = f"at {in_words(worst.place)}" if worst.bound >= rim else "at a rim"
    raise InputError(
        f"{found.before.name}, {' and '.join(found.steps)}, lies up to {deviates:.3g} mm off, {where}; at most "
        f"{found.allowed:.3g} mm is allowed: {ADVICE}, or allow it with `--max-deviation {1.1 * deviates:.2g}`.",
        deviation=deviates,
        allowed=found.allowed,
        place=worst.place,
    )


def _mesh_summary(surface: Surface) -> dict[str, Json]:
    lengths, angles = edge_lengths(surface), np.degrees(smallest_angles(surface))
    return {
        "faces": len(surface.faces),
        "edge_mean_mm": rounded(float(lengths.mean())),
        "edge_cv": rounded(float(lengths.std() / lengths.mean())),
        "smallest_angle_deg": rounded(float(angles.min())),
        "smallest_angle_p1_deg": rounded(float(np.quantile(angles, 0.01))),
    }


def _mesh_text(surface: Surface) -> str:
    lengths, angles = edge_lengths(surface), np.degrees(smallest_angles(surface))
    return (
        f"{len(surface.faces)} faces, edges {lengths.mean():.3g} mm (CV {lengths.std() / lengths.mean():.2f}), "
        f"smallest angle {angles.min():.3g} degrees, 1 % below {np.quantile(angles, 0.01):.3g}"
    )


def _distances_summary(found: Distances) -> dict[str, Json]:
    return {
        "max_mm": rounded(found.largest),
        "max_bound_mm": rounded(found.bound),
        "mean_mm": rounded(found.mean),
        "p95_mm": rounded(found.p95),
        "place_mm": all_rounded(found.place),
    }


def _distances_text(found: Distances) -> str:
    return (
        f"largest {_length(found.largest)} mm at {in_words(found.place)}, proven below {_length(found.bound)}; "
        f"mean {_length(found.mean)}, 95 % below {_length(found.p95)}"
    )


def _length(value: float) -> str:
    """Return a length [mm] to a thousandth, below which no printer tells a difference."""
    return f"{value:.3f}"
