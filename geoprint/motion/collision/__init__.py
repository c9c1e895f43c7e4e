"""What touches what: solids of tool, arm and cell, swept along the motion, and the clearance that is kept."""

from geoprint.motion.collision.arm_clearance import (
    arm_control as arm_control,
    runs_hit_by_links as runs_hit_by_links,
)
from geoprint.motion.collision.clearance import (
    ClearanceCheck as ClearanceCheck,
    clearance as clearance,
)
from geoprint.motion.collision.contact import (
    NOT_TESTED as NOT_TESTED,
    CollisionWorld as CollisionWorld,
    collision_control as collision_control,
    inflated_solids as inflated_solids,
)
from geoprint.motion.collision.link_solids import link_solids as link_solids
from geoprint.motion.collision.scene import CheckedWorld as CheckedWorld
from geoprint.motion.collision.single_poses import SinglePoses as SinglePoses
from geoprint.motion.collision.surroundings import (
    box_target as box_target,
    mesh_target as mesh_target,
    obstacle_target as obstacle_target,
)
from geoprint.motion.collision.table_motion import table_motion_clearance as table_motion_clearance
from geoprint.motion.collision.tip_zone import (
    SMALLEST_ROOM as SMALLEST_ROOM,
    TipZone as TipZone,
)
from geoprint.motion.collision.tool_solids import (
    polytope as polytope,
    tool_solids as tool_solids,
)
