"""What lies below a layer, with something on it that should not be there, or higher than it should be."""

from __future__ import annotations

from geoprint.layers import layer_level, with_sides
from geoprint.model import Surface
from geoprint.results import Plan
from geoprint.surfaces import united


def with_lump(ground: Surface, lump: Surface) -> Surface:
    """Return what is printed below a layer with a lump of the same material."""
    return united([ground, lump])


def raised_layers(planned: Plan, *, by: float) -> Surface:
    """Return what is printed below a planned layer as it would be if all of it were higher [mm].

    The tip goes over the true one at its stand-off, along the normal: raised by that and a depth more, it goes through.
    """
    place, ground = planned.workpiece.place, planned.workpiece.ground
    assert place is not None
    level = layer_level(place.base, place.bottom + by, height=place.height)
    found = with_sides(place.base, level)
    return Surface(found.vertices, found.faces, ground.name)
