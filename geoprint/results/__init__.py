"""What pipeline hands on: frozen values that hold every intermediate one of a plan or a comparison; no stages."""

from geoprint.results.calibration import (
    CalibratedFixture as CalibratedFixture,
    CalibratedTool as CalibratedTool,
    Suggestion as Suggestion,
)
from geoprint.results.comparison import (
    Comparison as Comparison,
    FailedPart as FailedPart,
    Planned as Planned,
    Refused as Refused,
)
from geoprint.results.measurement import (
    MeasuredFile as MeasuredFile,
    Measurement as Measurement,
)
from geoprint.results.mesh_files import (
    FileInspection as FileInspection,
    Remeshed as Remeshed,
    VolumeInspection as VolumeInspection,
)
from geoprint.results.plan import (
    Fed as Fed,
    JoinedProgram as JoinedProgram,
    Laid as Laid,
    Layer as Layer,
    Plan as Plan,
    RobotPlan as RobotPlan,
    TriedMiddle as TriedMiddle,
)
from geoprint.results.proposal import (
    Proposal as Proposal,
)
from geoprint.results.refusal import (
    Refusal as Refusal,
    TriedChange as TriedChange,
)
from geoprint.results.stacked import (
    FinishedStack as FinishedStack,
    StackedLayer as StackedLayer,
)
from geoprint.results.tilting import Order as Order, Tilting as Tilting
from geoprint.results.workpiece import (
    Orientation as Orientation,
    Patch as Patch,
    Side as Side,
    StackPlace as StackPlace,
    TargetFile as TargetFile,
    TriedSource as TriedSource,
    Workpiece as Workpiece,
)
