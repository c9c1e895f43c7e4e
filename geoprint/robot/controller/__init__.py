"""The motion as the controller runs it: targets, zones, interpolation, and the dry run above the part."""

from geoprint.robot.controller.fitting import apexes as apexes, rounded_deviations as rounded_deviations
from geoprint.robot.controller.interpolation import (
    controller_path as controller_path,
    there_and_back as there_and_back,
    written_path as written_path,
)
from geoprint.robot.controller.lifted import (
    LIFT as LIFT,
    LIFTED_STEP as LIFTED_STEP,
    lifted_joints as lifted_joints,
    lifted_path as lifted_path,
)
from geoprint.robot.controller.targets import (
    SHORTEST_TIME as SHORTEST_TIME,
    KnownStretches as KnownStretches,
    close_targets as close_targets,
    tightest_bend as tightest_bend,
    written_targets as written_targets,
)
