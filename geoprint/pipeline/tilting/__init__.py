"""Plans over a table that tilts the part."""

from geoprint.pipeline.tilting.division import with_table as with_table
from geoprint.pipeline.tilting.joining import (
    PART as PART,
    attitude_cell as attitude_cell,
    part_folder as part_folder,
)
from geoprint.pipeline.tilting.moving import (
    in_turn as in_turn,
    poses_at_rest as poses_at_rest,
    seen_at_rest as seen_at_rest,
    table_stand as table_stand,
)
from geoprint.pipeline.tilting.printing import with_attitudes as with_attitudes
from geoprint.pipeline.tilting.sweeping import move_clearance as move_clearance, sweep_seconds as sweep_seconds
