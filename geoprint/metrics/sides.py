"""Spacing to the left and to the right of any path, by exact distances over the surface; it needs no levels.

From a sample each quarter of a spacing to the nearest other stretch on either side, seen from outside: another run, or
the same one farther than two spacings along it. What has no neighbour within three spacings counts as `none`, as at a
rim; what is nearest only obliquely, at an open end or behind the path's own bend (`oracle.aside`) as `oblique`. Both
are left out of the figures and given as shares.
"""

from __future__ import annotations

from dataclasses import field
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.metrics.deposited import Samples
from geoprint.metrics.oracle import (
    FOUND,
    NONE,
    OBLIQUE,
    UNKNOWN,
    WINDOWS_IN_ALL,
    ComplexArray,
    FlatMesh,
    Places,
    Stretches,
    SurfacePath,
    neighbours,
    spatial,
)
from geoprint.metrics.spacing import APART, SpacingAt, SpacingFigures, Spans, no_spans, shares_at, spans_to_segments
from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen

# How far a neighbour may be, in spacings.
REACH = 3.0
# The direction of a path is that of its chord over so many spacings to both sides.
CHORD_SHARE = 0.05
# Samples are moved off edges and vertices by this share of the line to the middle of their face: they look from within.
INWARDS = 1e-7


@final
@frozen
class SideSpacing:
    """How far other stretches are to the left and to the right of samples along a path.

    Attributes:
        places: (k, 3) samples, run after run [mm].
        normals: (k, 3) outward unit normal of the face of each.
        ahead: (k, 3) unit vector along the path.
        offsets: (r + 1,) samples of run i are `places[offsets[i]:offsets[i + 1]]`.
        ratios: (k, 2) distance to the left and to the right, over the spacing; infinite where nothing was found.
        kinds: (k, 2) 0 where that is a neighbour, 1 none within reach, 2 only obliquely, 3 not known.
        nearest: (k, 2) run that is nearest, -1 for none.
        spans: from where to where the ratios were measured, on the left and on the right.
    """

    places: FloatArray
    normals: FloatArray
    ahead: FloatArray
    offsets: IntArray
    ratios: FloatArray
    kinds: IntArray
    nearest: IntArray
    spans: tuple[Spans, Spans] = field(default_factory=lambda: (no_spans(), no_spans()))

    def __post_init__(self) -> None:
        if self.ratios.shape != (len(self.places), 2) or not self.places.size:
            raise InputError("the spacing to both sides needs two ratios a sample, and at least one sample.")
        freeze_arrays(self, places="float: k 3", normals="float: k 3", ahead="float: k 3", offsets="int: o",
                      kinds="int: k 2", nearest="int: k 2")  # fmt: skip
        self.ratios.setflags(write=False)

    @property
    def left(self) -> SpacingFigures:
        """To the left of the path, as seen from outside along it."""
        return self._figures(slice(0, 1))

    @property
    def right(self) -> SpacingFigures:
        """To the right of it."""
        return self._figures(slice(1, 2))

    @property
    def both(self) -> SpacingFigures:
        """All samples of both sides."""
        return self._figures(slice(0, 2))

    def sides(self) -> FloatArray:
        """Return the (k, 2) ratios with NaN where there is no neighbour."""
        return np.where(self.kinds == FOUND, self.ratios, np.nan)

    def worse(self) -> FloatArray:
        """Return the (k,) ratios on the side where they are farther from 1, NaN where no side has a neighbour."""
        sides = self.sides()
        left, right = sides[:, 0], sides[:, 1]
        return np.where(~(np.abs(left - 1.0) <= np.abs(right - 1.0)) & np.isfinite(right), right, left)

    @property
    def strips(self) -> tuple[IntArray, Spans, Spans]:
        """The samples that have a neighbour on both sides, and the spans to their left and to their right."""
        found: BoolArray = self.kinds == FOUND
        both: BoolArray = found[:, 0] & found[:, 1]
        left, right = (spans.some(np.flatnonzero(both[found[:, side]])) for side, spans in enumerate(self.spans))
        return np.flatnonzero(both), left, right

    @property
    def rims(self) -> tuple[IntArray, Spans]:
        """The samples that have none on a side, and a span to that side: to the rim, which stays where it is."""
        sample, side = np.nonzero(self.kinds == NONE)
        towards = np.cross(self.normals, self.ahead)[sample] * np.where(side == 0, 1.0, -1.0)[:, None]
        runs = np.repeat(np.arange(self.offsets.size - 1), np.diff(self.offsets))
        steps = np.linalg.norm(np.diff(self.places, axis=0, prepend=self.places[:1]), axis=1)
        along = np.cumsum(np.where(np.diff(runs, prepend=-1) == 0, steps, 0.0))
        arcs = along - along[self.offsets[:-1]][runs]
        return sample, Spans(
            places=self.places[sample],
            feet=self.places[sample],
            towards=towards,
            beyond=np.zeros_like(towards),
            runs=np.column_stack([runs, runs])[sample],
            arcs=np.column_stack([arcs, arcs])[sample],
            ratios=np.ones(sample.size),
        )

    def _figures(self, columns: slice) -> SpacingFigures:
        kinds, ratios = self.kinds[:, columns], self.ratios[:, columns]
        none, oblique, unknown = (float((kinds == kind).mean()) for kind in (NONE, OBLIQUE, UNKNOWN))
        return SpacingFigures(ratios[kinds == FOUND], none, oblique, unknown)


def side_spacing(
    mesh: FlatMesh,
    path: SurfacePath,
    samples: Samples,
    *,
    spacing: float,
    windows: int = WINDOWS_IN_ALL,
    wanted: SpacingAt | None = None,
) -> SideSpacing:
    """Measure the spacing to the left and to the right of a path.

    Args:
        mesh: m triangles.
        path: r stretches on it, as `joined` makes them.
        samples: k samples along all of them.
        spacing: wanted [mm].
        windows: budget of work; samples that are left over then are unknown.
        wanted: what it is at each place, where that differs; the ratios are over the mean of both ends then.
    """
    ahead = _ahead(mesh, path, samples, reach=CHORD_SHARE * spacing)
    faces = samples.places.faces
    middles = mesh.corners.reshape(-1, 3)[faces].mean(axis=1)
    inside = samples.places.flat + INWARDS * (middles - samples.places.flat)
    axes = mesh.axes[faces]
    here = shares_at(mesh, samples.places, wanted, spacing=spacing)
    found = neighbours(
        mesh, path, _segments(path), Places(faces, inside), ahead=_in_faces(axes, ahead),
        own=samples.runs, arcs=samples.arcs, clear=APART * spacing,
        limit=REACH * spacing * max(float(here.max()), 1.0), windows=windows,
    )  # fmt: skip
    ratios = found.distances / (spacing * _between(mesh, path, found.segments, here, wanted, spacing=spacing))
    beside = [np.flatnonzero(kinds == FOUND) for kinds in found.kinds.T]
    left, right = (
        spans_to_segments(
            mesh, path, samples.some(rows), segments=found.segments[rows, side], ratios=ratios[rows, side]
        )
        for side, rows in enumerate(beside)
    )
    return SideSpacing(
        places=spatial(mesh, samples.places),
        normals=np.cross(axes[:, 0], axes[:, 1]),
        ahead=ahead,
        offsets=np.append(np.flatnonzero(np.diff(samples.runs, prepend=-1)), samples.runs.size),
        ratios=ratios,
        kinds=found.kinds,
        nearest=np.where(found.segments < 0, -1, path.runs[found.segments]),
        spans=(left, right),
    )


def _segments(path: SurfacePath) -> Stretches:
    """Return the segments of a path by the stretch that they belong to."""
    begins, stops = np.diff(path.runs, prepend=-1) != 0, np.diff(path.runs, append=-1) != 0
    is_open = ~path.closed[path.runs]
    return Stretches(
        stretches=path.runs,
        arcs=path.arcs + 0.5 * np.abs(path.ends - path.starts),
        loops=np.where(path.closed, path.lengths, np.inf)[path.runs],
        open_starts=begins & is_open,
        open_ends=stops & is_open,
    )


def _in_faces(axes: FloatArray, ahead: FloatArray) -> ComplexArray:
    """Return (k, 3) directions in the planes that (k, 2, 3) axes span."""
    flat: ComplexArray = np.einsum("kpx,kx->kp", axes, ahead) @ np.array([1.0, 1.0j])
    # Where the chord is square to its face the path is a tip as sharp as a needle; any direction serves.
    flat[np.abs(flat) < np.finfo(np.float64).tiny] = 1.0
    return flat


def _between(
    mesh: FlatMesh,
    path: SurfacePath,
    segments: IntArray,
    here: FloatArray,
    wanted: SpacingAt | None,
    *,
    spacing: float,
) -> FloatArray:
    """Return the (k, 2) means of (k,) shares of the spacing and those at (k, 2) segments; alone where there is none."""
    middles = Places(path.faces, 0.5 * (path.starts + path.ends))
    there = shares_at(mesh, middles, wanted, spacing=spacing)[segments]
    return np.where(segments < 0, here[:, None], 0.5 * (here[:, None] + there))


def _ahead(mesh: FlatMesh, path: SurfacePath, samples: Samples, *, reach: float) -> FloatArray:
    """Return the (k, 3) unit direction of the path at samples, of its chord so far to both sides [mm]."""
    lengths, closed = path.lengths[samples.runs], path.closed[samples.runs]
    reaches = np.minimum(reach, 0.25 * lengths)
    ends: list[FloatArray] = []
    for arcs in (samples.arcs - reaches, samples.arcs + reaches):
        around = np.where(closed, np.mod(arcs, lengths), np.clip(arcs, 0.0, lengths))
        ends.append(spatial(mesh, path.at(samples.runs, around)))
    along = ends[1] - ends[0]
    size = np.linalg.norm(along, axis=1, keepdims=True)
    return np.where(size > 0.0, along / np.where(size > 0.0, size, 1.0), mesh.axes[samples.places.faces, 0])
