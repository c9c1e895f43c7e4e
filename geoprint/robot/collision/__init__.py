"""What touches what: solids of tool, arm and cell, swept along the motion, and the clearance that is kept."""

from geoprint.robot.collision.arm_clearance import arm_control as arm_control
from geoprint.robot.collision.clearance import (
    CheckedWorld as CheckedWorld,
    ClearanceCheck as ClearanceCheck,
    SinglePoses as SinglePoses,
    clearance as clearance,
)
from geoprint.robot.collision.closest import tool_distances as tool_distances
from geoprint.robot.collision.contact import (
    NOT_TESTED as NOT_TESTED,
    CollisionWorld as CollisionWorld,
    collision_control as collision_control,
    inflated_solids as inflated_solids,
)
from geoprint.robot.collision.surroundings import (
    box_target as box_target,
    mesh_target as mesh_target,
    obstacle_target as obstacle_target,
)
from geoprint.robot.collision.table_motion import table_motion_clearance as table_motion_clearance
from geoprint.robot.collision.tip_zone import SMALLEST_ROOM as SMALLEST_ROOM
from geoprint.robot.collision.tool_solids import (
    link_solids as link_solids,
    polytope as polytope,
    tool_solids as tool_solids,
)
