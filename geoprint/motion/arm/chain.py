"""The chain of an arm's joints, from the base to the tool, for many joint vectors at once."""

from __future__ import annotations

from math import cos, sin

from geoprint.kernels import inlined, uncounted
from geoprint.model import FloatArray


@uncounted
def chain_frames(
    joints: FloatArray, origins: FloatArray, axes: FloatArray, T_end_tool: FloatArray, frames: FloatArray
) -> int:
    """Fill in where the links and the tool are; return how many rows were filled.

    Args:
        joints: (k, 6) angles [rad].
        origins: (6, 4, 4) frame of each joint at zero in the one before [mm].
        axes: (6, 3) unit axis of each in its own frame.
        T_end_tool: (4, 4) the tool in the frame of the last link [mm].
        frames: (k, 8, 4, 4) where the base, the links and the tool are written, in the base frame [mm].
    """
    count = joints.shape[0]
    for k in range(count):
        for j in range(8):
            frames[k, j, 3, 0], frames[k, j, 3, 1], frames[k, j, 3, 2], frames[k, j, 3, 3] = 0.0, 0.0, 0.0, 1.0
        for a in range(3):
            for b in range(4):
                frames[k, 0, a, b] = 1.0 if a == b else 0.0
        for j in range(6):
            _multiply(frames[k, j], origins[j], frames[k, j + 1])
            _turn(frames[k, j + 1], axes[j], joints[k, j])
        _multiply(frames[k, 6], T_end_tool, frames[k, 7])
    return count


@inlined
def _multiply(first: FloatArray, second: FloatArray, product: FloatArray) -> None:
    """Fill in the product of two rigid (4, 4) transforms."""
    for a in range(3):
        for b in range(4):
            product[a, b] = first[a, 0] * second[0, b] + first[a, 1] * second[1, b] + first[a, 2] * second[2, b]
        product[a, 3] += first[a, 3]


@inlined
def _turn(frame: FloatArray, axis: FloatArray, angle: float) -> None:
    """Turn a (4, 4) frame about an axis of its own, by Rodrigues' formula."""
    x, y, z, c, s = axis[0], axis[1], axis[2], cos(angle), sin(angle)
    d = 1.0 - c
    for a in range(3):
        p, q, r = frame[a, 0], frame[a, 1], frame[a, 2]
        frame[a, 0] = p * (c + d * x * x) + q * (d * x * y + s * z) + r * (d * x * z - s * y)
        frame[a, 1] = p * (d * x * y - s * z) + q * (c + d * y * y) + r * (d * y * z + s * x)
        frame[a, 2] = p * (d * x * z + s * y) + q * (d * y * z - s * x) + r * (c + d * z * z)
