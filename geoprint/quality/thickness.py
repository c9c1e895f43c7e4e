"""How even the layer is that a flow leaves behind: the laid volume levels on the surface and its thickness is measured.

The volume of every stretch of path is put down where the stretch lies. Then it spreads as heat does, no farther than
beads flow into each other, and nothing leaves over the border:

    M u + t L u = b    after each of several small steps, with mass M and stiffness L of linear finite elements,

where b is the volume at each vertex and u the thickness [Crane2013, sec. 3.2 for M and L]. Beads as wide as their
spacing leave no trace of single lines then, and what remains uneven is what the flow did not give. No width and no
distance of any other measurement enters.
"""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import cg
from scipy.spatial import KDTree

from geoprint.errors import FieldError
from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream, Surface, comparable
from geoprint.surfaces import closest, cotangent_laplacian, diagonal_matrix, lumped_mass
from geoprint.surfaces.remesh import refine
from geoprint.threads import single_threaded_blas

# Standard deviation of the spread over the spacing: lines one spacing apart are level to 1e-8 after it.
SPREAD_SHARE = 1.0
# Edges of the triangles and steps along the path over the spacing, fine enough for that spread.
EDGE_SHARE = 0.25
# Small steps of the spreading; with so many a ripple of lines one spacing apart falls below 1e-4.
STEPS = 16
# Relative residual of a step: far below any thickness that is told.
RESIDUAL = 1e-6
# A stretch has no next level inside where that is farther than this many times the distance to the level outside.
NO_NEXT_SHARE = 1.25
# Half the strip of such a stretch and one spacing: what lies within these spacings of it is near the medial axis.
NEAR_SHARE = 1.5


@final
@comparable
class Thickness:
    """Thickness of the laid layer over the surface, weighted by area.

    Near the medial axis fronts meet or paths end: everything within one spacing of the strip of a stretch that has no
    next level on its inner side.

    Attributes:
        mean: everywhere [mm].
        cv: coefficient of variation away from the medial axis, or None where nothing is away from it.
        near_cv: the same near the medial axis, or None where nothing is near it.
        away_share: share of the area away from the medial axis.
    """

    mean: float
    cv: float | None
    near_cv: float | None
    away_share: float


class _Stretches(NamedTuple):
    """Middles of k short stretches of path, each between two poses."""

    places: FloatArray
    lengths: FloatArray
    before: IntArray
    shares: FloatArray


@final
class LevelledLayer:
    """Answers how thick the layer becomes that a flow along a path leaves on a surface.

    Args:
        poses: the stream; only its places count, not its flow.
        surface: what it covers.
        spacing: distance between neighbouring levels [mm].

    Attributes:
        surface: the same refined, n vertices, at which thickness is simulated.
    """

    def __init__(self, poses: PoseStream, surface: Surface, *, spacing: float) -> None:
        self.surface = fine = refine(surface, edge_length=EDGE_SHARE * spacing)
        self._areas = lumped_mass(fine)
        self._stretches = _stretches(poses, step=EDGE_SHARE * spacing)
        landed, _ = closest(fine, self._stretches.places)
        count, vertices = self._stretches.lengths.size, len(fine.vertices)
        corners = fine.faces[landed.faces].ravel()
        indices = (corners, np.repeat(np.arange(count), 3))
        self._put_down = csr_array((landed.weights.ravel(), indices), shape=(vertices, count))
        time = 0.5 * (SPREAD_SHARE * spacing) ** 2 / STEPS
        self._step = csr_array(diagonal_matrix(self._areas) + time * cotangent_laplacian(fine))
        levels = poses.levels[self._stretches.before]
        ends = self._stretches.places[_without_next(self._stretches.places, levels, spacing=spacing)]
        self._near = _distances(fine.vertices, ends, otherwise=np.inf) <= NEAR_SHARE * spacing

    def __call__(self, flow: FloatArray) -> Thickness:
        """Return the thickness for a (p,) flow at the poses [mm3/mm], linear between them.

        Raises:
            FieldError: the spreading does not converge, on triangles that are far too thin.
        """
        thickness = self.field(flow)
        away = ~self._near
        return Thickness(
            mean=float(np.average(thickness, weights=self._areas)),
            cv=_variation(thickness[away], self._areas[away]),
            near_cv=_variation(thickness[self._near], self._areas[self._near]),
            away_share=float(self._areas[away].sum() / self._areas.sum()),
        )

    def field(self, flow: FloatArray) -> FloatArray:
        """Return the (n,) thickness at the vertices of the refined surface for a (p,) flow at the poses [mm].

        Raises:
            FieldError: as `__call__`.
        """
        return self._levelled(np.asarray(self._put_down @ self._volumes(flow)))

    def _volumes(self, flow: FloatArray) -> FloatArray:
        """Return the (k,) volume of each stretch [mm3]."""
        _, lengths, before, shares = self._stretches
        return lengths * ((1.0 - shares) * flow[before] + shares * flow[before + 1])

    def _levelled(self, volumes: FloatArray) -> FloatArray:
        """Return the (n,) thickness at the vertices [mm] after the volumes put down at them [mm3] have spread."""
        inverse_diagonal = diagonal_matrix(1.0 / self._step.diagonal())
        thickness = volumes / self._areas
        for _ in range(STEPS):
            # Vectors this short gain nothing from threads, and lose tenfold where the machine is busy.
            with single_threaded_blas():
                thickness, failed = cg(self._step, volumes, x0=thickness, rtol=RESIDUAL, M=inverse_diagonal)
            if failed:
                raise FieldError(
                    "the thickness of the layer cannot be simulated: its triangles are too thin for the solver; "
                    "remesh the part."
                )
            volumes = self._areas * thickness
        return thickness


def _stretches(poses: PoseStream, *, step: float) -> _Stretches:
    """Cut what is laid between poses into equal stretches of at most one step [mm]."""
    laid = np.flatnonzero(poses.laid)
    points = poses.surface_points
    start, along = points[laid], points[laid + 1] - points[laid]
    lengths = np.linalg.norm(along, axis=1)
    counts = np.maximum(np.ceil(lengths / step), 1).astype(np.int64)
    piece = np.repeat(np.arange(laid.size), counts)
    rank = np.arange(piece.size) - np.repeat(np.cumsum(counts) - counts, counts)
    shares: FloatArray = (rank + 0.5) / counts[piece]
    places = start[piece] + shares[:, None] * along[piece]
    return _Stretches(places, (lengths / counts)[piece], laid[piece], shares)


def _without_next(places: FloatArray, levels: IntArray, *, spacing: float) -> BoolArray:
    """Tell which of k places on levels have no next level on their inner side, because fronts meet there.

    The next level of an undisturbed front is about as far as the one before; the first level lies half a spacing from
    the seed, and the next one counts as one spacing away there.
    """
    found = np.ones(levels.size, dtype=np.bool_)
    for level in np.unique(levels)[:-1]:
        here = levels == level
        outside = _distances(places[here], places[levels == level - 1], otherwise=spacing)
        inside = _distances(places[here], places[levels == level + 1], otherwise=np.inf)
        found[here] = inside > NO_NEXT_SHARE * outside
    return found


def _distances(places: FloatArray, others: FloatArray, *, otherwise: float) -> FloatArray:
    if len(others) == 0:
        return np.full(len(places), otherwise)
    return np.asarray(KDTree(others).query(places)[0], dtype=np.float64)


def _variation(values: FloatArray, weights: FloatArray) -> float | None:
    if values.size == 0:
        return None
    mean = float(np.average(values, weights=weights))
    return float(np.sqrt(np.average((values - mean) ** 2, weights=weights))) / mean
