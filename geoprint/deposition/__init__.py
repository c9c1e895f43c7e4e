"""The process: how much material flows, what bead it makes, what cures it, and the flow that a path needs."""

from geoprint.deposition.bead import Bead, bead, flow_for
from geoprint.deposition.curing import Exposure, dose_of_pass, dose_of_passes, exposure, fastest_curing
from geoprint.deposition.fitting import PARAMETERS, FittedFluid, FluidModel, fit_fluid
from geoprint.deposition.following import following_flow
from geoprint.deposition.measured import MeasuredFlow, read_measured_flow
from geoprint.deposition.recommendation import Recommendation, RelativeSetting, recommend, relative_setting
from geoprint.deposition.rheology import (
    Bore,
    PressureBudget,
    bore_of,
    flow_through,
    pressure_for,
    starting_pressure,
)

__all__ = [
    "PARAMETERS",
    "Bead",
    "Bore",
    "Exposure",
    "FittedFluid",
    "FluidModel",
    "MeasuredFlow",
    "PressureBudget",
    "Recommendation",
    "RelativeSetting",
    "bead",
    "bore_of",
    "dose_of_pass",
    "dose_of_passes",
    "exposure",
    "fastest_curing",
    "fit_fluid",
    "flow_for",
    "flow_through",
    "following_flow",
    "pressure_for",
    "read_measured_flow",
    "recommend",
    "relative_setting",
    "starting_pressure",
]
