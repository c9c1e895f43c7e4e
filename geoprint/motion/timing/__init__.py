"""When the arm is where: TOPP-RA, the pace of the tip, slowdowns, and what is verified of them."""

from geoprint.motion.timing.confirmation import unconfirmed_speeds as unconfirmed_speeds
from geoprint.motion.timing.moments import (
    joints_at as joints_at,
    largest_jerk as largest_jerk,
    tips_at as tips_at,
)
from geoprint.motion.timing.print_speed import (
    ramp_delay as ramp_delay,
    timed_print as timed_print,
)
from geoprint.motion.timing.retiming import retime as retime
from geoprint.motion.timing.slowdown import (
    Slowed as Slowed,
    slowed_shares as slowed_shares,
)
from geoprint.motion.timing.spacing import timed_targets as timed_targets
from geoprint.motion.timing.straight_moves import (
    OffMoves as OffMoves,
    held_straight as held_straight,
    off_moves as off_moves,
)
