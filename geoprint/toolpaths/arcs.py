"""Arcs: points along those of G-code (G2, G3), of APT (CIRCLE) and of RAPID (MoveC)."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray

# Angle between points of an arc [rad]: on a radius of 20 mm its chords are within a micrometre.
STEP = np.radians(1.0)
# On large radii points are nearer: chords stay within this of the arc [mm].
SAGITTA = 0.001
# Chords of all arcs of a file: a short file of long arcs must not take minutes.
MOST_CHORDS = 2_000_000
# Ends of an arc that are nearer than this make it a full turn [rad], as in RS274/NGC.
CLOSED = 1e-6


def along_arc(start: FloatArray, through: FloatArray | None, end: FloatArray) -> FloatArray:
    """Return (k, 3) points of a straight line, or of the arc through another place [mm]."""
    if through is None:
        return np.stack([start, end])
    first, second = through - start, end - start
    normal = np.cross(first, second)
    square = float(normal @ normal)
    if square == 0.0:
        return np.stack([start, through, end])
    towards = np.cross((first @ first) * second - (second @ second) * first, normal)
    centre = start + towards / (2.0 * square)
    axis = normal / np.sqrt(square)
    points = round_axis(start, centre=centre, axis=axis, angle=turn_to(start, end, centre=centre, axis=axis))
    # A run goes on where the arc before it ends, without rounding.
    points[0], points[-1] = start, end
    return points


def turn_to(start: FloatArray, end: FloatArray, *, centre: FloatArray, axis: FloatArray) -> float:
    """Return by how much a start turns about an axis of length 1 to an end, counter-clockwise [rad], 0 to 2 pi."""
    x = start - centre
    return float(np.mod(np.arctan2((end - centre) @ np.cross(axis, x), (end - centre) @ x), 2.0 * np.pi))


def round_axis(
    start: FloatArray, *, centre: FloatArray, axis: FloatArray, angle: float, climb: float = 0.0
) -> FloatArray:
    """Return (k, 3) points of an arc from a start, as many as `chords` says.

    Args:
        start: where it begins.
        centre: a point of the axis.
        axis: of length 1.
        angle: by which it turns about the axis, counter-clockwise [rad], 0 or more.
        climb: how far it goes along the axis meanwhile.
    """
    foot = centre + ((start - centre) @ axis) * axis
    x = start - foot
    shares = np.linspace(0.0, 1.0, chords(angle, float(np.linalg.norm(x))) + 1)[:, None]
    turns = angle * shares
    return foot + np.cos(turns) * x + np.sin(turns) * np.cross(axis, x) + climb * shares * axis


def chords(angle: float, radius: float) -> int:
    """Return how many chords follow an arc [rad, mm]."""
    step = min(STEP, float(np.sqrt(8.0 * SAGITTA / max(radius, SAGITTA))))
    return max(int(np.ceil(angle / step)), 1)


def full_turn(angle: float, *, turns: int = 1) -> float:
    """Return the angle of an arc of G-code [rad]: a full turn where it would be none, and full turns besides.

    Args:
        angle: as `turn_to` returns it.
        turns: full turns that are begun, 1 or more.
    """
    closed = angle < CLOSED or angle > 2.0 * np.pi - CLOSED
    return (2.0 * np.pi if closed else angle) + 2.0 * np.pi * (turns - 1)
