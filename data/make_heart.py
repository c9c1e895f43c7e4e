"""Makes geoprint's own test parts: a heart, two patches of it, and a plate.

    python data/make_heart.py [--out FOLDER]

Needs scikit-image (an extra of development, `pip install -e .[dev]`) besides geoprint itself. The heart is drawn, not
measured: ventricles, atria and vessels are simple solids joined by a smooth minimum, in the size of an adult's. Axes as
in medical images: x to the heart's own left, y to the back, z up from the apex to the vessels, so that -z is the long
axis towards the apex; the origin is about the middle; mm.

The rims of the patches are edges of the heart, so that the patches are some of its very triangles. Everything is
computed in a fixed order, random numbers (only the plate's) come from a fixed source, and coordinates are rounded to
DECIMALS, which hides the rounding errors of different machines: the files come out the same to the byte.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import final

import numpy as np
from skimage.measure import marching_cubes

from geoprint.distance.heat import Heat
from geoprint.geometry import edge_faces, edges, half_edges, point_source, refine, vertex_normals
from geoprint.geometry.files import save_ply
from geoprint.model import FloatArray, IntArray, Surface

Field = Callable[[FloatArray], FloatArray]
Triple = tuple[float, float, float]

# Width of a voxel [mm]: marching cubes leave about 1.5 / VOXEL^2 vertices a mm2, edges of 1.5 mm once evened out.
VOXEL = 1.75
# The heart lies within these corners [mm].
BOX = np.array([[-54.0, -48.0, -66.0], [54.0, 54.0, 64.0]])
# Width of the rounded edge of a vessel's end [mm].
STUMP_EDGE = 5.0
# Rounds of evening out: after marching cubes, and after cutting the rims in.
ROUNDS = (20, 10)
# Share of the way to the mean of its neighbours that a vertex goes in a round.
EVENING = 0.5
# Newton steps to the surface at the end; a single one does between rounds.
NEWTON_STEPS = 4
# Distance over which slopes are taken [mm]: short against any radius, far above rounding.
SLOPE_STEP = 1e-5
# Edges are flipped only for this much [rad] of angle: ties then fall the same way on every machine.
FLIP_GAIN = 1e-6
# A vertex nearer to a rim than this share of an edge is moved onto it, which keeps rims free of slivers.
SNAP_SHARE = 0.35
# Edge length of the mesh that distances are computed on [mm].
DISTANCE_EDGE = 0.75
# Decimals of the coordinates in mm: far below what matters, far above rounding errors.
DECIMALS = 4

# Tip of the left ventricle [mm].
APEX = (8.0, 0.0, -60.0)
# Patches: name, about the middle, geodesic radius [mm]. One strongly curved, one nearly developable on the free wall of
# the left ventricle.
PATCHES = (("heart_apex_patch", APEX, 20.0), ("heart_flat_patch", (42.0, 4.0, -6.0), 25.0))
# Size of the plate and width of its cells [mm], share of a cell by which its inner vertices are moved, random source.
PLATE_SIZE, PLATE_CELL, PLATE_JITTER, PLATE_SEED = (40.0, 30.0), 1.5, 0.28, 2024


@final
@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Triangles that belong to regions; where two regions meet, the mesh has a rim that stays.

    Attributes:
        vertices: (n, 3) positions [mm].
        faces: (m, 3) vertex indices.
        regions: (m,) number of the region of each face.
    """

    vertices: FloatArray
    faces: IntArray
    regions: IntArray

    def surface(self, region: int | None = None) -> Surface:
        """Return all faces, or those of one region with the vertices that they use."""
        chosen = self.faces if region is None else self.faces[self.regions == region]
        used, faces = np.unique(chosen, return_inverse=True)
        return Surface(vertices=self.vertices[used], faces=faces.reshape(-1, 3))


def main() -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(description="Makes geoprint's own test parts.")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder to write to")
    out: Path = parser.parse_args().out
    mesh = polygonise(heart)
    for region, (_, middle, radius) in enumerate(PATCHES, start=1):
        source = projected(np.array([middle]), heart, steps=NEWTON_STEPS)[0]
        mesh = cut(mesh, distance_from(mesh.surface(), source), level=radius, region=region)
    mesh = rounded(evened(mesh, heart, rounds=ROUNDS[1]))
    save_ply(mesh.surface(), out / "heart.ply")
    for region, (name, _, _) in enumerate(PATCHES, start=1):
        save_ply(mesh.surface(region), out / f"{name}.ply")
    save_ply(rounded(plate()).surface(), out / "plate.ply")


def heart(points: FloatArray) -> FloatArray:
    """Return about the signed distance [mm] of (k, 3) points from the heart, negative inside."""
    # The left ventricle is an egg cut off at its base; its lower end is a hyperboloid: round at the tip, then a cone.
    egg = ellipsoid(points, centre=(11.0, 5.0, 4.0), radii=(31.0, 31.0, 76.0), lean=(0.0, 0.0))
    bowl = hyperboloid(points, tip=APEX, radius=7.0, slope=0.9)
    left = smooth_maximum(smooth_maximum(egg, bowl, width=8.0), points[:, 2] - 27.0, width=10.0)
    right = ellipsoid(points, centre=(-14.0, -12.0, -5.0), radii=(28.0, 25.0, 38.0), lean=(-0.30, -0.10))
    outflow = vessel(points, (-8.0, -22.0, -4.0), (4.0, -20.0, 32.0), radius=13.0)
    left_atrium = ellipsoid(points, centre=(12.0, 23.0, 27.0), radii=(30.0, 20.0, 17.0), lean=(0.0, 0.1))
    right_atrium = ellipsoid(points, centre=(-28.0, 8.0, 24.0), radii=(18.0, 21.0, 23.0), lean=(0.1, 0.0))
    left_auricle = vessel(points, (34.0, 8.0, 29.0), (30.0, -15.0, 28.0), radius=7.5)
    vena_cava = vessel(points, (-29.0, 14.0, 30.0), (-25.0, 17.0, 57.0), radius=8.0)
    aorta = vessel(points, (0.0, 2.0, 15.0), (-8.0, 0.0, 59.0), radius=12.0)
    trunk = vessel(points, (2.0, -21.0, 25.0), (18.0, -2.0, 55.0), radius=11.0)
    ventricles = smooth_minimum(smooth_minimum(left, right, width=7.0), outflow, width=14.0)
    atria = smooth_minimum(smooth_minimum(left_atrium, right_atrium, width=12.0), left_auricle, width=8.0)
    body = smooth_minimum(ventricles, atria, width=6.0)
    for stump in (aorta, trunk, vena_cava):
        body = smooth_minimum(body, stump, width=6.0)
    return body


def ellipsoid(points: FloatArray, *, centre: Triple, radii: Triple, lean: tuple[float, float]) -> FloatArray:
    """Return about the signed distance from an ellipsoid along the axes, sheared; exactly 0 on it.

    Args:
        points: (k, 3) positions.
        centre: of the ellipsoid.
        radii: along x, y and z before it leans.
        lean: by how much x and y of its long axis grow with z.
    """
    offset = points - np.array(centre)
    scaled = (offset - offset[:, 2:] * np.array([*lean, 0.0])) / np.array(radii)
    share, steepness = length(scaled), length(scaled / np.array(radii))
    # At the very centre the quotient has no value; any radius is as good there.
    return np.where(steepness > 0, (share - 1.0) * share / np.where(steepness > 0, steepness, 1.0), -min(radii))


def vessel(points: FloatArray, start: Triple, end: Triple, *, radius: float) -> FloatArray:
    """Return about the signed distance from a tube with a round start and a flat end with a rounded edge."""
    offset = points - np.array(start)
    whole = np.array(end) - np.array(start)
    reach = float(length(whole))
    along = (offset * (whole / reach)).sum(axis=1)
    side = length(offset - np.maximum(along, 0.0)[:, None] * (whole / reach)) - radius
    return smooth_maximum(side, along - reach, width=STUMP_EDGE)


def hyperboloid(points: FloatArray, *, tip: Triple, radius: float, slope: float) -> FloatArray:
    """Return about the signed distance from a bowl with its tip down.

    Args:
        points: (k, 3) positions.
        tip: its lowest point.
        radius: of curvature at the tip.
        slope: rise over run of the cone that it becomes farther up.
    """
    offset = points - np.array(tip)
    waist = slope * radius
    height = slope * (np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2 + waist**2) - waist)
    return (height - offset[:, 2]) / np.sqrt(1.0 + slope**2)


def smooth_minimum(first: FloatArray, second: FloatArray, *, width: float) -> FloatArray:
    """Return the minimum, its crease rounded where the two differ by less than the width; twice differentiable."""
    closeness = np.maximum(width - np.abs(first - second), 0.0) / width
    return np.minimum(first, second) - closeness**3 * (width / 6.0)


def smooth_maximum(first: FloatArray, second: FloatArray, *, width: float) -> FloatArray:
    """Return the maximum, rounded as `smooth_minimum`."""
    return -smooth_minimum(-first, -second, width=width)


def length(vectors: FloatArray) -> FloatArray:
    """Return the (k,) lengths of (k, 3) vectors."""
    return np.sqrt((vectors * vectors).sum(axis=-1))


def polygonise(field: Field) -> Mesh:
    """Return the zero set in BOX as evenly meshed triangles, wound counter-clockwise from outside."""
    axes = [np.arange(low, high, VOXEL) for low, high in BOX.T]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = field(grid.reshape(-1, 3)).reshape(grid.shape[:3])
    corners, faces, _, _ = marching_cubes(values, 0.0, allow_degenerate=False)
    vertices = BOX[0] + VOXEL * corners.astype(np.float64)
    mesh = Mesh(vertices, faces.astype(np.int64), np.zeros(len(faces), dtype=np.int64))
    return evened(mesh, field, rounds=ROUNDS[0])


def evened(mesh: Mesh, field: Field, *, rounds: int) -> Mesh:
    """Even out the triangles of a closed mesh on the zero set: flip edges, slide vertices between their neighbours.

    Vertices of rims stay where they are, up to a Newton step.
    """
    for _ in range(rounds):
        mesh = flipped(mesh)
        # On a closed mesh the half-edges are every edge both ways.
        here, neighbour = half_edges(mesh.faces).T
        total = np.column_stack([np.bincount(here, coordinate) for coordinate in mesh.vertices[neighbour].T])
        step = EVENING * (total / np.bincount(here)[:, None] - mesh.vertices)
        normals = vertex_normals(mesh.surface())
        step -= (step * normals).sum(axis=1)[:, None] * normals
        step[rim_edges(mesh).ravel()] = 0.0
        mesh = replace(mesh, vertices=projected(mesh.vertices + step, field, steps=1))
    return flipped(replace(mesh, vertices=projected(mesh.vertices, field, steps=NEWTON_STEPS)))


def projected(points: FloatArray, field: Field, *, steps: int) -> FloatArray:
    """Move points towards the zero set along the field's slope, by Newton steps."""
    for _ in range(steps):
        here = field(points)
        slope = np.column_stack([field(points + shift) - here for shift in SLOPE_STEP * np.eye(3)]) / SLOPE_STEP
        points = points - (here / (slope * slope).sum(axis=1))[:, None] * slope
    return points


def rim_edges(mesh: Mesh) -> IntArray:
    """Return the (e, 2) edges of a closed mesh where two regions meet."""
    regions = mesh.regions[edge_faces(mesh.faces)]
    return edges(mesh.faces)[regions[:, 0] != regions[:, 1]]


def flipped(mesh: Mesh) -> Mesh:
    """Flip edges whose opposite angles exceed a straight angle, the worst first, each vertex at most once.

    Edges of rims and of the border stay.
    """
    pairs, sides = edges(mesh.faces), edge_faces(mesh.faces)
    inner = (sides[:, 1] >= 0) & (mesh.regions[sides[:, 0]] == mesh.regions[sides[:, 1]])
    pairs, sides = pairs[inner], sides[inner]
    opposite = mesh.faces[sides].sum(axis=2) - pairs.sum(axis=1)[:, None]
    facing = angles(mesh.vertices, opposite[:, 0], pairs) + angles(mesh.vertices, opposite[:, 1], pairs)
    excess = facing - np.pi - FLIP_GAIN
    worst = np.argsort(-excess, kind="stable")[: int((excess > 0).sum())]
    # No edge may come to lie where there is one already.
    doubled = np.isin(numbers(np.sort(opposite[worst], axis=1), mesh), numbers(edges(mesh.faces), mesh))
    taken, faces = np.zeros(len(mesh.vertices), dtype=np.bool_), mesh.faces.copy()
    for edge in worst[~doubled]:
        around = np.concatenate([pairs[edge], opposite[edge]])
        if taken[around].any():
            continue
        taken[around] = True
        # Each of the two faces gives up the end of the edge that the other one keeps.
        for face, lost, gained in zip(sides[edge], pairs[edge], opposite[edge, ::-1], strict=True):
            faces[face] = np.where(faces[face] == lost, gained, faces[face])
    return replace(mesh, faces=faces)


def numbers(pairs: IntArray, mesh: Mesh) -> IntArray:
    """Return a number for each pair of vertices, the lower one first."""
    return pairs[:, 0] * len(mesh.vertices) + pairs[:, 1]


def angles(vertices: FloatArray, corner: IntArray, pairs: IntArray) -> FloatArray:
    """Return the (e,) angles [rad] at corners between the directions to both vertices of a pair."""
    first, second = vertices[pairs[:, 0]] - vertices[corner], vertices[pairs[:, 1]] - vertices[corner]
    return np.arctan2(length(np.cross(first, second)), (first * second).sum(axis=1))


def distance_from(surface: Surface, place: FloatArray) -> FloatArray:
    """Return the (n,) geodesic distance [mm] of the vertices from the point of the surface closest to a place."""
    fine = refine(surface, edge_length=DISTANCE_EDGE)  # its first vertices are those of the surface
    return Heat(fine).distance(point_source(fine, place, tolerance=VOXEL)).values[: len(surface.vertices)]


def cut(mesh: Mesh, distance: FloatArray, *, level: float, region: int) -> Mesh:
    """Cut triangles along a level of a function, and number those where it is smaller as a region."""
    height, mesh = snapped(mesh, distance - level)
    sides = np.sign(height[mesh.faces])
    crossed = (sides.min(axis=1) < 0) & (sides.max(axis=1) > 0)
    pairs = edges(mesh.faces)
    pairs = pairs[height[pairs].prod(axis=1) < 0]
    low, high = height[pairs].T
    share = low / (low - high)
    added = mesh.vertices[pairs[:, 0]] + share[:, None] * (mesh.vertices[pairs[:, 1]] - mesh.vertices[pairs[:, 0]])
    crossing = {(a, b): len(mesh.vertices) + row for row, (a, b) in enumerate(pairs.tolist())}
    pieces = [pieces_of(face, height, crossing) for face in mesh.faces[crossed].tolist()]
    inside = np.array([piece for below, _ in pieces for piece in below])
    outside = np.array([piece for _, above in pieces for piece in above])
    parent = np.repeat(mesh.regions[crossed], [len(above) for _, above in pieces])
    whole = np.where(sides.max(axis=1) <= 0, region, mesh.regions)[~crossed]
    return Mesh(
        vertices=np.concatenate([mesh.vertices, added]),
        faces=np.concatenate([mesh.faces[~crossed], inside, outside]),
        regions=np.concatenate([whole, np.full(len(inside), region), parent]),
    )


def snapped(mesh: Mesh, height: FloatArray) -> tuple[FloatArray, Mesh]:
    """Move vertices that are close to where an edge crosses height 0 to that place; their height becomes 0."""
    ends = half_edges(mesh.faces)
    here, there = height[ends].T
    crossing = here * there < 0
    ends, share = ends[crossing], here[crossing] / (here - there)[crossing]
    # The nearest crossing of each vertex comes last, and the last assignment stays.
    order = np.argsort(-share, kind="stable")
    chosen = order[share[order] < SNAP_SHARE]
    start, end = ends[chosen].T
    vertices, height = mesh.vertices.copy(), height.copy()
    vertices[start] += share[chosen, None] * (mesh.vertices[end] - mesh.vertices[start])
    height[start] = 0.0
    return height, replace(mesh, vertices=vertices)


def pieces_of(
    face: list[int], height: FloatArray, crossing: dict[tuple[int, int], int]
) -> tuple[list[list[int]], list[list[int]]]:
    """Cut one face at height 0 and return the triangles below and those above."""
    below: list[int] = []
    above: list[int] = []
    for corner, following in zip(face, face[1:] + face[:1], strict=True):
        if height[corner] <= 0:
            below.append(corner)
        if height[corner] >= 0:
            above.append(corner)
        new = crossing.get((min(corner, following), max(corner, following)))
        if new is not None:
            below.append(new)
            above.append(new)
    return fan(below), fan(above)


def fan(polygon: list[int]) -> list[list[int]]:
    """Return the triangles of a convex polygon."""
    return [[polygon[0], second, third] for second, third in pairwise(polygon[1:])]


def plate() -> Mesh:
    """Return a flat rectangle about the origin at z = 0, up outside, with irregular triangles."""
    counts = [round(size / PLATE_CELL) for size in PLATE_SIZE]
    places = np.stack(np.meshgrid(*[np.arange(count + 1) for count in counts], indexing="ij"), axis=-1)
    moves = np.zeros(places.shape)
    inner = moves[1:-1, 1:-1]
    inner[...] = np.random.default_rng(PLATE_SEED).uniform(-PLATE_JITTER, PLATE_JITTER, inner.shape)
    shares = (places + moves) / np.array(counts)
    flat = ((shares - 0.5) * np.array(PLATE_SIZE)).reshape(-1, 2)
    number = np.arange(len(flat)).reshape(places.shape[:2])
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    faces = np.stack([np.column_stack([a, b, c]), np.column_stack([a, c, d])], axis=1).reshape(-1, 3)
    mesh = Mesh(np.column_stack([flat, np.zeros(len(flat))]), faces, np.zeros(len(faces), dtype=np.int64))
    # Every flip can make another edge worth flipping; few passes settle all.
    for _ in range(ROUNDS[1]):
        mesh = flipped(mesh)
    return mesh


def rounded(mesh: Mesh) -> Mesh:
    """Round the coordinates, and turn -0 to 0."""
    return replace(mesh, vertices=np.round(mesh.vertices, DECIMALS) + 0.0)


if __name__ == "__main__":
    main()
