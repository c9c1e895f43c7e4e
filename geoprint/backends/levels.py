"""Where level curves lie, and how short edges must be to follow them: the same rules for every backend."""

from __future__ import annotations

import numpy as np

from geoprint.errors import FieldError, UsageError
from geoprint.model import FloatArray, ScalarField

# A distance that is linear in each triangle follows a curved front to a per cent of a spacing.
EDGES_PER_SPACING = 4


def level_distances(field: ScalarField, *, spacing: float) -> FloatArray:
    """Return the (l,) distances (k + 1/2) * spacing below the largest distance of the field [mm].

    Raises:
        UsageError: the spacing is not positive.
        FieldError: no level fits.
    """
    if not 0.0 < spacing < np.inf:
        raise UsageError(f"spacing is {spacing} mm; it must be positive, for example `--spacing 1.0`.")
    count = int(np.ceil(field.maximum / spacing - 0.5))
    if count < 1:
        raise FieldError(
            f"spacing is {spacing:g} mm, but no point of the surface is farther than {field.maximum:.3g} mm from the "
            f"seed: choose a spacing below {2 * field.maximum:.3g} mm."
        )
    return (np.arange(count, dtype=np.float64) + 0.5) * spacing


def linear_edge_length(*, spacing: float) -> float:
    """Return the edge length [mm] at which linear triangles follow level curves a spacing [mm] apart.

    Examples:
        >>> linear_edge_length(spacing=2.0)
        0.5
    """
    return spacing / EDGES_PER_SPACING
