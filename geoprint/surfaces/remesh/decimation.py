"""Fewer triangles: those are taken away first whose loss changes the surface least [Garland1997]."""

from __future__ import annotations

import numpy as np

from geoprint.errors import InputError
from geoprint.model import Surface
from geoprint.surfaces.conversion import missing
from geoprint.surfaces.operators import edge_lengths

# How fast the error that is accepted grows: the hearts that were tried stay manifold with this and deviate least.
AGGRESSIVENESS = 6.0
# Rounds after which the error would be larger than any part.
MOST_ROUNDS = 200
# The number of faces is met but for this share.
COUNT_TOLERANCE = 0.02


def decimate(surface: Surface, *, faces: int) -> Surface:
    """Return a surface with fewer triangles, small where it bends and large where it is flat.

    Rims keep all their vertices. The result nearly always is a manifold, but only `prepare` knows.

    Args:
        surface: manifold.
        faces: wanted number, fewer than there are.

    Returns:
        The surface with that many faces, but for COUNT_TOLERANCE.

    Raises:
        InputError: it has no more faces than that, or cannot be brought down to so few.
        UsageError: pyfqmr is not installed.
    """
    if not 0 < faces < len(surface.faces):
        raise InputError(
            f"{surface.name} has {len(surface.faces)} faces, so that it cannot be decimated to {faces}; ask for fewer "
            "than it has and more than none, or for an edge length.",
            faces=len(surface.faces),
        )
    try:
        from pyfqmr import Simplify
    except ImportError as error:
        raise missing("pyfqmr", extra="scan", work="decimating") from error
    # The error that is accepted is a number without unit: a mean edge of 1 makes it mean the same for every part.
    scale = float(edge_lengths(surface).mean())
    work = Simplify()
    work.setMesh(surface.vertices / scale, surface.faces.astype(np.int32))
    work.simplify_mesh(
        target_count=faces,
        aggressiveness=AGGRESSIVENESS,
        max_iterations=MOST_ROUNDS,
        preserve_border=True,
        verbose=False,
    )
    vertices, found, _ = work.getMesh()
    if abs(len(found) / faces - 1.0) > COUNT_TOLERANCE:
        raise InputError(
            f"{surface.name}: the fewest faces it can be decimated to is {len(found)}, asked for {faces}; its rims "
            "keep their vertices, so ask for more faces, or for an edge length.",
            faces=len(found),
        )
    return Surface(vertices=vertices * scale, faces=found.astype(np.int64), name=surface.name)
