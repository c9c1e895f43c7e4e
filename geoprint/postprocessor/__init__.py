"""The post-processor: RAPID modules, tables and the bundle on disk, each verified before it counts."""

from typing import TYPE_CHECKING

from geoprint.lazy import attached
from geoprint.postprocessor.bundle import (
    EVIDENCE as EVIDENCE,
    MANIFEST as MANIFEST,
    PLAN as PLAN,
    TIMINGS as TIMINGS,
    Json as Json,
    check_writable as check_writable,
    json_bytes as json_bytes,
    seal as seal,
    staging as staging,
    write_bundle as write_bundle,
)
from geoprint.postprocessor.execution import (
    Executed as Executed,
    NotExecuted as NotExecuted,
    OwnProgram as OwnProgram,
    Settings as Settings,
    StackProof as StackProof,
    StackSettings as StackSettings,
    Switched as Switched,
)
from geoprint.postprocessor.expected import expected_events as expected_events, expected_waits as expected_waits
from geoprint.postprocessor.ordering import orders_of as orders_of
from geoprint.postprocessor.orders import Event as Event, Orders as Orders, TipsAt as TipsAt
from geoprint.postprocessor.setup_file import Setup as Setup, read_setup as read_setup, setup_file as setup_file
from geoprint.postprocessor.switching import waits as waits
from geoprint.postprocessor.tables import (
    FEEDBACK_TABLE as FEEDBACK_TABLE,
    PosesTable as PosesTable,
    TrajectoryTable as TrajectoryTable,
    feedback_table as feedback_table,
    poses_table as poses_table,
    read_orders as read_orders,
    read_poses_table as read_poses_table,
    read_trajectory_table as read_trajectory_table,
    read_wanted_flow as read_wanted_flow,
    targets_table as targets_table,
    trajectory_table as trajectory_table,
    verify_poses_table as verify_poses_table,
    verify_trajectory_table as verify_trajectory_table,
)
from geoprint.postprocessor.timeline import Timeline as Timeline, check_timeline as check_timeline, timeline as timeline

if not TYPE_CHECKING:
    __getattr__, __dir__ = attached(__name__, modules="rapid")
