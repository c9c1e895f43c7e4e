"""The nouns of geoprint: frozen values that stages take and return. No algorithm lives here."""

from geoprint.model.cell import (
    Box as Box,
    Cell as Cell,
    Lamp as Lamp,
    LoadLimits as LoadLimits,
    Obstacle as Obstacle,
    Placement as Placement,
    Robot as Robot,
    SearchWeights as SearchWeights,
    Tool as Tool,
    TouchedPoints as TouchedPoints,
)
from geoprint.model.motion import (
    Bend as Bend,
    Clearance as Clearance,
    ControllerPath as ControllerPath,
    Eased as Eased,
    JointPath as JointPath,
    OnSlowdown as OnSlowdown,
    Program as Program,
    Slowdown as Slowdown,
    Targets as Targets,
    Trajectory as Trajectory,
)
from geoprint.model.path import PoseStream as PoseStream, Toolpath as Toolpath
from geoprint.model.process import (
    ACCURACY_LENGTH as ACCURACY_LENGTH,
    FLOW_SHARES as FLOW_SHARES,
    GAP_SHARE as GAP_SHARE,
    OVERLAP_SHARE as OVERLAP_SHARE,
    PASCAL_PER_KPA as PASCAL_PER_KPA,
    PATH_FACTOR as PATH_FACTOR,
    POSE_FACTOR as POSE_FACTOR,
    Dispensing as Dispensing,
    Flood as Flood,
    Fluid as Fluid,
    GoodPrint as GoodPrint,
    Material as Material,
    PrintErrors as PrintErrors,
    Process as Process,
    Purge as Purge,
    SignalMode as SignalMode,
    Signals as Signals,
)
from geoprint.model.surface import (
    Contours as Contours,
    FollowedLines as FollowedLines,
    Paths as Paths,
    Polylines as Polylines,
    Reading as Reading,
    ScalarField as ScalarField,
    Source as Source,
    Surface as Surface,
    SurfaceCurves as SurfaceCurves,
    SurfacePoints as SurfacePoints,
    reading as reading,
)
from geoprint.model.table import (
    Cylinder as Cylinder,
    Hexapod as Hexapod,
    TablePose as TablePose,
    TiltingTable as TiltingTable,
    TiltTurn as TiltTurn,
)
from geoprint.model.values import (
    BoolArray as BoolArray,
    FloatArray as FloatArray,
    IntArray as IntArray,
    OptionValue as OptionValue,
    Table as Table,
    comparable as comparable,
    described as described,
    freeze_arrays as freeze_arrays,
    frozen as frozen,
    table_of as table_of,
)
