"""Where the stages meet: plan, compare, place, calibrate, cut, remesh, check, and how their results land on disk."""

from geoprint.pipeline.calibrating import (
    CalibratedFixture,
    CalibratedTool,
    calibrate,
    calibrate_cell,
    calibrate_tool,
    save_calibrated,
)
from geoprint.pipeline.calibration_text import calibration_summary, calibration_text
from geoprint.pipeline.cell_writer import check_cell_writable
from geoprint.pipeline.checking import Checked, Finding, check_bundle
from geoprint.pipeline.comparison import (
    COMPARED,
    Comparison,
    FailedPart,
    Planned,
    Refused,
    compare,
    compare_parts,
)
from geoprint.pipeline.comparison_files import (
    comparison_picture,
    comparison_report,
    comparison_summary,
    save_comparisons,
)
from geoprint.pipeline.doctor import examine
from geoprint.pipeline.drawn_curve import read_curve
from geoprint.pipeline.flow_fitting import fit_flow, fit_summary, material_table
from geoprint.pipeline.inspecting import FileInspection, inspect_file, inspection_summary, inspection_text
from geoprint.pipeline.patches import Patch, PatchChoice, cut_patch, patch_summary, patch_text
from geoprint.pipeline.placing import Proposal, propose_placement
from geoprint.pipeline.planning import Plan, RobotPlan, plan
from geoprint.pipeline.proposal_text import proposal_summary, proposal_text
from geoprint.pipeline.recommending import recommendation
from geoprint.pipeline.remeshing import Remeshed, remesh_file, remeshing_summary, remeshing_text
from geoprint.pipeline.run_sheet import check_summary, run_sheet
from geoprint.pipeline.saving import save_plan
from geoprint.pipeline.several_patches import patches_of
from geoprint.pipeline.summary import outcome_text, summary
from geoprint.pipeline.table import comparison_table
from geoprint.pipeline.verdict import verdict
from geoprint.pipeline.workpiece import Workpiece

__all__ = [
    "COMPARED",
    "CalibratedFixture",
    "CalibratedTool",
    "Checked",
    "Comparison",
    "FailedPart",
    "FileInspection",
    "Finding",
    "Patch",
    "PatchChoice",
    "Plan",
    "Planned",
    "Proposal",
    "Refused",
    "Remeshed",
    "RobotPlan",
    "Workpiece",
    "calibrate",
    "calibrate_cell",
    "calibrate_tool",
    "calibration_summary",
    "calibration_text",
    "check_bundle",
    "check_cell_writable",
    "check_summary",
    "compare",
    "compare_parts",
    "comparison_picture",
    "comparison_report",
    "comparison_summary",
    "comparison_table",
    "cut_patch",
    "examine",
    "fit_flow",
    "fit_summary",
    "inspect_file",
    "inspection_summary",
    "inspection_text",
    "material_table",
    "outcome_text",
    "patch_summary",
    "patch_text",
    "patches_of",
    "plan",
    "proposal_summary",
    "proposal_text",
    "propose_placement",
    "read_curve",
    "recommendation",
    "remesh_file",
    "remeshing_summary",
    "remeshing_text",
    "run_sheet",
    "save_calibrated",
    "save_comparisons",
    "save_plan",
    "summary",
    "verdict",
]
