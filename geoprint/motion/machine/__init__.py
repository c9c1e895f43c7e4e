"""What moves the part: the hexapod and the tilt-turn table, their poses, limits and speeds."""

from geoprint.motion.machine.hexapod import SINGULAR_SHARE as SINGULAR_SHARE, HexapodMachine as HexapodMachine
from geoprint.motion.machine.moving import (
    driven_seconds as driven_seconds,
    move_seconds as move_seconds,
    obstacles_at as obstacles_at,
    straight_course as straight_course,
    table_machine as table_machine,
    tilted_placement as tilted_placement,
    turned_course as turned_course,
    work_poses as work_poses,
)
from geoprint.motion.machine.tilt_turn import TiltTurnMachine as TiltTurnMachine
