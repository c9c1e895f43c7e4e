"""When the arm is where: TOPP-RA, the speed profile of the tip, slowdowns, and what is verified of them."""

from geoprint.robot.timing.confirmation import (
    UNCONFIRMED_SPEEDS as UNCONFIRMED_SPEEDS,
    unconfirmed_speeds as unconfirmed_speeds,
)
from geoprint.robot.timing.knots import OffMoves as OffMoves, held_straight as held_straight, off_moves as off_moves
from geoprint.robot.timing.moments import joints_at as joints_at, largest_jerk as largest_jerk, tips_at as tips_at
from geoprint.robot.timing.print_speed import (
    ramp_delay as ramp_delay,
    ramp_delays as ramp_delays,
    timed_print as timed_print,
    timed_targets as timed_targets,
)
from geoprint.robot.timing.retiming import retime as retime
from geoprint.robot.timing.slowdown import Slowed as Slowed, slowed_shares as slowed_shares
