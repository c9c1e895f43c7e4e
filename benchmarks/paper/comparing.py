"""What the paper does with its photographs: edges of each, and Hausdorff distances between them."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from types import MappingProxyType
from typing import final

import numpy as np
from scipy import ndimage

from benchmarks.paper.printing import Printing
from benchmarks.paper.prints import Print, Studio, over_area, prints_of, thickness, unevenness
from geoprint.appraisal import SetDistances, apart, edges
from geoprint.model import BoolArray, FloatArray, frozen

# Table II of the paper [pixels].
PAPER: Mapping[tuple[str, str], float] = MappingProxyType(
    {("A", "B"): 62.2254, ("A", "C"): 72.8354, ("B", "C"): 47.3814}
)
PAPER_ORDER = tuple(sorted(PAPER, key=lambda pair: -PAPER[pair]))
# Edges of fewer pixels, over the outline of a drop as wide as the needle, are grain.
_WHOLE_OUTLINE = np.pi
# Pixels that touch at a corner belong together.
_ROUND = np.ones((3, 3), dtype=np.int64)


@final
@frozen
class Compared:
    """Three prints, analysed as in the paper.

    Attributes:
        prints: A, B and C.
        edges: (h, w) edge image of each.
        distances: of each pair of cases [pixels].
        thickness: mean of each layer over the patch, over the layer that was wanted.
        bare: share of the patch without material.
        unevenness: mean distance of the thickness from the wanted layer, over that.
    """

    prints: tuple[Print, ...]
    edges: tuple[BoolArray, ...]
    distances: Mapping[tuple[str, str], SetDistances]
    thickness: tuple[float, ...]
    bare: tuple[float, ...]
    unevenness: tuple[float, ...]

    @property
    def order(self) -> tuple[tuple[str, str], ...]:
        """Pairs of cases, the farthest apart first."""
        return tuple(sorted(self.distances, key=lambda pair: -self.distances[pair].hausdorff))

    @property
    def as_paper(self) -> bool:
        """Whether d(A, C) > d(A, B) > d(B, C), each by more than nothing."""
        sizes = [self.distances[pair].hausdorff for pair in PAPER_ORDER]
        return all(larger > smaller for larger, smaller in pairwise(sizes))

    @property
    def best(self) -> str:
        """The case whose layer is nearest to the wanted one."""
        return self.prints[int(np.argmin(self.unevenness))].case.name


def compared(studio: Studio, printing: Printing, *, seed: int) -> Compared:
    """Print, photograph and compare the three cases.

    Args:
        studio: what is planned, and the camera.
        printing: how it is laid and photographed.
        seed: of every noise.

    Raises:
        InputError: a photograph is of one colour.
    """
    prints = prints_of(studio, printing, seed=seed)
    width = printing.scale * prints[0].case.cell.tool.inner_diameter
    shown = tuple(edge_image(each.grey, width=width) for each in prints)
    named = {each.case.name: picture for each, picture in zip(prints, shown, strict=True)}
    angle = np.radians(printing.angle_deg)
    layers = [each.case.cell.process.layer_height for each in prints]
    laid = [thickness(studio.patch, each.beads, angle=angle) for each in prints]
    return Compared(
        prints=prints,
        edges=shown,
        distances={(one, other): apart(_pixels(named[one]), _pixels(named[other])) for one, other in PAPER},
        thickness=tuple(over_area(studio.patch, each) / layer for each, layer in zip(laid, layers, strict=True)),
        bare=tuple(over_area(studio.patch, (each == 0.0).astype(np.float64)) for each in laid),
        unevenness=tuple(unevenness(studio.patch, each, layer=layer) for each, layer in zip(laid, layers, strict=True)),
    )


def edge_image(grey: FloatArray, *, width: float) -> BoolArray:
    """Return the edges of a photograph as in the paper: G(I) of the remapped picture, threshold, clean-up.

    Args:
        grey: (h, w).
        width: of the needle's inside in the picture [pixels], known before anything is printed and the same for all.

    Raises:
        InputError: the picture is of one colour.
    """
    found = edges(grey, width=width)
    labels, count = ndimage.label(found, structure=_ROUND)
    sizes = ndimage.sum_labels(found, labels, np.arange(count + 1))
    return np.asarray(found & (sizes >= _WHOLE_OUTLINE * width)[labels])


def _pixels(shown: BoolArray) -> FloatArray:
    """Return the (n, 2) pixels (u, v) of an edge image."""
    rows, columns = np.nonzero(shown)
    return np.column_stack([columns, rows]).astype(np.float64)
