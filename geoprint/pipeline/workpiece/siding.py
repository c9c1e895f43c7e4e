"""Which side of a part is printed on: as the file winds it, unless the body that the part lies on tells otherwise."""

from __future__ import annotations

import numpy as np

from geoprint.errors import MeshError
from geoprint.model import Surface
from geoprint.results import Side
from geoprint.surfaces import (
    boundary_half_edges,
    closest,
    face_areas,
    face_normals,
    signed_volume,
    turned_over,
)
from geoprint.surfaces.repair import prepare

# A patch bulges, or is hollow, where the volume of the cone from its middle is beyond this share of area times size: a
# cap of a ball that is as high as a fiftieth of its width.
LEAST_BULGE = 0.004
# The body tells the side where at least this share of the part's area agrees; between, it tells nothing.
TELLING_SHARE = 0.9


def printed_side(
    part: Surface, body: Surface | None, *, flip: bool, filed: Surface | None = None
) -> tuple[Surface, Side]:
    """Decide which side is printed on, and turn the part where the body tells that it is inside out.

    Args:
        part: as prepared, turned already where `flip` says so.
        body: what it lies on; only a closed one tells its outside.
        flip: whether the user turned the file's winding; then the body only warns.
        filed: the body as its file winds it, or the part where there is no body; None where nobody knows.

    Returns:
        The part, and how its side was found.
    """
    if boundary_half_edges(part.faces).size == 0:
        where = "inside of a closed surface, as `--flip` asks" if flip else "outside of a closed surface"
        return part, Side("closed", flip, None, f"printed on the {where}.{_also(filed)}")
    agreeing = None if body is None else _agreeing(part, body)
    source = "flip" if flip else "winding"
    told = "the side to which `--flip` turned it" if flip else "the side that the file's winding calls outside"
    if agreeing is None:
        other = "leave `--flip` out for the other" if flip else "`--flip` turns it"
        return part, Side(
            source, flip, None, f"printed on {told}, {shape_in_words(part)}; {other}, a closed `--body` decides."
        )
    name = body.name if body is not None else ""
    if agreeing >= TELLING_SHARE:
        sentence = f"printed on the side that faces out of {name} ({agreeing:.0%} of it).{_also(filed)}"
        return part, Side("body", flip, agreeing, sentence)
    share = f"{1 - agreeing:.0%} of it faces into {name}"
    if agreeing > 1 - TELLING_SHARE or flip:
        return part, Side(source, flip, agreeing, f"printed on {told}, but {share}: check the side.")
    sentence = f"turned: as the file is wound, {share}; printed on the other side.{_also(filed)}"
    return turned_over(part), Side(source="body", turned=True, agreeing=1 - agreeing, sentence=sentence)


def shape_in_words(part: Surface) -> str:
    """Return what the shape tells of the side of an open patch: parts bulge out of what they are of, if they curve."""
    size = float(np.linalg.norm(np.ptp(part.vertices, axis=0)))
    bulge = signed_volume(part) / (size * float(face_areas(part).sum()))
    if bulge < -LEAST_BULGE:
        return "which is hollow: is the file mirrored, or are its faces flipped? Nothing else can tell"
    kind = "which bulges" if bulge > LEAST_BULGE else "which neither bulges nor is hollow"
    return f"{kind}; nothing else can tell, since an open patch encloses nothing"


def _also(filed: Surface | None) -> str:
    """Return a sentence where the file of a closed body is inside out."""
    words = "" if filed is None else inverted_in_words(filed)
    return f" But {words}" if words else ""


def inverted_in_words(filed: Surface) -> str:
    """Return what is to be said of a closed file whose faces look inward; nothing where they do not."""
    volume = signed_volume(filed) / 1000.0
    if volume >= 0.0:
        return ""
    return (
        f"the volume of {filed.name} is {volume:.3g} cm3, as its faces are wound: they are all flipped, which is "
        "corrected, or it is mirrored, which is not: is left where it should be? Else export it again."
    )


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
