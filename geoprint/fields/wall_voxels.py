"""A ventricle's wall as voxels, and what is harmonic in it: how deep a place lies, and how far from apex to base.

Depth is 0 on the outside of the wall and 1 at the cavity, height 0 at the apex and 1 at the base, and neither flows
through what is left of the wall's surface [Bayer2012]. Voxels are cells of a finite volume grid; the wall's boundary
cuts the line between the centres of two of them, and the flow over it goes as far as that, which is right to second
order [Gibou2002]. The cut is found in labels smoothed by a voxel, without which it would be a terrace.
"""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np
from scipy import ndimage
from scipy.sparse import coo_array, csr_array
from scipy.sparse.linalg import cg

from geoprint.errors import FieldError, InputError
from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen
from geoprint.surfaces import diagonal_matrix
from geoprint.threads import single_threaded_blas

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


class Known(NamedTuple):
    """Where a function is known.

    Attributes:
        places: (k, 3) voxel coordinates.
        values: (k,) there.
    """

    places: FloatArray
    values: FloatArray


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


def harmonic_in(voxels: WallVoxels) -> tuple[Known, Known]:
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
                f"{voxels.name}: nothing of the wall is beside {what}: check which labels are of the wall, the cavity "
                "and the base."
            )
    at_side, at_cavity = ~inside & (links.kinds != 2), (links.kinds == 1).astype(np.float64)
    depths = _solved(voxels, len(cells), links, at_side, at_cavity)
    centres: FloatArray = cells.astype(np.float64)
    cuts = centres[links.cells]
    cuts[np.arange(len(cuts)), links.axes] += links.steps * links.cuts
    tip = _apex(voxels, cells, links)
    at_end = (~inside & (links.kinds == 2)) | (inside & (tip[links.cells] | tip[links.others]))
    heights = _solved(voxels, len(cells), links, at_end, (~inside).astype(np.float64))
    depth = Known(np.concatenate([centres, cuts[at_side]]), np.concatenate([depths, at_cavity[at_side]]))
    return depth, Known(centres, heights)


def _linked(voxels: WallVoxels) -> tuple[IntArray, _Links]:
    """Return the (c, 3) voxels of the wall's largest piece, and what is beside them."""
    pieces, count = ndimage.label(voxels.wall)
    if count == 0:
        raise FieldError(f"{voxels.name}: no voxel is of the wall: check its labels.")
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
