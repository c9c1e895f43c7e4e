"""From where to where spacing was measured, and what an error at either end of a span does to its length."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.model import FloatArray, IntArray, freeze_arrays, frozen
from geoprint.quality.deposited import Samples
from geoprint.quality.oracle import FlatMesh, Places, SurfacePath, spatial

# Ends nearer than this [mm] have no direction.
SHORTEST = 1e-9


@final
@frozen
class Spans:
    """Spans from k samples to the nearest place of the path beside them: their feet.

    Where the sample moves by d and the foot by e, the distance over the surface between them grows by
    e . beyond - d . towards, in the first order.

    Attributes:
        places: (k, 3) samples [mm].
        feet: (k, 3) where the spans end [mm].
        towards: (k, 3) unit vector in the surface at the sample, along the span.
        beyond: (k, 3) unit vector in the surface at the foot, along the span.
        runs: (k, 2) run of the sample, and of the foot.
        arcs: (k, 2) where they lie along these runs [mm].
        ratios: (k,) length over the surface, over the wanted spacing.
    """

    places: FloatArray
    feet: FloatArray
    towards: FloatArray
    beyond: FloatArray
    runs: IntArray
    arcs: FloatArray
    ratios: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, places="float: k 3", feet="float: k 3", towards="float: k 3", beyond="float: k 3", runs="int: k 2",
            arcs="float: k 2", ratios="float: k",
        )  # fmt: skip

    @property
    def count(self) -> int:
        """Number of spans k."""
        return int(self.ratios.size)

    def some(self, which: IntArray) -> Spans:
        """Return some of them."""
        return Spans(
            self.places[which], self.feet[which], self.towards[which], self.beyond[which], self.runs[which],
            self.arcs[which], self.ratios[which],
        )  # fmt: skip


def no_spans() -> Spans:
    """Return no spans at all, as where there is one level."""
    none, pairs = np.zeros((0, 3)), np.zeros((0, 2))
    return Spans(none, none, none, none, pairs.astype(np.int64), pairs, np.zeros(0))


def joined_spans(one: Spans, other: Spans) -> Spans:
    """Return the spans of both, as of the left and the right of the same path."""
    return Spans(
        *(
            np.concatenate([getattr(one, name), getattr(other, name)])
            for name in ("places", "feet", "towards", "beyond", "runs", "arcs", "ratios")
        )
    )


def spans_to(
    mesh: FlatMesh, path: SurfacePath, samples: Samples, *, runs: IntArray, arcs: FloatArray, ratios: FloatArray
) -> Spans:
    """Return the spans from samples to places of a path.

    Args:
        mesh: m triangles.
        path: r runs on it.
        samples: k samples along runs.
        runs: (k,) run on which each span ends.
        arcs: (k,) where on it [mm].
        ratios: (k,) length of each over the wanted spacing.
    """
    feet = path.at(runs, arcs)
    here, there = spatial(mesh, samples.places), spatial(mesh, feet)
    return Spans(
        places=here,
        feet=there,
        towards=_within(mesh, samples.places, there - here),
        beyond=_within(mesh, feet, there - here),
        runs=np.column_stack([samples.runs, runs]),
        arcs=np.column_stack([samples.arcs, arcs]),
        ratios=ratios,
    )


def spans_to_segments(
    mesh: FlatMesh, path: SurfacePath, samples: Samples, *, segments: IntArray, ratios: FloatArray
) -> Spans:
    """Return the spans from samples to segments of a path, each to its closest point.

    Args:
        mesh: m triangles.
        path: p segments.
        samples: k samples along runs.
        segments: (k,) on which each span ends.
        ratios: (k,) length of each over the wanted spacing.
    """
    faces = path.faces[segments]
    start, end = (spatial(mesh, Places(faces, flat[segments])) for flat in (path.starts, path.ends))
    along = end - start
    squares = np.maximum((along**2).sum(axis=1), SHORTEST**2)
    shares = np.clip(((spatial(mesh, samples.places) - start) * along).sum(axis=1) / squares, 0.0, 1.0)
    arcs = path.arcs[segments] + shares * np.abs(path.ends[segments] - path.starts[segments])
    return spans_to(mesh, path, samples, runs=path.runs[segments], arcs=arcs, ratios=ratios)


def _within(mesh: FlatMesh, places: Places, directions: FloatArray) -> FloatArray:
    """Return directions turned into the faces of places, of unit length; 0 where there is none."""
    axes = mesh.axes[places.faces]
    flat = np.einsum("kp,kpx->kx", np.einsum("kpx,kx->kp", axes, directions), axes)
    lengths = np.linalg.norm(flat, axis=1, keepdims=True)
    return np.where(lengths > SHORTEST, flat / np.maximum(lengths, SHORTEST), 0.0)
