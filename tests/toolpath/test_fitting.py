"""The middle on shapes of known width: every bead lies at its share of it, on the ridge itself where they are odd."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.distance import BACKENDS
from geoprint.errors import UsageError
from geoprint.geometry import boundary_seed, positions
from geoprint.model import FloatArray, Strokes, Surface
from geoprint.toolpath import PATTERNS
from tests.meshes import annulus, disc, plate

INNER = 10.0


def strokes(surface: Surface, *, middle: str, spacing: float = 1.0) -> Strokes:
    backend = BACKENDS["fast-marching"](surface)
    return PATTERNS["contours"](middle=middle).strokes(
        surface, boundary_seed(surface), backend=backend, spacing=spacing
    )


def radii(drawn: Strokes, surface: Surface) -> list[FloatArray]:
    places = positions(surface, drawn.curves.points)
    return np.split(np.linalg.norm(places, axis=1), drawn.curves.offsets[1:-1])


@pytest.mark.parametrize(
    ("width", "beads"),
    [
        # Three level curves on either side leave 0.9 spacings to the ridge: one bead more lies on it.
        (6.8, 7),
        # Four on either side leave 0.2 spacings: the two innermost become one.
        (7.4, 7),
        # Four leave 0.3 spacings: they only move.
        (7.6, 8),
        (8.4, 8),
    ],
)
def test_beads_share_the_width_of_a_ring(width: float, beads: int) -> None:
    ring = annulus(inner=INNER, outer=INNER + width, divisions=(180, 28))
    drawn = strokes(ring, middle="fitted")
    found = sorted(float(line.mean()) for line in radii(drawn, ring))
    wanted = INNER + (np.arange(beads) + 0.5) * width / beads
    np.testing.assert_allclose(found, wanted, atol=0.02)
    assert max(float(np.ptp(line)) for line in radii(drawn, ring)) < 0.05
    assert drawn.curves.closed.all()
    # On either side levels count inwards; a bead on the ridge has the level that it would have there.
    assert sorted(drawn.levels.tolist()) == sorted(min(bead, beads - 1 - bead) for bead in range(beads))


def test_contours_are_plain_unless_the_middle_is_fitted() -> None:
    ring = annulus(inner=INNER, outer=INNER + 6.8, divisions=(180, 28))
    drawn = strokes(ring, middle="plain")
    assert drawn.curves.count == 6
    np.testing.assert_allclose(
        sorted(float(line.mean()) for line in radii(drawn, ring)), [10.5, 11.5, 12.5, 14.3, 15.3, 16.3], atol=0.01
    )


def test_contours_stay_as_they_were_traced_where_a_whole_number_fits() -> None:
    round_part = disc(radius=10.0, rings=30)
    plain, fitted = (strokes(round_part, middle=middle) for middle in ("plain", "fitted"))
    assert fitted.curves.count == plain.curves.count
    for before, after in zip(radii(plain, round_part), radii(fitted, round_part), strict=True):
        assert after.mean() == pytest.approx(before.mean(), abs=0.12)


def test_tips_of_square_corners_reach_outwards_and_those_beside_the_rim_stay() -> None:
    square = plate((12.4, 12.4), (40, 40))
    plain, fitted = (strokes(square, middle=middle) for middle in ("plain", "fitted"))
    for level, reach in ((0, 0.0), (1, 0.086), (2, 0.086)):
        tips: list[float] = []
        for drawn in (plain, fitted):
            places = positions(square, drawn.curves.points)
            which = np.flatnonzero(drawn.levels == level)[0]
            line = places[slice(*drawn.curves.offsets[which : which + 2])]
            tips.append(float(np.linalg.norm(line[:, :2], axis=1).min()))
        # From the corner at the origin: half of a right angle, (1 - 0.55 (1 + sin 45)) / sin 45 = 0.086 spacings.
        assert tips[0] - tips[1] == pytest.approx(reach, abs=0.035), level


def test_an_unknown_middle_is_refused() -> None:
    with pytest.raises(UsageError, match="no middle 'wide'; choose one of: plain, fitted"):
        PATTERNS["contours"](middle="wide")
