"""What moves the part: the hexapod and the tilt-turn table, and which attitude prints what."""

from geoprint.positioner.attitudes import (
    Attitude as Attitude,
    Margins as Margins,
    Tilts as Tilts,
    UpRange as UpRange,
    attitudes_of as attitudes_of,
    gathered as gathered,
    tilted as tilted,
)
from geoprint.positioner.hexapod import SINGULAR_SHARE as SINGULAR_SHARE, HexapodMachine as HexapodMachine
from geoprint.positioner.tilt_turn import (
    TiltTurnMachine as TiltTurnMachine,
    driven_seconds as driven_seconds,
    move_seconds as move_seconds,
    obstacles_at as obstacles_at,
    straight_course as straight_course,
    table_machine as table_machine,
    tilted_placement as tilted_placement,
    turned_course as turned_course,
    work_poses as work_poses,
)
