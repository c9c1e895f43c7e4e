"""How long edges may be for a distance that is linear in each triangle: the same rule for every backend with one."""

from __future__ import annotations

# A distance that is linear in each triangle follows a curved front to a per cent of a spacing.
EDGES_PER_SPACING = 4


def linear_edge_length(*, spacing: float) -> float:
    """Return the edge length [mm] at which linear triangles follow level curves a spacing [mm] apart.

    Examples:
        >>> linear_edge_length(spacing=2.0)
        0.5
    """
    return spacing / EDGES_PER_SPACING
