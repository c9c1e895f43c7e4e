"""From poses to a checked trajectory: placement, kinematics, timing and clearance. Metres stay inside."""

from geoprint.motion.arm_clearance import arm_control
from geoprint.motion.clearance import clearance
from geoprint.motion.collision import collision_control
from geoprint.motion.controller import controller_path
from geoprint.motion.inverse import reach, reach_map, reach_margin
from geoprint.motion.kinematics import Arm
from geoprint.motion.margins import Margin
from geoprint.motion.placement import demo_placement, fit_touched_points
from geoprint.motion.placement_search import Candidate, Room, Stand, search_placement
from geoprint.motion.reach_map import ReachMap, Reason, lost_shares
from geoprint.motion.targets import close_targets, written_targets
from geoprint.motion.timing import retime

__all__ = [
    "Arm",
    "Candidate",
    "Margin",
    "ReachMap",
    "Reason",
    "Room",
    "Stand",
    "arm_control",
    "clearance",
    "close_targets",
    "collision_control",
    "controller_path",
    "demo_placement",
    "fit_touched_points",
    "lost_shares",
    "reach",
    "reach_map",
    "reach_margin",
    "retime",
    "search_placement",
    "written_targets",
]
