"""The patches of one job: cut from one body, kept apart, and put together to the part that is planned."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import final

import numpy as np

from geoprint.config import Job
from geoprint.errors import InputError, naming
from geoprint.model import FloatArray, Surface, frozen
from geoprint.pipeline.workpiece.patches import choice_of, cut_patch
from geoprint.results import Patch
from geoprint.surfaces import PolylineDistance, boundary_loops, closest, edge_lengths, face_areas, in_words, united
from geoprint.surfaces.files import MeshFile
from geoprint.surfaces.remesh import refine
from geoprint.surfaces.repair import PreparationReport, prepare

# Patches may reach over each other's rim by this [mm], which no bead notices, or by this share of an edge: as far as a
# cut slides vertices beside it.
OVERLAP_TOLERANCE = 0.1
OVERLAP_SHARE = 0.1
# Patches are cut into triangles this many times smaller than they are to find where they overlap.
TRIANGLES_ACROSS = 30


@final
@frozen
class PreparedPart:
    """The part of a job, on the side that the file is wound to.

    Attributes:
        surface: as prepared; of several patches their union, in their order.
        preparations: what preparing changed, patch by patch.
        patches: that it was cut as, none where the file is the part.
        body: what they were cut from, or None.
    """

    surface: Surface
    preparations: tuple[PreparationReport, ...]
    patches: tuple[Patch, ...]
    body: Surface | None


def prepared_part(job: Job, loaded: MeshFile) -> PreparedPart:
    """Prepare what a file holds, or cut the patches out of it that a job names.

    Raises:
        MeshError: the file cannot be prepared.
        InputError: a patch cannot be cut, or two overlap; of several patches the sentence says which.
    """
    patches = patches_of(job, loaded)
    if not patches:
        surface, preparation = prepare(loaded.surface, longest_hole=job.fill_holes)
        return PreparedPart(surface, (preparation,), (), None)
    surface = united([patch.surface for patch in patches])
    return PreparedPart(surface, tuple(patch.preparation for patch in patches), patches, _common_body(patches))


def patches_of(job: Job, body: MeshFile) -> tuple[Patch, ...]:
    """Return the patches that a job cuts from its body, in its order; none where the whole body is the part.

    Raises:
        UsageError: the body's file has no such region.
        InputError: as `cut_patch`, and so the other errors; or two patches overlap. The sentence says which.
    """
    several = len(job.patches) > 1
    patches: list[Patch] = []
    for number, region in enumerate(job.patches, start=1):
        place = "" if region.at is None else f" at {in_words(np.array(region.at))}"
        with naming(f"patch {number}{place}" if several else ""):
            patches.append(cut_patch(body.surface, choice_of(region, body), longest_hole=job.fill_holes))
    _refuse_overlaps(patches)
    return tuple(patches)


def _refuse_overlaps(patches: Sequence[Patch]) -> None:
    """Refuse patches of which one lies on another: there material would be laid twice."""
    for (i, one), (j, other) in combinations(enumerate(patches, start=1), 2):
        edge = max(float(edge_lengths(patch.surface).mean()) for patch in (one, other))
        allowed = max(OVERLAP_TOLERANCE, OVERLAP_SHARE * edge)
        for first, second, number in ((one, other, j), (other, one, i)):
            depth, place = _deepest(first.surface, second.surface, near=allowed)
            if depth > allowed:
                raise InputError(
                    f"patches {i} and {j} overlap at {in_words(place)}, {depth:.2g} mm inside the rim of patch "
                    f"{number}, allowed are {allowed:.2g} mm: material would be laid there twice; move them apart or "
                    "make one smaller.",
                    depth=depth,
                )


def _deepest(surface: Surface, other: Surface, *, near: float) -> tuple[float, FloatArray]:
    """Return how far inside the rim of another surface points of one lie on it at most [mm], and where; 0 for none.

    Points on the other surface are those that are no farther from it than `near` [mm].
    """
    size = float(np.sqrt(face_areas(surface).sum())) / TRIANGLES_ACROSS
    points = refine(surface, edge_length=size).vertices
    low, high = other.vertices.min(axis=0) - near, other.vertices.max(axis=0) + near
    points = points[((points >= low) & (points <= high)).all(axis=1)]
    if len(points):
        points = points[closest(other, points)[1] <= near]
    if not len(points):
        return 0.0, surface.vertices[0]
    rims = [other.vertices[np.append(loop, loop[0])] for loop in boundary_loops(other)]
    # A closed surface has no rim: all that lies on it lies inside.
    depths = PolylineDistance(rims, step=size)(points) if rims else np.full(len(points), np.inf)
    return float(depths.max()), points[int(depths.argmax())]


def _common_body(patches: Sequence[Patch]) -> Surface:
    """Return what patches were cut from: the piece of the file that they lie on, or all such pieces, each once."""
    kept: list[Surface] = []
    for body in sorted((patch.body for patch in patches), key=lambda body: -len(body.faces)):
        corners = body.vertices[body.faces[0]]
        if not any((one.vertices[:, None] == corners).all(axis=2).any(axis=0).all() for one in kept):
            kept.append(body)
    return united(kept)
