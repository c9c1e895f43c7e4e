"""Which side of the part is printed on: that of the file's winding, unless the body that it lies on tells another."""

from __future__ import annotations

import numpy as np

from geoprint.errors import MeshError
from geoprint.model import Surface
from geoprint.results import Side
from geoprint.surfaces import boundary_half_edges, closest, face_areas, face_normals, turned_over
from geoprint.surfaces.repair import prepare

# The body tells the side where at least this share of the part's area agrees; between, it tells nothing.
TELLING_SHARE = 0.9


def printed_side(part: Surface, body: Surface | None, *, flip: bool) -> tuple[Surface, Side]:
    """Decide which side is printed on, and turn the part where the body tells that it is inside out.

    Args:
        part: as prepared, turned already where `flip` says so.
        body: what it lies on; only a closed one tells its outside.
        flip: whether the user turned the file's winding; then the body only warns.

    Returns:
        The part, and how its side was found.
    """
    if boundary_half_edges(part.faces).size == 0:
        return part, Side("closed", flip, None, "printed on the outside of a closed surface.")
    agreeing = None if body is None else _agreeing(part, body)
    source = "flip" if flip else "winding"
    told = "the side to which `--flip` turned it" if flip else "the side that the file's winding calls outside"
    if agreeing is None:
        way = "leave `--flip` out for the other" if flip else "`--flip` turns it"
        return part, Side(source, flip, None, f"printed on {told}; {way}.")
    name = body.name if body is not None else ""
    if agreeing >= TELLING_SHARE:
        sentence = f"printed on the side that faces out of {name} ({agreeing:.0%} of it)."
        return part, Side("body", flip, agreeing, sentence)
    share = f"{1 - agreeing:.0%} of it faces into {name}"
    if agreeing > 1 - TELLING_SHARE or flip:
        return part, Side(source, flip, agreeing, f"printed on {told}, but {share}: check the side.")
    sentence = f"turned: as the file is wound, {share}; printed on the other side."
    return turned_over(part), Side(source="body", turned=True, agreeing=1 - agreeing, sentence=sentence)


def _agreeing(part: Surface, body: Surface) -> float | None:
    """Return the share of the part's area whose normal is within 90 degrees of the body's below it."""
    try:
        outward, _ = prepare(body)
    except MeshError:
        return None
    if boundary_half_edges(outward.faces).size:
        return None
    below, _ = closest(outward, part.vertices[part.faces].mean(axis=1))
    along = np.einsum("mx,mx->m", face_normals(outward)[below.faces], face_normals(part))
    areas = face_areas(part)
    return float(areas[along > 0].sum() / areas.sum())
