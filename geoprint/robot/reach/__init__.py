"""Turn, lean and branch of a stream of poses: the motion of the joints that reaches all of them."""

from geoprint.robot.reach.costs import LARGEST_JUMP as LARGEST_JUMP
from geoprint.robot.reach.exhaustion import (
    COARSE_TURN_STEP as COARSE_TURN_STEP,
    Exhausted as Exhausted,
    Exhaustion as Exhaustion,
    Grid as Grid,
    JudgedPose as JudgedPose,
    Worst as Worst,
)
from geoprint.robot.reach.inverse import reach as reach, reach_map as reach_map, reach_margin as reach_margin
from geoprint.robot.reach.keyframes import (
    TURN_STEP as TURN_STEP,
    Margin as Margin,
    PoseSamples as PoseSamples,
    angle_margins as angle_margins,
    bead_steps as bead_steps,
    keyframes as keyframes,
    sample_poses as sample_poses,
    smallest_margin as smallest_margin,
    tip_lengths as tip_lengths,
    tool_poses as tool_poses,
    turns as turns,
)
from geoprint.robot.reach.lean_room import Leaning as Leaning, NozzleRoom as NozzleRoom, depositing as depositing
from geoprint.robot.reach.quadrants import frame_room as frame_room
from geoprint.robot.reach.reach_map import ReachMap as ReachMap, lost_shares as lost_shares
