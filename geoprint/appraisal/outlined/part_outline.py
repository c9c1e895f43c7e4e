"""The outline of a part under a camera: the edges of its mesh beyond which a line of sight meets nothing."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.appraisal.camera import Camera
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.surfaces import face_normals
from geoprint.surfaces.rays import RayTree
from geoprint.surfaces.topology import numbered_edges

# An edge is the outline's where a line of sight beside it, this far in pixels, meets nothing.
BESIDE = 0.75


@final
@frozen
class PartOutline:
    """The outline of a part as a camera sees it, in no order.

    Attributes:
        places: (k, 3) of the part [mm].
        pixels: (k, 2) where they are seen [pixels].
        outward: (k, 2) unit normals out of the part in the picture.
    """

    places: FloatArray
    pixels: FloatArray
    outward: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, places="float: k 3", pixels="float: k 2", outward="float: k 2")


@final
class OutlinedPart:
    """A part that is looked at from many places: its edges, and the faces on both sides of them."""

    def __init__(self, surface: Surface) -> None:
        edges, side_edge = numbered_edges(surface.faces)
        order = np.argsort(side_edge.ravel(), kind="stable")
        counts = np.bincount(side_edge.ravel(), minlength=len(edges))
        firsts = np.cumsum(counts) - counts
        self.surface = surface
        self._rays = RayTree(surface)
        self._edges = edges
        self._one = order[firsts] // 3
        # A border has the same face on both sides; so has, harmlessly, what more than two faces share.
        self._other = order[firsts + counts - 1] // 3
        self._border = counts != 2
        self._normals = face_normals(surface)
        self._corners = surface.vertices[surface.faces[:, 0]]

    def under(self, camera: Camera, *, places: int) -> PartOutline:
        """Return the outline of the part under a camera.

        Args:
            camera: all of the part lies ahead of it.
            places: about so many are looked at, evenly in the picture; those that are not outermost are left out.
        """
        toward = ((camera.place - self._corners) * self._normals).sum(axis=1) > 0.0
        edge = np.flatnonzero(self._border | (toward[self._one] != toward[self._other]))
        starts, ends = (self.surface.vertices[self._edges[edge, side]] for side in (0, 1))
        first, last = camera.seen(starts), camera.seen(ends)
        lengths: FloatArray = np.linalg.norm(last - first, axis=1)
        reached: FloatArray = np.concatenate([[0.0], np.cumsum(lengths)])
        at = (np.arange(places) + 0.5) * reached[-1] / places
        behind: IntArray = np.asarray(np.searchsorted(reached, at, side="right"), dtype=np.int64)
        owner = np.minimum(behind - 1, len(edge) - 1)
        share = ((at - reached[owner]) / np.maximum(lengths[owner], 1e-12))[:, None]
        points = starts[owner] + share * (ends - starts)[owner]
        pixels = camera.seen(points)
        along = (last - first)[owner] / np.maximum(lengths[owner], 1e-12)[:, None]
        aside = np.column_stack([along[:, 1], -along[:, 0]])
        beside = np.vstack([pixels + BESIDE * aside, pixels - BESIDE * aside])
        left, right = self._meets(camera, beside).reshape(2, places)
        outer = left != right
        out = np.where(left[:, None], -aside, aside)
        return PartOutline(points[outer], pixels[outer], out[outer])

    def _meets(self, camera: Camera, pixels: FloatArray) -> BoolArray:
        """Return which (k,) lines of sight meet the part."""
        toward = camera.directions(pixels)
        return self._rays.first_hits(np.broadcast_to(camera.place, toward.shape).copy(), toward).met
