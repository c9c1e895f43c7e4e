"""From poses to a checked trajectory: placement, kinematics, timing and clearance. Metres stay inside."""

from geoprint.motion.arm_clearance import arm_control
from geoprint.motion.clearance import clearance
from geoprint.motion.collision import collision_control
from geoprint.motion.controller import controller_path
from geoprint.motion.inverse import reach
from geoprint.motion.kinematics import Arm
from geoprint.motion.placement import demo_placement, fit_touched_points
from geoprint.motion.targets import written_targets
from geoprint.motion.timing import retime

__all__ = [
    "Arm",
    "arm_control",
    "clearance",
    "collision_control",
    "controller_path",
    "demo_placement",
    "fit_touched_points",
    "reach",
    "retime",
    "written_targets",
]
