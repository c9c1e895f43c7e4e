"""Level surfaces of the distance from a part: a net of triangles, what a layer of even thickness ends in."""

from __future__ import annotations

from functools import cache

import numpy as np

from geoprint.errors import FieldError, InputError, MeshError
from geoprint.geometry import clipped, component_labels, connected_nodes, part_of, remesh
from geoprint.geometry.manifold import split_vertices
from geoprint.layers.feet import Ground
from geoprint.layers.refining import fine_where, on_level, trimmed
from geoprint.model import BoolArray, FloatArray, IntArray, Surface

# A net of triangles about a level of the distance from a part: a vertex in each cell of a grid that the level
# crosses.
#
# Cells are found from large to small: distance changes by no more than one moves, so a cell whose middle is farther
# from the level than its corners are from the middle holds none of it [Gibson1998].


# Corners of a cell, and of which of them its twelve edges are.
CORNERS: IntArray = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
EDGES: IntArray = np.array([
    [first, second]
    for first in range(8)
    for second in range(first + 1, 8)
    if np.abs(CORNERS[first] - CORNERS[second]).sum() == 1
])  # fmt: skip
# The largest cells are so many times as long as the smallest.
LARGEST = 16
# Half the diagonal of a cell over its side, and a little.
HALF_DIAGONAL = 0.5 * np.sqrt(3.0) * 1.01
# Rounds in which corners change sides so that no cell holds two sheets, and how far [mm] they then are below the level.
CHANGES = 30
SMALLEST = 1e-9
DIAGONALS: IntArray = np.array([[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]])


@cache
def several_sheets() -> BoolArray:
    """Return (256,) whether corners on one side of the level hang together along edges in two parts or more.

    A side is the number whose bits say which corners are on it.
    """
    found = np.zeros(256, dtype=np.bool_)
    for number in range(256):
        below = (number >> np.arange(8)) & 1 == 1
        for side in (below, ~below):
            linked = EDGES[side[EDGES].all(axis=1)]
            found[number] |= np.unique(connected_nodes(linked[:, 0], linked[:, 1], nodes=8)[side]).size > 1
    return found


def net(ground: Ground, *, height: float, cell: float, shift: float) -> tuple[FloatArray, IntArray]:
    """Return the vertices and triangles of a net about the level at a height over the outer side.

    Args:
        ground: the part.
        height: of the level over it [mm].
        cell: side of the cells [mm].
        shift: by which share of a cell the grid is moved: another one where two sheets fall into one cell.
    """
    low = ground.part.vertices.min(axis=0) - height - (2.0 + shift) * cell
    cells = _crossed(ground, low, height=height, cell=cell)
    corners: IntArray = cells[:, None] + CORNERS
    keys = _keys(corners)
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    places = low + cell * corners.reshape(-1, 3)[first]
    over = _unambiguous(ground.feet(places)[1] - height, inverse.reshape(keys.shape))
    active = (over.min(axis=1) < 0.0) & (over.max(axis=1) >= 0.0)
    cells, over = cells[active], over[active]
    vertices = ground.raised(low + cell * (cells + _middles(over)), height)
    return vertices, _faces(cells, over, vertices)


def _crossed(ground: Ground, low: FloatArray, *, height: float, cell: float) -> IntArray:
    """Return the (c, 3) cells that may hold some of the level, counted from the lowest corner of the grid."""
    high = ground.part.vertices.max(axis=0) + height + 2.0 * cell
    size = LARGEST
    counts = np.ceil((high - low) / (size * cell)).astype(np.int64)
    cells: IntArray = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    while True:
        middles = low + (cells + 0.5) * size * cell
        away = np.abs(np.abs(ground.feet(middles)[1]) - height)
        cells = cells[away <= HALF_DIAGONAL * size * cell]
        if size == 1:
            return cells
        cells = (2 * cells[:, None] + CORNERS).reshape(-1, 3)
        size //= 2


def _unambiguous(over: FloatArray, corners: IntArray) -> FloatArray:
    """Return (c, 8) how far the corners of cells are over the level, such that one sheet of it crosses each cell.

    Where two would, as in a narrow crease, the corner nearest to the level changes sides: a vertex between them is put
    where it belongs afterwards.

    Args:
        over: (p,) of every corner [mm].
        corners: (c, 8) which of them each cell has.
    """
    over = over.copy()
    for _ in range(CHANGES):
        own = over[corners]
        several = np.flatnonzero(several_sheets()[(own < 0.0) @ (1 << np.arange(8))])
        if not several.size:
            break
        changed = np.unique(corners[several, np.abs(own[several]).argmin(axis=1)])
        over[changed] = np.where(over[changed] < 0.0, 0.0, -SMALLEST)
    return over[corners]


def _keys(cells: IntArray) -> IntArray:
    """Return one number for each place of a grid, (..., 3) counted from its lowest corner."""
    return (cells[..., 0] * (1 << 20) + cells[..., 1]) * (1 << 20) + cells[..., 2]


def _middles(over: FloatArray) -> FloatArray:
    """Return (c, 3) the mean of where the level crosses edges of each cell, as shares of it.

    Args:
        over: (c, 8) how far each corner is over the level.
    """
    first, second = over[:, EDGES[:, 0]], over[:, EDGES[:, 1]]
    crossed = (first < 0.0) != (second < 0.0)
    share = np.where(crossed, first / np.where(crossed, first - second, 1.0), 0.0)
    places = CORNERS[EDGES[:, 0]] + share[..., None] * (CORNERS[EDGES[:, 1]] - CORNERS[EDGES[:, 0]])
    return np.einsum("ce,cex->cx", crossed, places) / crossed.sum(axis=1)[:, None]


def _faces(cells: IntArray, over: FloatArray, vertices: FloatArray) -> IntArray:
    """Return triangles between the vertices of the four cells about each edge that the level crosses."""
    keys = _keys(cells)
    order = np.argsort(keys)
    quads: list[IntArray] = []
    for axis in range(3):
        ahead, aside, across = np.roll(np.eye(3, dtype=np.int64), -axis, axis=0)
        (end,) = np.flatnonzero((ahead == CORNERS).all(axis=1))
        chosen = np.flatnonzero((over[:, 0] < 0.0) != (over[:, end] < 0.0))
        about = cells[chosen, None] - np.stack([0 * ahead, aside, aside + across, across])
        wanted = _keys(about)
        found = order[np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)]
        whole = (keys[found] == wanted).all(axis=1)
        rising = over[chosen, 0] < 0.0
        quads.append(np.where(rising[:, None], found, found[:, ::-1])[whole])
    quad = np.concatenate(quads)
    spans = [np.linalg.norm(vertices[quad[:, one]] - vertices[quad[:, one + 2]], axis=1) for one in (0, 1)]
    shorter = (spans[0] > spans[1]).astype(np.int64)
    return np.take_along_axis(quad[:, None], DIAGONALS[shorter].reshape(len(quad), 1, 6), axis=2).reshape(-1, 3)


# Level surfaces of the distance from a part: what a layer of even thickness ends in.
#
# A part pushed along its normals is too thin where it bulges between vertices and folds where it is hollow. Here
# every vertex has the wanted distance to the closest place of the part, and edges are halved until what lies between
# does too.


# Grids that are tried, moved by these shares of a cell: where two sheets share a cell of one, they may not of another.
SHIFTS = (0.0, 0.37, 0.71, 0.53)
# Cells are a little smaller than the edges that are wanted.
CELL_SHARE = 0.8
# The rim of the net is true to this share of a cell: a layer that stands out so little over the one below is as high.
RIM_SHARE = 0.03
# A hole in it whose rim has so many cells is none of the part's, but where what lies beyond jumps from place to place.
HOLE = 4.0


def level_surface(part: Surface, *, height: float, edge_length: float, tolerance: float) -> Surface:
    """Return the surface at one distance from a part, on its outer side, cut along the normals of its rim.

    Args:
        part: manifold, consistently wound.
        height: distance from the part [mm].
        edge_length: of its triangles [mm]; shorter where they would lie off by more than
        tolerance: the largest deviation of the distance at the middles of edges and faces [mm], if halving reaches it.

    Returns:
        Its vertices have the distance up to rounding. Where the part is hollow it may fall into pieces.

    Raises:
        InputError: a length is no positive number.
        FieldError: nothing of the outer side is that far from the part.
        MeshError: sheets of it lie too close together for the edge length.
    """
    for name, value in (("height", height), ("edge_length", edge_length), ("tolerance", tolerance)):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name} must be a positive number of mm, found {value}.")
    ground = Ground(part)
    cell = CELL_SHARE * edge_length
    for shift in SHIFTS:
        try:
            cut = _cut(ground, height=height, cell=cell, shift=shift)
            rough = remesh(cut, edge_length=edge_length)
        except MeshError:
            continue
        return on_level(ground, rough, height=height, tolerance=tolerance, hole=HOLE * cell)
    raise MeshError(
        f"{height:g} mm over {part.name} sheets of its level surface lie closer together than {edge_length:g} mm: "
        "choose shorter edges, or a lower layer."
    )


def _cut(ground: Ground, *, height: float, cell: float, shift: float) -> Surface:
    """Return the net about the level that stands on the part, without what lies beyond its rim."""

    def beyond(places: FloatArray) -> FloatArray:
        return ground.beyond(places, ground.feet(places)[0])

    vertices, faces = net(ground, height=height, cell=cell, shift=shift)
    kept: BoolArray = beyond(vertices)[faces].min(axis=1) <= 0.0
    if not kept.any():
        raise FieldError(
            f"nothing of the outer side of {ground.part.name} is {height:g} mm away from it: choose a smaller "
            "thickness."
        )
    whole = part_of(Surface(vertices, faces, ground.part.name), kept)
    if not ground.rimmed:
        return whole
    # In a crease the closest place of the part changes, and with it how far beyond its rim a place lies: by a jump.
    whole = fine_where(ground, whole, beyond, height=height, tolerance=RIM_SHARE * cell)
    standing = _standing(ground, split_vertices(clipped(whole, beyond(whole.vertices)[:, None])), cell=cell)
    return trimmed(ground, standing, hole=HOLE * cell)


def _standing(ground: Ground, surface: Surface, *, cell: float) -> Surface:
    """Return the pieces that stand on the inside of the part: at the rim a cut may leave crumbs."""
    labels = component_labels(surface)
    feet = ground.feet(surface.vertices)[0]
    inside = ground.beyond(feet, feet) < -0.5 * cell
    return part_of(surface, np.isin(labels, labels[inside[surface.faces].any(axis=1)]))
