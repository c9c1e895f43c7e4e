"""The nouns of geoprint: frozen values that stages take and return. No algorithm lives here."""

from geoprint.model.arrays import BoolArray, FloatArray, IntArray
from geoprint.model.cell import (
    Box,
    Cell,
    Lamp,
    LoadLimits,
    Placement,
    Robot,
    SearchWeights,
    Tool,
    TouchedPoints,
)
from geoprint.model.material import Fluid, Material
from geoprint.model.motion import (
    Clearance,
    ControllerPath,
    JointPath,
    OnSlowdown,
    Program,
    Slowdown,
    Targets,
    Trajectory,
)
from geoprint.model.path import PoseStream, Toolpath
from geoprint.model.process import PASCAL_PER_KPA, Flood, GoodPrint, Process, Purge, SignalMode, Signals
from geoprint.model.surface import Contours, ScalarField, Seed, Surface, SurfaceCurves, SurfacePoints

__all__ = [
    "PASCAL_PER_KPA",
    "BoolArray",
    "Box",
    "Cell",
    "Clearance",
    "Contours",
    "ControllerPath",
    "FloatArray",
    "Flood",
    "Fluid",
    "GoodPrint",
    "IntArray",
    "JointPath",
    "Lamp",
    "LoadLimits",
    "Material",
    "OnSlowdown",
    "Placement",
    "PoseStream",
    "Process",
    "Program",
    "Purge",
    "Robot",
    "ScalarField",
    "SearchWeights",
    "Seed",
    "SignalMode",
    "Signals",
    "Slowdown",
    "Surface",
    "SurfaceCurves",
    "SurfacePoints",
    "Targets",
    "Tool",
    "Toolpath",
    "TouchedPoints",
    "Trajectory",
]
