"""From poses to a checked trajectory: placement, kinematics, timing and clearance. Metres stay inside."""

from geoprint.motion.aloft import ALOFT_STEP, LIFT, aloft_path
from geoprint.motion.arm_clearance import arm_control
from geoprint.motion.clearance import clearance
from geoprint.motion.collision import collision_control
from geoprint.motion.configuration import configuration_data
from geoprint.motion.controller import controller_path, there_and_back
from geoprint.motion.inverse import reach, reach_map, reach_margin
from geoprint.motion.kinematics import Arm
from geoprint.motion.margins import Margin
from geoprint.motion.placement import demo_placement, fit_touched_points
from geoprint.motion.placement_search import Candidate, Room, Stand, search_placement
from geoprint.motion.reach_map import ReachMap, Reason, lost_shares
from geoprint.motion.targets import written_targets
from geoprint.motion.timing import retime
from geoprint.motion.tips import joints_at, tips_at

__all__ = [
    "ALOFT_STEP",
    "LIFT",
    "Arm",
    "Candidate",
    "Margin",
    "ReachMap",
    "Reason",
    "Room",
    "Stand",
    "aloft_path",
    "arm_control",
    "clearance",
    "collision_control",
    "configuration_data",
    "controller_path",
    "demo_placement",
    "fit_touched_points",
    "joints_at",
    "lost_shares",
    "reach",
    "reach_map",
    "reach_margin",
    "retime",
    "search_placement",
    "there_and_back",
    "tips_at",
    "written_targets",
]
