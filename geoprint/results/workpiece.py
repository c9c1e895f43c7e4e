"""What was planned on: the part as read, prepared and refined, where it was cut from and where it stands."""

from __future__ import annotations

from typing import final

from geoprint.config import StoredField
from geoprint.geometry import PreparationReport, upright_of
from geoprint.geometry.files import MeshFile
from geoprint.model import Cell, Count, FloatArray, Placement, Rounded, Source, Surface, freeze_arrays, frozen, recorded
from geoprint.process import WidthsOver
from geoprint.robot.placing import Uncertainty


@final
@recorded("SideRecord")
class Side:
    """How the printed side was found.

    Attributes:
        source: basis of the side: 'closed' (outward), 'winding' (the file's), 'flip' (turned on request) or 'body'
            (found from the body).
        turned: whether the file's winding was turned.
        agreeing: share of the part's area that faces as the body below it does; None where no closed body was
            given.
        sentence: sentence on the side for the person who prints.
    """

    source: str
    turned: bool
    agreeing: float | None
    sentence: str


@final
@frozen
class Patch:
    """A patch cut from a body.

    Attributes:
        surface: the patch, as prepared.
        preparation: what joining the body and preparing the surroundings and the patch changed, and the patch.
        body: the whole surface it was cut from, joined and facing outward where it is closed.
        outside: how it is known which side is outside.
        missed: how far the given points lie off the body at most [mm], or None without a point.
        inside: what a drawn curve encloses and which side of it was taken, or None without one.
    """

    surface: Surface
    preparation: PreparationReport
    body: Surface
    outside: str
    missed: float | None
    inside: str | None


@final
@frozen
class Orientation:
    """How a demonstration was turned, because with its mean normal up it is refused.

    Attributes:
        rpy: (3,) roll, pitch, yaw about the fixed axes of the base, after its mean normal was turned up [rad].
        tilt: angle of the mean normal from upright [rad].
        margin: of the coarse motion that reaches it there, from limits and singularities [rad].
        tried: how many orientations were tried.
        start: why it is refused with its mean normal up.
        refused: why those before it in the search's order are.
    """

    rpy: FloatArray
    tilt: float
    margin: float
    tried: int
    start: str
    refused: tuple[str, ...]

    def __post_init__(self) -> None:
        freeze_arrays(self, rpy="float: 3")


@final
@frozen
class Moved:
    """Where a demonstration was moved, because where the cell puts it, it is refused however it is turned.

    Attributes:
        position: (3,) of its centroid in the base frame [mm].
        rpy: (3,) roll, pitch, yaw about the fixed axes of the base, after its mean normal was turned up [rad].
        start: why it is refused where the cell puts it.
    """

    position: FloatArray
    rpy: FloatArray
    start: str

    def __post_init__(self) -> None:
        freeze_arrays(self, position="float: 3", rpy="float: 3")


@final
@frozen
class TargetFile:
    """What layers shall fill, as it was read: a shape, or a table of thicknesses.

    Attributes:
        name: of the file.
        digest: SHA-256 of its bytes.
        unit: of its lengths.
        stored: from which it is read again.
        content: the shape, as prepared; or (k, 4) places on the part and the thickness there [mm].
    """

    name: str
    digest: str
    unit: str
    stored: bytes
    content: Surface | FloatArray


@final
@frozen
class StackPlace:
    """Where a layer lies in its stack.

    Attributes:
        number: of the layer, from 1, from the part outwards.
        count: of all layers.
        bottom: height over the part at which it begins [mm].
        height: its own [mm].
        base: the part that the lowest layer lies on.
        ground: what this layer lies on: the part, or the top of what lies below with its sides.
        standing_out: how much of it stands out over the layer below by more than its own height [mm2].
        left_out: how much of it is in pieces too narrow for a path [mm2].
        target: what the layers fill, as it was read; None for one thickness everywhere.
    """

    number: int
    count: int
    bottom: float
    height: float
    base: Surface
    ground: Surface
    standing_out: float = 0.0
    left_out: float = 0.0
    target: TargetFile | None = None

    @property
    def middle(self) -> float:
        """Height over the part at which its paths lie [mm]."""
        return self.bottom + self.below

    @property
    def below(self) -> float:
        """How far its paths lie over what it lies on [mm]: they run in its middle."""
        return self.height / 2.0


@final
@recorded("SourceRecord")
class TriedSource:
    """A source that distance may be measured from on a patch, and how its paths cover the patch.

    Attributes:
        patch: number of the patch, from 1.
        source: source in words, as `--from` takes it.
        gap: share of the area that no path covers.
        overlap: share of the area that is covered twice.
        cv: coefficient of variation of the spacing; not a number where there is one level.
        runs: number of runs.
        taken: whether the source is the one that was taken.
    """

    patch: int
    source: str
    gap: Rounded
    overlap: Rounded
    cv: Rounded
    runs: Count
    taken: bool


@final
@frozen
class Workpiece:
    """What every backend of a job starts from.

    Attributes:
        cell: the machine.
        part: the surface as prepared, before refinement.
        side: which side of the part is printed on, and how that was found.
        body: what the part lies on, which is what it was cut from where the job names no other; or None.
        files: the part's mesh and, where the job names one, the body's, as they were read.
        cell_text: of the cell's file, or None for the cell that comes with geoprint.
        patches: that the part was cut from its body as, none where the file is the part; its pieces are in their order.
        preparations: what preparing changed, patch by patch.
        edge_length: that the part was refined to [mm], the shortest of all patches.
        surface: the refined surface to plan on, in as many pieces.
        source: where distance is zero.
        placement: where the part stands, or None where the job leaves the robot out.
        uncertainty: of the calibration along the part's normal, where it is largest; None where nobody calibrated or
            stated the part's place on the fixture, or the robot is left out.
        turnable: whether a demonstration that cannot be printed as it stands may be turned, or moved.
        orientation: how it was turned, or None where it stands as it did.
        moved: where it was moved, or None where it stands where the cell puts it.
        tried: sources of patches whose best one was sought, in the order of the patches.
        place: of the layer in its stack, whose middle the part then is; None of a single skin.
        field: the file that says which lines fibres follow, with those that it names; or None.
        widths: how wide fibres are, or None where that is the spacing everywhere.
        feedback_text: of the appraisal of the last print, or None.
    """

    cell: Cell
    part: Surface
    side: Side
    body: Surface | None
    files: tuple[MeshFile, ...]
    cell_text: str | None
    patches: tuple[Patch, ...]
    preparations: tuple[PreparationReport, ...]
    edge_length: float
    surface: Surface
    source: Source
    placement: Placement | None
    uncertainty: Uncertainty | None
    turnable: bool = False
    orientation: Orientation | None = None
    moved: Moved | None = None
    tried: tuple[TriedSource, ...] = ()
    place: StackPlace | None = None
    field: StoredField | None = None
    widths: WidthsOver | None = None
    feedback_text: str | None = None

    @property
    def base(self) -> Surface:
        """What stands in the cell: the part, or what the lowest layer lies on."""
        return self.part if self.place is None else self.place.base

    @property
    def ground(self) -> Surface:
        """What material is deposited on: the part, or what the layer lies on."""
        return self.part if self.place is None else self.place.ground

    @property
    def below(self) -> float:
        """How far that lies below the paths [mm]."""
        return 0.0 if self.place is None else self.place.below

    @property
    def standoff(self) -> float:
        """Height of the tip over the paths on deposit [mm]; the cell's counts from what they are deposited on."""
        return self.cell.process.standoff - self.below

    @property
    def name(self) -> str:
        """Of the part's file."""
        return self.files[0].name

    @property
    def surface_within(self) -> float | None:
        """What the surface is known within along its normal, in 95 of 100 calibrations [mm]; None as `uncertainty`."""
        return None if self.uncertainty is None else self.uncertainty.bound

    @property
    def upright(self) -> FloatArray:
        """How the part stands; where nobody places it its mean normal is up, or its own z axis without one."""
        if self.placement is not None:
            return self.placement.T_base_work[:3, :3]
        return upright_of(self.part)
