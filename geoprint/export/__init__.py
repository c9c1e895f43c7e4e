"""What leaves geoprint: RAPID modules, tables and the bundle on disk, each verified before it counts."""

from geoprint.export.bundle import Json, check_writable, json_bytes, write_bundle
from geoprint.export.rapid import rapid_program
from geoprint.export.rapid_cell import check_cell
from geoprint.export.rapid_verify import verify_program
from geoprint.export.tables import (
    poses_table,
    read_poses_table,
    read_trajectory_table,
    trajectory_table,
    verify_poses_table,
    verify_trajectory_table,
)

__all__ = [
    "Json",
    "check_cell",
    "check_writable",
    "json_bytes",
    "poses_table",
    "rapid_program",
    "read_poses_table",
    "read_trajectory_table",
    "trajectory_table",
    "verify_poses_table",
    "verify_program",
    "verify_trajectory_table",
    "write_bundle",
]
