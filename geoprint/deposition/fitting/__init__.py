"""A material fitted to measured lines; pressure, nozzle, speed and spacing that fit each other."""

from geoprint.deposition.fitting.advice import (
    Advice as Advice,
    Beside as Beside,
)
from geoprint.deposition.fitting.fluids import (
    PARAMETERS as PARAMETERS,
    FittedFluid as FittedFluid,
    FluidModel as FluidModel,
    fit_fluid as fit_fluid,
)
from geoprint.deposition.fitting.measured import (
    MeasuredFlow as MeasuredFlow,
    read_measured_flow as read_measured_flow,
)
from geoprint.deposition.fitting.recommendation import (
    Recommendation as Recommendation,
    RelativeSetting as RelativeSetting,
    recommend as recommend,
    relative_setting as relative_setting,
)
