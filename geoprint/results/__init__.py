"""What `workflow` hands on: frozen values that hold every intermediate one of a plan or a comparison; no stages."""

from geoprint.results.outcomes import (
    CalibratedFixture as CalibratedFixture,
    CalibratedTool as CalibratedTool,
    CellComparison as CellComparison,
    CellOutcome as CellOutcome,
    Comparison as Comparison,
    FailedPart as FailedPart,
    FileInspection as FileInspection,
    MeasuredFile as MeasuredFile,
    Measurement as Measurement,
    Planned as Planned,
    Proposal as Proposal,
    Refusal as Refusal,
    Refused as Refused,
    Remeshed as Remeshed,
    Suggestion as Suggestion,
    TriedChange as TriedChange,
    VolumeInspection as VolumeInspection,
)
from geoprint.results.plan import (
    DepositedLayer as DepositedLayer,
    Fed as Fed,
    JoinedProgram as JoinedProgram,
    Layer as Layer,
    Order as Order,
    Plan as Plan,
    RobotPlan as RobotPlan,
    Tilting as Tilting,
    TriedMedialAxis as TriedMedialAxis,
)
from geoprint.results.workpiece import (
    Moved as Moved,
    Orientation as Orientation,
    Patch as Patch,
    Side as Side,
    StackPlace as StackPlace,
    TargetFile as TargetFile,
    TriedSource as TriedSource,
    Workpiece as Workpiece,
)
