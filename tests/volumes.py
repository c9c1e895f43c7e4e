"""Makers of label volumes: a ball in voxels, where and however the grid lies, as NIfTI or NRRD files."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geoprint.model import FloatArray

RADIUS = 12.0
CENTRE = np.array([30.0, -20.0, 50.0])


def affine(sides: tuple[float, float, float], *, angle: float = 0.0, mirrored: bool = False) -> FloatArray:
    """Return a grid of voxels with these sides [mm] about the ball, turned about z and x, and mirrored on request."""
    turn_z = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    turn_x = np.array([[1.0, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    result = np.eye(4)
    result[:3, :3] = turn_z @ turn_x @ np.diag(sides) @ np.diag([-1.0 if mirrored else 1.0, 1.0, 1.0])
    result[:3, 3] = CENTRE - result[:3, :3] @ (np.array(shape(sides)) / 2.0)
    return result


def shape(sides: tuple[float, float, float]) -> tuple[int, ...]:
    """Return how many voxels hold the ball."""
    return tuple(int(2.6 * RADIUS / side) + 2 for side in sides)


def ball_labels(grid: FloatArray, sides: tuple[float, float, float], *, label: int = 7) -> NDArray[np.uint8]:
    """Return the voxels whose centres lie in the ball, and one voxel of label 3 in a corner."""
    index = np.stack(np.meshgrid(*(np.arange(count) for count in shape(sides)), indexing="ij"), axis=-1)
    centres = index @ grid[:3, :3].T + grid[:3, 3]
    labels = np.where(np.linalg.norm(centres - CENTRE, axis=-1) <= RADIUS, label, 0).astype(np.uint8)
    labels[0, 0, 0] = 3
    return labels


def save_nifti(path: Path, labels: NDArray[np.generic], grid: FloatArray, *, unit: int = 2) -> bytes:
    """Write a NIfTI file, gzipped where its name ends so, and return it unpacked; unit 2 is mm, 0 unknown."""
    import nibabel

    image = nibabel.Nifti1Image(labels, grid)
    content = bytearray(image.to_bytes())
    content[123] = unit
    path.write_bytes(gzip.compress(bytes(content)) if path.suffix == ".gz" else bytes(content))
    return bytes(content)
