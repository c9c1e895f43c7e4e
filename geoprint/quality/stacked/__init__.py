"""How thick a stack of layers becomes: what each lays over places of the part, and all of them against their target.

- `columns`: places of the part, spread evenly by area, and what stands on them at a height;
- `flows`: what a program lays along its path, as it was executed;
- `finished`: the sum of all layers against what was wanted.
"""

from geoprint.quality.stacked.columns import (
    ColumnFeet as ColumnFeet,
    column_feet as column_feet,
    have_met as have_met,
    laid_over as laid_over,
    wanted_over as wanted_over,
    within_sides as within_sides,
)
from geoprint.quality.stacked.finished import Finished as Finished, finished as finished
from geoprint.quality.stacked.flows import (
    deposited_shares as deposited_shares,
    executed_flow as executed_flow,
    flow_of_all as flow_of_all,
    laid_volume as laid_volume,
)
