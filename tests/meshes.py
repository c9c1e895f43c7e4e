"""Makers of analytic test surfaces: vertices lie exactly on the named shape, normals point outwards or up.

With a jitter seed the interior vertices move along the shape by up to JITTER of the mesh width at random, which spoils
the symmetry that flatters many methods; boundary vertices never move.
"""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray, IntArray, Surface

# Share of the mesh width; below about 0.3 no triangle turns over.
JITTER = 0.2


def plate(
    size: tuple[float, float] = (40.0, 30.0), divisions: tuple[int, int] = (8, 6), *, jitter_seed: int | None = None
) -> Surface:
    """Return the rectangle [0, size[0]] x [0, size[1]] at z = 0 [mm], its cells cut along alternating diagonals."""
    flat, faces = _rectangle(size, divisions, jitter_seed)
    return Surface(vertices=np.column_stack([flat, np.zeros(len(flat))]), faces=faces, name="plate")


def folded_plate(angle: float) -> Surface:
    """Return a plate of 20 x 12 mm folded down along x = 0 by an angle [degrees], by a negative one up."""
    flat = plate((20.0, 12.0), (20, 12))
    x, y, _ = flat.vertices.T
    beyond, turn = np.maximum(x - 10.0, 0.0), np.radians(angle)
    places = np.column_stack([np.minimum(x - 10.0, 0.0) + beyond * np.cos(turn), y - 6.0, -beyond * np.sin(turn)])
    return Surface(places, flat.faces, name="folded plate")


def bent_plate(angle: float, *, radius: float) -> Surface:
    """Return a plate of 20 x 12 mm bent down by an angle [degrees] over a radius [mm] in the middle of its length."""
    flat = plate((20.0, 12.0), (200, 12))
    x, y, _ = flat.vertices.T
    turn = np.radians(angle)
    before, bent = np.minimum(x - 10.0, -radius * turn / 2.0), np.clip((x - 10.0) / radius + turn / 2.0, 0.0, turn)
    beyond = np.maximum(x - 10.0 - radius * turn / 2.0, 0.0)
    across = before + radius * np.sin(bent) + beyond * np.cos(turn)
    return Surface(
        np.column_stack([across, y - 6.0, -radius * (1.0 - np.cos(bent)) - beyond * np.sin(turn)]), flat.faces,
        name="bent plate",
    )  # fmt: skip


def comb(*, finger: float, teeth: int = 13, divisions: int = 2) -> Surface:
    """Return a flat bar, 5 mm high, with fingers that are 10 mm long and as far apart as they are wide [mm]."""
    edge = finger / divisions
    columns, rows = (2 * teeth - 1) * divisions, round(15.0 / edge)
    full = plate((columns * edge, rows * edge), (columns, rows))
    x, y, _ = (full.vertices[full.faces].mean(axis=1) - full.vertices.min(axis=0)).T
    faces = full.faces[(y < 5.0) | (np.floor(x / finger) % 2 == 0)]
    used, renumbered = np.unique(faces, return_inverse=True)
    return Surface(full.vertices[used], renumbered.reshape(-1, 3), name="comb")


def cylinder_patch(
    *,
    radius: float = 30.0,
    angle: float = 1.5,
    length: float = 40.0,
    divisions: tuple[int, int] = (12, 10),
    jitter_seed: int | None = None,
) -> Surface:
    """Return a part of a cylinder about the y axis that rolls a plate of radius * angle by length; top at z = radius.

    It is developable: distances are those of the plate.
    """
    flat, faces = _rectangle((radius * angle, length), divisions, jitter_seed)
    turn = flat[:, 0] / radius - angle / 2
    vertices = np.column_stack([radius * np.sin(turn), flat[:, 1], radius * np.cos(turn)])
    return Surface(vertices=vertices, faces=faces, name="cylinder")


def disc(*, radius: float = 20.0, rings: int = 8, jitter_seed: int | None = None) -> Surface:
    """Return the flat disc about the origin at z = 0; vertex 0 is its centre."""
    flat, faces = _unit_disc(rings, jitter_seed)
    return Surface(vertices=np.column_stack([radius * flat, np.zeros(len(flat))]), faces=faces, name="disc")


def spherical_cap(
    *, radius: float = 30.0, angle: float = 1.0, rings: int = 10, jitter_seed: int | None = None
) -> Surface:
    """Return the part of a sphere about the origin within `angle` [rad] of the +z axis; vertex 0 is the pole."""
    flat, faces = _unit_disc(rings, jitter_seed)
    share = np.linalg.norm(flat, axis=1)
    outward = flat / np.where(share > 0, share, 1.0)[:, None]
    polar = angle * share
    vertices = radius * np.column_stack([outward * np.sin(polar)[:, None], np.cos(polar)])
    return Surface(vertices=vertices, faces=faces, name="cap")


def annulus(
    *, inner: float = 8.0, outer: float = 20.0, divisions: tuple[int, int] = (48, 8), jitter_seed: int | None = None
) -> Surface:
    """Return the flat ring about the origin at z = 0, with divisions around and across."""
    around, across = divisions
    turn, out = np.meshgrid(np.arange(around), np.arange(across + 1), indexing="ij")
    grid = np.column_stack([turn.ravel(), out.ravel()]).astype(np.float64)
    grid += _jitter(len(grid), (out.ravel() > 0) & (out.ravel() < across), jitter_seed)
    angle, radius = 2 * np.pi * grid[:, 0] / around, inner + (outer - inner) * grid[:, 1] / across
    vertices = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(len(grid))])
    # Angle first and radius second is left-handed: the winding is turned.
    faces = _grid_faces((around + 1, across + 1)) % len(grid)
    return Surface(vertices=vertices, faces=faces[:, ::-1], name="annulus")


def sphere(*, radius: float = 20.0, subdivisions: int = 3, jitter_seed: int | None = None) -> Surface:
    """Return the closed sphere about the origin: an icosahedron, each face cut in four `subdivisions` times."""
    golden = (1 + np.sqrt(5)) / 2
    corners = np.array([(0.0, i, j * golden) for i in (-1, 1) for j in (-1, 1)])
    vertices = np.concatenate([np.roll(corners, shift, axis=1) for shift in range(3)])
    faces = np.array(
        [
            (i, j, k) if np.linalg.det(vertices[[i, j, k]]) > 0 else (i, k, j)
            for i in range(12)
            for j in range(i + 1, 12)
            for k in range(j + 1, 12)
            if max(np.linalg.norm(vertices[[i, j, k]] - vertices[[j, k, i]], axis=1)) < 2.1  # the side is 2
        ]
    )
    for _ in range(subdivisions):
        vertices, faces = _quarter(vertices, faces)
    vertices = _on_unit_sphere(vertices)
    if jitter_seed is not None:
        # The side of an icosahedron in the unit sphere is 1.05.
        shift = np.random.default_rng(jitter_seed).uniform(-JITTER, JITTER, vertices.shape)
        vertices = _on_unit_sphere(vertices + shift * 1.05 / 2**subdivisions)
    return Surface(vertices=radius * vertices, faces=faces, name="sphere")


def torus(*, major: float = 20.0, minor: float = 8.0, divisions: tuple[int, int] = (48, 24)) -> Surface:
    """Return the closed torus about the z axis, with divisions around the axis and around the tube."""
    around, tube = divisions
    u, v = np.meshgrid(np.arange(around), np.arange(tube), indexing="ij")
    a, b = 2 * np.pi * u.ravel() / around, 2 * np.pi * v.ravel() / tube
    reach = major + minor * np.cos(b)
    vertices = np.column_stack([reach * np.cos(a), reach * np.sin(a), minor * np.sin(b)])
    right, up = (u + 1) % around, (v + 1) % tube
    corner = [(i * tube + j).ravel() for i, j in ((u, v), (right, v), (right, up), (u, up))]
    faces = np.concatenate([np.column_stack([corner[0], corner[1], corner[2]]), np.column_stack(corner)[:, [0, 2, 3]]])
    return Surface(vertices=vertices, faces=faces, name="torus")


def blocks(filled: list[list[list[int]]], *, x: list[float], y: list[float], z: list[float]) -> Surface:
    """Return the closed boundary of the blocks of a grid that are filled; none may touch another in an edge alone.

    Args:
        filled: whether the block between x[i] and x[i + 1], y[j] and y[j + 1], z[k] and z[k + 1] is, at [i][j][k].
        x: where the grid is cut [mm]; also y and z.
    """
    full = np.pad(np.array(filled, dtype=np.int64), 1)
    index = np.arange(len(x) * len(y) * len(z)).reshape(len(x), len(y), len(z))
    faces: list[IntArray] = []
    for axis in range(3):
        step = np.diff(full, axis=axis)
        for place in np.argwhere(step != 0):
            corner = place - 1
            corner[axis] += 1
            aside, across = np.roll(np.eye(3, dtype=np.int64), -axis - 1, axis=0)[:2]
            a, b, c, d = (index[tuple(corner + shift)] for shift in (0 * aside, aside, aside + across, across))
            # What begins is seen against the axis, what ends along it.
            faces.append(np.array([[a, c, b], [a, d, c]] if step[tuple(place)] > 0 else [[a, b, c], [a, c, d]]))
    grid = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    used, renumbered = np.unique(np.concatenate(faces), return_inverse=True)
    return Surface(grid[used], renumbered.reshape(-1, 3), name="blocks")


def wedge(*, length: float, width: float, height: float, depth: float = 1.0) -> Surface:
    """Return a closed wedge: its top rises from z = 0 at x = 0 to a height at x = length; its floor lies at -depth."""
    floor = [(i, j, -depth) for i, j in ((0.0, 0.0), (length, 0.0), (length, width), (0.0, width))]
    top = [(i, j, height * i / length) for i, j, _ in floor]
    faces = [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7)]
    for corner in range(4):
        ahead = (corner + 1) % 4
        faces += [(corner, ahead, 4 + ahead), (corner, 4 + ahead, 4 + corner)]
    return Surface(np.array(floor + top), np.array(faces), name="wedge")


def _on_unit_sphere(vertices: FloatArray) -> FloatArray:
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True).astype(np.float64)


def _rectangle(
    size: tuple[float, float], divisions: tuple[int, int], jitter_seed: int | None
) -> tuple[FloatArray, IntArray]:
    i, j = (index.ravel() for index in np.meshgrid(*(np.arange(count + 1) for count in divisions), indexing="ij"))
    inside = (i > 0) & (i < divisions[0]) & (j > 0) & (j < divisions[1])
    grid = np.column_stack([i, j]) + _jitter(i.size, inside, jitter_seed)
    return grid * (np.array(size) / divisions), _grid_faces((divisions[0] + 1, divisions[1] + 1))


def _grid_faces(shape: tuple[int, int]) -> IntArray:
    """Return the triangles of a grid of vertices i * shape[1] + j, counter-clockwise with i along x and j along y."""
    i, j = (index.ravel() for index in np.meshgrid(*(np.arange(count - 1) for count in shape), indexing="ij"))
    a = i * shape[1] + j
    b, c, d = a + shape[1], a + shape[1] + 1, a + 1
    even = ((i + j) % 2 == 0)[:, None]
    first = np.where(even, np.column_stack([a, b, c]), np.column_stack([a, b, d]))
    second = np.where(even, np.column_stack([a, c, d]), np.column_stack([b, c, d]))
    return np.stack([first, second], axis=1).reshape(-1, 3)


def _unit_disc(rings: int, jitter_seed: int | None) -> tuple[FloatArray, IntArray]:
    """Return the unit disc with 6 k vertices on ring k."""
    numbers = [np.arange(6 * k) for k in range(1, rings + 1)]
    angles = np.concatenate([[0.0], *(2 * np.pi * number / (6 * k) for k, number in enumerate(numbers, start=1))])
    radii = np.concatenate([[0.0], *(np.full(number.size, k / rings) for k, number in enumerate(numbers, start=1))])
    flat = np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])
    first = [0, *(1 + 3 * k * (k - 1) for k in range(1, rings + 1))]
    faces: list[tuple[int, int, int]] = []
    for k in range(1, rings + 1):
        outer, inner = 6 * k, max(6 * (k - 1), 1)
        for sector in range(6):
            for step in range(k):
                out, into = sector * k + step, sector * (k - 1) + step
                a, b = first[k] + out, first[k] + (out + 1) % outer
                faces.append((first[k - 1] + into % inner, a, b))
                if step < k - 1:
                    faces.append((first[k - 1] + into % inner, b, first[k - 1] + (into + 1) % inner))
    # The centre stays, so that the pole is known.
    inside = (radii > 0) & (np.arange(len(flat)) < first[rings])
    return flat + _jitter(len(flat), inside, jitter_seed) / rings, np.array(faces)


def _quarter(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(sides, axis=0, return_inverse=True)
    a, b, c = faces.T
    m, n, o = len(vertices) + inverse.reshape(-1, 3).T
    pieces = [np.column_stack(piece) for piece in ((a, m, o), (m, b, n), (o, n, c), (m, n, o))]
    return np.concatenate([vertices, vertices[unique].mean(axis=1)]), np.concatenate(pieces)


def _jitter(count: int, where: np.ndarray[tuple[int], np.dtype[np.bool_]], seed: int | None) -> FloatArray:
    """Return (count, 2) shifts in mesh widths, zero where not asked for or without a seed."""
    if seed is None:
        return np.zeros((count, 2))
    return np.random.default_rng(seed).uniform(-JITTER, JITTER, (count, 2)) * where[:, None]
