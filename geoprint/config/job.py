"""What to plan, as the command line or a program asks for it.

Whatever is said of a key stands at its field: the options of the commands, the commented job.toml and the settings in
plan.json are made from there. A new key is a new field.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, NonNegativeInt, PositiveFloat, PositiveInt, model_validator

from geoprint.config.key import Key, keys_of
from geoprint.config.layer_pattern import LayerPattern, layer_pattern
from geoprint.config.patch_region import PatchRegion
from geoprint.config.source import SHAPES, Source
from geoprint.config.strict import Rounds, Table
from geoprint.model import OnSlowdown

# Each is held against each other one.
MOST_PATCHES = 100
# Paths nearer together than this [mm] are a typing error: every needle is hundreds of times as wide.
LEAST_SPACING = 1e-3

Spacing = Annotated[float, Field(ge=LEAST_SPACING)]
# Position [mm] and roll, pitch, yaw [degrees].
Stand = Annotated[list[float], Field(min_length=6, max_length=6)]
# What one backend or pattern alone takes: a value by the name of its option.
Options = dict[str, bool | int | float | str]

# Parts of job.toml in their order, with the comment that stands above each.
GROUPS = {
    "part": "The part, or the body that patches are cut from: STL, OBJ, PLY, OFF, 3MF, STEP, IGES, NIfTI, NRRD, DICOM.",
    "spacing": "How closely the paths lie: one of",
    "paths": "",
    "robot": "",
    "source": "What distance is measured from: one of these; without any, the whole border.",
    "options": "What one backend or pattern alone takes, a table each.",
    "patches": "The patches to print, one table each, one after another; without any, the whole surface is the part. "
    "Of one patch\neverything that is given holds together.",
}


class Job(Table):
    """What to plan, as the command line or a program asks for it.

    The order of the fields is that of the settings in plan.json. Spacing [mm] and rounds, the number of levels between
    the seed and the farthest point, exclude each other; lengths are mm, angles degrees.
    """

    surface: Annotated[Path, Key("", '"heart.ply"', group="part", option="", told="", shown=True)]
    unit: Annotated[
        Literal["mm", "cm", "m", "um", "in"] | None,
        Key(
            "Length unit of the file: mm, cm, m, um or in.",
            '"mm" # of the file: mm, cm, m, um or in; leave it out where the file carries its unit',
            group="part",
            told="",
            shown=True,
        ),
    ] = None
    backend: Annotated[str, Key("Planning backend.", "# heat, fast-marching or lscm", group="paths")] = "heat"
    compared: Annotated[
        list[str] | None,
        Key(
            "",
            '["lscm", "heat"] # plan as in a comparison of these: on the surface that all of them need, and what no '
            "robot can print, too",
            group="paths",
            option="",
            told="",
        ),
    ] = None
    pattern: Annotated[
        str,
        Key(
            "How paths cover the surface.",
            "# how paths cover the surface: contours, spiral, guided or fibres",
            group="paths",
            always=False,
        ),
    ] = "contours"
    patterns: Annotated[
        list[str] | None,
        Field(min_length=1),
        Key(
            "Patterns of the layers of a thickness in turn, from the lowest, with commas between them; with the angle "
            "of straight rows in degrees, as contours,guided:45,guided:-45.",
            '["contours", "guided:45", "guided:-45"] # of layers, in turn from the lowest',
            group="paths",
            always=False,
        ),
    ] = None
    middle: Annotated[
        Literal["best", "fitted", "plain"] | None,
        Key(
            "What becomes of contours where fronts meet: plain ones, fitted to the width that is there, or the best, "
            "which covers better; by default the best.",
            '"plain" # contours where fronts meet: plain, fitted to the width that is there, or best of both',
            group="paths",
        ),
    ] = None
    contours: Annotated[
        NonNegativeInt | None,
        Key("Contours around guided rows, so many.", "2 # contours around guided rows", group="paths", always=False),
    ] = None
    field: Annotated[
        Path | None,
        Key(
            "Field file that fibres follow; `geoprint init` writes one.",
            '"field.toml" # which lines the pattern fibres follows',
            group="paths",
            told="",
            always=False,
        ),
    ] = None
    spacing: Annotated[
        Spacing | None,
        Key("Distance of neighbouring paths (stepover) in mm.", "1.0", group="spacing", told="spacing_mm", shown=True),
    ] = None
    resolution: Annotated[
        PositiveInt | None,
        Key(
            "Pixels along the longer side of lscm's raster of its conformal map; by default 16 a spacing.",
            "500 # pixels along the longer side of the raster of lscm",
            group="paths",
        ),
    ] = None
    rounds: Annotated[
        Rounds | None,
        Key(
            "Number of rounds (contour-parallel passes) from the seed inwards.",
            "20 # from the border to the farthest point; of several patches, to that of the deepest",
            group="spacing",
        ),
    ] = None
    source: Annotated[
        Source | None,
        Key(
            f"What distance is measured from (source): {SHAPES}; by default the border. `geoprint plan --from BUNDLE` "
            "without a part plans a bundle again.",
            "[source]",
            group="source",
            option="from",
        ),
    ] = None
    options: Annotated[
        dict[str, Options],
        Key(
            "What one backend or pattern alone takes, as lscm.resolution=500; may be given several times.",
            "[options.lscm]\nresolution = 500",
            group="options",
            option="option",
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
            "Of resampled labels or probabilities: share from which on a voxel belongs to a label; by default 0.5.",
            "0.5 # share from which on a voxel of resampled labels or probabilities belongs to a label",
            group="part",
            always=False,
        ),
    ] = None
    patches: Annotated[list[PatchRegion], Field(max_length=MOST_PATCHES), Key("", "[[patches]]", group="patches")] = (
        Field(default=[])
    )
    thickness: Annotated[
        PositiveFloat | None,
        Key(
            "Thickness in mm of a device that is printed over the part, layer upon layer.",
            "3.0 # of a device that is printed over the part, layer upon layer",
            group="part",
            told="thickness_mm",
            always=False,
        ),
    ] = None
    feather: Annotated[
        PositiveFloat | None,
        Key(
            "Let the thickness rise from nothing at the rim to the whole of it so far in, in mm.",
            "2.0 # the thickness rises from nothing at the rim to the whole of it so far in",
            group="part",
            told="feather_mm",
            always=False,
        ),
    ] = None
    target: Annotated[
        Path | None,
        Key(
            "What the layers fill instead of one thickness: a closed mesh over the part, or a CSV file "
            "x,y,z,thickness (mm) of points on it.",
            '"device.stl" # what the layers fill instead: a closed mesh, or a CSV file x,y,z,thickness of points',
            group="part",
            told="",
            always=False,
        ),
    ] = None
    layer: Annotated[
        PositiveInt | None,
        Key(
            "Plan this layer of the thickness alone, from 1, the one on the part.",
            "1 # of the thickness this layer alone, from 1",
            group="part",
            always=False,
        ),
    ] = None
    fill_holes: Annotated[
        PositiveFloat | None,
        Key(
            "Close holes whose border is up to this long in mm; by default missing triangles.",
            "2.0 # close holes whose border is up to this long",
            group="part",
            told="fill_holes_mm",
        ),
    ] = None
    body: Annotated[
        Path | None,
        Key(
            "Mesh of what the part lies on, same coordinates.",
            '"phantom.ply" # what the part lies on; what patches are cut from counts without being named',
            group="robot",
            told="",
        ),
    ] = None
    cell: Annotated[
        Path | None, Key("Cell file; `geoprint init` writes one.", '"irb120-bent45.toml"', group="robot")
    ] = None
    needle: Annotated[
        PositiveFloat | None,
        Key(
            "Inner diameter in mm of the needle, one of the common ones or the cell's own: spacing, layer height, "
            "stand-off and speed follow from it where they are not given.",
            "0.4 # inner diameter of the needle; given as an option it sets spacing, layer_height, standoff and speed",
            group="robot",
            told="",
            always=False,
        ),
    ] = None
    layer_height: Annotated[
        PositiveFloat | None,
        Key("", "0.3 # instead of the cell's layer_height_mm", group="robot", option="", told="", always=False),
    ] = None
    standoff: Annotated[
        PositiveFloat | None,
        Key("", "0.3 # instead of the cell's standoff_mm", group="robot", option="", told="", always=False),
    ] = None
    place: Annotated[
        Literal["demo", "best"] | None,
        Key(
            "'demo': at demo_position_mm of the cell; 'best': where `geoprint place` puts it; the program runs only "
            "dry.",
            '"demo" # at demo_position_mm of the cell, "best" where the arm prints it best, for a program that runs '
            "only dry; else it must be calibrated",
            group="robot",
        ),
    ] = None
    stand: Annotated[
        Stand | None,
        Key(
            "",
            "[300, 0, 50, 0, 0, 90] # x, y, z, roll, pitch, yaw of a demonstration instead of the cell's; a table goes "
            "with it",
            group="robot",
            option="",
            told="",
            always=False,
        ),
    ] = None
    max_tilt: Annotated[
        float,
        Field(ge=0.0, le=45.0),
        Key(
            "How far the nozzle may lean from the surface normal, in degrees.",
            "# how far the nozzle may lean from the surface normal",
            group="robot",
            told="max_tilt_deg",
        ),
    ] = 15.0
    speed: Annotated[
        PositiveFloat | None,
        Key(
            "Print no faster than this in mm/s; the cell's speed_mm_s where left out.",
            "15.0 # print no faster than this; left out: the cell's speed_mm_s",
            group="robot",
            told="",
            always=False,
        ),
    ] = None
    on_slowdown: Annotated[
        OnSlowdown,
        Key(
            "Where joints cannot hold the speed: 'auto' finds one that deposits what was planned, 'follow' keeps it.",
            '# where joints cannot hold the speed: "auto" finds one at which a valve deposits what was planned, '
            '"follow" keeps it',
            group="robot",
        ),
    ] = "auto"
    accept_flow: Annotated[
        bool,
        Key(
            "Write a program even where a run gets less than 90 or more than 110 % of its volume.",
            "# true writes a program even where a run gets less than 90 or more than 110 % of its volume",
            group="robot",
            always=False,
        ),
    ] = False
    feedback: Annotated[
        Path | None,
        Key(
            "The appraisal.json of a scan of this plan's last print: flow and valve are corrected by it.",
            '"appraisal.json" # of a scan of the last print of this plan: corrects flow and valve',
            group="robot",
            told="",
            always=False,
        ),
    ] = None
    robot: Annotated[
        bool,
        Key("Plan the robot too, or leave it out: paths only.", "# false leaves the robot out", group="robot"),
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
            raise ValueError("give either a thickness or a target, not both: a target says how thick it is")
        return self

    @model_validator(mode="after")
    def _patterns_of_layers(self) -> Self:
        if self.patterns is None:
            return self
        if self.pattern != type(self).model_fields["pattern"].default:
            raise ValueError("give either a pattern or patterns, not both: patterns say that of each layer")
        angles = [each.angle_deg for each in self.drawings]
        if self.source is not None and None not in angles:
            raise ValueError(
                f"the source {self.source} is of none of the patterns, which all have an angle: leave out one of both"
            )
        return self

    @model_validator(mode="after")
    def _a_source_for_each_patch(self) -> Self:
        source = self.source
        everywhere = source is None or source.border or source.best or source.angle is not None
        if len(self.patches) > 1 and not everywhere:
            raise ValueError(
                f"the source {source} lies on one patch, but there are {len(self.patches)}: give each its own, as "
                "`source` in its table, or take border, best or an angle for all"
            )
        return self

    @property
    def layered(self) -> bool:
        """Whether it is of layers over the part."""
        return self.thickness is not None or self.target is not None

    @property
    def drawings(self) -> tuple[LayerPattern, ...]:
        """The patterns that layers have in turn, from the lowest; one where all have the same.

        Raises:
            ValueError: a text means none.
        """
        return (LayerPattern(self.pattern),) if self.patterns is None else tuple(map(layer_pattern, self.patterns))

    @property
    def drawing(self) -> LayerPattern:
        """The pattern of its layer; of the lowest where it is of all."""
        return self.drawings[((self.layer or 1) - 1) % len(self.drawings)]

    @property
    def counted_from(self) -> Source | None:
        """What distance is measured from on its layer: the angle of its pattern, else its source."""
        angle = self.drawing.angle_deg
        return self.source if angle is None else Source(angle=angle)

    def settings(self) -> dict[str, object]:
        """Return what plan.json tells of the job, by the names there; pattern and source are those of its layer."""
        values = dict(self) | {"pattern": self.drawing.name, "source": self.counted_from}
        return {
            key.told or name: values[name]
            for name, key, field in keys_of(type(self))
            if key.told != "" and (key.always or values[name] != field.default)
        }
