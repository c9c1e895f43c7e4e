"""Where the stages meet: plan, compare, and how their results land on disk."""

from geoprint.pipeline.comparison import (
    COMPARED,
    Comparison,
    Planned,
    Refused,
    compare,
    comparison_picture,
    comparison_summary,
    save_comparison,
)
from geoprint.pipeline.doctor import examine
from geoprint.pipeline.planning import Plan, RobotPlan, plan
from geoprint.pipeline.saving import save_plan
from geoprint.pipeline.summary import outcome_text, summary
from geoprint.pipeline.table import comparison_table
from geoprint.pipeline.workpiece import Workpiece

__all__ = [
    "COMPARED",
    "Comparison",
    "Plan",
    "Planned",
    "Refused",
    "RobotPlan",
    "Workpiece",
    "compare",
    "comparison_picture",
    "comparison_summary",
    "comparison_table",
    "examine",
    "outcome_text",
    "plan",
    "save_comparison",
    "save_plan",
    "summary",
]
