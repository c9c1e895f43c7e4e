"""What to plan, as the command line or a program asks for it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, PositiveFloat, PositiveInt, model_validator

from geoprint.config.strict import Rounds, Table, Triple
from geoprint.model import OnSlowdown

# A line is sought between each two; what is drawn by hand has a few dozens.
MOST_CURVE_POINTS = 500
# Each is held against each other one.
MOST_PATCHES = 100
# Paths nearer together than this [mm] are a typing error: every needle is hundreds of times as wide.
LEAST_SPACING = 1e-3


class PatchRegion(Table):
    """Where a patch lies on its body; what is given holds together: within the radius and within the box.

    Attributes:
        at: point [mm] on or near the body that the patch holds; with it
        radius: greatest distance from the point along the surface [mm]; and
        cone_deg: greatest angle between the surface's normal and that at the point [degrees].
        box: lowest x, y, z and highest x, y, z [mm].
        curve: points [mm] on or near the body, in order round the patch, joined by the shortest lines over it; the
            patch is the side that holds the point, without one the smaller side.
        region: name that the body's file gives to some of its faces.
    """

    at: Triple | None = None
    radius: PositiveFloat | None = None
    cone_deg: Annotated[float, Field(gt=0.0, lt=180.0)] | None = None
    box: Annotated[list[float], Field(min_length=6, max_length=6)] | None = None
    curve: list[Triple] | None = None
    region: str | None = None

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


class Job(Table):
    """What to plan, as the command line or a program asks for it.

    Attributes:
        surface: mesh file of the part.
        unit: length unit of the file, None where the file carries it.
        flip: whether the file's winding is turned, so that the other side is printed.
        backend: name of the planning backend.
        pattern: name of how strokes cover the part.
        resolution: pixels along the longer side of the raster of a backend that has one.
        options: by the name of a backend or a pattern, its options by their names.
        spacing: distance between neighbouring paths [mm]; or
        rounds: number of levels between the seed and the farthest point.
        seed: point [mm] from which distance is measured, instead of the border.
        body: mesh file of what the part lies on, in the same coordinates and unit.
        cell: cell file; a packaged one if not given.
        place: "demo" puts the part over the pedestal; without it the cell must be calibrated.
        robot: whether the robot's chain is planned too.
        label: of a label volume, which one is the part or its body.
        patches: where on the surface the part lies, which is cut from it, one or several that are printed one after
            another; the whole surface if not given.
        max_tilt: largest angle between nozzle and surface normal on deposit [degrees].
        on_slowdown: where joints cannot hold the speed: "lower" it for the run, or let the flow "follow".
        fill_holes: holes whose border is up to this long are closed [mm]; only missing triangles if not given.
    """

    surface: Path
    unit: Literal["mm", "cm", "m", "um", "in"] | None = None
    flip: bool = False
    backend: str = "heat"
    pattern: str = "contours"
    resolution: PositiveInt | None = None
    options: dict[str, dict[str, bool | int | float | str]] = Field(default={})
    spacing: Annotated[float, Field(ge=LEAST_SPACING)] | None = None
    rounds: Rounds | None = None
    seed: Triple | None = None
    body: Path | None = None
    cell: Path | None = None
    place: Literal["demo"] | None = None
    robot: bool = True
    label: PositiveInt | None = None
    patches: Annotated[list[PatchRegion], Field(max_length=MOST_PATCHES)] = Field(default=[])
    max_tilt: Annotated[float, Field(ge=0.0, le=45.0)] = 15.0
    on_slowdown: OnSlowdown = "lower"
    fill_holes: PositiveFloat | None = None

    @model_validator(mode="after")
    def _one_of_spacing_and_rounds(self) -> Self:
        if self.spacing is not None and self.rounds is not None:
            raise ValueError("give either spacing or rounds, not both: each follows from the other")
        return self

    @model_validator(mode="after")
    def _no_seed_for_several_patches(self) -> Self:
        if self.seed is not None and len(self.patches) > 1:
            raise ValueError(
                "a seed lies on one patch; several patches are each covered from their border: leave it out"
            )
        return self
