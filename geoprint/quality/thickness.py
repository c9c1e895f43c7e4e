"""How thick, and how even, the layer is that a flow along paths leaves on a surface: the headline of evenness.

Every stretch of path puts its volume down where it lies. Then the volume spreads over the surface as heat does, and
nothing leaves over the rim:

    M u + t L u = b    after each of many small steps, with mass M and stiffness L of linear finite elements,

where b is the volume at each vertex and u the thickness [Crane2013, sec. 3.2 for M and L]. Paths one spacing apart
leave one thickness everywhere but for a ripple of 0.2 %; gaps, overlaps, ends, corners and rows that are off count as
what they leave behind. No level, no neighbour, no window and no threshold enters.
"""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import cg

from geoprint.errors import FieldError
from geoprint.model import FloatArray, IntArray, PoseStream, Surface, comparable
from geoprint.quality.deposited import Samples
from geoprint.quality.oracle import FlatMesh, SurfacePath, spatial
from geoprint.quality.spacing import SpacingAt, cut_evenly
from geoprint.surfaces import closest, cotangent_laplacian, diagonal_matrix, lumped_mass
from geoprint.surfaces.remesh import refine
from geoprint.threads import single_threaded_blas

# Standard deviation of the spread over the spacing: about what a bead does that is as wide as its spacing.
SPREAD_SHARE = 0.6
# Edges of the triangles over the spacing: a CV is 0.01 to 0.04 points above what ever finer ones tend to.
EDGE_SHARE = 0.125
# Longest stretch of path that puts its volume down at its middle, over the spacing.
STRETCH_SHARE = 0.125
# Small steps of the spreading.
STEPS = 32
# Residual of a step over the volume of a layer as thick as wanted: without any, a CV changes by up to 0.002 points.
RESIDUAL = 1e-5


@final
@comparable
class Thickness:
    """Thickness of a layer over all of the surface, each place weighted by its area; 1 is as wanted.

    Attributes:
        mean: over the wanted one.
        cv: coefficient of variation: standard deviation over mean.
        within_5_percent: share of the area that is as near to the wanted one.
        within_10_percent: the same for a tenth.
        smallest: over the wanted one.
        largest: over the wanted one.
    """

    mean: float
    cv: float
    within_5_percent: float
    within_10_percent: float
    smallest: float
    largest: float


class Stretches(NamedTuple):
    """Middles of k short stretches of path, each between two of the places that its flow is given at.

    Attributes:
        places: (k, 3) [mm].
        lengths: (k,) [mm].
        before: (k,) which place lies before each; the one behind it follows.
        shares: (k,) how far each lies on the way between the two.
    """

    places: FloatArray
    lengths: FloatArray
    before: IntArray
    shares: FloatArray

    def volumes(self, flow: FloatArray) -> FloatArray:
        """Return the (k,) volume of each stretch for a flow at the places, linear between them [mm3/mm]."""
        return self.lengths * ((1.0 - self.shares) * flow[self.before] + self.shares * flow[self.before + 1])

    def at_ends(self, values: FloatArray, samples: Samples) -> FloatArray:
        """Return the (k,) mean over the stretches behind each sample of values of them."""
        count = samples.runs.size
        sums, counts = (np.bincount(self.before, each, minlength=count) for each in (values, np.ones(values.size)))
        # The last sample of a run has none behind it.
        last = np.flatnonzero(counts == 0)
        sums[last], counts[last] = sums[last - 1], counts[last - 1]
        return sums / counts


@final
class LevelledLayer:
    """Answers how thick the layer becomes that volumes at places leave on a surface.

    Args:
        surface: what is covered.
        places: (k, 3) where volumes are put down [mm].
        spacing: distance between neighbouring paths [mm].
        wanted: what it is at each place, where that differs.

    Attributes:
        surface: the same refined, n vertices, at which thickness is simulated.
    """

    def __init__(
        self, surface: Surface, places: FloatArray, *, spacing: float, wanted: SpacingAt | None = None
    ) -> None:
        least = spacing if wanted is None else min(spacing, float(wanted(surface.vertices).min()))
        self.surface = fine = refine(surface, edge_length=EDGE_SHARE * least)
        self._areas = lumped_mass(fine)
        landed, _ = closest(fine, places)
        corners = fine.faces[landed.faces].ravel()
        indices = (corners, np.repeat(np.arange(len(places)), 3))
        self._put_down = csr_array((landed.weights.ravel(), indices), shape=(len(fine.vertices), len(places)))
        widths = spacing if wanted is None else wanted(fine.vertices[fine.faces].mean(axis=1))
        times = 0.5 * (SPREAD_SHARE * widths) ** 2 / STEPS
        self._step = csr_array(diagonal_matrix(self._areas) + cotangent_laplacian(fine, times))

    def __call__(self, volumes: FloatArray) -> Thickness:
        """Return the thickness for (k,) volumes at the places [mm3].

        Raises:
            FieldError: as `field`.
        """
        return self.over_all(self.field(volumes))

    def over_all(self, thickness: FloatArray) -> Thickness:
        """Return what a thickness at the n vertices [mm] is over all of the area."""
        areas = self._areas
        mean, whole = float(np.average(thickness, weights=areas)), float(areas.sum())
        within = [float(areas[np.abs(thickness - 1.0) <= share].sum()) / whole for share in (0.05, 0.1)]
        return Thickness(
            mean=mean,
            cv=float(np.sqrt(np.average((thickness - mean) ** 2, weights=areas))) / mean,
            within_5_percent=within[0],
            within_10_percent=within[1],
            smallest=float(thickness.min()),
            largest=float(thickness.max()),
        )

    def field(self, volumes: FloatArray) -> FloatArray:
        """Return the (n,) thickness at the vertices of the refined surface for (k,) volumes at the places [mm].

        Raises:
            FieldError: the spreading does not converge, on triangles that are far too thin.
        """
        left = np.asarray(self._put_down @ volumes)
        inverse_diagonal = diagonal_matrix(1.0 / self._step.diagonal())
        residual = RESIDUAL * float(np.linalg.norm(self._areas))
        thickness, before = left / self._areas, None
        for _ in range(STEPS):
            # What changes as it did in the last step is found in half of the work.
            guess = thickness if before is None else 2.0 * thickness - before
            before = thickness
            # Vectors this short gain nothing from threads, and lose tenfold where the machine is busy.
            with single_threaded_blas():
                thickness, failed = cg(self._step, left, x0=guess, rtol=0.0, atol=residual, M=inverse_diagonal)
            if failed:
                raise FieldError(
                    "the thickness of the layer cannot be simulated: its triangles are too thin for the solver; "
                    "remesh the part."
                )
            left = self._areas * thickness
        return thickness

    def at_places(self, thickness: FloatArray) -> FloatArray:
        """Return the (k,) thickness at the places, of one at the n vertices [mm]."""
        return np.asarray(self._put_down.T @ thickness)


def stretches_of_poses(poses: PoseStream, *, spacing: float) -> Stretches:
    """Cut what is deposited between poses into equal stretches; flow is given at the (p,) poses.

    Args:
        poses: p of them.
        spacing: [mm].
    """
    laid = np.flatnonzero(poses.laid)
    points = poses.surface_points
    start, along = points[laid], points[laid + 1] - points[laid]
    lengths = np.linalg.norm(along, axis=1)
    owner, shares, counts = cut_evenly(lengths, step=STRETCH_SHARE * spacing)
    places = start[owner] + shares[:, None] * along[owner]
    return Stretches(places, (lengths / counts)[owner], laid[owner], shares)


def stretches_of_path(mesh: FlatMesh, path: SurfacePath, samples: Samples, *, spacing: float) -> Stretches:
    """Cut a path between samples into equal stretches; flow is given at the samples.

    Args:
        mesh: that the path lies on.
        path: r runs.
        samples: k samples along all of them, ends included.
        spacing: [mm].
    """
    between = np.flatnonzero(np.diff(samples.runs) == 0)
    lengths = np.diff(samples.arcs)[between]
    owner, shares, counts = cut_evenly(lengths, step=STRETCH_SHARE * spacing)
    arcs = samples.arcs[between][owner] + shares * lengths[owner]
    places = spatial(mesh, path.at(samples.runs[between][owner], arcs))
    return Stretches(places, (lengths / counts)[owner], between[owner], shares)
