"""What was repaired on a mesh, counted once: repairs of several steps add up, and each kind is named in its place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Annotated, Any, final, get_args, get_origin, get_type_hints

from geoprint.model import comparable
from geoprint.surfaces.places import in_words


@final
@comparable
class Repairs:
    """How often each kind of repair was made, and where that matters the place.

    What stands in an annotation is said behind the number wherever a person meets it. Faces without area are those
    before and after welding; a duplicate one has the corners of an earlier one, however it is wound.
    """

    welded_vertices: Annotated[int, "vertices joined to others that coincide"] = 0
    dropped_degenerate_faces: Annotated[int, "faces without area dropped"] = 0
    dropped_duplicate_faces: Annotated[int, "duplicate faces dropped"] = 0
    dropped_unreferenced_vertices: Annotated[int, "vertices that no face uses dropped"] = 0
    dropped_debris_faces: Annotated[int, "faces of specks dropped"] = 0
    debris_places: Annotated[tuple[tuple[float, ...], ...], "a corner of each speck [mm]"] = ()
    junction_faces: Annotated[int, "faces added where vertices lie on edges (T-junctions)"] = 0
    flipped_faces: Annotated[int, "faces turned for one winding"] = 0
    split_vertices: Annotated[int, "vertices split where fans of faces touch"] = 0
    filled_holes: Annotated[tuple[tuple[float, ...], ...], "middle of each hole that was closed [mm]"] = ()

    def __add__(self, later: Repairs) -> Repairs:
        """Return these and later ones as one."""
        return Repairs(*(getattr(self, field.name) + getattr(later, field.name) for field in fields(self)))

    def changes(self) -> tuple[str, ...]:
        """Return a phrase for each kind of change, with its number and where it matters its place."""
        places = {"dropped_debris_faces": f", at {_places(self.debris_places)}"}
        counted = [
            (getattr(self, name), what + places.get(name, "")) for name, kind, what in described(Repairs) if kind is int
        ]
        holes = (len(self.filled_holes), f"holes closed, at {_places(self.filled_holes)}")
        return tuple(f"{count} {what}" for count, what in (*counted, holes) if count)


def described(kind: type) -> Iterator[tuple[str, Any, str]]:
    """Return name, type and description of the fields that have one in their annotation, in their order."""
    for name, hint in get_type_hints(kind, include_extras=True).items():
        if get_origin(hint) is Annotated:
            yield name, *get_args(hint)


def _places(places: tuple[tuple[float, ...], ...]) -> str:
    """Return the first places in words, and how many more there are."""
    shown = ", ".join(in_words(place) for place in places[:3])
    return f"{shown} and {len(places) - 3} more" if len(places) > 3 else shown
