"""Results beside a plan: refusals, placements, comparisons, calibrations, measurements and mesh files."""

from __future__ import annotations

from typing import final

from geoprint.config import Job
from geoprint.geometry import Deviation, Inspection, Landmark, PreparationReport
from geoprint.geometry.files import LabelFound, MeshFile
from geoprint.metrics import Printed, RigidFit, Uniformity
from geoprint.model import (
    Cell,
    FloatArray,
    Place,
    Placement,
    Reading,
    Rounded,
    Surface,
    comparable,
    freeze_arrays,
    frozen,
    recorded,
)
from geoprint.results.plan import Plan, result_figure, result_html, result_view, save_result
from geoprint.results.workpiece import Workpiece
from geoprint.robot.placing import FixtureCalibration, FixturePose, TipCalibration, Uncertainty
from geoprint.robot.reach import Exhausted, Margin, ReachMap

# Why a part cannot be printed, and what would change that: what a search at the worst poses and trials found.


@final
@comparable
class TriedChange:
    """A change that frees the worst poses, taken through the whole chain.

    Attributes:
        name: what changes, as a sentence begins with it.
        keys: what a person writes or types for it.
        missing: why it does not print all the same; empty where the whole program is checked.
    """

    name: str
    keys: str
    missing: str

    @property
    def helps(self) -> bool:
        """Whether the part prints with it."""
        return not self.missing


@final
@comparable
class Refusal:
    """A refusal with what stands behind it.

    Attributes:
        exhausted: what the search at the worst poses found.
        screened: changes that were asked at these poses.
        freeing: how many of them free all of these.
        tried: those that were taken through the chain, in that order.
    """

    exhausted: Exhausted
    screened: int
    freeing: int
    tried: tuple[TriedChange, ...]

    @property
    def help(self) -> TriedChange | None:
        """The change with which the part prints, or None where none was found."""
        return next((change for change in self.tried if change.helps), None)


# A placement that was planned through, beside the one that the cell file has.


@final
@frozen
class Proposal:
    """A placement that was planned through, beside the one that the cell file has.

    Attributes:
        plan: of the part where it is proposed to stand.
        placement: of the part there; every check was passed.
        pose: where that is.
        table: where the table that tilts the part stands then, or None without one.
        before: margin where the cell file puts the part.
        map_before: what can be reached there.
        after: margin where it is proposed.
        above: height of the lowest point of part and body over what lies below them [mm]; infinite over free space.
        refused: why better candidates fell, in their order.
    """

    plan: Plan
    placement: Placement
    pose: FixturePose
    table: FixturePose | None
    before: Margin
    map_before: ReachMap
    after: Margin
    above: float
    refused: tuple[str, ...]

    @property
    def better(self) -> bool:
        """Whether the part stands better than where the cell file puts it."""
        return not self.map_before.complete or self.after.angle > self.before.angle


# The same part planned with several backends: what became of each, and of a part that could not be compared.


# The stages whose time is a backend's own.
PLANNING_STAGES = ("contours", "path")


@final
@frozen
class Planned:
    """A backend's outcome.

    Attributes:
        plan: with the robot where the part is printable, without it where it is not.
        not_printable: why the robot cannot print it, or None where it can or was left out.
        lost: reason and share of the deposited length that the arm cannot reach for it, largest first; empty where
            reach is not what refuses.
    """

    plan: Plan
    not_printable: str | None
    lost: tuple[tuple[str, float], ...] = ()

    @property
    def uniformity(self) -> Uniformity:
        """How even its paths are.

        Raises:
            FieldError: the plan holds strokes and poses alone, which nobody has measured.
        """
        return self.plan.evenness

    @property
    def planning_time(self) -> float:
        """Seconds that the backend's own stages took."""
        return sum(seconds for name, seconds in self.plan.timings if name in PLANNING_STAGES)


@final
@frozen
class CellOutcome:
    """What becomes of a part on a cell.

    Attributes:
        name: of the cell, as it was given.
        cell: as its file has it, or None where that cannot be read.
        plan: of the part there, or None where it cannot be printed.
        margin: how far the arm stays from what is refused along the whole motion, or None without a plan.
        refused: why it cannot be printed there, or None.
        lost: share of the deposited length that the arm cannot reach, or None where reach is not what refuses.
    """

    name: str
    cell: Cell | None
    plan: Plan | None
    margin: Margin | None
    refused: str | None
    lost: float | None


@final
@frozen
class CellComparison:
    """A part on several cells.

    Attributes:
        job: that was planned on each; its cell does not count.
        outcomes: in the order of the cells; one has a plan at least.
    """

    job: Job
    outcomes: tuple[CellOutcome, ...]

    @property
    def plans(self) -> tuple[Plan, ...]:
        """The plans that were made."""
        return tuple(each.plan for each in self.outcomes if each.plan is not None)


@final
@comparable
class Refused:
    """A backend that cannot plan on this part.

    Attributes:
        reason: one sentence.
    """

    reason: str


@final
@frozen
class Comparison:
    """The outcomes of several backends on one workpiece.

    Attributes:
        job: what was asked for; its backend is ignored.
        workpiece: the part and cell that all of them planned on.
        outcomes: backend name to outcome, in the order of the table.
    """

    job: Job
    workpiece: Workpiece
    outcomes: tuple[tuple[str, Planned | Refused], ...]

    _repr_html_, view, figure, save = result_html, result_view, result_figure, save_result

    @property
    def plans(self) -> dict[str, Plan]:
        """The plans of those that planned, by name."""
        return {name: outcome.plan for name, outcome in self.planned}

    @property
    def planned(self) -> tuple[tuple[str, Planned], ...]:
        """Those that planned, by name."""
        return tuple((name, outcome) for name, outcome in self.outcomes if isinstance(outcome, Planned))

    @property
    def refused(self) -> tuple[tuple[str, str], ...]:
        """Name and reason of those that did not."""
        return tuple((name, outcome.reason) for name, outcome in self.outcomes if isinstance(outcome, Refused))


@final
@frozen
class FailedPart:
    """A part that could not be compared at all.

    Attributes:
        job: what was asked for.
        reason: one sentence.
    """

    job: Job
    reason: str


# A calibrated cell: its fixture or its tool, how well it is known, and what to touch next.


@final
@recorded("NextTouchRecord", model="fixture_mm", base="base_mm", deviation="deviation_mm", bound="within_mm")
class Suggestion:
    """What to touch next.

    Attributes:
        name: of the point, or which part it lies on.
        again: whether it was touched before.
        model: where it is in the fixture's own frame [mm].
        base: where the tip will be, about, in the base frame [mm].
        deviation: largest standard deviation that is left at the part [mm].
        bound: what the error keeps within there in 95 of 100 calibrations [mm].
    """

    name: str
    again: bool
    model: Place
    base: Place
    deviation: Rounded
    bound: Rounded


@final
@frozen
class CalibratedFixture:
    """A cell whose fixture was touched.

    Attributes:
        cell: as the new file has it.
        text: of the new file.
        names: of the touched points, in their order.
        calibration: the fit and its statistics.
        part: name of the part, or None where the fixture's own extent stands for it.
        position: uncertainty at the corners of the box about the part or the fixture's points, at the worst.
        turn: uncertainty of the attitude.
        surface: uncertainty along the part's normal where it is largest, or None without a part.
        suggestion: what to touch next.
    """

    cell: Cell
    text: str
    names: tuple[str, ...]
    calibration: FixtureCalibration
    part: str | None
    position: Uncertainty
    turn: Uncertainty
    surface: Uncertainty | None
    suggestion: Suggestion


@final
@frozen
class CalibratedTool:
    """A cell whose tool centre point was found.

    Attributes:
        cell: as the new file has it.
        text: of the new file.
        calibration: the fit and its statistics.
        before: (3,) tip of the cell as it was, in the flange frame [mm].
    """

    cell: Cell
    text: str
    calibration: TipCalibration
    before: FloatArray


# What measuring files of toolpaths on a part yields.


@final
@frozen
class MeasuredFile:
    """One file of toolpaths, measured.

    Attributes:
        name: of the file.
        format: that it was read as.
        deposit: how deposit was distinguished from travel.
        points: that were read.
        dropped: runs of a single point, left out.
        reading: what its reader used, skipped and assumed.
        fit: the motion that aligned it with the part, or None where it was taken as it is.
        measured: how evenly it covers the part.
        printed: how even prints of it are expected to be.
        seconds: processor time that measuring took, all threads together [s].
    """

    name: str
    format: str
    deposit: str
    points: int
    dropped: int
    reading: Reading
    fit: RigidFit | None
    measured: Uniformity
    printed: Printed
    seconds: float


@final
@frozen
class Measurement:
    """Files of toolpaths, measured side by side on one part.

    Attributes:
        part: its file as it was read.
        surface: what they were measured on, as prepared.
        upright: (3, 3) rotation that turns the part's mean normal up.
        spacing: wanted [mm].
        files: in the order given, with names that differ.
        cell: name of the one whose flow and errors the prints have.
        own_errors: whether that was given, and says its errors.
    """

    part: MeshFile
    surface: Surface
    upright: FloatArray
    spacing: float
    files: tuple[MeasuredFile, ...]
    cell: str
    own_errors: bool = False

    _repr_html_, view, figure, save = result_html, result_view, result_figure, save_result

    def __post_init__(self) -> None:
        freeze_arrays(self, upright="float: 3 3")


# What was made of a mesh file: its examination, or a part with another mesh.


@final
@frozen
class FileInspection:
    """What the mesh doctor says of a file.

    Attributes:
        name: of the file.
        unit: that it was read in.
        assumed: whether the unit is a guess from the size, because neither file nor user said it.
        hint: where the size is unusual, what that may mean.
        low: (3,) lowest, and
        high: (3,) highest coordinates [mm].
        found: the examination of the mesh.
        regions: name, number of faces and area [mm2] of each that the file has.
        side: what tells which side of it is outside, in words.
        terraces: height of the steps where the surface is a staircase around voxels [mm], else None.
        backends: by name, 'yes', or why a backend cannot plan on it, or that it was 'not tried' and why.
        reading: what was used of the file, skipped and assumed.
        labels: that a label volume holds; empty for other files.
        landmarks: places to find the way by; none where preparing refuses the mesh.
        label: of which the surface is, or None.
    """

    name: str
    unit: str
    assumed: bool
    hint: str | None
    low: tuple[float, ...]
    high: tuple[float, ...]
    found: Inspection
    regions: tuple[tuple[str, int, float], ...]
    side: str
    terraces: float | None
    backends: tuple[tuple[str, str], ...]
    reading: Reading = Reading({}, {}, ())
    labels: tuple[LabelFound, ...] = ()
    landmarks: tuple[Landmark, ...] = ()
    label: int | None = None


@final
@frozen
class VolumeInspection:
    """What is said of a label volume where no label is chosen of several, or no surface can be put around one.

    Attributes:
        name: of the file.
        labels: that it holds.
        refusal: why there is no surface around the label that was chosen or is the only one; None where none was.
        reading: what was used of the file, skipped and assumed.
    """

    name: str
    labels: tuple[LabelFound, ...]
    refusal: str | None
    reading: Reading


@final
@frozen
class Remeshed:
    """A part with another mesh.

    Attributes:
        before: the part as prepared.
        preparation: what preparing changed.
        after: the part with its new mesh.
        steps: what was done, in words.
        deviation: how far the two lie apart.
        allowed: how far they may [mm].
    """

    before: Surface
    preparation: PreparationReport
    after: Surface
    steps: tuple[str, ...]
    deviation: Deviation
    allowed: float
