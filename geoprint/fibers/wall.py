"""Fibres by rule within a ventricle's wall: the wall as voxels, what is harmonic in it, and the helix angle."""

from __future__ import annotations

from dataclasses import replace
from math import radians
from typing import NamedTuple, final

import numpy as np
from scipy import ndimage
from scipy.sparse import coo_array, csc_array, csr_array
from scipy.sparse.linalg import cg
from scipy.spatial import KDTree

from geoprint.distance.sparse_solver import SymmetricSolver, nested_dissection
from geoprint.errors import FieldError, InputError, UsageError, how_many
from geoprint.fibers.fields import DirectionField, angles_in_faces, connection, nearest_field
from geoprint.geometry import (
    closest,
    cotangent_laplacian,
    diagonal_matrix,
    face_areas,
    face_normals,
    gradient,
    in_words,
    pieces,
)
from geoprint.geometry.topology import used_vertices
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.threads import single_threaded_blas

# A ventricle's wall as voxels, and what is harmonic in it: how deep a place lies, and how far from apex to base.
#
# Depth is 0 on the outside of the wall and 1 at the cavity, height 0 at the apex and 1 at the base, and neither
# flows through what is left of the wall's surface [Bayer2012]. Voxels are cells of a finite volume grid; the wall's
# boundary cuts the line between the centres of two of them, and the flow over it goes as far as that, which is right
# to second order [Gibou2002]. The cut is found in labels smoothed by a voxel, without which it would be a terrace.


# Standard deviation of the smoothing [finest side of a voxel]: it takes away terraces, and moves a wall of ten voxels
# by a few hundredths of one.
SMOOTHING = 1.0
# A boundary is no nearer to a voxel's centre than this share of the line to the next one, nor farther than that.
NEAREST_CUT = 0.1
# The apex is what of the wall is farther from the middle of the base than this share of the farthest: a tip of a few
# voxels, since from a single one a harmonic function rises by most of its range at once.
APEX_SHARE = 0.95
# Edges of a voxel are square to each other but for this.
SQUARE = 1e-3
# Equations are solved to this share of their right side.
SOLVED = 1e-8
# The six neighbours of a voxel: an axis and a sense.
SIDES = tuple((axis, step) for axis in range(3) for step in (-1, 1))


@final
@frozen
class WallVoxels:
    """Voxels of a ventricle's wall and of what is around it.

    Attributes:
        wall: (i, j, k) which are of the wall.
        cavity: (i, j, k) which are of the cavity that it encloses.
        base: (i, j, k) which are beyond its base: valves, atrium, vessel.
        affine: (4, 4) position of the voxels' centres [mm], without shear.
        name: of where they come from.
    """

    wall: BoolArray
    cavity: BoolArray
    base: BoolArray
    affine: FloatArray
    name: str = "wall"

    def __post_init__(self) -> None:
        freeze_arrays(self, wall="bool: i j k", cavity="bool: i j k", base="bool: i j k", affine="float: 4 4")
        edges = self.affine[:3, :3] / np.maximum(self.sides, np.finfo(np.float64).tiny)
        if np.abs(edges.T @ edges - np.eye(3)).max() > SQUARE:
            raise InputError(f"{self.name}: the edges of its voxels are not square to each other: resample the volume.")

    @property
    def sides(self) -> FloatArray:
        """(3,) of a voxel [mm]."""
        lengths: FloatArray = np.linalg.norm(self.affine[:3, :3], axis=0)
        return lengths


class _Links(NamedTuple):
    """Voxels of the wall beside others, one of the six sides after the other.

    Attributes:
        cells: (k,) numbers of the voxels of the wall.
        others: (k,) numbers of those beyond; -1 where these are not of the wall.
        cuts: (k,) share of the line between both centres at which the boundary cuts it; 1 within the wall.
        kinds: (k,) 1 where the cavity is beyond, 2 where the base is, else 0.
        axes: (k,) along which they lie beside each other.
        steps: (k,) 1 along it or -1 against it.
    """

    cells: IntArray
    others: IntArray
    cuts: FloatArray
    kinds: IntArray
    axes: IntArray
    steps: IntArray


def harmonic_in(voxels: WallVoxels) -> tuple[_Smooth, _Smooth]:
    """Return the depth and the height at the centres of the wall's voxels, the depth also where its boundary is cut.

    Of several pieces of wall the largest counts.

    Raises:
        FieldError: the wall has no voxels, or nothing of it is beside the cavity, the base or the outside.
    """
    cells, links = _linked(voxels)
    inside = links.others >= 0
    for kind, what in ((0, "the outside"), (1, "the cavity"), (2, "the base")):
        if not ((links.kinds == kind) & ~inside).any():
            raise FieldError(
                f"{voxels.name}: the wall does not touch {what}: check which labels are the wall, the cavity and the "
                "base."
            )
    at_side, at_cavity = ~inside & (links.kinds != 2), (links.kinds == 1).astype(np.float64)
    depths = _solved(voxels, len(cells), links, at_side, at_cavity)
    centres: FloatArray = cells.astype(np.float64)
    cuts = centres[links.cells]
    cuts[np.arange(len(cuts)), links.axes] += links.steps * links.cuts
    tip = _apex(voxels, cells, links)
    at_end = (~inside & (links.kinds == 2)) | (inside & (tip[links.cells] | tip[links.others]))
    heights = _solved(voxels, len(cells), links, at_end, (~inside).astype(np.float64))
    depth = _Smooth(np.concatenate([centres, cuts[at_side]]), np.concatenate([depths, at_cavity[at_side]]))
    return depth, _Smooth(centres, heights)


def _linked(voxels: WallVoxels) -> tuple[IntArray, _Links]:
    """Return the (c, 3) voxels of the wall's largest piece, and what is beside them."""
    pieces, count = ndimage.label(voxels.wall)
    if count == 0:
        raise FieldError(f"{voxels.name}: no voxel belongs to the wall: check its labels.")
    wall = np.pad(pieces == 1 + np.argmax(np.bincount(pieces.ravel())[1:]), 1)
    cavity, base = np.pad(voxels.cavity, 1), np.pad(voxels.base, 1)
    widths = SMOOTHING * voxels.sides.min() / voxels.sides
    solid, hollow = (
        np.asarray(ndimage.gaussian_filter(each.astype(np.float64), widths), dtype=np.float64)
        for each in (wall | cavity | base, cavity)
    )
    numbers = np.full(wall.shape, -1, dtype=np.int64)
    numbers[wall] = np.arange(int(wall.sum()))
    kinds = np.where(cavity, 1, np.where(base, 2, 0))
    found = [_beside(wall, numbers, kinds, (solid, 1.0 - hollow), side) for side in SIDES]
    return np.argwhere(wall) - 1, _Links(*(np.concatenate(each) for each in zip(*found, strict=True)))


def _beside(
    wall: BoolArray, numbers: IntArray, kinds: IntArray, solid: tuple[FloatArray, FloatArray], side: tuple[int, int]
) -> _Links:
    """Return the links of all voxels of the wall to their neighbours on one side."""
    axis, step = side
    here = np.nonzero(wall)
    there = tuple(index + step * (number == axis) for number, index in enumerate(here))
    others, kind = numbers[there], kinds[there]
    # How much of either side is solid, or not cavity, falls through a half where the boundary is.
    mine, beyond = (np.where(kind == 1, solid[1][at], solid[0][at]) for at in (here, there))
    cuts = np.clip((mine - 0.5) / np.maximum(mine - beyond, 1e-6), NEAREST_CUT, 1.0)
    # The wall goes on to the base: it ends in the middle between two voxels.
    cuts = np.where(others >= 0, 1.0, np.where(kind == 2, 0.5, cuts))
    return _Links(numbers[here], others, cuts, kind, np.full(kind.size, axis), np.full(kind.size, step))


def _apex(voxels: WallVoxels, cells: IntArray, links: _Links) -> BoolArray:
    """Return which of the wall's voxels are its apex: those farthest from the middle of the base."""
    places = cells * voxels.sides
    base = places[np.unique(links.cells[(links.others < 0) & (links.kinds == 2)])]
    away = np.linalg.norm(places - base.mean(axis=0), axis=1)
    return np.asarray(away > APEX_SHARE * away.max())


def _solved(voxels: WallVoxels, count: int, links: _Links, held: BoolArray, values: FloatArray) -> FloatArray:
    """Return (c,) values at the wall's voxels, harmonic where nothing is held.

    Args:
        voxels: of the wall.
        count: c, of these.
        links: of these.
        held: (k,) over which links a value is held.
        values: (k,) what is, where it is.

    Raises:
        FieldError: the equations are not solved.
    """
    flow = 1.0 / (voxels.sides[links.axes] ** 2 * links.cuts)
    free = (links.others >= 0) & ~held
    diagonal: FloatArray = np.bincount(links.cells[free | held], flow[free | held], minlength=count).astype(np.float64)
    right = np.bincount(links.cells[held], (flow * values)[held], minlength=count)
    between = coo_array((flow[free], (links.cells[free], links.others[free])), shape=(count, count))
    matrix = csr_array(diagonal_matrix(diagonal) - csr_array(between))
    # Sums in one order, so that the same labels have the same fibres everywhere.
    with single_threaded_blas():
        found, failed = cg(matrix, right, rtol=SOLVED, M=diagonal_matrix(1.0 / diagonal))
    if failed:
        raise FieldError(f"{voxels.name}: no harmonic function is found in the wall: check its labels for crumbs.")
    return np.asarray(found, dtype=np.float64)


# Fibres of a ventricle's wall: a helix angle that changes from the outside to the inside [Bayer2012].
#
# On a surface within the wall the direction from apex to base is the gradient of a height, harmonic between both or
# measured along an axis. The direction around the ventricle lies across it, and fibres are turned from there by the
# helix angle, which goes through the wall from that of the epicardium to that of the endocardium [Bayer2012].


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
                f"{surface.name} has {how_many(len(surface.vertices), 'vertex', 'vertices')} and takes a finite "
                f"height and a depth at each, not {heights.shape} and {depths.shape}."
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
            raise FieldError(
                f"a component of {surface.name} has no apex or no base: name vertices of both on each component."
            )
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
                f"the height is constant over a component of {surface.name}, so the direction from apex to base is "
                "undefined: choose another axis."
            )
        angles[faces[found]] = np.angle(lines[found].sum(axis=1)) / 2
        missing[faces[found]] = False
    return angles


# Fibres by rule on any surface within a ventricle's wall: what is harmonic in the wall, at the surface's vertices.
#
# Harmonic functions are smooth, so that at a place they are what the plane through their values about it says there:
# the one of least squares, whose weights fall to nothing within a few voxels and so leave no jumps [Levin1998].


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
        self._depth, self._height = harmonic_in(voxels)

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
                f"{in_words(place)} lies off the wall of {self._voxels.name}, by more than {REACH:g} voxels. Plan "
                "within the wall, in the coordinates of its labels; a `--target` ends layers where the wall ends."
            )
        return found

    def _in_voxels(self, places: FloatArray) -> FloatArray:
        linear, origin = self._voxels.affine[:3, :3], self._voxels.affine[:3, 3]
        return np.asarray(np.linalg.solve(linear, (places - origin).T).T, dtype=np.float64)


@final
class _Smooth:
    """Values at scattered places, and smooth between them.

    Args:
        places: (k, 3) voxel coordinates.
        values: (k,) there.
    """

    def __init__(self, places: FloatArray, values: FloatArray) -> None:
        self._places, self._values, self._tree = places, values, KDTree(places)

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
        count = min(MOST, len(self._values))
        away, near = self._tree.query(places, k=np.arange(1, count + 1), distance_upper_bound=REACH)
        within = np.isfinite(away)
        near = np.where(within, near, 0)
        weights = np.where(within, (1.0 - np.where(within, away / REACH, 1.0) ** 2) ** 2, 0.0)
        offsets = self._places[near] - places[:, None]
        terms = np.concatenate([np.ones((*near.shape, 1)), offsets], axis=2)
        matrices = np.einsum("kn,kni,knj->kij", weights, terms, terms, optimize=True)
        total = matrices[:, 0, 0]
        record = total > 0.0
        matrices += HELD * np.where(record, total, 1.0)[:, None, None] * np.diag([0.0, 1.0, 1.0, 1.0])
        matrices[~record] = np.eye(4)
        right = np.einsum("kn,kni,kn->ki", weights, terms, self._values[near], optimize=True)
        found: FloatArray = np.asarray(np.linalg.solve(matrices, right[:, :, None]), dtype=np.float64)[:, :, 0]
        return np.where((record & (within.sum(axis=1) >= least))[:, None], found, np.nan)
