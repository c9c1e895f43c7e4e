"""What a stream of poses deposits, as anybody's paths."""

from __future__ import annotations

import numpy as np

from geoprint.model import Polylines, PoseStream


def deposited(poses: PoseStream) -> Polylines:
    """Return what a stream deposits, without its levels."""
    rows = np.flatnonzero(poses.deposit)
    firsts = np.flatnonzero(np.diff(poses.runs[rows], prepend=-1))
    return Polylines(poses.surface_points[rows], np.append(firsts, rows.size))
