"""Field files: which lines fibres follow, as a person writes it.

Either what a field of lines has and leans to, which is the smoothest then, or lines at one angle about an axis.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, PositiveFloat, ValidationError, model_validator

from geoprint.config.strict import Table, Triple, describe, line_of, parsed_toml, text_of
from geoprint.errors import UsageError

# A line turns by half turns; more than four whole ones about a vertex are no field that anybody draws.
MOST_TURNS = 4.0
# As many as a person writes, and points of one stroke.
MOST_TABLES, MOST_POINTS = 100, 500
Index = Annotated[float, Field(ge=-MOST_TURNS, le=MOST_TURNS, multiple_of=0.5)]
HelixAngle = Annotated[float, Field(ge=-90.0, le=90.0)]
# More than a whole turn, through all layers or a mm of them, is a typing error.
TurnAngle = Annotated[float, Field(ge=-360.0, le=360.0)]

FIELD_EXAMPLE = """\
# What fibres follow: `geoprint plan PART --pattern fibres --field field.toml`. A field of lines, as smooth as what is
# said here lets it be. Lengths in mm, places in the part's coordinates, angles in degrees.

# What lines lean to, one table each: one of rim, direction, curvature and stroke. A weight of a few lets them lean,
# hundreds let them follow as far as singularities do; left out it is 100 for rim and stroke, and 10 else.
[[preferences]]
rim = true                  # along the rim
weight = 100.0

# [[preferences]]
# direction = [1.0, 0.0, 0.0] # as it falls onto the surface
# weight = 10.0

# [[preferences]]
# curvature = "smallest"    # along the smallest or the largest curvature: along a tube, or around it
# weight = 10.0

# [[preferences]]
# stroke = [[-8.0, 0.0, 30.0], [8.0, 0.0, 30.0]] # points on the surface, from one to the next
# weight = 100.0

# Around which places lines turn, and how often: 1 where they circle, 0.5 around the end of a fold, -0.5 where three
# folds meet. On a closed part the indices add up to its Euler characteristic. Without any the field has its own.
# [[singularities]]
# place = [0.0, 0.0, 30.0]
# index = 1.0

# Instead of all of these: lines at one angle to the direction around an axis, positive where they rise to the right
# for who looks at the part from outside with the axis up.
# [helix]
# axis = [0.0, 0.0, 1.0]    # from apex to base
# angle = 30.0

# Over a thickness every layer has the lines of the part itself, carried there. Here they turn on the way,
# counter-clockwise for who looks at the part from outside: from the part to the outermost layer by these angles, or
# by so many degrees each mm, as turn_deg_per_mm = 12.0 alone.
# [through]
# inner_deg = 60.0            # at the part
# outer_deg = -60.0           # where the layers end
"""


class SingularityTable(Table):
    """A place around which lines turn, and how often."""

    place: Triple
    index: Index


class PreferenceTable(Table):
    """What lines lean to, and how much; one of these is given."""

    rim: Literal[True] | None = None
    direction: Triple | None = None
    curvature: Literal["smallest", "largest"] | None = None
    stroke: Annotated[list[Triple] | None, Field(min_length=2, max_length=MOST_POINTS)] = None
    weight: PositiveFloat | None = None

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        given = [name for name, value in self if value is not None and name != "weight"]
        if len(given) != 1:
            found = " and ".join(given) if given else "none"
            raise ValueError(f"a preference is one of rim, direction, curvature and stroke, found {found}")
        if self.direction is not None and not any(self.direction):
            raise ValueError("a direction must have a length; [1.0, 0.0, 0.0] is the part's x axis")
        return self


class HelixTable(Table):
    """Lines at one angle to the direction around an axis."""

    axis: Triple
    angle: HelixAngle

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        if not any(self.axis):
            raise ValueError("an axis must have a length; [0.0, 0.0, 1.0] is the part's z axis")
        return self


class ThroughTable(Table):
    """How lines turn from layer to layer; either so much each mm, or from one angle to another."""

    turn_deg_per_mm: TurnAngle | None = None
    inner_deg: TurnAngle | None = None
    outer_deg: TurnAngle | None = None

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        given = [name for name, value in self if value is not None]
        if given not in (["turn_deg_per_mm"], ["inner_deg", "outer_deg"]):
            found = " and ".join(given) if given else "none"
            raise ValueError(f"lines turn by turn_deg_per_mm, or from inner_deg to outer_deg, found {found}")
        return self


class FieldFile(Table):
    """The lines that fibres follow."""

    preferences: Annotated[list[PreferenceTable], Field(max_length=MOST_TABLES)] = Field(default=[])
    singularities: Annotated[list[SingularityTable], Field(max_length=MOST_TABLES)] = Field(default=[])
    helix: HelixTable | None = None
    through: ThroughTable | None = None

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        designed = bool(self.preferences or self.singularities)
        if designed and self.helix is not None:
            raise ValueError("a helix says every line: leave out the preferences and singularities, or the helix")
        if not designed and self.helix is None:
            raise ValueError("it says no line: give a preference, a singularity or a helix")
        return self


def field_text(path: Path | str) -> str:
    """Return the text of a field file.

    Raises:
        UsageError: it is missing or cannot be read.
    """
    try:
        return text_of(Path(path))
    except (OSError, ValueError) as error:
        raise UsageError(f"the field file {path} cannot be read ({error}); `geoprint init` writes one.") from error


def read_field(path: Path | str) -> FieldFile:
    """Read and validate a field file.

    Raises:
        UsageError: it is missing, not TOML, or has an unknown, missing or meaningless key; the sentence names the line.
    """
    text, name = field_text(path), Path(path).name
    try:
        return FieldFile.model_validate(parsed_toml(text, name=name))
    except ValidationError as error:
        where = line_of(error, text, name=name)
        raise UsageError(f"{where}: {describe(error)}; `geoprint init` writes a commented field.toml.") from error
