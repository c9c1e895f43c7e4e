"""Fibres by rule on any surface within a ventricle's wall: what is harmonic in the wall, at the surface's vertices.

Harmonic functions are smooth, so that at a place they are what the plane through their values about it says there: the
one of least squares, whose weights fall to nothing within a few voxels and so leave no jumps [Levin1998].
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import FieldError
from geoprint.fields.direction_field import DirectionField
from geoprint.fields.helix import HelixRule
from geoprint.fields.wall_voxels import Known, WallVoxels, harmonic_in
from geoprint.model import FloatArray, Surface
from geoprint.surfaces import face_normals, in_words
from geoprint.surfaces.topology import used_vertices

# Values count within so many sides of a voxel, and are at most so many: those of all voxels there and of the boundary.
REACH, MOST = 2.5, 128
# A place with fewer lies off the wall.
LEAST = 8
# Slopes that values do not tell, where all of them lie in a plane, are held at nothing with this share of the weight.
HELD = 1e-3
# So many places are worked on at once, for the sake of memory.
AT_ONCE = 4096
# The side that a surface looks to is asked at about so many of its faces, so many sides of a voxel off it.
ASKED, OFF = 200, 1.0


@final
class WallCoordinates:
    """How deep places lie in a wall, and how far from apex to base.

    Args:
        voxels: of the wall.

    Raises:
        FieldError: as `harmonic_in`.
    """

    def __init__(self, voxels: WallVoxels) -> None:
        self._voxels = voxels
        self._depth, self._height = (_Smooth(known) for known in harmonic_in(voxels))

    def depths(self, places: FloatArray) -> FloatArray:
        """Return (k,) depths of (k, 3) places [mm], 0 on the outside of the wall and 1 at the cavity.

        Raises:
            FieldError: a place lies off the wall.
        """
        return np.clip(self._at(self._depth, places), 0.0, 1.0)

    def heights(self, places: FloatArray) -> FloatArray:
        """Return (k,) heights of (k, 3) places [mm], from 0 at the apex to 1 at the base.

        Raises:
            FieldError: a place lies off the wall.
        """
        return self._at(self._height, places)

    def field(self, surface: Surface, rule: HelixRule) -> DirectionField:
        """Return the fibres on a surface within the wall, as lines.

        It may look to either side: angles count as seen from outside of the wall.

        Raises:
            FieldError: a vertex lies off the wall.
            MeshError: as `HelixRule.field`.
        """
        used = used_vertices(surface.faces)
        depths, heights = np.zeros(len(surface.vertices)), np.zeros(len(surface.vertices))
        depths[used], heights[used] = (each(surface.vertices[used]) for each in (self.depths, self.heights))
        seen = rule if self._looks_out(surface) else HelixRule(-rule.epicardial, -rule.endocardial, rule.power)
        return seen.field(surface, heights=heights, depths=depths)

    def _looks_out(self, surface: Surface) -> bool:
        """Return whether a surface looks to the outside of the wall, where depths are less."""
        asked = np.arange(0, len(surface.faces), max(len(surface.faces) // ASKED, 1))
        middles = surface.vertices[surface.faces[asked]].mean(axis=1)
        off = OFF * float(self._voxels.sides.min()) * face_normals(surface)[asked]
        behind, before = (self._depth.at(self._in_voxels(middles + step), least=1) for step in (-off, off))
        return float(np.nansum(before - behind)) <= 0.0

    def _at(self, known: _Smooth, places: FloatArray) -> FloatArray:
        found = known.at(self._in_voxels(places), least=LEAST)
        off = np.isnan(found)
        if off.any():
            place = places[int(np.argmax(off))]
            raise FieldError(
                f"{in_words(place)} lies off the wall of {self._voxels.name}, farther than {REACH:g} voxels: plan "
                "within the wall, in the coordinates of its labels, and let a `--target` cut layers off where it ends."
            )
        return found

    def _in_voxels(self, places: FloatArray) -> FloatArray:
        linear, origin = self._voxels.affine[:3, :3], self._voxels.affine[:3, 3]
        return np.asarray(np.linalg.solve(linear, (places - origin).T).T, dtype=np.float64)


@final
class _Smooth:
    """Values at scattered places, and smooth between them.

    Args:
        known: in voxel coordinates.
    """

    def __init__(self, known: Known) -> None:
        self._known, self._tree = known, KDTree(known.places)

    def at(self, places: FloatArray, *, least: int) -> FloatArray:
        """Return (k,) values at (k, 3) places in voxels; not a number where fewer than the least are near."""
        parts = [self._some(places[begin : begin + AT_ONCE], least) for begin in range(0, len(places), AT_ONCE)]
        return np.concatenate([np.zeros(0), *parts])

    def _some(self, places: FloatArray, least: int) -> FloatArray:
        count = min(MOST, len(self._known.values))
        away, near = self._tree.query(places, k=np.arange(1, count + 1), distance_upper_bound=REACH)
        within = np.isfinite(away)
        near = np.where(within, near, 0)
        weights = np.where(within, (1.0 - np.where(within, away / REACH, 1.0) ** 2) ** 2, 0.0)
        offsets = self._known.places[near] - places[:, None]
        terms = np.concatenate([np.ones((*near.shape, 1)), offsets], axis=2)
        matrices = np.einsum("kn,kni,knj->kij", weights, terms, terms, optimize=True)
        total = matrices[:, 0, 0]
        told = total > 0.0
        matrices += HELD * np.where(told, total, 1.0)[:, None, None] * np.diag([0.0, 1.0, 1.0, 1.0])
        matrices[~told] = np.eye(4)
        right = np.einsum("kn,kni,kn->ki", weights, terms, self._known.values[near], optimize=True)
        found: FloatArray = np.asarray(np.linalg.solve(matrices, right[:, :, None]), dtype=np.float64)[:, 0, 0]
        return np.where(told & (within.sum(axis=1) >= least), found, np.nan)
