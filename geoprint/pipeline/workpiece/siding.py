"""Which side of a part is printed on: as the file winds it, unless the body that the part lies on tells otherwise."""

from __future__ import annotations

import numpy as np

from geoprint.errors import MeshError
from geoprint.model import Surface
from geoprint.results import Side
from geoprint.surfaces import (
    boundary_half_edges,
    closest_once,
    encloses,
    face_areas,
    face_normals,
    part_of,
    signed_volume,
    turned_over,
)
from geoprint.surfaces.repair import prepare, stays_open

# A patch bulges, or is hollow, where the volume of the cone from its middle is beyond this share of area times size: a
# cap of a ball that is as high as a fiftieth of its width.
LEAST_BULGE = 0.004
# The body tells the side where at least this share of the part's area agrees; between, it tells nothing.
TELLING_SHARE = 0.9


def printed_side(
    part: Surface,
    body: Surface | None,
    *,
    flip: bool,
    filed: Surface | None = None,
    cut: bool = False,
) -> tuple[Surface, Side]:
    """Decide which side is printed on, and turn the part where the body tells that it is inside out.

    Args:
        part: as prepared, turned already where `flip` says so.
        body: what it lies on; only a closed one tells its outside.
        flip: whether the user turned the file's winding; then the body only warns.
        filed: the body as its file winds it, or the part where there is no body; None where nobody knows.
        cut: whether the part was cut from the body, which is then joined already, and sound where the part lies.

    Returns:
        The part, and how its side was found.
    """
    if boundary_half_edges(part.faces).size == 0:
        where = "inside of a closed surface, as `--flip` asks" if flip else "outside of a closed surface"
        return part, Side("closed", flip, None, f"printed on the {where}.{_also(filed)}")
    agreeing = None if body is None else _agreeing(part, body, cut=cut)
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


def _agreeing(part: Surface, body: Surface, *, cut: bool) -> float | None:
    """Return the share of the part's area whose normal is within 90 degrees of the body's below it."""
    outward = _outward(body, cut=cut)
    if outward is None:
        return None
    middles = part.vertices[part.faces].mean(axis=1)
    below, _ = closest_once(outward, middles)
    under = part_of(outward, np.isin(np.arange(len(outward.faces)), below.faces))
    rank = np.searchsorted(np.unique(below.faces), below.faces)
    along = np.einsum("mx,mx->m", face_normals(under)[rank], face_normals(part))
    areas = face_areas(part)
    return float(areas[along > 0].sum() / areas.sum())


def _outward(body: Surface, *, cut: bool) -> Surface | None:
    """Return a body with its faces outward; None where it is open or cannot be prepared.

    What a part was cut from is not looked at for crossings, which far from the part do no harm, and where it stays
    open nothing is prepared.
    """
    if cut and encloses(body.faces):
        return body if signed_volume(body) > 0 else turned_over(body)
    try:
        if cut and stays_open(body):
            return None
        outward, _ = prepare(body)
    except MeshError:
        return None
    return None if boundary_half_edges(outward.faces).size else outward
