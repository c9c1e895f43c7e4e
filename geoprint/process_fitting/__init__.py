"""Process settings from measurements: the fluid that measured lines fit, and what fits a pressure."""

from geoprint.process_fitting.fitting import (
    Advice as Advice,
    Beside as Beside,
    FittedFluid as FittedFluid,
    MeasuredFlow as MeasuredFlow,
    Recommendation as Recommendation,
    RelativeSetting as RelativeSetting,
    fit_fluid as fit_fluid,
    read_measured_flow as read_measured_flow,
    recommend as recommend,
    relative_setting as relative_setting,
)
from geoprint.process_fitting.recommending import fit_flow as fit_flow, recommendation as recommendation
