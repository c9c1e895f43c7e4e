"""The schema of plan.json: what is said of a plan, from the file that was read to the warnings.

Lengths are mm, angles degrees, times s, and another unit stands in the name; a share or a ratio is of 1. Runs, levels
and layers count from 0.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, create_model

from geoprint.account.records.evenness import EvennessRecord
from geoprint.account.records.feedback import FeedbackRecord
from geoprint.account.records.overhang import OverhangRecord
from geoprint.account.records.robot import JoinedRecord, RobotRecord
from geoprint.account.records.rounding import Count, Pair, Place, Record, Rounded, Thousandths
from geoprint.account.records.tried import MiddleRecord, SourceRecord
from geoprint.config.job import Job
from geoprint.config.key import keys_of
from geoprint.config.patch_region import PatchRegion
from geoprint.surfaces.repair import PreparationReport, Repairs, described


class FileRecord(Record):
    """A file as it was read."""

    name: str = Field(description="of the file, without its folder")
    sha256: str = Field(description="of its bytes", pattern="^[0-9a-f]{64}$")
    unit: str = Field(description="of its lengths")


class InputRecord(FileRecord):
    """The part's file, and those of the body and of what layers fill if the job names them."""

    made: dict[str, str | float | int] | None = Field(
        default=None, description="how the mesh was made, where the file holds something else"
    )
    body: FileRecord | None = Field(default=None, description="what the part lies on")
    target: FileRecord | None = Field(default=None, description="what layers fill: a shape, or a table of thicknesses")


def _asked() -> dict[str, Any]:
    """Return what keys of a job become here: their names in plan.json with type and, as description, their help."""
    return {
        key.told or name: (
            field.annotation,
            Field(description=key.help) if key.always else Field(default=field.default, description=key.help),
        )
        for name, key, field in keys_of(Job)
        if key.told != ""
    }


class SettingsRecord(create_model("AskedRecord", __base__=Record, **_asked())):
    """What was asked for, which is every key of a job that tells itself, and with which cell."""

    backend: str | None = Field(default=None, description="that planned; left out where several are compared")
    spacing_mm: float = Field(description="wanted distance between neighbouring paths [mm]")
    patches: list[PatchRegion] = Field(description="where on the body the part lies")
    cell: str = Field(description="name of the cell")
    speed_mm_s: float = Field(description="at which it prints [mm/s]")
    travel_speed_mm_s: float = Field(description="of the tip on travel [mm/s]")
    standoff_mm: float = Field(description="of the tip over what the layer lies on [mm]")
    clearance_mm: float = Field(description="that the tool keeps [mm]")
    retract_mm: float = Field(description="height of travel above the surface [mm]")
    layer_height_mm: float = Field(description="of the layer [mm]")
    needle_mm: float = Field(description="inner diameter of the needle [mm]")
    flow_shares: tuple[float, float] = Field(
        description="least and most of flow that follows, over that of a strip one spacing wide"
    )
    pressure_kpa: float | None = Field(description="of the air [kPa]")
    flood_s: float | None = Field(description="final exposure of the whole part [s]")


class MeshRecord(Record):
    """A mesh."""

    vertices: Count = Field(description="how many")
    faces: Count = Field(description="how many")
    mean_edge_mm: Rounded = Field(description="mean length of an edge [mm]")


def _prepared() -> dict[str, Any]:
    """Return what fields of a report on preparing become here, the repairs first: their types and descriptions."""
    return {
        name: (Count if kind is int else kind, Field(description=what))
        for name, kind, what in (*described(Repairs), *described(PreparationReport))
    }


class PreparationRecord(create_model("PreparedRecord", __base__=Record, **_prepared())):
    """What preparing the mesh changed, and what it found."""


class SideRecord(Record):
    """Which side is printed on."""

    source: str = Field(description="what told it: closed, winding, flip or body")
    turned: bool = Field(description="whether the file's winding was turned")
    agreeing: float | None = Field(description="share of the area that faces as the body below it does")
    sentence: str = Field(description="for the person who prints")


class SurfaceRecord(Record):
    """The part's surface."""

    topology: str = Field(description="in words")
    area_mm2: Rounded = Field(description="[mm2]")
    size_mm: Place = Field(description="of its box along x, y, z [mm]")
    prepared: MeshRecord = Field(description="before refinement")
    refined: MeshRecord = Field(description="planned on")
    preparation: PreparationRecord | None = Field(description="null for several patches: each says what changed")
    side: SideRecord = Field(description="that is printed on")


class FibresRecord(Record):
    """The angles of fibres, by their length."""

    off_mean_deg: Rounded = Field(description="mean angle to the lines that they follow [degrees]")
    off_p95_deg: Rounded = Field(description="95th percentile of that [degrees]")
    helix_mean_deg: Rounded | None = Field(
        default=None,
        description="mean angle to the direction around the axis, positive where they rise to the right, seen from "
        "outside with the axis up [degrees]; left out where the lines have no axis",
    )
    helix_deg: tuple[Rounded, Rounded] | None = Field(
        default=None, description="5th and 95th percentile of that [degrees]; left out with it"
    )


class PathsRecord(Record):
    """The paths as they are printed."""

    runs: Count = Field(description="how many; each starts and stops the dispenser")
    levels: Count = Field(description="how many")
    poses: Count = Field(description="rows of poses.csv")
    deposit_mm: Rounded = Field(description="length of the tip's path on deposit [mm]")
    travel_mm: Rounded = Field(description="length of the tip's path on travel [mm]")
    stops_while_laying: Count = Field(description="at sharp corners, with the valve open")
    corners_rounded: Count = Field(description="how many")
    corners_rounded_mm: tuple[Place, ...] = Field(description="where [mm]")
    corners_split: Count = Field(description="too sharp to be rounded at speed")
    corners_split_mm: tuple[Place, ...] = Field(description="where [mm]")
    fragments: Count = Field(description="runs shorter than five spacings, little more than a start and a stop")
    dropped_runs: Count = Field(
        description="too short to be worth a start: shorter than one spacing or than the valve needs, fibres than three"
    )
    dropped_mm: Rounded = Field(description="their length in all [mm]")
    dropped_mm2: Rounded = Field(description="what they would have filled, length by width [mm2]")
    widths_mm: tuple[Rounded, Rounded] | None = Field(
        default=None, description="least and most that is wanted; left out where paths are one spacing wide [mm]"
    )
    fibres: FibresRecord | None = Field(default=None, description="left out where they follow no lines")
    largest_distance_mm: Rounded = Field(description="from the seed [mm]")
    largest_lean_deg: Rounded = Field(description="of the nozzle from the normal [degrees]")
    mean_lean_deg: Rounded = Field(description="of the nozzle from the normal [degrees]")


class LayerRecord(Record):
    """One skin of material."""

    number: Count = Field(description="from 0, from the part outwards")
    count: Count = Field(default=1, description="of all layers of the thickness")
    bottom_mm: float = Field(default=0.0, description="height over the part at which it begins [mm]")
    height_mm: float = Field(description="that it shall have [mm]")
    pattern: str | None = Field(
        default=None, description="of its paths, with the angle of rows in degrees, where patterns take turns"
    )
    standoff_mm: Rounded = Field(description="of the tip over what the layer lies on [mm]")
    runs: Pair = Field(description="first and last that make it")


class RefinementRecord(Record):
    """How finely the surface was cut."""

    edge_length_mm: Rounded = Field(description="that the backend asked for [mm]")
    faces_before: Count = Field(description="of the prepared surface")
    faces_after: Count = Field(description="of the surface that was planned on")


class FieldRecord(Record):
    """How true the distance is that the paths follow: its slope is 1 where it is exact."""

    refinement: RefinementRecord = Field(description="of the surface")
    mean_slope_error: Rounded = Field(description="off 1, away from where fronts meet")
    p95_slope_error: Rounded = Field(description="its 95th percentile")
    cut_locus_share: Rounded = Field(description="of the area, where fronts meet")


class PatchSpacingRecord(Record):
    """The spacing on one patch, over the wanted one."""

    mean: Rounded | None = Field(description="null with one level")
    cv: Rounded | None = Field(description="standard deviation over mean; null with one level")


class CutRecord(Record):
    """How a patch was cut from its body."""

    body: str = Field(description="that it was cut from")
    topology: str = Field(description="in words")
    area_mm2: Rounded = Field(description="[mm2]")
    rims_mm: tuple[Rounded, ...] = Field(description="length of each rim, the longest first [mm]")
    faces: Count = Field(description="how many")
    outside: str = Field(description="how it is known which side is outside")
    inside: str | None = Field(description="what a drawn curve encloses, and which side of it was taken")
    point_off_body_mm: Rounded | None = Field(description="how far given points lie off the body at most [mm]")
    changes: tuple[str, ...] = Field(description="that preparing made")


class PatchRecord(CutRecord):
    """A patch: how it was cut, and what became of it."""

    place_mm: Place = Field(description="about its middle [mm]")
    runs: Pair = Field(description="first and last that lie on it")
    deposit_mm: Rounded = Field(description="length on deposit [mm]")
    spacing: PatchSpacingRecord = Field(description="over the wanted one")


class ChartLevelRecord(Record):
    """The spacing that the chart predicts for one level, over the wanted one."""

    level: Count = Field(description="from 0, the outermost")
    mean: Rounded = Field(description="ratio")
    min: Rounded = Field(description="ratio")
    max: Rounded = Field(description="ratio")


class AreaScaleRecord(Record):
    """Percentiles of the chart's area over that on the surface; 1 everywhere on a plane."""

    p1: Rounded = Field(description="ratio")
    p50: Rounded = Field(description="ratio")
    p99: Rounded = Field(description="ratio")


class ChartRecord(Record):
    """What flattening does to lengths and areas; of several patches over all, with the coarsest raster."""

    resolution: int = Field(description="pixels along the longer side of the raster")
    pixel_mm: Rounded = Field(description="side of a pixel in the chart [mm]")
    largest_pixel_on_surface_mm: Rounded = Field(description="side of the largest one on the surface [mm]")
    area_scale: AreaScaleRecord = Field(description="of the chart")
    mean_dilatation: Rounded = Field(description="longest over shortest scale of length; 1 is conformal")
    predicted_spacing: tuple[ChartLevelRecord, ...] = Field(description="one over the scale of length, level by level")


class LightRecord(Record):
    """What the lamp gives on its path over the part."""

    one_pass: float = Field(description="dose when the spot passes once [mJ/cm2]")
    all_passes: float = Field(description="mean dose of all passes together [mJ/cm2]")
    wanted: float | None = Field(description="dose that cures the material [mJ/cm2]")
    fastest: float | None = Field(description="speed up to which one pass gives it [mm/s]")
    flood: float | None = Field(description="final exposure of the whole part [s]")


class DepositionRecord(Record):
    """What flows along the paths, and what light falls on it."""

    flow: Literal["constant", "follows the width"] = Field(
        description="that is printed; constant over the wanted width where that differs"
    )
    valve_mm3_s: Rounded = Field(description="that a valve lets through which only opens and shuts [mm3/s]")
    valve_kpa: Rounded | None = Field(
        default=None, description="pressure that lets it through, of a [material] whose flow is fitted [kPa]"
    )
    least_mm3_per_mm: Rounded = Field(description="of a flow that follows the width [mm3/mm]")
    most_mm3_per_mm: Rounded = Field(description="of a flow that follows the width [mm3/mm]")
    printed_mean_within: Rounded = Field(description="share off the mean thickness that 95 of 100 prints keep within")
    light: LightRecord | None = Field(description="null where nobody measured the lamp")


class TimingsRecord(Record):
    """The content of timings.json, which no manifest lists: what varies from run to run."""

    timings_s: dict[str, Thousandths] = Field(description="of each stage [s]")
    peak_memory_mb: Count = Field(description="of the whole process so far [MB]")


class PlanRecord(Record):
    """The content of plan.json; what varies from run to run stands in timings.json."""

    layout: Literal[9] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="of geoprint")
    input: InputRecord = Field(description="file of the part")
    settings: SettingsRecord = Field(description="what was asked for, and with which cell")
    surface: SurfaceRecord = Field(description="of the part")
    paths: PathsRecord = Field(description="as printed")
    layers: tuple[LayerRecord, ...] = Field(description="from the part outwards")
    field: FieldRecord = Field(description="of distance that the paths follow")
    patches: tuple[PatchRecord, ...] = Field(default=(), description="where the part was cut from a body")
    sources: tuple[SourceRecord, ...] = Field(default=(), description="that were tried, where the best was asked for")
    middles: tuple[MiddleRecord, ...] = Field(default=(), description="that were tried, where the best was sought")
    chart: ChartRecord | None = Field(default=None, description="of a backend that works in the plane")
    uniformity: EvennessRecord | None = Field(default=None, description="left out where it was not measured")
    deposition: DepositionRecord | None = Field(default=None, description="of material")
    overhang: OverhangRecord | None = Field(default=None, description="of beads; older versions did not measure it")
    feedback: FeedbackRecord | None = Field(default=None, description="what the last print taught")
    robot: tuple[RobotRecord, ...] = Field(
        description="one a placement of the part, in the order of printing; none without a robot"
    )
    joined: JoinedRecord | None = Field(
        default=None, description="the program of all attitudes; left out where there is one or none"
    )
    not_printable: str | None = Field(default=None, description="why the robot cannot print what was compared")
    warnings: tuple[str, ...] = Field(description="what a person should act on")
    notes: tuple[str, ...] = Field(default=(), description="what a person wants to know before printing")
    details: tuple[str, ...] = Field(default=(), description="what is as it should be, and how it came to be so")
