"""Fibres of a ventricle's wall: a helix angle that changes from the outside to the inside [Bayer2012].

On a surface within the wall the direction from apex to base is the gradient of a height, harmonic between both or
measured along an axis. The direction around the ventricle lies across it, and fibres are turned from there by the helix
angle, which goes through the wall from that of the epicardium to that of the endocardium
[Bayer2012].
"""

from __future__ import annotations

from dataclasses import replace
from math import radians
from typing import final

import numpy as np
from scipy.sparse import csc_array

from geoprint.backends.sparse_solver import SymmetricSolver, nested_dissection
from geoprint.errors import FieldError, InputError, UsageError
from geoprint.fields.connection import angles_in_faces, connection
from geoprint.fields.direction_field import DirectionField, nearest_field
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, frozen
from geoprint.surfaces import cotangent_laplacian, face_areas, face_normals, gradient, pieces
from geoprint.surfaces.topology import used_vertices

# A height that rises over a face by less than this share of the largest one has no direction there, but rounding.
LEVEL = 1e-9


@final
@frozen
class HelixRule:
    """How fibres turn through a ventricle's wall.

    Angles count from the direction around the ventricle, to the right for who looks at a surface from outside with the
    base up, and are positive where a fibre then rises to the right. A positive one winds as a right-handed screw. The
    defaults are those of [Bayer2012].

    Attributes:
        epicardial: helix angle on the outside of the wall [rad].
        endocardial: that on its inside [rad].
        power: of the depth, in between: 1 for an angle that changes evenly, more for one that keeps longer to that of
            the epicardium; positive.
    """

    epicardial: float = radians(-50.0)
    endocardial: float = radians(40.0)
    power: float = 1.0

    def __post_init__(self) -> None:
        if not np.isfinite([self.epicardial, self.endocardial]).all() or not 0.0 < self.power < np.inf:
            raise UsageError(
                f"a helix rule takes two angles in rad and a positive power, not {self.epicardial}, "
                f"{self.endocardial} and {self.power}."
            )

    def angles(self, depths: FloatArray) -> FloatArray:
        """Return (k,) helix angles [rad] at (k,) depths, from 0 at the epicardium to 1 at the endocardium.

        Raises:
            InputError: a depth is outside of the wall.

        Examples:
            >>> np.degrees(HelixRule().angles(np.array([0.0, 0.5, 1.0])))
            array([-50.,  -5.,  40.])
        """
        if depths.size and not (depths.min() >= 0.0 and depths.max() <= 1.0):
            raise InputError(
                f"depths in the wall go from 0 at the epicardium to 1 at the endocardium; found {depths.min():g} to "
                f"{depths.max():g}."
            )
        return self.epicardial + (self.endocardial - self.epicardial) * depths**self.power

    def field(self, surface: Surface, *, heights: FloatArray, depths: FloatArray) -> DirectionField:
        """Return the fibres on a surface in the wall or on a side of it, as lines.

        A face over which the height does not rise, such as a corner of the rim, has the mean of its neighbours.

        Args:
            surface: its outside towards the epicardium; turn an endocardium over that looks into the cavity.
            heights: (n,) at the vertices, rising from apex to base: `apex_to_base`, or along an axis.
            depths: (n,) at the vertices, from 0 at the epicardium to 1 at the endocardium.

        Raises:
            InputError: there are not as many heights or depths as vertices, or a depth is outside of the wall.
            FieldError: the height is the same all over a piece of the surface.
            MeshError: as `connection`.
        """
        if not heights.shape == depths.shape == (len(surface.vertices),) or not np.isfinite(heights).all():
            raise InputError(
                f"{surface.name} has {len(surface.vertices)} vertices and takes a finite height and a depth at each, "
                f"not {heights.shape} and {depths.shape}."
            )
        upwards = gradient(surface, heights)
        rise = np.linalg.norm(upwards, axis=1) * np.sqrt(face_areas(surface))
        upwards = np.where((rise <= LEVEL * np.abs(heights[surface.faces]).max())[:, None], 0.0, upwards)
        return helix_lines(surface, upwards=upwards, angles=self.angles(depths)[surface.faces].mean(axis=1))


def helix_lines(surface: Surface, *, upwards: FloatArray, angles: FloatArray) -> DirectionField:
    """Return lines at helix angles to the direction around an axis, and that axis in each face.

    A face in which nothing points up has the mean of its neighbours, and no axis.

    Args:
        surface: m faces, seen from outside.
        upwards: (m, 3) vectors in the faces that point from apex to base.
        angles: (m,) from around to the right towards that [rad].

    Raises:
        FieldError: nothing on a piece of the surface points from apex to base.
        MeshError: as `connection`.
    """
    around: FloatArray = np.cross(upwards, face_normals(surface))
    steep: FloatArray = np.linalg.norm(upwards, axis=1)
    turned = angles_in_faces(surface, np.arange(len(surface.faces)), around) + angles
    axes = np.stack([around, upwards], axis=1) / np.where(steep == 0.0, np.inf, steep)[:, None, None]
    return replace(nearest_field(surface, _filled(surface, turned, steep == 0.0), symmetry=2), axes=axes)


def apex_to_base(surface: Surface, *, apex: IntArray, base: IntArray) -> FloatArray:
    """Return (n,) heights from 0 at the apex to 1 at the base, harmonic in between; free on other rims [Bayer2012].

    Args:
        surface: n vertices; vertices that no face uses have height 0.
        apex: vertices at the apex, one or more.
        base: vertices at the base, one or more, none of the apex.

    Raises:
        InputError: a vertex is no vertex of a face, or of both.
        FieldError: a piece of the surface has no apex or no base.
    """
    used = used_vertices(surface.faces)
    if not np.isin(np.concatenate([apex, base]), used).all() or np.isin(apex, base).any():
        raise InputError(f"apex and base are vertices of faces of {surface.name}, and none is both.")
    for piece in pieces(surface):
        if not (np.isin(apex, piece.vertices).any() and np.isin(base, piece.vertices).any()):
            raise FieldError(f"a piece of {surface.name} has no apex or no base: name vertices of both on each piece.")
    heights = np.zeros(len(surface.vertices))
    heights[base] = 1.0
    free = np.setdiff1d(used, np.concatenate([apex, base]))
    if free.size:
        rows = cotangent_laplacian(surface)[free]
        inner = csc_array(rows[:, free])
        solver = SymmetricSolver(inner, order=nested_dissection(inner, coordinates=surface.vertices[free]))
        heights[free] = solver.solve(np.asarray(-(rows @ heights), dtype=np.float64))
    return heights


def _filled(surface: Surface, angles: FloatArray, missing: BoolArray) -> FloatArray:
    """Return (m,) angles of lines with the missing ones as means of their neighbours, from the rims of gaps inwards.

    Raises:
        FieldError: all of a piece are missing.
    """
    over, angles, missing = connection(surface), angles.copy(), missing.copy()
    while missing.any():
        faces = np.flatnonzero(missing)
        beyond = over.twins[3 * faces[:, None] + np.arange(3)]
        known = (beyond >= 0) & ~missing[beyond // 3]
        lines = np.where(known, np.exp(2j * (angles[beyond // 3] + over.transport[beyond])), 0.0)
        found = known.any(axis=1)
        if not found.any():
            raise FieldError(
                f"the height is the same all over a piece of {surface.name}, so that nothing points from apex to base: "
                "choose an axis that is not across it."
            )
        angles[faces[found]] = np.angle(lines[found].sum(axis=1)) / 2
        missing[faces[found]] = False
    return angles
