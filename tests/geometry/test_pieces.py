"""Surfaces in several pieces: what is put together comes apart again, and curves keep their places."""

from __future__ import annotations

import numpy as np

from geoprint.geometry import all_curves, boundary_seed, middle_of, pieces, positions, some_curves, united
from geoprint.model import Surface, SurfaceCurves
from tests.meshes import annulus, disc, plate


def moved(surface: Surface, along: float) -> Surface:
    return Surface(surface.vertices + np.array([along, 0.0, 0.0]), surface.faces, name=surface.name)


PARTS = (plate(), moved(annulus(), 100.0), moved(disc(), 200.0))


def test_what_is_put_together_comes_apart_in_the_same_order() -> None:
    whole = united(PARTS)
    for part, piece in zip(PARTS, pieces(whole), strict=True):
        assert np.array_equal(piece.surface.faces, part.faces)
        assert np.array_equal(piece.surface.vertices, part.vertices)
        assert np.array_equal(whole.vertices[piece.vertices], part.vertices)
    assert whole.name == "plate"


def test_one_piece_is_the_surface_itself() -> None:
    surface = plate()
    assert united([surface]) is surface
    assert pieces(surface)[0].surface is surface


def test_pieces_whose_faces_are_mixed_come_apart_too() -> None:
    whole = united(PARTS)
    mixed = Surface(whole.vertices, whole.faces[np.random.default_rng(1).permutation(len(whole.faces))])
    for piece in pieces(mixed):
        assert np.array_equal(mixed.vertices[mixed.faces[piece.faces]], piece.surface.vertices[piece.surface.faces])


def places(surface: Surface, curves: SurfaceCurves) -> list[list[list[float]]]:
    at = positions(surface, curves.points)
    return [at[a:b].tolist() for a, b in zip(curves.offsets[:-1], curves.offsets[1:], strict=True)]


def test_curves_keep_their_places_on_a_piece_and_back_on_the_whole() -> None:
    whole = united(PARTS)
    curves = boundary_seed(whole).curves
    found = pieces(whole)
    assert [int(piece.holds(curves).sum()) for piece in found] == [1, 2, 1]
    for piece in found:
        own = piece.own(curves)
        assert places(piece.surface, own) == places(whole, piece.on_whole(own))
    back = all_curves([piece.on_whole(piece.own(curves)) for piece in found])
    assert sorted(places(whole, back)) == sorted(places(whole, curves))
    assert back.closed.all()


def test_curves_are_taken_in_the_order_asked_for() -> None:
    whole = united(PARTS)
    curves = boundary_seed(whole).curves
    taken = some_curves(curves, np.array([2, 0]))
    assert places(whole, taken) == [places(whole, curves)[2], places(whole, curves)[0]]
    assert some_curves(curves, np.array([], dtype=np.int64)).count == 0


def test_the_middle_of_a_surface_lies_on_it() -> None:
    ring = annulus()
    assert (ring.vertices == middle_of(ring)).all(axis=1).any()
    assert np.allclose(middle_of(disc()), 0.0)
