"""The process: how much material flows, what bead it makes, how wide it shall be, what cures it, what a path needs."""

from geoprint.process.bead import (
    bead_width as bead_width,
    following_flow as following_flow,
    strand_diameter as strand_diameter,
)
from geoprint.process.curing import (
    Exposure as Exposure,
    bottom_doses as bottom_doses,
    cured_depth as cured_depth,
    exposure as exposure,
)
from geoprint.process.rheology import (
    Bore as Bore,
    PressureBudget as PressureBudget,
    bore_of as bore_of,
    flow_through as flow_through,
    pressure_for as pressure_for,
    starting_pressure as starting_pressure,
)
from geoprint.process.widths import (
    WidthRule as WidthRule,
    WidthsAbout as WidthsAbout,
    WidthsAlong as WidthsAlong,
    WidthsBetween as WidthsBetween,
    WidthsOver as WidthsOver,
    between as between,
)
