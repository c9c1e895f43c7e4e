"""Where the part stands: calibration by touches, and the place that suits the arm best."""

from geoprint.motion.placing.calibration import (
    NOTABLE_SHARE as NOTABLE_SHARE,
    FixtureCalibration as FixtureCalibration,
    Uncertainty as Uncertainty,
    calibrate_fixture as calibrate_fixture,
    next_touch as next_touch,
    normal_uncertainty as normal_uncertainty,
    position_uncertainty as position_uncertainty,
    refuse_uncertain as refuse_uncertain,
    turn_uncertainty as turn_uncertainty,
)
from geoprint.motion.placing.placement import demo_placement as demo_placement
from geoprint.motion.placing.placement_search import (
    Candidate as Candidate,
    Room as Room,
    Stand as Stand,
    search_placement as search_placement,
)
from geoprint.motion.placing.tip_calibration import (
    TipCalibration as TipCalibration,
    calibrate_tip as calibrate_tip,
)
from geoprint.motion.placing.touch_statistics import TouchStatistics as TouchStatistics
