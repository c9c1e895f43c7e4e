"""Field files: which lines fibres follow, as a person writes it.

Either what a field of lines has and leans to, which is the smoothest then, or lines at one angle about an axis, or the
fibres of a ventricle's wall.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, PositiveFloat, PositiveInt, ValidationError, model_validator

from geoprint.config.strict import Table, Triple, describe, line_of, parsed_toml, text_of
from geoprint.errors import UsageError

# A line turns by half turns; more than four whole ones about a vertex are no field that anybody draws.
MOST_TURNS = 4.0
# As many as a person writes, and points of one stroke.
MOST_TABLES, MOST_POINTS = 100, 500
Index = Annotated[float, Field(ge=-MOST_TURNS, le=MOST_TURNS, multiple_of=0.5)]
Labels = Annotated[list[PositiveInt], Field(min_length=1, max_length=MOST_TABLES)]
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

# Over a thickness every layer has the lines of the part itself, carried there. Here they turn meanwhile,
# counter-clockwise for who looks at the part from outside: from the part to the outermost layer by these angles, or
# by so many degrees each mm, as turn_deg_per_mm = 12.0 alone.
# [through]
# inner_deg = 60.0            # at the part
# outer_deg = -60.0           # where the layers end

# Instead of all of the above: the fibres of a ventricle's wall, on surfaces within it and layers through it, from the
# labels of a volume in the part's coordinates. The helix angle goes from that of the outside to that at the cavity.
# [wall]
# volume = "heart.nii.gz"     # beside this file; .nii, .nii.gz, .nrrd or .dcm
# labels = [1, 7]             # of the wall
# cavity = [11]               # of the blood in it
# base = [3, 5]               # of what is beyond its base; the apex is the part of the wall that is farthest from that
# epicardial_deg = -60.0      # outside
# endocardial_deg = 60.0      # at the cavity
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


class WallTable(Table):
    """The fibres of a ventricle's wall, which labels say."""

    volume: Annotated[str, Field(min_length=1)]
    labels: Labels
    cavity: Labels
    base: Labels
    epicardial_deg: HelixAngle
    endocardial_deg: HelixAngle

    @model_validator(mode="after")
    def _is_apart(self) -> Self:
        every = [*self.labels, *self.cavity, *self.base]
        twice = sorted({label for label in every if every.count(label) > 1})
        if twice:
            raise ValueError(f"a label is of the wall, of its cavity or of its base, found {twice[0]} twice")
        return self


class FieldFile(Table):
    """The lines that fibres follow."""

    preferences: Annotated[list[PreferenceTable], Field(max_length=MOST_TABLES)] = Field(default=[])
    singularities: Annotated[list[SingularityTable], Field(max_length=MOST_TABLES)] = Field(default=[])
    helix: HelixTable | None = None
    through: ThroughTable | None = None
    wall: WallTable | None = None

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        designed = bool(self.preferences or self.singularities)
        if self.wall is not None and (designed or self.helix or self.through):
            raise ValueError("a wall says every line through it: leave out all other tables, or the wall")
        if designed and self.helix is not None:
            raise ValueError("a helix says every line: leave out the preferences and singularities, or the helix")
        if not designed and self.helix is None and self.wall is None:
            raise ValueError("it says no line: give a preference, a singularity, a helix or a wall")
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
    """Read and validate a field file; the volume of a wall is then named from where the file is.

    Raises:
        UsageError: it is missing, not TOML, or has an unknown, missing or meaningless key, and the sentence names the
            line; or the volume that it names is no file.
    """
    text, name = field_text(path), Path(path).name
    try:
        found = FieldFile.model_validate(parsed_toml(text, name=name))
    except ValidationError as error:
        where = line_of(error, text, name=name)
        raise UsageError(f"{where}: {describe(error)}; `geoprint init` writes a commented field.toml.") from error
    if found.wall is None:
        return found
    volume = Path(path).parent / found.wall.volume
    if not volume.is_file():
        raise UsageError(f"{name}: [wall] names the volume {found.wall.volume}, but there is no file {volume}.")
    return found.model_copy(update={"wall": found.wall.model_copy(update={"volume": str(volume)})})


def field_volume(path: Path | str) -> tuple[str, bytes] | None:
    """Return name and bytes of the label volume that a field file names, or None.

    Raises:
        UsageError: as `read_field`, or the volume cannot be read.
    """
    wall = read_field(path).wall
    if wall is None:
        return None
    try:
        return Path(wall.volume).name, Path(wall.volume).read_bytes()
    except OSError as error:
        raise UsageError(f"the volume {wall.volume} of {Path(path).name} cannot be read ({error}).") from error
