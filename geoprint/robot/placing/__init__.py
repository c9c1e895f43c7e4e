"""Where the part stands: calibration by touches, and the place that suits the arm best."""

from geoprint.robot.placing.calibration import (
    NOTABLE_SHARE as NOTABLE_SHARE,
    FixtureCalibration as FixtureCalibration,
    TipCalibration as TipCalibration,
    TouchStatistics as TouchStatistics,
    Uncertainty as Uncertainty,
    calibrate_fixture as calibrate_fixture,
    calibrate_tip as calibrate_tip,
    next_touch as next_touch,
    normal_uncertainty as normal_uncertainty,
    position_uncertainty as position_uncertainty,
    refuse_uncertain as refuse_uncertain,
    turn_uncertainty as turn_uncertainty,
)
from geoprint.robot.placing.orientation_search import (
    ROUND_SOLIDS as ROUND_SOLIDS,
    Oriented as Oriented,
    Scene as Scene,
    search_orientation as search_orientation,
)
from geoprint.robot.placing.placement import (
    LEAST_MEAN_NORMAL as LEAST_MEAN_NORMAL,
    SHORTEST_MEAN_NORMAL as SHORTEST_MEAN_NORMAL,
    demo_placement as demo_placement,
)
from geoprint.robot.placing.placement_search import (
    Candidate as Candidate,
    FixturePose as FixturePose,
    Room as Room,
    search_placement as search_placement,
)
