"""What is said of a result: plan.json and compare.json, tables, verdict, run sheet, report and pictures."""

from geoprint.account.calibration import calibration_summary as calibration_summary
from geoprint.account.checked import (
    Checked as Checked,
    CheckedComparison as CheckedComparison,
    Finding as Finding,
    also_seen as also_seen,
)
from geoprint.account.comparison_summary import (
    comparison_report as comparison_report,
    tell_comparison as tell_comparison,
)
from geoprint.account.inspection import inspection_summary as inspection_summary, inspection_text as inspection_text
from geoprint.account.measured.figures import (
    record_measure_timings as record_measure_timings,
    record_measurement as record_measurement,
)
from geoprint.account.patches import patch_summary as patch_summary, patch_text as patch_text
from geoprint.account.proposal import proposal_summary as proposal_summary, proposal_text as proposal_text
from geoprint.account.records.check import (
    CheckedComparisonRecord as CheckedComparisonRecord,
    CheckRecord as CheckRecord,
)
from geoprint.account.records.comparison import (
    ComparisonRecord as ComparisonRecord,
    ToldComparison as ToldComparison,
)
from geoprint.account.records.evidence import STAGES as STAGES, SeenFile as SeenFile
from geoprint.account.records.measure import MeasurementRecord as MeasurementRecord
from geoprint.account.records.plan import PlanRecord as PlanRecord
from geoprint.account.records.rounding import (
    as_json as as_json,
    read_record as read_record,
)
from geoprint.account.records.stack import StackRecord as StackRecord
from geoprint.account.records.stack_comparison import StackComparisonRecord as StackComparisonRecord
from geoprint.account.remeshing import remeshing_summary as remeshing_summary, remeshing_text as remeshing_text
from geoprint.account.robot_summary import program_digest as program_digest
from geoprint.account.run_tables import (
    csv_text as csv_text,
    levels_table as levels_table,
    runs_table as runs_table,
    save_table as save_table,
)
from geoprint.account.spacing_table import samples_table as samples_table
from geoprint.account.summary import (
    peak_memory as peak_memory,
    record_evenness as record_evenness,
    record_plan as record_plan,
    record_timings as record_timings,
    summary as summary,
)
from geoprint.account.texts.calibration import calibration_text as calibration_text
from geoprint.account.texts.checking import check_text as check_text
from geoprint.account.texts.comparison import comparison_table as comparison_table
from geoprint.account.texts.measuring import measure_table as measure_table
from geoprint.account.texts.plan import again_text as again_text, outcome_text as outcome_text
from geoprint.account.texts.run_sheet import (
    check_summary as check_summary,
    run_sheet as run_sheet,
)
from geoprint.account.texts.stack import stack_text as stack_text
from geoprint.account.texts.stack_comparison import stack_comparison_text as stack_comparison_text
from geoprint.account.verdict import verdict as verdict
