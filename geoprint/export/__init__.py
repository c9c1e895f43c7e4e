"""What leaves geoprint: RAPID modules, tables and the bundle on disk, each verified before it counts."""

from geoprint.export.bundle import MANIFEST, Json, check_writable, json_bytes, write_bundle
from geoprint.export.orders import Orders, orders_of
from geoprint.export.rapid import rapid_program
from geoprint.export.rapid_cell import check_cell
from geoprint.export.rapid_names import check_names
from geoprint.export.rapid_run import Step
from geoprint.export.rapid_settings import CELL_MODULE, Settings, as_new
from geoprint.export.rapid_verify import program_findings, program_settings, read_back, verify_program
from geoprint.export.setup_file import Setup, read_setup, setup_file
from geoprint.export.switching import Event, TipsAt, switching_events
from geoprint.export.tables import (
    PosesTable,
    TrajectoryTable,
    poses_table,
    read_poses_table,
    read_trajectory_table,
    trajectory_table,
    verify_poses_table,
    verify_trajectory_table,
)
from geoprint.export.targets_table import read_orders, targets_table
from geoprint.export.timeline import Timeline, check_timeline, timeline

__all__ = [
    "CELL_MODULE",
    "MANIFEST",
    "Event",
    "Json",
    "Orders",
    "PosesTable",
    "Settings",
    "Setup",
    "Step",
    "Timeline",
    "TipsAt",
    "TrajectoryTable",
    "as_new",
    "check_cell",
    "check_names",
    "check_timeline",
    "check_writable",
    "json_bytes",
    "orders_of",
    "poses_table",
    "program_findings",
    "program_settings",
    "rapid_program",
    "read_back",
    "read_orders",
    "read_poses_table",
    "read_setup",
    "read_trajectory_table",
    "setup_file",
    "switching_events",
    "targets_table",
    "timeline",
    "trajectory_table",
    "verify_poses_table",
    "verify_program",
    "verify_trajectory_table",
    "write_bundle",
]
