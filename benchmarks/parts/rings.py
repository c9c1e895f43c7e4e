"""Rings about a pole, one spacing apart, on a disc or on a dome: a small part whose exact shape is known."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.parts.reprints import Shape
from geoprint.model import FloatArray, PoseStream, Surface

STANDOFF = 0.3
# Points of a ring, and rows and columns of the mesh, over the spacing.
STEP = 0.25


def shape_of(radius: float) -> Shape:
    """Return a dome with its pole at the origin; a plane where the radius is infinite."""
    return Shape(np.array([0.0, 0.0, 0.0 if np.isinf(radius) else -radius]), radius)


def surface(shape: Shape, *, reach: float, step: float) -> Surface:
    """Return a mesh of all that is nearer to the pole than `reach` [mm], with edges of about a step [mm]."""
    rows = np.linspace(0.0, reach, round(reach / step) + 1)[1:]
    turns = round(2.0 * np.pi * reach / step / 2.0)
    vertices = np.vstack([[0.0, 0.0, 0.0], *(ring(shape, reach=row, points=turns) for row in rows)])
    along = np.arange(turns)
    following = (along + 1) % turns
    faces = [np.column_stack([np.zeros(turns, dtype=np.int64), 1 + along, 1 + following])]
    for row in range(1, rows.size):
        inner, outer = 1 + (row - 1) * turns, 1 + row * turns
        faces += [
            np.column_stack([inner + along, outer + along, outer + following]),
            np.column_stack([inner + along, outer + following, inner + following]),
        ]
    return Surface(vertices, np.vstack(faces), name="rings")


def rings(shape: Shape, *, count: int, spacing: float) -> PoseStream:
    """Return a stream of closed rings, the outermost first, the innermost half a spacing from the pole.

    The tool's z axis points into the surface, its x axis stays as near to that of space as that allows.
    """
    reaches = spacing * (np.arange(count)[::-1] + 0.5)
    lines = [ring(shape, reach=reach, points=max(round(2 * np.pi * reach / spacing / STEP), 12)) for reach in reaches]
    lines = [np.vstack([line, line[:1]]) for line in lines]
    counts, points = [len(line) for line in lines], np.vstack(lines)
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    if np.isfinite(shape.radius):
        normals = (points - shape.centre) / shape.radius
    x_axes = np.array([1.0, 0.0, 0.0]) - normals[:, :1] * normals
    x_axes /= np.linalg.norm(x_axes, axis=1, keepdims=True)
    attitudes: FloatArray = np.asarray(
        np.stack([x_axes, np.cross(-normals, x_axes), -normals], axis=2), dtype=np.float64
    )
    return PoseStream(
        tips=points + STANDOFF * normals,
        quaternions=Rotation.from_matrix(attitudes).as_quat(scalar_first=True),
        normals=normals,
        runs=np.repeat(np.arange(count), counts),
        levels=np.repeat(np.arange(count), counts),
        layers=np.zeros(len(points), dtype=np.int64),
        deposit=np.ones(len(points), dtype=np.bool_),
        stops=np.zeros(len(points), dtype=np.bool_),
        arcs=np.concatenate([np.arange(k, dtype=np.float64) for k in counts]),
        flow=np.ones(len(points)),
        standoff=STANDOFF,
    )


def ring(shape: Shape, *, reach: float, points: int) -> FloatArray:
    """Return points at a distance from the pole along the shape [mm]."""
    turn = 2.0 * np.pi * np.arange(points) / points
    out, down = reach, 0.0
    if np.isfinite(shape.radius):
        out, down = shape.radius * np.sin(reach / shape.radius), shape.radius * (np.cos(reach / shape.radius) - 1.0)
    return np.column_stack([out * np.cos(turn), out * np.sin(turn), np.full(points, down)])
