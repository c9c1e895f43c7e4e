"""What to plan, as the command line or a program asks for it.

Whatever is said of a key stands at its field: the options of the commands, the commented job.toml and the settings in
plan.json are made from there. A new key is a new field.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self, final

from pydantic import Field, NonNegativeInt, PositiveFloat, PositiveInt, model_validator

from geoprint.config.curve_table import read_curve
from geoprint.config.strict import Key, Rounds, Table, Triple, keys_of
from geoprint.errors import UsageError
from geoprint.model import OnSlowdown, OptionValue

# A pattern of a layer, as a job states it where patterns take turns: `contours`, or rows at an angle, `guided:45`.


# Rows look the same after half a turn [degrees].
HALF_TURN = 180.0


@final
@dataclass(frozen=True, slots=True)
class LayerPattern:
    """How paths cover one layer.

    Attributes:
        name: of the pattern.
        angle_deg: of the line that its rows run beside, as a source has it [degrees]; None where the source of the job
            counts.
    """

    name: str
    angle_deg: float | None = None

    def __str__(self) -> str:
        """Return it as `--pattern` takes it."""
        return self.name if self.angle_deg is None else f"{self.name}:{self.angle_deg:g}"


def layer_pattern(text: str) -> LayerPattern:
    """Return the pattern that a text means: a name, and behind a colon or a blank the angle of its rows.

    Raises:
        ValueError: there is no name, or the angle is none between -180 and 180 degrees.

    Examples:
        >>> str(layer_pattern("guided 45")), str(layer_pattern("contours"))
        ('guided:45', 'contours')
    """
    name, *angle = text.replace(":", " ").split() or [""]
    try:
        value = float(*angle) if angle else None
    except (TypeError, ValueError):
        value = math.nan
    if not name or (value is not None and not abs(value) <= HALF_TURN):
        raise ValueError(
            f"{text[:60]!r} is not a pattern of a layer: give its name, and after a colon the angle of its rows (-180 "
            "to 180), as guided:45"
        )
    return LayerPattern(name, value)


# Where paths are counted from, as a job states it: loops of the border, part of one, a curve, an angle, or a point.


# A line is sought between each two points of a drawn curve.
MOST_SOURCE_POINTS = 500
SHAPES = (
    "border, best, loops:1,3, near:X,Y,Z, between:X,Y,Z:X,Y,Z, point:X,Y,Z, angle:45, or a CSV file x,y,z of a drawn "
    "curve"
)

# Of a line, which looks the same after half a turn [degrees].
Angle = Annotated[float, Field(ge=-180.0, le=180.0)]


class SourceTable(Table):
    """Where distance is zero; one of these is given. Places [mm] are on or near the surface."""

    border: Annotated[bool, Key("", "true # the whole border")] = False
    best: Annotated[bool, Key("", "true # try what the part has, take what covers it best")] = False
    loops: Annotated[
        list[PositiveInt] | None,
        Field(min_length=1),
        Key("", "[1] # some loops of the border, the longest is 1; `geoprint inspect` lists them"),
    ] = None
    near: Annotated[
        list[Triple] | None, Field(min_length=1), Key("", "[[0.0, 0.0, 0.0]] # the loops nearest to these points")
    ] = None
    between: Annotated[
        list[Triple] | None,
        Field(min_length=2, max_length=3),
        Key("", "[[-8.0, 0.0, 30.0], [8.0, 0.0, 30.0]] # the shorter part of a loop, or by a point in the middle"),
    ] = None
    curve: Annotated[
        list[Triple] | None,
        Field(min_length=2, max_length=MOST_SOURCE_POINTS),
        Key("", "[[-8.0, 0.0, 30.0], [8.0, 0.0, 30.0]] # points of a drawn curve, joined by shortest lines"),
    ] = None
    point: Annotated[Triple | None, Key("", "[0.0, 0.0, 0.0] # one point")] = None
    angle: Annotated[
        Angle | None, Key("", "45.0 # a straight line over the middle, in degrees from the x axis seen from outside")
    ] = None

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, given: object) -> object:
        return _keys_of(given) if isinstance(given, str) else given

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        given = [name for name, value in self if value is not None and value is not False]
        if len(given) != 1:
            found = " and ".join(given) if given else "none"
            raise ValueError(f"a source is one of {', '.join(type(self).model_fields)}, found {found}")
        return self

    def __str__(self) -> str:
        """Return it in a few words, as `--from` takes them; a drawn curve by its number of points."""
        if self.loops is not None:
            return f"loops:{','.join(map(str, self.loops))}"
        if self.angle is not None:
            return f"angle:{self.angle:g}"
        if self.curve is not None:
            return f"a curve of {len(self.curve)} points"
        point = None if self.point is None else [self.point]
        for name, places in (("near", self.near), ("between", self.between), ("point", point)):
            if places is not None:
                return f"{name}:{':'.join(','.join(f'{value:g}' for value in place) for place in places)}"
        return "best" if self.best else "border"


def source_named(text: str) -> dict[str, object]:
    """Return the keys of the source that an option means, such as `loops:1,3`, or a table with a drawn curve.

    Raises:
        UsageError: it means none.
        InputError: the table cannot be read.
    """
    if Path(text).is_file():
        return {"curve": read_curve(text)}
    try:
        return _keys_of(text)
    except ValueError as error:
        raise UsageError(f"`--from`: {error}.") from error


def _keys_of(text: str) -> dict[str, object]:
    """Return the keys that a text means."""
    kind, _, rest = text.strip().partition(":")
    if text.strip() in {"border", "best"}:
        return {text.strip(): True}
    try:
        return {"loops" if kind == "loop" else kind: READERS[kind](rest)}
    except (KeyError, ValueError) as error:
        raise ValueError(f"{text[:60]!r} is neither a source nor a file: give one of {SHAPES}") from error


def _numbers(text: str) -> list[int]:
    return [int(number) for number in text.split(",")]


def _place(text: str) -> list[float]:
    return [float(number) for number in text.split(",")]


def _places(text: str) -> list[list[float]]:
    return [_place(place) for place in text.split(":")]


READERS: dict[str, Callable[[str], object]] = {
    "loop": _numbers, "loops": _numbers, "near": _places, "between": _places, "point": _place, "angle": float
}  # fmt: skip


# Points in order round what is drawn on a part.
ClosedCurve = Annotated[list[Triple], Field(min_length=3, max_length=MOST_SOURCE_POINTS)]

# Where a patch lies on its body, as a job states it: about a point, in a box, inside a drawn curve, or named.


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
            "Cut the part out of the file: the surface around this point in mm.",
            "[0.0, 0.0, 0.0] # point on or near the surface that the patch holds",
        ),
    ] = None
    radius: Annotated[
        PositiveFloat | None,
        Key(
            "With `--at`: up to this distance along the surface.",
            "10.0 # up to this far from it along the surface",
            shape="MM",
        ),
    ] = None
    cone_deg: Annotated[
        Cone | None,
        Key(
            "With `--at`: up to this turn of the normal.",
            "30.0 # where the normal turns at most this far from that at the point",
            option="cone",
            shape="DEG",
            rare=True,
        ),
    ] = None
    box: Annotated[
        Corners | None,
        Key(
            "Cut the part out of the file by a box: lowest and highest X Y Z in mm.",
            "[-10.0, -10.0, -10.0, 10.0, 10.0, 10.0] # lowest x, y, z and highest x, y, z",
            rare=True,
        ),
    ] = None
    curve: Annotated[
        list[Triple] | None,
        Key(
            "Cut the part out along a closed curve: a CSV file x,y,z (mm) of points in order. `--at` chooses the "
            "side, by default the smaller.",
            "[[-8.0, 0.0, 30.0], [8.0, 0.0, 30.0], [0.0, 9.0, 29.0]] # points in order round it, "
            "joined by shortest lines",
            rare=True,
        ),
    ] = None
    region: Annotated[
        str | None,
        Key(
            "Cut the part out by a group, object or label of the file; `geoprint inspect` lists them.",
            '"anterior" # name that the file gives to some of its faces; `geoprint inspect` lists them',
            rare=True,
        ),
    ] = None
    source: Annotated[
        SourceTable | None, Key("", "{ best = true } # what its distance is measured from, as in [source]", option="")
    ] = None

    @model_validator(mode="after")
    def _is_bounded(self) -> Self:
        if self.at is None and (self.radius is not None or self.cone_deg is not None):
            raise ValueError("a radius or a cone needs its point: give `at` (--at X Y Z) too")
        if all(bound is None for bound in (self.radius, self.cone_deg, self.box, self.curve, self.region)):
            raise ValueError("a patch needs a bound: give a radius, a cone, a box, a curve or a region")
        if self.box is not None and not all(low < high for low, high in zip(self.box[:3], self.box[3:], strict=True)):
            raise ValueError("a box is its lowest x y z, then its highest x y z")
        if self.curve is not None and not 3 <= len(self.curve) <= MOST_CURVE_POINTS:
            raise ValueError(f"a curve has 3 to {MOST_CURVE_POINTS} points, found {len(self.curve)}")
        return self


# Each is held against each other one.
MOST_PATCHES = 100
# Paths nearer together than this [mm] are a typing error: every needle is hundreds of times as wide.
LEAST_SPACING = 1e-3

Spacing = Annotated[float, Field(ge=LEAST_SPACING)]
# Position [mm] and roll, pitch, yaw [degrees].
PositionAndTurn = Annotated[list[float], Field(min_length=6, max_length=6)]
# What one backend or pattern alone takes: a value by the name of its option.
Options = dict[str, OptionValue]

# Parts of job.toml in their order, with the comment that stands above each.
GROUPS = {
    "part": "The part, or the body that patches are cut from: STL, OBJ, PLY, OFF, 3MF, STEP, IGES, NIfTI, NRRD, DICOM.",
    "spacing": "How closely the paths lie: one of",
    "paths": "",
    "layers": "A device that is printed over the part, layer upon layer.",
    "robot": "",
    "source": "What distance is measured from: one of these; without any, the whole border.",
    "options": "What one backend, pattern or feature alone takes, a table each; that of a feature asks for it.",
    "patches": "The patches to print, one table each, one after another; without any, the whole surface is the part. "
    "Of one patch\neverything that is given holds together.",
}


class Job(Table):
    """What to plan: the keys of a job file, and the options of the commands.

    Give either the spacing [mm] or rounds, the number of levels between the source and the farthest point. Lengths are
    in mm, angles in degrees. The order of the keys is that of the settings in plan.json.
    """

    surface: Annotated[Path, Key("", '"heart.ply"', group="part", option="", record="", shown=True)]
    unit: Annotated[
        Literal["mm", "cm", "m", "um", "in"] | None,
        Key(
            "Length unit of the file.",
            '"mm" # of the file: mm, cm, m, um or in; leave it out where the file carries its unit',
            group="part",
            record="",
            shown=True,
        ),
    ] = None
    backend: Annotated[
        str,
        Key(
            "Planning backend: heat, fast-marching or lscm (by a conformal map).",
            "# heat, fast-marching or lscm",
            group="paths",
        ),
    ] = "heat"
    compared: Annotated[
        list[str] | None,
        Key(
            "",
            '["lscm", "heat"] # plan as in a comparison of these: on the surface that all of them need, and what no '
            "robot can print, too",
            group="paths",
            option="",
            record="",
        ),
    ] = None
    pattern: Annotated[
        str,
        Key(
            "How paths cover the surface: contours, spiral, guided or fibres. Layers of a thickness take several in "
            "turn, from the lowest, as contours,guided:45,guided:-45 (angles of rows in degrees).",
            "# contours, spiral, guided or fibres; of layers in turn as contours,guided:45,guided:-45",
            group="paths",
            shape="NAME,...",
            always=False,
        ),
    ] = "contours"
    middle: Annotated[
        Literal["best", "fitted", "plain"] | None,
        Key(
            "Contours at the medial axis: plain, fitted to the local width, or best (default), which covers better.",
            '"plain" # contours where fronts meet: plain, fitted to the width that is there, or best of both',
            group="paths",
            rare=True,
        ),
    ] = None
    contours: Annotated[
        NonNegativeInt | None,
        Key(
            "Number of contours around guided rows.",
            "2 # contours around guided rows",
            group="paths",
            always=False,
            rare=True,
        ),
    ] = None
    field: Annotated[
        Path | None,
        Key(
            "Field file that fibres follow; `geoprint init` writes one.",
            '"field.toml" # which lines the pattern fibres follows',
            group="paths",
            record="",
            always=False,
        ),
    ] = None
    spacing: Annotated[
        Spacing | None,
        Key(
            "Distance between neighbouring paths (stepover).",
            "1.0",
            group="spacing",
            record="spacing_mm",
            shown=True,
            shape="MM",
        ),
    ] = None
    rounds: Annotated[
        Rounds | None,
        Key(
            "Number of rounds (contour-parallel passes) from the source inwards.",
            "20 # from the border to the farthest point; of several patches, to that of the deepest",
            group="spacing",
        ),
    ] = None
    source: Annotated[
        SourceTable | None,
        Key(
            f"What distance is measured from (source): {SHAPES}. `geoprint plan --from BUNDLE` without a part plans a "
            "bundle again.",
            "[source]",
            group="source",
            option="from",
            shape="SOURCE",
        ),
    ] = None
    options: Annotated[
        dict[str, Options],
        Key(
            "Options of one backend, pattern or feature.",
            "[options.lscm]\nresolution = 500",
            group="options",
            option="",
            always=False,
        ),
    ] = Field(default={})
    flip: Annotated[
        bool,
        Key("Print on the other side of the surface.", "# print on the other side of the surface", group="part"),
    ] = False
    label: Annotated[
        PositiveInt | None,
        Key("Which label of a label volume (.nii, .nii.gz, .nrrd, .dcm).", "1 # of a label volume", group="part"),
    ] = None
    threshold: Annotated[
        Annotated[float, Field(gt=0.0, lt=1.0)] | None,
        Key(
            "Least share of a voxel that belongs to a label, for resampled labels or probabilities; by default 0.5.",
            "0.5 # share from which on a voxel of resampled labels or probabilities belongs to a label",
            group="part",
            always=False,
            shape="SHARE",
            rare=True,
        ),
    ] = None
    patches: Annotated[list[PatchRegion], Field(max_length=MOST_PATCHES), Key("", "[[patches]]", group="patches")] = (
        Field(default=[])
    )
    keep_outs: Annotated[
        list[ClosedCurve],
        Field(max_length=MOST_PATCHES),
        Key(
            "Closed curves on the part, inside of which, on the smaller side, nothing is deposited.",
            "[[[-2.0, 0.0, 30.0], [2.0, 0.0, 30.0], [0.0, 3.0, 29.0]]] # closed curves on the part; inside of them, on "
            "the smaller side, nothing is deposited",
            group="part",
            option="",
            always=False,
        ),
    ] = Field(default=[])
    margin: Annotated[
        PositiveFloat | None,
        Key(
            "Width of the strip that stays empty along every border of the part.",
            "2.0 # a strip so wide stays empty along every border of the part and of what is kept out",
            group="part",
            record="margin_mm",
            always=False,
            shape="MM",
            rare=True,
        ),
    ] = None
    thickness: Annotated[
        PositiveFloat | None,
        Key(
            "Thickness of a device printed over the part in layers.",
            "3.0 # of a device that is printed over the part, layer upon layer",
            group="layers",
            record="thickness_mm",
            always=False,
            shape="MM",
        ),
    ] = None
    feather: Annotated[
        PositiveFloat | None,
        Key(
            "Width in mm over which the thickness rises from zero at the rim.",
            "2.0 # the thickness rises from nothing at the rim to the whole of it so far in",
            group="layers",
            record="feather_mm",
            always=False,
            shape="MM",
            rare=True,
        ),
    ] = None
    target: Annotated[
        Path | None,
        Key(
            "Shape that the layers fill instead of one thickness: a closed mesh over the part, or a CSV file "
            "x,y,z,thickness (mm).",
            '"device.stl" # what the layers fill instead: a closed mesh, or a CSV file x,y,z,thickness of points',
            group="layers",
            record="",
            always=False,
        ),
    ] = None
    layer: Annotated[
        PositiveInt | None,
        Key(
            "Plan only this layer of the thickness; 1 lies on the part.",
            "1 # of the thickness this layer alone, from 1",
            group="layers",
            always=False,
        ),
    ] = None
    fill_holes: Annotated[
        PositiveFloat | None,
        Key(
            "Close holes with a border up to this length in mm; by default only missing triangles.",
            "2.0 # close holes whose border is up to this long",
            group="part",
            record="fill_holes_mm",
            shape="MM",
            rare=True,
        ),
    ] = None
    body: Annotated[
        Path | None,
        Key(
            "Mesh of the body under the part, in the same coordinates.",
            '"phantom.ply" # what the part lies on; what patches are cut from counts without being named',
            group="part",
            record="",
        ),
    ] = None
    cell: Annotated[
        Path | None,
        Key("Cell file, or the name of a cell that `geoprint init` writes.", '"irb120-bent45.toml"', group="robot"),
    ] = None
    needle: Annotated[
        PositiveFloat | None,
        Key(
            "Inner diameter of the needle, a common one or the cell's. It sets spacing, layer height, stand-off and "
            "speed where these are not given.",
            "0.4 # inner diameter of the needle; given as an option it sets spacing, layer_height, standoff and speed",
            group="robot",
            record="",
            always=False,
            shape="MM",
        ),
    ] = None
    layer_height: Annotated[
        PositiveFloat | None,
        Key("", "0.3 # instead of the cell's layer_height_mm", group="robot", option="", record="", always=False),
    ] = None
    standoff: Annotated[
        PositiveFloat | None,
        Key("", "0.3 # instead of the cell's standoff_mm", group="robot", option="", record="", always=False),
    ] = None
    place: Annotated[
        Literal["demo", "best"] | None,
        Key(
            "'demo': at demo_position_mm of the cell, or where it prints; 'best': where `geoprint place` puts it. The "
            "program only runs dry.",
            '"demo" # at demo_position_mm of the cell, "best" where the arm prints it best, for a program that runs '
            "only dry; else it must be calibrated",
            group="robot",
        ),
    ] = None
    stand: Annotated[
        PositionAndTurn | None,
        Key(
            "",
            "[300, 0, 50, 0, 0, 90] # x, y, z, roll, pitch, yaw of a demonstration instead of the cell's; a table goes "
            "with it",
            group="robot",
            option="",
            record="",
            always=False,
        ),
    ] = None
    max_tilt: Annotated[
        float,
        Field(ge=0.0, le=45.0),
        Key(
            "Largest lean of the nozzle from the surface normal, in degrees.",
            "# how far the nozzle may lean from the surface normal",
            group="robot",
            record="max_tilt_deg",
            shape="DEG",
            rare=True,
        ),
    ] = 15.0
    speed: Annotated[
        PositiveFloat | None,
        Key(
            "Largest print speed; by default speed_mm_s of the cell.",
            "15.0 # print no faster than this; left out: the cell's speed_mm_s",
            group="robot",
            record="",
            always=False,
            shape="MM/S",
        ),
    ] = None
    on_slowdown: Annotated[
        OnSlowdown,
        Key(
            "If joints cannot hold the speed: 'auto' finds one that deposits the planned volume, 'follow' keeps it.",
            '# where joints cannot hold the speed: "auto" finds one at which a valve deposits what was planned, '
            '"follow" keeps it',
            group="robot",
            rare=True,
        ),
    ] = "auto"
    accept_flow: Annotated[
        bool,
        Key(
            "Write a program even if a run gets less than 90 or more than 110 % of its volume.",
            "# true writes a program even where a run gets less than 90 or more than 110 % of its volume",
            group="robot",
            always=False,
            rare=True,
        ),
    ] = False
    feedback: Annotated[
        Path | None,
        Key(
            "The appraisal.json of this plan's last print: it corrects flow and valve.",
            '"appraisal.json" # of a scan of the last print of this plan: corrects flow and valve',
            group="robot",
            record="",
            always=False,
        ),
    ] = None
    robot: Annotated[
        bool,
        Key("Leave the robot out: plan paths only.", "# false leaves the robot out", group="robot"),
    ] = True

    @model_validator(mode="after")
    def _one_of_spacing_and_rounds(self) -> Self:
        if self.spacing is not None and self.rounds is not None:
            raise ValueError("give either spacing or rounds, not both: each follows from the other")
        return self

    @model_validator(mode="after")
    def _a_thickness_over_one_patch(self) -> Self:
        if self.layered and len(self.patches) > 1:
            raise ValueError("a thickness is printed over one patch: plan the patches one by one")
        if self.thickness is not None and self.target is not None:
            raise ValueError("give either a thickness or a target, not both: a target defines the thickness")
        return self

    @model_validator(mode="after")
    def _patterns_of_layers(self) -> Self:
        angles = [each.angle_deg for each in self.drawings]
        if self.source is not None and None not in angles:
            raise ValueError(
                f"the source {self.source} does not apply, because all patterns have an angle: remove one of them"
            )
        return self

    @model_validator(mode="after")
    def _a_source_for_each_patch(self) -> Self:
        source = self.source
        everywhere = source is None or source.border or source.best or source.angle is not None
        if len(self.patches) > 1 and not everywhere:
            raise ValueError(
                f"the source {source} lies on one of {len(self.patches)} patches: give each patch its own `source` in "
                "its table, or use border, best or an angle"
            )
        return self

    @property
    def layered(self) -> bool:
        """Whether it is of layers over the part."""
        return self.thickness is not None or self.target is not None

    @property
    def divided(self) -> bool:
        """Whether it is of all layers, which are planned one by one and printed in turn."""
        return self.layered and self.layer is None

    @property
    def drawings(self) -> tuple[LayerPattern, ...]:
        """The patterns that layers have in turn, from the lowest; one where all have the same.

        Raises:
            ValueError: a text means none.
        """
        return tuple(map(layer_pattern, self.pattern.split(",")))

    @property
    def drawing(self) -> LayerPattern:
        """The pattern of its layer; of the lowest where it is of all."""
        return self.drawings[((self.layer or 1) - 1) % len(self.drawings)]

    @property
    def counted_from(self) -> SourceTable | None:
        """What distance is measured from on its layer: the angle of its pattern, else its source."""
        angle = self.drawing.angle_deg
        return self.source if angle is None else SourceTable(angle=angle)

    def settings(self) -> dict[str, object]:
        """Return what plan.json tells of the job, by the names there; pattern and source are those of its layer."""
        values = dict(self) | {"pattern": self.drawing.name, "source": self.counted_from}
        return {
            key.record or name: values[name]
            for name, key, field in keys_of(type(self))
            if key.record != "" and (key.always or values[name] != field.default)
        }
