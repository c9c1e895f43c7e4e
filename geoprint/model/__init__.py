"""The nouns of geoprint: frozen values that stages take and return. No algorithm lives here."""

from geoprint.model.arrays import (
    BoolArray as BoolArray,
    FloatArray as FloatArray,
    IntArray as IntArray,
    freeze_arrays as freeze_arrays,
)
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
from geoprint.model.dispensing import Dispensing as Dispensing
from geoprint.model.material import (
    Fluid as Fluid,
    Material as Material,
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
from geoprint.model.path import (
    PoseStream as PoseStream,
    Toolpath as Toolpath,
)
from geoprint.model.polylines import Polylines as Polylines
from geoprint.model.print_errors import (
    ACCURACY_LENGTH as ACCURACY_LENGTH,
    PATH_FACTOR as PATH_FACTOR,
    POSE_FACTOR as POSE_FACTOR,
    PrintErrors as PrintErrors,
)
from geoprint.model.process import (
    FLOW_SHARES as FLOW_SHARES,
    GAP_SHARE as GAP_SHARE,
    OVERLAP_SHARE as OVERLAP_SHARE,
    PASCAL_PER_KPA as PASCAL_PER_KPA,
    Flood as Flood,
    GoodPrint as GoodPrint,
    Process as Process,
    Purge as Purge,
    SignalMode as SignalMode,
    Signals as Signals,
)
from geoprint.model.readings import (
    Reading as Reading,
    reading as reading,
)
from geoprint.model.surface import (
    Contours as Contours,
    FollowedLines as FollowedLines,
    ScalarField as ScalarField,
    Seed as Seed,
    Strokes as Strokes,
    Surface as Surface,
    SurfaceCurves as SurfaceCurves,
    SurfacePoints as SurfacePoints,
)
from geoprint.model.table import (
    Cylinder as Cylinder,
    Hexapod as Hexapod,
    TablePose as TablePose,
    TiltingTable as TiltingTable,
    TiltTurn as TiltTurn,
)
from geoprint.model.values import (
    comparable as comparable,
    described as described,
    frozen as frozen,
)
