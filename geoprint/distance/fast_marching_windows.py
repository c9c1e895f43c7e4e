"""Straight lines from a source inside triangles: numba kernels that follow them through a few rings of triangles.

A front that leaves a point is too strongly curved for marching. So the first rings around every piece of a source get
their exact distances: the triangles around the piece are unfolded into its plane one by one, and a window, the wedge
or strip of straight lines that pass through an edge, is cut at every corner it meets [Mitchell1987]. A corner within
its window is seen from the piece; where lines would have to bend around a vertex, marching takes over.
"""

from __future__ import annotations

from math import atan2, sqrt
from typing import NamedTuple

from geoprint.distance.fast_marching_kernels import (
    BESIDE_SEED,
    SEED_VERTEX,
    SEEN_FROM_SEED,
    Front,
    MarchingMesh,
    arrive,
)
from geoprint.geometry.halfedges import next_half, previous_half
from geoprint.kernels import inner, njit
from geoprint.model import FloatArray, IntArray

# How far straight lines are followed, in longest sides of the triangle they start in.
REACH = 2.0
# Distances that differ by this share of the reach are the same.
TIE = 1e-6
# Windows that may wait; what does not fit is left to marching.
WAITING_WINDOWS = 256
# A piece nearer to a corner than this share of the triangle's longest side goes through it.
TOUCHING = 1e-9


class Point(NamedTuple):
    """A point or a vector in the plane of unfolded triangles [mm]."""

    x: float
    y: float


class Line(NamedTuple):
    """The line a x + b y + c = 0, positive on its left."""

    a: float
    b: float
    c: float


class Origin(NamedTuple):
    """Where straight lines start.

    Attributes:
        place: the point they leave in all directions, or a point of the segment that they leave squarely.
        normal: the zero vector for a point, the direction of all lines for a segment.
    """

    place: Point
    normal: Point


class Window(NamedTuple):
    """Lines that pass through one edge, out of the triangle on its left.

    Attributes:
        half: the edge's half-edge in the triangle that they leave.
        start: its start, on the right of the lines.
        end: its end, on their left.
        right: the rightmost line.
        left: the leftmost line.
    """

    half: int
    start: Point
    end: Point
    right: Line
    left: Line


@njit
def see_from_vertices(mesh: MarchingMesh, front: Front, vertices: IntArray) -> None:
    """Set the distances of what is seen from source vertices through the triangles around them."""
    for vertex in vertices:
        half = int(mesh.first[vertex])
        while True:
            opposite = next_half(half)
            see_along(mesh, front, opposite, mesh.lengths[half], mesh.bearings[opposite], mesh.angles[opposite])
            last = previous_half(half)
            see_along(mesh, front, last, mesh.lengths[last], mesh.bearings[last], 0.0)
            here, right, apex = triangle(mesh, half)
            source = Origin(here, Point(0.0, 0.0))
            window = Window(opposite, right, apex, line_from(source, right), line_from(source, apex))
            follow(mesh, front, source, window, REACH * longest_side(mesh, half))
            half = int(mesh.twins[last])
            if half < 0 or half == mesh.first[vertex]:
                break


@njit
def see_from_border(mesh: MarchingMesh, front: Front, border: IntArray) -> None:
    """Set the distances of what is seen squarely from seeded border edges, given by their half-edges."""
    for k in range(border.size):
        side_number = int(border[k]) % 3
        half = int(border[k]) - side_number
        corners = triangle(mesh, half)
        start, end = corners[side_number], corners[(side_number + 1) % 3]
        opposite = corners[(side_number + 2) % 3]
        back = towards_segment(opposite, start, end)
        angle = turn(Point(start.x - opposite.x, start.y - opposite.y), back)
        corner = previous_half(int(border[k]))
        see_along(mesh, front, corner, sqrt(back.x * back.x + back.y * back.y), mesh.bearings[corner], angle)
        leave_segment(mesh, front, half, corners, start, end, longest_side(mesh, half))


@inner
def see_along(mesh: MarchingMesh, front: Front, corner: int, distance: float, bearing: float, angle: float) -> None:
    """Offer a corner the straight line from the source, `angle` counter-clockwise from its half-edge."""
    vertex = int(mesh.corners[corner])
    if distance < front.distances[vertex]:
        front.marks[vertex] |= SEEN_FROM_SEED
        arrive(front, vertex, distance, bearing + angle * mesh.stretch[vertex])


@njit
def see_from_pieces(mesh: MarchingMesh, front: Front, faces: IntArray, starts: FloatArray, ends: FloatArray) -> None:
    """Set the distances of what is seen from straight pieces inside triangles.

    Args:
        mesh: m triangles.
        front: changed in place.
        faces: (k,) triangle of each piece.
        starts: (k, 3) barycentric weights of its start.
        ends: (k, 3) of its end; a piece may be a point.
    """
    for k in range(faces.size):
        half = 3 * faces[k]
        corners = triangle(mesh, half)
        start, end = weighted(corners, starts[k]), weighted(corners, ends[k])
        longest = longest_side(mesh, half)
        for i in range(3):
            see_corner(mesh, front, half + i, corners[i], corners[(i + 1) % 3], start, end, TOUCHING * longest)
        length = sqrt((end.x - start.x) ** 2 + (end.y - start.y) ** 2)
        if length <= TOUCHING * longest:
            leave_point(mesh, front, half, corners, start, longest)
        else:
            leave_segment(mesh, front, half, corners, start, end, longest)
            leave_segment(mesh, front, half, corners, end, start, longest)


@inner
def see_corner(
    mesh: MarchingMesh,
    front: Front,
    corner: int,
    here: Point,
    following: Point,
    start: Point,
    end: Point,
    touching: float,
) -> None:
    """Offer a corner of a triangle its distance from a segment in it."""
    back = towards_segment(here, start, end)
    distance = sqrt(back.x * back.x + back.y * back.y)
    if distance <= touching:
        vertex = mesh.corners[corner]
        front.marks[vertex] |= SEED_VERTEX
        if front.distances[vertex] > 0.0:
            arrive(front, vertex, 0.0, 0.0)
        return
    front.marks[mesh.corners[corner]] |= BESIDE_SEED
    angle = turn(Point(following.x - here.x, following.y - here.y), back)
    see_along(mesh, front, corner, distance, mesh.bearings[corner], angle)


@inner
def towards_segment(here: Point, start: Point, end: Point) -> Point:
    """Return the vector from a point to the nearest point of a segment, which may be a point."""
    x, y = end.x - start.x, end.y - start.y
    square = x * x + y * y
    share = 0.0
    if square > 0.0:
        share = min(1.0, max(0.0, ((here.x - start.x) * x + (here.y - start.y) * y) / square))
    return Point(start.x + share * x - here.x, start.y + share * y - here.y)


@inner
def leave_point(
    mesh: MarchingMesh, front: Front, half: int, corners: tuple[Point, Point, Point], place: Point, longest: float
) -> None:
    """Follow all straight lines from a point of a triangle, in it or on one of its sides."""
    source = Origin(place, Point(0.0, 0.0))
    for i in range(3):
        start, end = corners[i], corners[(i + 1) % 3]
        nearest = min(separation(start, place), separation(end, place))
        if nearest > TOUCHING * longest:
            window = Window(half + i, start, end, line_from(source, start), line_from(source, end))
            follow(mesh, front, source, window, REACH * longest)


@inner
def leave_segment(
    mesh: MarchingMesh,
    front: Front,
    half: int,
    corners: tuple[Point, Point, Point],
    first: Point,
    last: Point,
    longest: float,
) -> None:
    """Follow the straight lines that leave a segment of a triangle squarely, to its left."""
    length = separation(first, last)
    x, y = (last.x - first.x) / length, (last.y - first.y) / length
    source = Origin(first, Point(-y, x))
    for i in range(3):
        start, end = corners[i], corners[(i + 1) % 3]
        # Places along the segment, from its last point on the right of the lines to its first on their left.
        right = min(length, (start.x - first.x) * x + (start.y - first.y) * y)
        left = max(0.0, (end.x - first.x) * x + (end.y - first.y) * y)
        if right - left > TOUCHING * longest:
            rightmost = line_from(source, Point(first.x + right * x, first.y + right * y))
            leftmost = line_from(source, Point(first.x + left * x, first.y + left * y))
            follow(mesh, front, source, Window(half + i, start, end, rightmost, leftmost), REACH * longest)


@njit
def follow(mesh: MarchingMesh, front: Front, source: Origin, window: Window, reach: float) -> None:
    """Follow a window from triangle to triangle, as far as `reach` [mm], and set the corners that it sees.

    It ends where all corners of a triangle are nearer to other pieces of the source.
    """
    windows = [window]
    tie = TIE * reach
    while len(windows) > 0:
        window = windows.pop()
        half = int(mesh.twins[window.half])
        if half < 0 or gap(source, window.start, window.end) > reach:
            continue
        apex = beyond(mesh, half, window.end, window.start)
        first, last = next_half(half), previous_half(half)
        if (
            is_nearer(front, int(mesh.corners[half]), source, window.end, tie)
            and is_nearer(front, int(mesh.corners[first]), source, window.start, tie)
            and is_nearer(front, int(mesh.corners[last]), source, apex, tie)
        ):
            continue
        to_left, to_right = side(window.left, apex), side(window.right, apex)
        if to_left > 0.0:
            windows.append(Window(first, window.start, apex, window.right, window.left))
        elif to_right < 0.0:
            windows.append(Window(last, apex, window.end, window.right, window.left))
        elif len(windows) < WAITING_WINDOWS:
            back = travelled(source, apex)
            distance = sqrt(back.x * back.x + back.y * back.y)
            angle = turn(Point(window.end.x - apex.x, window.end.y - apex.y), Point(-back.x, -back.y))
            see_along(mesh, front, last, distance, mesh.bearings[last], angle)
            middle = line_from(source, apex)
            windows.append(Window(first, window.start, apex, window.right, middle))
            windows.append(Window(last, apex, window.end, middle, window.left))


@inner
def is_nearer(front: Front, vertex: int, source: Origin, place: Point, tie: float) -> bool:
    """Tell whether a vertex, unfolded to a place, is nearer to another piece of the source."""
    back = travelled(source, place)
    return front.distances[vertex] < sqrt(back.x * back.x + back.y * back.y) - tie


@inner
def travelled(source: Origin, place: Point) -> Point:
    """Return the vector that a straight line from the source has covered at a place."""
    x, y = place.x - source.place.x, place.y - source.place.y
    if source.normal.x == 0.0 and source.normal.y == 0.0:
        return Point(x, y)
    height = x * source.normal.x + y * source.normal.y
    return Point(height * source.normal.x, height * source.normal.y)


@inner
def line_from(source: Origin, place: Point) -> Line:
    """Return the straight line from the source through a place."""
    x, y = source.normal.x, source.normal.y
    if x == 0.0 and y == 0.0:
        x, y = place.x - source.place.x, place.y - source.place.y
    return Line(-y, x, y * place.x - x * place.y)


@inner
def side(line: Line, place: Point) -> float:
    """Return a positive number on the left of a line and a negative one on its right."""
    return line.a * place.x + line.b * place.y + line.c


@inner
def gap(source: Origin, start: Point, end: Point) -> float:
    """Return how far the nearest point of an edge is from the source, along the lines that leave it [mm]."""
    first, last = travelled(source, start), travelled(source, end)
    x, y = last.x - first.x, last.y - first.y
    square = x * x + y * y
    share = 0.0
    if square > 0.0:
        share = min(1.0, max(0.0, -(first.x * x + first.y * y) / square))
    return sqrt((first.x + share * x) ** 2 + (first.y + share * y) ** 2)


@inner
def turn(first: Point, second: Point) -> float:
    """Return the angle between two vectors, without its sign [rad]."""
    return abs(atan2(first.x * second.y - first.y * second.x, first.x * second.x + first.y * second.y))


@inner
def separation(first: Point, second: Point) -> float:
    """Return the distance between two points of the plane [mm]."""
    return sqrt((first.x - second.x) ** 2 + (first.y - second.y) ** 2)


@inner
def beyond(mesh: MarchingMesh, half: int, start: Point, end: Point) -> Point:
    """Return the corner opposite to a half-edge that runs from start to end, on its left."""
    length, right, left = mesh.lengths[half], mesh.lengths[previous_half(half)], mesh.lengths[next_half(half)]
    along = 0.5 * (length + (right - left) * (right + left) / length)
    away = sqrt(max(right * right - along * along, 0.0))
    x, y = (end.x - start.x) / length, (end.y - start.y) / length
    return Point(start.x + along * x - away * y, start.y + along * y + away * x)


@inner
def triangle(mesh: MarchingMesh, half: int) -> tuple[Point, Point, Point]:
    """Return the corners of a triangle in the plane: its half-edge starts at the origin, along the x axis."""
    start, end = Point(0.0, 0.0), Point(mesh.lengths[half], 0.0)
    return start, end, beyond(mesh, half, start, end)


@inner
def weighted(corners: tuple[Point, Point, Point], weights: FloatArray) -> Point:
    """Return the point of a triangle with the given barycentric weights."""
    x = weights[0] * corners[0].x + weights[1] * corners[1].x + weights[2] * corners[2].x
    y = weights[0] * corners[0].y + weights[1] * corners[1].y + weights[2] * corners[2].y
    return Point(x, y)


@inner
def longest_side(mesh: MarchingMesh, half: int) -> float:
    """Return the longest side of the triangle of a half-edge [mm]."""
    return max(mesh.lengths[half], mesh.lengths[next_half(half)], mesh.lengths[previous_half(half)])
