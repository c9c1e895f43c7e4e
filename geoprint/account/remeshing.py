"""What is said of a part with another mesh: the lines that a person reads, and the object for programs."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import final

import numpy as np

from geoprint.account.records.rounding import rounded
from geoprint.export import Json
from geoprint.model import Surface
from geoprint.results import Remeshed
from geoprint.surfaces import edge_lengths, in_words, smallest_angles
from geoprint.surfaces.remesh import Distances


@final
@dataclass(frozen=True, slots=True)
class FinenessRecord:
    """How fine and how even a mesh is: mean of its edges and their standard deviation over it, its smallest angles."""

    faces: int
    edge_mean_mm: float
    edge_cv: float
    smallest_angle_deg: float
    smallest_angle_p1_deg: float


@final
@dataclass(frozen=True, slots=True)
class DistancesRecord:
    """How far one surface lies from the other: where it is most, what that is proven below, mean and 95 %."""

    max_mm: float
    max_bound_mm: float
    mean_mm: float
    p95_mm: float
    place_mm: tuple[float, ...]


@final
@dataclass(frozen=True, slots=True)
class DeviationRecord:
    """How far two surfaces lie apart in both directions, and their rims, and how far they may."""

    old_to_new: DistancesRecord
    new_to_old: DistancesRecord
    rim_max_mm: float
    allowed_mm: float


@final
@dataclass(frozen=True, slots=True)
class RemeshingRecord:
    """What `geoprint remesh` says; the fields are the keys of `--json` in their order.

    Attributes:
        name: of the part.
        steps: what was done, in words.
        topology: which both meshes have.
        preparation: what preparing the part changed, in words.
        before: the mesh as prepared.
        after: the new one.
        deviation: how far they lie apart.
    """

    name: str
    steps: tuple[str, ...]
    topology: str
    preparation: tuple[str, ...]
    before: FinenessRecord
    after: FinenessRecord
    deviation: DeviationRecord


def remeshing_summary(found: Remeshed) -> dict[str, Json]:
    """Return what `geoprint remesh --json` prints."""
    return asdict(_record(found))


def remeshing_text(found: Remeshed) -> str:
    """Return the lines that a person reads."""
    record = _record(found)
    deviation = record.deviation
    rim = f"; rims at most {deviation.rim_max_mm:.3f} mm" if found.preparation.boundary_lengths else ""
    return "\n".join(
        [
            f"{record.name}: {'; '.join([*record.preparation, *record.steps])}",
            f"before: {_mesh_text(record.before)}",
            f"after:  {_mesh_text(record.after)}",
            f"old surface to new: {_distances_text(deviation.old_to_new)}",
            f"new surface to old: {_distances_text(deviation.new_to_old)}{rim}; {deviation.allowed_mm:.3g} mm allowed",
        ]
    )


def _record(found: Remeshed) -> RemeshingRecord:
    return RemeshingRecord(
        name=found.before.name,
        steps=found.steps,
        topology=found.preparation.topology,
        preparation=found.preparation.repairs.changes(),
        before=_mesh(found.before),
        after=_mesh(found.after),
        deviation=DeviationRecord(
            old_to_new=_distances(found.deviation.forward),
            new_to_old=_distances(found.deviation.backward),
            rim_max_mm=rounded(found.deviation.rim),
            allowed_mm=rounded(found.allowed),
        ),
    )


def _mesh(surface: Surface) -> FinenessRecord:
    lengths, angles = edge_lengths(surface), np.degrees(smallest_angles(surface))
    return FinenessRecord(
        faces=len(surface.faces),
        edge_mean_mm=rounded(lengths.mean()),
        edge_cv=rounded(lengths.std() / lengths.mean()),
        smallest_angle_deg=rounded(angles.min()),
        smallest_angle_p1_deg=rounded(np.quantile(angles, 0.01)),
    )


def _distances(found: Distances) -> DistancesRecord:
    return DistancesRecord(
        max_mm=rounded(found.largest),
        max_bound_mm=rounded(found.bound),
        mean_mm=rounded(found.mean),
        p95_mm=rounded(found.p95),
        place_mm=tuple(map(rounded, found.place)),
    )


def _mesh_text(mesh: FinenessRecord) -> str:
    return (
        f"{mesh.faces} faces, edges {mesh.edge_mean_mm:.3g} mm (CV {mesh.edge_cv:.2f}), smallest angle "
        f"{mesh.smallest_angle_deg:.3g} degrees, 1 % below {mesh.smallest_angle_p1_deg:.3g}"
    )


def _distances_text(found: DistancesRecord) -> str:
    """Return lengths to a thousandth of a mm, below which no printer tells a difference."""
    return (
        f"largest {found.max_mm:.3f} mm at {in_words(found.place_mm)}, proven below {found.max_bound_mm:.3f}; "
        f"mean {found.mean_mm:.3f}, 95 % below {found.p95_mm:.3f}"
    )
