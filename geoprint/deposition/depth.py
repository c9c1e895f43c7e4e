"""Light within the material: how deep a dose cures, and the doses within a stack.

Light falls to 1/e within the penetration depth of the material (Beer and Lambert), and what got its critical dose is
solid [Jacobs1992, ch. 4]. Both are taken to be the same before the cure and after it.
"""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray


def cured_depth(dose: float, *, needed: float, penetration: float) -> float:
    """Return how deep a dose cures the material [mm]: penetration * ln(dose / needed) [Jacobs1992, ch. 4].

    Args:
        dose: at the surface [mJ/cm2].
        needed: that cures the material [mJ/cm2].
        penetration: depth at which 1/e of it is left [mm].

    Returns:
        0 where the dose cures not even the surface.

    Examples:
        >>> round(cured_depth(271.828, needed=100.0, penetration=0.4), 3)
        0.4
    """
    return penetration * max(float(np.log(dose / needed)), 0.0)


def bottom_doses(doses: FloatArray, heights: FloatArray, *, penetration: float) -> tuple[FloatArray, FloatArray]:
    """Return the doses at the bottoms of layers that are laid and lit one upon the other [mJ/cm2].

    Light of the passes for a layer enters at its top and reaches all layers below, weaker with the depth.

    Args:
        doses: (n,) at the top of each layer from its own passes, the lowest first [mJ/cm2].
        heights: (n,) of the layers [mm].
        penetration: depth at which 1/e of it is left [mm].

    Returns:
        (n,) at the bottom of each layer after its own passes, and after those for all layers.

    Examples:
        >>> own, whole = bottom_doses(np.array([100.0, 100.0]), np.array([1.0, 1.0]), penetration=1.0)
        >>> own.round(1), whole.round(1)
        (array([36.8, 36.8]), array([50.3, 36.8]))
    """
    tops = np.cumsum(heights)
    bottoms = tops - heights
    # A row a bottom, a column the passes for a layer; those before the layer itself was laid do not count.
    depths = np.maximum(tops[None, :] - bottoms[:, None], 0.0)
    reaching = np.triu(doses[None, :] * np.exp(-depths / penetration))
    return np.diagonal(reaching).copy(), reaching.sum(axis=1)
