"""Makers of irregular test surfaces, and what their distance from the border is.

Structured triangulations flatter the heat method, so that every surface here is an irregular triangulation of a flat
region, lifted: points of a jittered hexagonal grid (`irregular`), the same stretched by 20 (`anisotropic`), or points
at random with a part of the edges turned to the wrong diagonal (`sliver`).
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from matplotlib.path import Path as Polygon
from scipy.spatial import Delaunay, KDTree

from geoprint.distance.intrinsic import intrinsic_triangulation
from geoprint.model import BoolArray, FloatArray, IntArray, Surface

STYLES = ("irregular", "anisotropic", "sliver")
# Length to width of the triangles of the anisotropic style.
STRETCH = 20.0
# Share of the mesh width by which points of the hexagonal grid move.
JITTER = 0.25
# Interior points keep this share of the mesh width from the border, so that border edges are edges of the Delaunay
# triangulation: no point lies in the circle over one.
CLEARANCE = 0.6
# Share of the inner edges that the sliver style turns to the wrong diagonal.
TURNED = 0.15
# Pieces into which the oracle cuts each border edge: it measures from vertices only.
BORDER_PIECES = 8


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """A flat region and how it is lifted.

    Attributes:
        borders: closed polygons (b, 2) with dense corners, the outer one first [mm].
        lift: (n, 2) flat points to (n, 3) [mm].
        distance: (n, 3) points to their (n,) distance from the border [mm], where a formula is known.
    """

    borders: tuple[FloatArray, ...]
    lift: Callable[[FloatArray], FloatArray]
    distance: Callable[[FloatArray], FloatArray] | None = None


def circle(radius: float, centre: tuple[float, float] = (0.0, 0.0)) -> FloatArray:
    """Return a circle as a polygon of many corners."""
    turn = np.linspace(0.0, 2 * np.pi, 20_000, endpoint=False)
    return radius * np.column_stack([np.cos(turn), np.sin(turn)]) + centre


def rectangle(width: float, height: float) -> FloatArray:
    """Return the corners of the rectangle from the origin to (width, height)."""
    return np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])


def _flat(points: FloatArray) -> FloatArray:
    return np.column_stack([points, np.zeros(len(points))])


def _plate() -> Shape:
    width, height = 40.0, 30.0

    def distance(places: FloatArray) -> FloatArray:
        x, y = places[:, 0], places[:, 1]
        return np.minimum(np.minimum(x, width - x), np.minimum(y, height - y))

    return Shape((rectangle(width, height),), _flat, distance)


def _disc() -> Shape:
    return Shape((circle(20.0),), _flat, lambda places: 20.0 - np.hypot(places[:, 0], places[:, 1]))


def _cylinder() -> Shape:
    radius, angle, length = 12.0, np.pi, 30.0

    def lift(points: FloatArray) -> FloatArray:
        turn = points[:, 0] / radius
        return np.column_stack([-radius * np.cos(turn), points[:, 1], radius * np.sin(turn)])

    def distance(places: FloatArray) -> FloatArray:
        along = radius * np.clip(np.arctan2(places[:, 2], -places[:, 0]), 0.0, angle)
        across = places[:, 1]
        return np.minimum(np.minimum(along, radius * angle - along), np.minimum(across, length - across))

    return Shape((rectangle(radius * angle, length),), lift, distance)


def _cone() -> Shape:
    slant, half_angle = 30.0, np.pi / 6

    def lift(points: FloatArray) -> FloatArray:
        reach = np.hypot(points[:, 0], points[:, 1])
        return np.column_stack([points * np.sin(half_angle), -reach * np.cos(half_angle)])

    return Shape((circle(slant),), lift, lambda places: slant - np.sqrt((places**2).sum(axis=1)))


def _cap(half_angle: float = np.pi / 2, *, radius: float = 20.0) -> Shape:
    # Areas are kept: the flat radius of the polar angle a is 2 radius sin(a / 2).
    rim = 2 * radius * np.sin(half_angle / 2)

    def lift(points: FloatArray) -> FloatArray:
        reach, turn = np.hypot(points[:, 0], points[:, 1]), np.arctan2(points[:, 1], points[:, 0])
        polar = 2 * np.arcsin(np.clip(reach / (2 * radius), 0.0, 1.0))
        return radius * np.column_stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])

    def distance(places: FloatArray) -> FloatArray:
        return radius * (half_angle - np.arccos(np.clip(places[:, 2] / radius, -1.0, 1.0)))

    return Shape((circle(rim),), lift, distance)


def _saddle() -> Shape:
    radius = 20.0

    def lift(points: FloatArray) -> FloatArray:
        x, y = points.T / radius
        return np.column_stack([points, 0.6 * radius * (x**2 - y**2)])

    return Shape((circle(radius),), lift)


def _bumpy() -> Shape:
    size = 40.0

    def lift(points: FloatArray) -> FloatArray:
        x, y = 2 * np.pi * points.T / size
        height = 0.12 * np.sin(1.5 * x) * np.cos(1.2 * y) + 0.05 * np.sin(2.3 * x + 1.7 * y)
        return np.column_stack([points, size * height])

    return Shape((rectangle(size, size),), lift)


def _half_torus() -> Shape:
    major, minor = 20.0, 7.0

    def lift(points: FloatArray) -> FloatArray:
        around, tube = points[:, 0] / major, points[:, 1] / minor - 0.75 * np.pi
        reach = major + minor * np.cos(tube)
        return np.column_stack([reach * np.cos(around), reach * np.sin(around), minor * np.sin(tube)])

    return Shape((rectangle(major * np.pi, minor * 1.5 * np.pi),), lift)


def _sheet_with_hole() -> Shape:
    radius = 20.0

    def lift(points: FloatArray) -> FloatArray:
        x, y = points.T / radius
        return np.column_stack([points, 0.15 * radius * np.cos(3 * x) * np.sin(2.5 * y)])

    return Shape((circle(radius), circle(5.0, (6.0, 2.0))), lift)


SHAPES: Mapping[str, Callable[[], Shape]] = MappingProxyType(
    {
        "plate": _plate,
        "disc": _disc,
        "cylinder": _cylinder,
        "cone": _cone,
        "cap": _cap,
        "saddle": _saddle,
        "bumpy": _bumpy,
        "half torus": _half_torus,
        "sheet with hole": _sheet_with_hole,
    }
)


def cap(half_angle_deg: float, *, depth: float = 20.0) -> Shape:
    """Return a spherical cap: the more of the sphere, the more a flat map must stretch it.

    Args:
        half_angle_deg: from the pole to the rim [degrees].
        depth: distance along the sphere from the rim to the pole [mm].
    """
    half_angle = float(np.radians(half_angle_deg))
    return _cap(half_angle, radius=depth / half_angle)


def wrap(angle_deg: float, *, radius: float, length: float) -> Shape:
    """Return a part of a tube along the x axis, its middle upwards.

    Args:
        angle_deg: about the axis [degrees].
        radius: of the tube [mm].
        length: along the axis, from the origin on [mm].
    """
    half = float(np.radians(angle_deg)) / 2

    def lift(points: FloatArray) -> FloatArray:
        turn = half - points[:, 1] / radius
        return np.column_stack([points[:, 0], -radius * np.sin(turn), radius * np.cos(turn)])

    return Shape((rectangle(length, 2 * half * radius),), lift)


def make(shape: str, *, faces: int, style: str = "irregular", random_seed: int = 0) -> Surface:
    """Return a triangulated shape.

    Args:
        shape: one of `SHAPES`.
        faces: about how many.
        style: one of `STYLES`.
        random_seed: another one gives another triangulation.
    """
    return triangulated(SHAPES[shape](), name=shape, faces=faces, style=style, random_seed=random_seed)


def triangulated(made: Shape, *, name: str, faces: int, style: str = "irregular", random_seed: int = 0) -> Surface:
    """Return a triangulation of any shape, named; the rest is as for `make`."""
    rng = np.random.default_rng(random_seed)
    stretch = np.array([1.0, STRETCH if style == "anisotropic" else 1.0])
    borders = [border * stretch for border in made.borders]
    width = float(np.sqrt(_enclosed(borders) / faces * 4 / np.sqrt(3)))
    rims = [_evenly(border, width) for border in borders]
    inside = _random_points(borders, width, rng) if style == "sliver" else _grid_points(borders, width, rng)
    points = np.concatenate([*rims, inside])
    triangles = _triangles(points, rims)
    if style == "sliver":
        triangles = _turned(points, triangles, rng)
    used, renumbered = np.unique(triangles, return_inverse=True)
    return Surface(made.lift(points[used] / stretch), renumbered.reshape(-1, 3), name=f"{name}, {style}")


def exact_distance(surface: Surface) -> FloatArray:
    """Return the (n,) exact polyhedral distance from the border [mm], by window propagation (pygeodesic).

    The oracle measures from vertices, so that border edges are cut into `BORDER_PIECES` first; what is left of them
    is about 1e-4 mesh widths.
    """
    cut, sources = _with_cut_border(surface)
    geodesic = importlib.import_module("pygeodesic.geodesic")
    oracle = geodesic.PyGeodesicAlgorithmExact(cut.vertices.copy(), cut.faces.astype(np.int32))
    distances, _ = oracle.geodesicDistances(sources.astype(np.int32), None)
    return np.asarray(distances, dtype=np.float64)[: len(surface.vertices)]


def _enclosed(borders: list[FloatArray]) -> float:
    """Return the area [mm2] inside the first border and outside the others."""
    areas = [abs(float(np.sum(b[:, 0] * np.roll(b[:, 1], -1) - np.roll(b[:, 0], -1) * b[:, 1]))) / 2 for b in borders]
    return areas[0] - sum(areas[1:])


def _evenly(border: FloatArray, width: float) -> FloatArray:
    """Return points along a polygon about one width apart; the corners of a coarse polygon stay."""
    ends = np.roll(border, -1, axis=0)
    lengths = np.linalg.norm(ends - border, axis=1)
    if len(border) > 100:
        arcs = np.concatenate([[0.0], np.cumsum(lengths)])
        count = max(round(float(arcs[-1]) / width), 3)
        stations = np.linspace(0.0, float(arcs[-1]), count, endpoint=False)
        closed = np.concatenate([border, border[:1]])
        x, y = np.interp(stations, arcs, closed[:, 0]), np.interp(stations, arcs, closed[:, 1])
        return np.column_stack([x, y])
    sides: list[FloatArray] = []
    for start, along, length in zip(border, ends - border, lengths, strict=True):
        count = max(round(float(length) / width), 1)
        sides.append(start + np.arange(count)[:, None] / count * along)
    return np.concatenate(sides)


def _inside(points: FloatArray, borders: list[FloatArray]) -> BoolArray:
    contained = [Polygon(border).contains_points(points) for border in borders]
    return np.asarray(contained[0] & ~np.any(contained[1:], axis=0) if contained[1:] else contained[0])


def _clear(points: FloatArray, borders: list[FloatArray], width: float) -> FloatArray:
    """Keep the points inside that have their clearance from the border."""
    rim = np.concatenate([_evenly(border, width / 20) for border in borders])
    points = points[_inside(points, borders)]
    distances, _ = KDTree(rim).query(points, distance_upper_bound=CLEARANCE * width)
    return points[np.isinf(distances)]


def _grid_points(borders: list[FloatArray], width: float, rng: np.random.Generator) -> FloatArray:
    low, high = borders[0].min(axis=0), borders[0].max(axis=0)
    size = high - low
    columns, rows = int(np.ceil(size[0] / width)) + 1, int(np.ceil(size[1] / (width * np.sqrt(3) / 2))) + 1
    row, column = np.divmod(np.arange(int(rows * columns)), columns)
    grid: FloatArray = low + width * np.column_stack([column + 0.5 * (row % 2), row * np.sqrt(3) / 2])
    jitter: FloatArray = rng.uniform(-JITTER, JITTER, (rows * columns, 2)) * width
    return _clear(grid + jitter, borders, width)


def _random_points(borders: list[FloatArray], width: float, rng: np.random.Generator) -> FloatArray:
    low, high = borders[0].min(axis=0), borders[0].max(axis=0)
    size = high - low
    count = int(size[0] * size[1] / (width**2 * np.sqrt(3) / 2))
    points: FloatArray = rng.uniform(low, high, (count, 2))
    return _clear(points, borders, width)


def _triangles(points: FloatArray, rims: list[FloatArray]) -> IntArray:
    """Return the counter-clockwise Delaunay triangles inside the rims."""
    triangles = np.asarray(Delaunay(points).simplices, dtype=np.int64)
    doubled = _doubled(points, triangles)
    triangles[doubled < 0] = triangles[doubled < 0][:, [0, 2, 1]]
    triangles = triangles[np.abs(doubled) > 1e-6 * np.median(np.abs(doubled))]
    return triangles[_inside(points[triangles].mean(axis=1), rims)]


def _doubled(points: FloatArray, triangles: IntArray) -> FloatArray:
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]


def _turned(points: FloatArray, triangles: IntArray, rng: np.random.Generator) -> IntArray:
    """Turn a random part of the edges to the other diagonal where the quadrilateral stays convex."""
    twins = intrinsic_triangulation(Surface(_flat(points), triangles)).twins.ravel()
    half = np.flatnonzero(twins > np.arange(twins.size))
    half = rng.permutation(half)[: int(TURNED * half.size)]
    # Each triangle takes part in one turn at most: the first in the random order.
    rank = np.full(len(triangles), half.size)
    pairs = np.column_stack([half, twins[half]]) // 3
    np.minimum.at(rank, pairs, np.arange(half.size)[:, None])
    half = half[(rank[pairs] == np.arange(half.size)[:, None]).all(axis=1)]
    u, v, w = (triangles[half // 3, (half + shift) % 3] for shift in range(3))
    x = triangles[twins[half] // 3, (twins[half] + 2) % 3]
    first, second = np.column_stack([x, v, w]), np.column_stack([w, u, x])
    total = _doubled(points, first) + _doubled(points, second)
    convex = np.minimum(_doubled(points, first), _doubled(points, second)) > 0.02 * total
    result = triangles.copy()
    result[half[convex] // 3], result[twins[half[convex]] // 3] = first[convex], second[convex]
    return result


def _with_cut_border(surface: Surface) -> tuple[Surface, IntArray]:
    """Cut every border edge into pieces and its triangle into a fan; return the vertices on the border too.

    Triangles with two border edges are first cut at their middle into three with one each.
    """
    faces, vertices = surface.faces, surface.vertices
    border = intrinsic_triangulation(surface).twins < 0
    crowded = border.sum(axis=1) > 1
    middles = len(vertices) + np.arange(int(crowded.sum()))
    corners = faces[crowded]
    fan = np.concatenate([np.column_stack([corners[:, i], corners[:, (i + 1) % 3], middles]) for i in range(3)])
    vertices = np.concatenate([vertices, vertices[corners].mean(axis=1)])
    faces = np.concatenate([faces[~crowded], fan])
    border = intrinsic_triangulation(Surface(vertices, faces)).twins < 0
    cut = np.flatnonzero(border.any(axis=1))
    side = np.argmax(border[cut], axis=1)
    a, b, c = (faces[cut, (side + shift) % 3] for shift in range(3))
    shares = np.arange(1, BORDER_PIECES)[:, None, None] / BORDER_PIECES
    added = vertices[a] * (1 - shares) + vertices[b] * shares
    numbers: IntArray = len(vertices) + np.arange((BORDER_PIECES - 1) * cut.size).reshape(BORDER_PIECES - 1, cut.size)
    chain = np.concatenate([a[None], numbers, b[None]])
    pieces = [np.column_stack([chain[i], chain[i + 1], c]) for i in range(BORDER_PIECES)]
    kept = np.delete(faces, cut, axis=0)
    whole = Surface(np.concatenate([vertices, added.reshape(-1, 3)]), np.concatenate([kept, *pieces]))
    return whole, np.unique(chain)
