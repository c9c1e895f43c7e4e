"""Field files: which lines fibres follow, as a person writes it.

Either what a field of lines has and leans to, which is the smoothest then, or lines at one angle about an axis, or the
fibres of a ventricle's wall.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self, final

from pydantic import Field, PositiveFloat, PositiveInt, ValidationError, model_validator

from geoprint.config.strict import Table, Triple, describe, line_of, parsed_toml, text_of
from geoprint.errors import UsageError, reason_of

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

# How wide fibres are, which lie as far from one another, where that is not `--spacing` everywhere: from a table, or
# along a direction from where the part begins to where it ends, or at places and fading to the spacing around them. A
# cell deposits least_flow_share to most_flow_share of the spacing, and flow that follows takes its mode "analog".
# [width]
# table = "widths.csv"        # beside this file: x,y,z,width in mm of points on the part
# direction = [0.0, 0.0, 1.0]
# begin_mm = 0.8
# end_mm = 1.6
# places = [[0.0, 0.0, 30.0]]
# at_mm = 1.6
# within_mm = 8.0             # so far from the places, straight, it is the spacing again

# Instead of all tables but the width: the fibres of a ventricle's wall, on surfaces within it and layers through it,
# from the labels of a volume in the part's coordinates. The helix angle goes from that of the outside to that at the
# cavity.
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


class WidthTable(Table):
    """How wide fibres are where that differs: by a table, along a direction, or about places."""

    table: Annotated[str | None, Field(min_length=1)] = None
    direction: Triple | None = None
    begin_mm: PositiveFloat | None = None
    end_mm: PositiveFloat | None = None
    places: Annotated[list[Triple] | None, Field(min_length=1, max_length=MOST_TABLES)] = None
    at_mm: PositiveFloat | None = None
    within_mm: PositiveFloat | None = None

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        given = [name for name, value in self if value is not None]
        if given not in (["table"], ["direction", "begin_mm", "end_mm"], ["places", "at_mm", "within_mm"]):
            found = " and ".join(given) if given else "none"
            raise ValueError(
                "a width is from a table, along a direction with begin_mm and end_mm, or about places with at_mm and "
                f"within_mm, found {found}"
            )
        if self.direction is not None and not any(self.direction):
            raise ValueError("a direction must have a length; [0.0, 0.0, 1.0] is the part's z axis")
        return self


class FieldFile(Table):
    """The lines that fibres follow."""

    preferences: Annotated[list[PreferenceTable], Field(max_length=MOST_TABLES)] = Field(default=[])
    singularities: Annotated[list[SingularityTable], Field(max_length=MOST_TABLES)] = Field(default=[])
    helix: HelixTable | None = None
    through: ThroughTable | None = None
    width: WidthTable | None = None
    wall: WallTable | None = None

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        designed = bool(self.preferences or self.singularities)
        if self.wall is not None and (designed or self.helix or self.through):
            raise ValueError("a wall defines every line through it: remove all tables but the width, or the wall")
        if designed and self.helix is not None:
            raise ValueError("a helix defines every line: remove the preferences and singularities, or the helix")
        if not designed and self.helix is None and self.wall is None:
            raise ValueError("it defines no line: give a preference, a singularity, a helix or a wall")
        return self


def _text(path: Path | str) -> str:
    """Return the text of a field file.

    Raises:
        UsageError: it is missing or cannot be read.
    """
    try:
        return text_of(Path(path))
    except (OSError, ValueError) as error:
        raise UsageError(
            f"the field file {path} cannot be read ({reason_of(error)}); `geoprint init` writes one."
        ) from error


def read_field(path: Path | str) -> FieldFile:
    """Read and validate a field file; the files that it names are then named from where it is.

    Raises:
        UsageError: it is missing, not TOML, or has an unknown, missing or meaningless key, and the sentence names the
            line; or what it names is no file.
    """
    text, name = _text(path), Path(path).name
    try:
        found = FieldFile.model_validate(parsed_toml(text, name=name))
    except ValidationError as error:
        where = line_of(error, text, name=name)
        raise UsageError(
            f"{where}: {describe(error, kind=FieldFile)}; `geoprint init` writes a commented field.toml."
        ) from error
    wall, width = found.wall, found.width
    if wall is not None:
        wall = wall.model_copy(update={"volume": _beside(path, "wall", "volume", wall.volume)})
    if width is not None and width.table is not None:
        width = width.model_copy(update={"table": _beside(path, "width", "table", width.table)})
    return found.model_copy(update={"wall": wall, "width": width})


def _beside(path: Path | str, table: str, key: str, named: str) -> str:
    """Return the path of a file that a table names from where the field file is.

    Raises:
        UsageError: there is none.
    """
    file = Path(path).parent / named
    if not file.is_file():
        raise UsageError(f"{Path(path).name}: [{table}] names the {key} {named}, but the file {file} does not exist.")
    return str(file)


@final
@dataclass(frozen=True, slots=True)
class StoredField:
    """A field file with all that it names, from which it can be read again.

    Attributes:
        text: of the file.
        files: name and bytes of each file that it names, by the table and the key that name it.
    """

    text: str
    files: Mapping[tuple[str, str], tuple[str, bytes]]


def stored_field(path: Path | str) -> StoredField:
    """Return a field file with the files that it names.

    Raises:
        UsageError: as `read_field`, or one of them cannot be read.
    """
    file = read_field(path)
    named = {
        ("wall", "volume"): None if file.wall is None else file.wall.volume,
        ("width", "table"): None if file.width is None else file.width.table,
    }
    found = dict[tuple[str, str], tuple[str, bytes]]()
    for (table, key), each in named.items():
        if each is None:
            continue
        try:
            found[table, key] = Path(each).name, Path(each).read_bytes()
        except OSError as error:
            raise UsageError(f"the {key} {each} of {Path(path).name} cannot be read ({reason_of(error)}).") from error
    return StoredField(_text(path), found)
