"""Fibres by rule on any surface within a ventricle's wall: what is harmonic in the wall, at the surface's vertices.

Harmonic functions are smooth, so that at a place they are what the plane through their values about it says there: the
one of least squares, whose weights fall to nothing within a few voxels and so leave no jumps [Levin1998].
"""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import FieldError
from geoprint.fields.direction_field import DirectionField
from geoprint.fields.helix import HelixRule, helix_lines
from geoprint.fields.wall_voxels import Known, WallVoxels, harmonic_in
from geoprint.model import BoolArray, FloatArray, Surface
from geoprint.surfaces import closest, face_normals, gradient, in_words
from geoprint.surfaces.topology import used_vertices

# Values count within so many sides of a voxel, and are at most so many: those of all voxels there and of the boundary.
REACH, MOST = 2.5, 128
# A place with fewer lies off the wall.
LEAST = 8
# Slopes that values do not tell, where all of them lie in a plane, are held at nothing with this share of the weight.
HELD = 1e-3
# So many places are worked on at once, for the sake of memory.
AT_ONCE = 4096
# Farther from every value than this no place is of the wall, however values go on there: no place within a cube is
# farther than 0.87 of its side from all voxels' centres.
BESIDE = 1.0
# Where a straight way leaves the wall is found by as many halvings: to a thousandth of it.
HALVINGS = 10
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

    def field(self, surface: Surface, rule: HelixRule, *, part: Surface | None = None) -> DirectionField:
        """Return the fibres on a surface within the wall, or on a layer over one, as lines.

        It may look to either side: angles count as seen from outside of the wall. Beyond the wall, to its outside or in
        its cavity, a layer has the fibres of where the straight way to it from its foot leaves the wall, as other
        fields are carried.

        Args:
            surface: that fibres are wanted on.
            rule: of their angles.
            part: that the surface is a layer over, within the wall; None where the surface itself is.

        Raises:
            FieldError: a vertex of the part, or of the surface where there is none, lies off the wall.
            MeshError: as `HelixRule.field`.
        """
        used = used_vertices(surface.faces)
        inside = np.ones(len(surface.vertices), dtype=np.bool_)
        if part is not None:
            self.depths(part.vertices[used_vertices(part.faces)])
            inside[used] = self._inside(surface.vertices[used])
        known = used[inside[used]]
        depths, heights = np.zeros(len(surface.vertices)), np.zeros(len(surface.vertices))
        depths[known], heights[known] = (each(surface.vertices[known]) for each in (self.depths, self.heights))
        upwards, deep = gradient(surface, heights), depths[surface.faces].mean(axis=1)
        beyond = np.flatnonzero(~inside[surface.faces].all(axis=1))
        if part is not None and beyond.size:
            ends = self._ends(surface.vertices[surface.faces[beyond]].mean(axis=1), part)
            upwards[beyond], deep[beyond] = self._upwards(ends), self.depths(ends)
            normals = face_normals(surface)[beyond]
            upwards[beyond] -= np.einsum("kx,kx->k", upwards[beyond], normals)[:, None] * normals
        if self._looks_out(surface if part is None else part):
            return helix_lines(surface, upwards=upwards, angles=rule.angles(deep))
        found = helix_lines(surface, upwards=upwards, angles=-rule.angles(deep))
        # Seen from outside of the wall, right is left of who looks at this surface.
        return found if found.axes is None else replace(found, axes=found.axes * np.array([[-1.0], [1.0]]))

    def _ends(self, places: FloatArray, part: Surface) -> FloatArray:
        """Return where the straight ways to (k, 3) places from their feet on a part leave the wall; (k, 3) [mm]."""
        feet = closest(part, places)[0].xyz(part)
        inner, outer = np.zeros(len(feet)), np.ones(len(feet))
        # A foot that lies outside by a part of a voxel, as the mesh of a wall does, is where the way leaves it.
        outer[~self._inside(feet)] = 0.0
        for _ in range(HALVINGS):
            middle = (inner + outer) / 2.0
            inside = self._inside(feet + middle[:, None] * (places - feet))
            inner, outer = np.where(inside, middle, inner), np.where(inside, outer, middle)
        return feet + inner[:, None] * (places - feet)

    def _inside(self, places: FloatArray) -> BoolArray:
        """Return which of (k, 3) places lie between the sides of the wall."""
        there = self._in_voxels(places)
        depths = self._depth.at(there, least=LEAST)
        return (depths >= 0.0) & (depths <= 1.0) & (self._depth.away(there) <= BESIDE)

    def _looks_out(self, surface: Surface) -> bool:
        """Return whether a surface looks to the outside of the wall, where depths are less."""
        asked = np.arange(0, len(surface.faces), max(len(surface.faces) // ASKED, 1))
        middles = surface.vertices[surface.faces[asked]].mean(axis=1)
        off = OFF * float(self._voxels.sides.min()) * face_normals(surface)[asked]
        behind, before = (self._depth.at(self._in_voxels(middles + step), least=1) for step in (-off, off))
        return float(np.nansum(before - behind)) <= 0.0

    def _upwards(self, places: FloatArray) -> FloatArray:
        """Return the (k, 3) gradient of the height at (k, 3) places [1/mm].

        Raises:
            FieldError: a place lies off the wall.
        """
        self.heights(places)
        slopes = self._height.slopes(self._in_voxels(places))
        return np.asarray(np.linalg.solve(self._voxels.affine[:3, :3].T, slopes.T).T, dtype=np.float64)

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
        return self._planes(places, least)[:, 0]

    def slopes(self, places: FloatArray) -> FloatArray:
        """Return the (k, 3) gradient at (k, 3) places in voxels, near which values are known."""
        return self._planes(places, 1)[:, 1:]

    def away(self, places: FloatArray) -> FloatArray:
        """Return the (k,) distance from (k, 3) places to the nearest known one, in voxels."""
        return np.asarray(self._tree.query(places)[0], dtype=np.float64)

    def _planes(self, places: FloatArray, least: int) -> FloatArray:
        """Return the (k, 4) value and gradient of the plane at each place."""
        parts = [self._some(places[begin : begin + AT_ONCE], least) for begin in range(0, len(places), AT_ONCE)]
        return np.concatenate([np.zeros((0, 4)), *parts])

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
        found: FloatArray = np.asarray(np.linalg.solve(matrices, right[:, :, None]), dtype=np.float64)[:, :, 0]
        return np.where((told & (within.sum(axis=1) >= least))[:, None], found, np.nan)
