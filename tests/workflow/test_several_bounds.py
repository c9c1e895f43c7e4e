"""How far patches may reach over each other, measured on rectangles whose overlap is known by construction."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.geometry import edge_lengths, united
from geoprint.model import Surface
from geoprint.results import Patch
from geoprint.workflow.patches import _common_body, _deepest, _refuse_overlaps  # pyright: ignore[reportPrivateUsage]
from tests.meshes import plate, sphere

# Edges of 1 mm, and of 10 mm.
FINE = plate((6.0, 3.0), (6, 3))
COARSE = plate((60.0, 30.0), (6, 3))


def moved(surface: Surface, x: float, y: float = 0.0, z: float = 0.0) -> Surface:
    return Surface(surface.vertices + np.array([x, y, z]), surface.faces)


def patches(*surfaces: Surface) -> Sequence[Patch]:
    """Patches as far as it matters here: their surfaces, which are also what they were cut from."""
    return cast("Sequence[Patch]", [SimpleNamespace(surface=each, body=each) for each in surfaces])


@pytest.mark.parametrize("overlap", [0.05, 0.5, 3.0])
def test_how_far_one_reaches_over_the_rim_of_another_is_as_it_was_laid(overlap: float) -> None:
    depth, place = _deepest(COARSE, moved(COARSE, 60.0 - overlap), near=0.1)
    assert depth == pytest.approx(overlap, abs=1e-9)
    assert place[0] == 60.0


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    ("one", "other", "allowed"),
    [
        # A tenth of the mean edge, of the coarser patch: less than 0.1 mm only where the triangles are small.
        (plate((0.6, 0.3), (6, 3)), plate((0.6, 0.3), (6, 3)), 0.1),
        (COARSE, COARSE, 1.118),
        (COARSE, plate((60.0, 30.0), (60, 30)), 1.118),
    ],
)
def test_patches_may_overlap_by_a_tenth_of_a_millimetre_or_of_an_edge(
    one: Surface, other: Surface, allowed: float, turned: object
) -> None:
    width = float(one.vertices[:, 0].max())
    assert allowed == pytest.approx(max(0.1, 0.1 * float(edge_lengths(one).mean())), abs=1e-3)

    def pair(overlap: float) -> Sequence[Patch]:
        beside = moved(other, width - overlap)
        return patches(beside, one) if turned else patches(one, beside)

    _refuse_overlaps(pair(0.99 * allowed))
    with pytest.raises(InputError, match="patches 1 and 2 overlap at") as caught:
        _refuse_overlaps(pair(1.01 * allowed))
    assert caught.value.details["depth"] == pytest.approx(1.01 * allowed, rel=1e-6)
    assert f"allowed are {allowed:.2g} mm" in str(caught.value)


def test_of_three_patches_the_two_that_overlap_are_named() -> None:
    with pytest.raises(InputError, match=r"patches 2 and 3 overlap at .* inside the rim of patch [23]"):
        _refuse_overlaps(patches(moved(FINE, 0.0, 50.0), FINE, moved(FINE, 4.0)))
    _refuse_overlaps(patches(moved(FINE, 0.0, 50.0), FINE, moved(FINE, 6.0)))


def test_a_small_patch_within_a_large_one_is_found_whichever_comes_first() -> None:
    """No point of the large one need lie on the small one."""
    small = moved(plate((2.0, 2.0), (2, 2)), 24.0, 14.0)
    for pair in (patches(COARSE, small), patches(small, COARSE)):
        with pytest.raises(InputError, match="overlap at"):
            _refuse_overlaps(pair)


def test_patches_above_one_another_are_apart_from_as_far_as_they_may_overlap() -> None:
    assert _deepest(COARSE, moved(COARSE, 0.0, 0.0, 0.4), near=0.41)[0] == pytest.approx(15.0, abs=0.01)
    assert _deepest(COARSE, moved(COARSE, 0.0, 0.0, 0.4), near=0.39)[0] == 0.0
    assert _deepest(COARSE, moved(COARSE, 0.0, 0.0, -0.4), near=0.41)[0] == pytest.approx(15.0, abs=0.01)
    assert _deepest(COARSE, moved(COARSE, 0.0, 0.0, -0.4), near=0.39)[0] == 0.0
    _refuse_overlaps(patches(COARSE, moved(COARSE, 0.0, 0.0, 1.12)))
    with pytest.raises(InputError, match="overlap at"):
        _refuse_overlaps(patches(COARSE, moved(COARSE, 0.0, 0.0, 1.11)))


def test_all_that_lies_on_a_closed_surface_lies_inside() -> None:
    ball = sphere(radius=20.0, subdivisions=2)
    with pytest.raises(InputError, match=r"patches 1 and 2 overlap at .* inf mm inside the rim"):
        _refuse_overlaps(patches(ball, ball))
    _refuse_overlaps(patches(ball, moved(ball, 45.0)))


def test_what_patches_were_cut_from_is_there_once() -> None:
    far = moved(COARSE, 100.0)
    whole = united([COARSE, far])
    assert len(_common_body(patches(COARSE, COARSE)).faces) == len(COARSE.faces)
    assert len(_common_body(patches(COARSE, far)).faces) == 2 * len(COARSE.faces)
    assert len(_common_body(patches(COARSE, whole, far)).faces) == 2 * len(COARSE.faces)


def test_pieces_that_touch_at_a_corner_are_two() -> None:
    touching = [COARSE, moved(COARSE, 60.0, 30.0), moved(COARSE, -60.0, -30.0), moved(COARSE, 60.0, -30.0)]
    assert len(_common_body(patches(*touching)).faces) == 4 * len(COARSE.faces)
    assert len(_common_body(patches(*touching[::-1])).faces) == 4 * len(COARSE.faces)
