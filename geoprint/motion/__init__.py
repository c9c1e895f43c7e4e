"""From poses to a checked trajectory: placement, kinematics, timing and clearance. Metres stay inside."""

from geoprint.motion.aloft import ALOFT_STEP, LIFT, aloft_configuration, aloft_path
from geoprint.motion.arm_clearance import arm_control
from geoprint.motion.calibration import (
    NOTABLE_SHARE,
    FixtureCalibration,
    NextTouch,
    Uncertainty,
    calibrate_fixture,
    next_touch,
    normal_uncertainty,
    position_uncertainty,
    refuse_uncertain,
    turn_uncertainty,
)
from geoprint.motion.clearance import clearance
from geoprint.motion.collision import collision_control
from geoprint.motion.configuration import configuration_data, require_abb_conventions
from geoprint.motion.controller import controller_path, there_and_back
from geoprint.motion.inverse import reach, reach_map, reach_margin
from geoprint.motion.kinematics import Arm
from geoprint.motion.lean_room import Leaning, NozzleRoom, laying
from geoprint.motion.margins import Margin
from geoprint.motion.nozzle import is_axial, tilts
from geoprint.motion.payload import WristLoad, check_load, wrist_load
from geoprint.motion.placement import demo_placement, fit_touched_points
from geoprint.motion.placement_search import Candidate, Room, Stand, search_placement
from geoprint.motion.reach_map import ReachMap, Reason, lost_shares
from geoprint.motion.targets import close_targets, written_targets
from geoprint.motion.timing import retime
from geoprint.motion.tip_calibration import TipCalibration, calibrate_tip
from geoprint.motion.tips import joints_at, tips_at
from geoprint.motion.touch_statistics import TouchStatistics

__all__ = [
    "ALOFT_STEP",
    "LIFT",
    "NOTABLE_SHARE",
    "Arm",
    "Candidate",
    "FixtureCalibration",
    "Leaning",
    "Margin",
    "NextTouch",
    "NozzleRoom",
    "ReachMap",
    "Reason",
    "Room",
    "Stand",
    "TipCalibration",
    "TouchStatistics",
    "Uncertainty",
    "WristLoad",
    "aloft_configuration",
    "aloft_path",
    "arm_control",
    "calibrate_fixture",
    "calibrate_tip",
    "check_load",
    "clearance",
    "close_targets",
    "collision_control",
    "configuration_data",
    "controller_path",
    "demo_placement",
    "fit_touched_points",
    "is_axial",
    "joints_at",
    "laying",
    "lost_shares",
    "next_touch",
    "normal_uncertainty",
    "position_uncertainty",
    "reach",
    "reach_map",
    "reach_margin",
    "refuse_uncertain",
    "require_abb_conventions",
    "retime",
    "search_placement",
    "there_and_back",
    "tilts",
    "tips_at",
    "turn_uncertainty",
    "wrist_load",
    "written_targets",
]
