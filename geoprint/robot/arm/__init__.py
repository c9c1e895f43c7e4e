"""The arm: its URDF, forward and inverse kinematics, configuration data, and the load on its flange."""

from geoprint.robot.arm.calibration import CALIBRATED_ARMS as CALIBRATED_ARMS, calibrated_urdf as calibrated_urdf
from geoprint.robot.arm.configuration import (
    BORDER_MARGIN as BORDER_MARGIN,
    BORDERED as BORDERED,
    QUARTER_TURN as QUARTER_TURN,
    border_distances as border_distances,
    bordered_joints as bordered_joints,
    branch_of as branch_of,
    check_load as check_load,
    configuration_data as configuration_data,
    require_abb_conventions as require_abb_conventions,
    singularity_distances as singularity_distances,
    wrist_angles as wrist_angles,
)
from geoprint.robot.arm.confirmation import (
    UNCONFIRMED_KINEMATICS as UNCONFIRMED_KINEMATICS,
    unconfirmed_kinematics as unconfirmed_kinematics,
)
from geoprint.robot.arm.kinematics import (
    Arm as Arm,
    about_nozzle as about_nozzle,
    is_axial as is_axial,
    tilts as tilts,
    turned as turned,
)
from geoprint.robot.arm.ortho_parallel import BRANCHES as BRANCHES, JOINTS as JOINTS
from geoprint.robot.arm.three_parallel import singular_terms as singular_terms, solve_either as solve_either
from geoprint.robot.arm.urdf import (
    FLANGE_FRAME as FLANGE_FRAME,
    MILLIMETRES_PER_METRE as MILLIMETRES_PER_METRE,
    LinkShape as LinkShape,
    chain_of as chain_of,
    link_shapes as link_shapes,
    origin_of as origin_of,
    read_urdf as read_urdf,
    read_urdf_file as read_urdf_file,
)
