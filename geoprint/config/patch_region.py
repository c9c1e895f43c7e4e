"""Where a patch lies on its body, as a job states it: about a point, in a box, inside a drawn curve, or named."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, PositiveFloat, model_validator

from geoprint.config.key import Key
from geoprint.config.source import Source
from geoprint.config.strict import Table, Triple

# A line is sought between each two; what is drawn by hand has a few dozens.
MOST_CURVE_POINTS = 500

Cone = Annotated[float, Field(gt=0.0, lt=180.0)]
Corners = Annotated[list[float], Field(min_length=6, max_length=6)]


class PatchRegion(Table):
    """Where a patch lies on its body; what is given holds together: within the radius and within the box.

    A radius [mm] and a cone are about the point `at`. The patch is the side of the curve that holds that point, without
    one the smaller side.
    """

    at: Annotated[
        Triple | None,
        Key(
            "Cut the part out of the file: the piece about the point X Y Z (mm) ...",
            "[0.0, 0.0, 0.0] # point on or near the surface that the patch holds",
        ),
    ] = None
    radius: Annotated[
        PositiveFloat | None,
        Key("... up to this far along the surface in mm ...", "10.0 # up to this far from it along the surface"),
    ] = None
    cone_deg: Annotated[
        Cone | None,
        Key(
            "... and where its normal turns at most this far, in degrees.",
            "30.0 # where the normal turns at most this far from that at the point",
            option="cone",
        ),
    ] = None
    box: Annotated[
        Corners | None,
        Key(
            "Cut the part out of the file by a box: lowest and highest X Y Z in mm.",
            "[-10.0, -10.0, -10.0, 10.0, 10.0, 10.0] # lowest x, y, z and highest x, y, z",
        ),
    ] = None
    curve: Annotated[
        list[Triple] | None,
        Key(
            "Cut the part out of the file along a closed curve: a CSV file x,y,z (mm) of points in order round "
            "it; `--at` says which side, by default the smaller.",
            "[[-8.0, 0.0, 30.0], [8.0, 0.0, 30.0], [0.0, 9.0, 29.0]] # points in order round it, "
            "joined by shortest lines",
        ),
    ] = None
    region: Annotated[
        str | None,
        Key(
            "Cut the part out of the file by a group, object or label of it; `geoprint inspect` lists them.",
            '"anterior" # name that the file gives to some of its faces; `geoprint inspect` lists them',
        ),
    ] = None
    source: Annotated[
        Source | None, Key("", "{ best = true } # what its distance is measured from, as in [source]", option="")
    ] = None

    @model_validator(mode="after")
    def _is_bounded(self) -> Self:
        if self.at is None and (self.radius is not None or self.cone_deg is not None):
            raise ValueError("a radius or a cone needs the point that it is about: give `at` (--at X Y Z) too")
        if all(bound is None for bound in (self.radius, self.cone_deg, self.box, self.curve, self.region)):
            raise ValueError("a patch needs a bound: give a radius, a cone, a box, a curve or a region")
        if self.box is not None and not all(low < high for low, high in zip(self.box[:3], self.box[3:], strict=True)):
            raise ValueError("a box is its lowest x y z and then its highest x y z")
        if self.curve is not None and not 3 <= len(self.curve) <= MOST_CURVE_POINTS:
            raise ValueError(f"a curve has 3 to {MOST_CURVE_POINTS} points, found {len(self.curve)}")
        return self
