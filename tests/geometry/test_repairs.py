"""Repairs are counted in one value: those of several steps add up, and every kind is said and described."""

from __future__ import annotations

from dataclasses import fields

from geoprint.geometry import Repairs, described

FIRST = Repairs(1, 2, 3, 4, 5, ((1.0, 2.0, 3.0),), 6, 7, 8, ((0.0, 0.5, 0.25),))
LATER = Repairs(welded_vertices=10, debris_places=((4.0, 5.0, 6.0),))


def test_repairs_of_several_steps_add_up() -> None:
    both = FIRST + LATER
    assert both == Repairs(11, 2, 3, 4, 5, ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)), 6, 7, 8, ((0.0, 0.5, 0.25),))
    assert FIRST + Repairs() == Repairs() + FIRST == FIRST


def test_every_kind_of_repair_is_said_with_its_number_and_where_it_matters_its_place() -> None:
    assert FIRST.changes() == (
        "1 vertices joined to others that coincide",
        "2 faces without area dropped",
        "3 duplicate faces dropped",
        "4 vertices that no face uses dropped",
        "5 faces of specks dropped, at (1.00, 2.00, 3.00) mm",
        "6 faces added where vertices lie on edges (T-junctions)",
        "7 faces turned for one winding",
        "8 vertices split where fans of faces touch",
        "1 holes closed, at (0.00, 0.50, 0.25) mm",
    )
    assert Repairs().changes() == ()


def test_the_first_places_are_said_and_how_many_more_there_are() -> None:
    (said,) = Repairs(filled_holes=((0.0, 0.0, 0.0),) * 5).changes()
    assert said == "5 holes closed, at " + ", ".join(["(0.00, 0.00, 0.00) mm"] * 3) + " and 2 more"


def test_every_field_is_described() -> None:
    assert [name for name, _, _ in described(Repairs)] == [field.name for field in fields(Repairs)]
