"""What front marching works on: half-edge arrays, the state of the front, and the heap of vertices that wait.

Half-edges are numbered as `surfaces.halfedges` says.
Directions at a vertex are bearings: angles [rad] counter-clockwise from its first half-edge, stretched at a vertex
inside the surface so that a full turn is 2 pi whatever angles meet there [Polthier1998]. On the border the first
half-edge is the one along the border, and nothing is stretched.

Small kernels are inlined into the loops that call them, and those loops count no references (`uncounted`).
"""

from __future__ import annotations

from math import acos, pi
from typing import NamedTuple

import numpy as np

from geoprint.kernels import inlined, inner, njit
from geoprint.model import FloatArray, IntArray
from geoprint.surfaces.halfedges import next_half, previous_half

# Marks of a vertex, added up. A seed vertex has distance 0; along border edges of the seed the front starts parallel.
SEED_VERTEX = 1
SEED_FIRST_EDGE = 2
SEED_LAST_EDGE = 4
# A corner of a triangle that holds a piece of the seed inside: between it and the next corner the distance has a
# valley, through which nothing is marched.
BESIDE_SEED = 8
# The arrival was computed along a straight line from the seed.
SEEN_FROM_SEED = 16


class MarchingMesh(NamedTuple):
    """Half-edge arrays of m triangles and n vertices.

    Attributes:
        corners: (3 m,) vertex that each half-edge starts from.
        lengths: (3 m,) length [mm].
        twins: (3 m,) half-edge on the other side of the edge; -1 on the border.
        angles: (3 m,) angle of the corner [rad], not stretched.
        bearings: (3 m,) bearing of the half-edge at the vertex it starts from [rad].
        stretch: (n,) bearing by angle: 2 pi by the sum of angles inside, 1 on the border.
        first: (n,) first half-edge of each vertex; -1 where no triangle uses it.
    """

    corners: IntArray
    lengths: FloatArray
    twins: IntArray
    angles: FloatArray
    bearings: FloatArray
    stretch: FloatArray
    first: IntArray


class Front(NamedTuple):
    """What is known of the distance so far, and the vertices from which it still has to spread.

    Attributes:
        distances: (n,) [mm], infinite where nothing has arrived.
        origins: (n,) bearing back to where the shortest line to the vertex comes from [rad].
        marks: (n,) sum of the marks of the vertex.
        heap: (n,) binary heap of waiting vertices, the nearest first.
        places: (n,) place of each vertex in the heap, -1 outside.
        waiting: (1,) number of vertices in the heap.
    """

    distances: FloatArray
    origins: FloatArray
    marks: IntArray
    heap: IntArray
    places: IntArray
    waiting: IntArray


@njit
def measure_corners(
    corners: IntArray, lengths: FloatArray, twins: IntArray, vertex_count: int
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Return angles, bearings, stretch and first half-edges, as `MarchingMesh` holds them."""
    angles = np.empty(corners.size)
    first = np.full(vertex_count, -1)
    sums = np.zeros(vertex_count)
    for half in range(corners.size):
        right, left, across = lengths[half], lengths[previous_half(half)], lengths[next_half(half)]
        cosine = (right * right + left * left - across * across) / (2.0 * right * left)
        angles[half] = acos(min(1.0, max(-1.0, cosine)))
        vertex = corners[half]
        sums[vertex] += angles[half]
        if twins[half] < 0 or first[vertex] < 0:
            first[vertex] = half
    bearings = np.zeros(corners.size)
    stretch = np.ones(vertex_count)
    for vertex in range(vertex_count):
        half = first[vertex]
        if half < 0:
            continue
        if twins[half] >= 0:
            stretch[vertex] = 2.0 * pi / sums[vertex]
        angle = 0.0
        while True:
            bearings[half] = angle * stretch[vertex]
            angle += angles[half]
            half = twins[previous_half(half)]
            if half < 0 or half == first[vertex]:
                break
    return angles, bearings, stretch, first


@inlined
def arrive(front: Front, vertex: int, distance: float, origin: float) -> None:
    """Set a smaller distance of a vertex and let it wait for its turn."""
    front.distances[vertex] = distance
    front.origins[vertex] = origin
    if front.places[vertex] < 0:
        front.heap[front.waiting[0]] = vertex
        front.places[vertex] = front.waiting[0]
        front.waiting[0] += 1
    rise(front, front.places[vertex])


@inlined
def pop_nearest(front: Front) -> int:
    """Take the nearest vertex out of the heap."""
    heap, places = front.heap, front.places
    nearest = heap[0]
    places[nearest] = -1
    front.waiting[0] -= 1
    count = front.waiting[0]
    if count > 0:
        heap[0] = heap[count]
        places[heap[0]] = 0
        sink(front, count)
    return nearest


@inlined
def rise(front: Front, place: int) -> None:
    """Move the vertex at a place of the heap up to where it belongs."""
    heap, places, keys = front.heap, front.places, front.distances
    vertex = heap[place]
    while place > 0:
        parent = (place - 1) >> 1
        if keys[heap[parent]] <= keys[vertex]:
            break
        heap[place] = heap[parent]
        places[heap[place]] = place
        place = parent
    heap[place] = vertex
    places[vertex] = place


@inlined
def sink(front: Front, count: int) -> None:
    """Move the vertex at the top of a heap of `count` down to where it belongs."""
    heap, places, keys = front.heap, front.places, front.distances
    vertex, place = heap[0], 0
    while 2 * place + 1 < count:
        child = 2 * place + 1
        if child + 1 < count and keys[heap[child + 1]] < keys[heap[child]]:
            child += 1
        if keys[heap[child]] >= keys[vertex]:
            break
        heap[place] = heap[child]
        places[heap[place]] = place
        place = child
    heap[place] = vertex
    places[vertex] = place


@inner
def border_bearing(mesh: MarchingMesh, vertex: int) -> float:
    """Return the bearing of the last edge of a border vertex: the sum of its angles [rad]."""
    half = int(mesh.first[vertex])
    while mesh.twins[previous_half(half)] >= 0:
        half = int(mesh.twins[previous_half(half)])
    return mesh.bearings[half] + mesh.angles[half]
