"""Where the stages meet: plan, compare, place, and how their results land on disk."""

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
from geoprint.pipeline.inspecting import FileInspection, inspect_file, inspection_summary, inspection_text
from geoprint.pipeline.placing import Proposal, propose_placement
from geoprint.pipeline.planning import Plan, RobotPlan, plan
from geoprint.pipeline.proposal_text import proposal_summary, proposal_text
from geoprint.pipeline.saving import save_plan
from geoprint.pipeline.summary import outcome_text, summary
from geoprint.pipeline.table import comparison_table
from geoprint.pipeline.verdict import verdict
from geoprint.pipeline.workpiece import Workpiece

__all__ = [
    "COMPARED",
    "Comparison",
    "FailedPart",
    "FileInspection",
    "Plan",
    "Planned",
    "Proposal",
    "Refused",
    "RobotPlan",
    "Workpiece",
    "compare",
    "compare_parts",
    "comparison_picture",
    "comparison_report",
    "comparison_summary",
    "comparison_table",
    "examine",
    "inspect_file",
    "inspection_summary",
    "inspection_text",
    "outcome_text",
    "plan",
    "proposal_summary",
    "proposal_text",
    "propose_placement",
    "save_comparisons",
    "save_plan",
    "summary",
    "verdict",
]
