"""What is said of a result: plan.json and compare.json, tables, verdict, run sheet, report and figures."""

from geoprint.reporting.calibration import (
    calibration_summary as calibration_summary,
    calibration_text as calibration_text,
)
from geoprint.reporting.chart_figure import (
    FlattenedPart as FlattenedPart,
    chart_figure as chart_figure,
    inspection_figure as inspection_figure,
)
from geoprint.reporting.check import (
    Checked as Checked,
    CheckedComparison as CheckedComparison,
    CheckedComparisonRecord as CheckedComparisonRecord,
    CheckRecord as CheckRecord,
    Finding as Finding,
    also_seen as also_seen,
)
from geoprint.reporting.comparison import (
    comparison_table as comparison_table,
    recorded_comparison as recorded_comparison,
)
from geoprint.reporting.evenness import record_evenness as record_evenness
from geoprint.reporting.figures import (
    CoveragePanel as CoveragePanel,
    coverage_figure as coverage_figure,
    lines_figure as lines_figure,
    switching_figure as switching_figure,
)
from geoprint.reporting.measurement import (
    measure_table as measure_table,
    record_measure_timings as record_measure_timings,
    record_measurement as record_measurement,
)
from geoprint.reporting.mesh_files import (
    inspection_summary as inspection_summary,
    inspection_text as inspection_text,
    remeshing_summary as remeshing_summary,
    remeshing_text as remeshing_text,
)
from geoprint.reporting.page import html_report as html_report
from geoprint.reporting.placement import proposal_summary as proposal_summary, proposal_text as proposal_text
from geoprint.reporting.plan import (
    outcome_text as outcome_text,
    patch_summary as patch_summary,
    patch_text as patch_text,
    peak_memory as peak_memory,
    record_plan as record_plan,
    record_timings as record_timings,
    replanned_text as replanned_text,
    summary as summary,
)
from geoprint.reporting.records.comparison import (
    ComparisonRecord as ComparisonRecord,
    MeasurementRecord as MeasurementRecord,
)
from geoprint.reporting.records.evidence import SeenFile as SeenFile
from geoprint.reporting.records.plan import PlanRecord as PlanRecord
from geoprint.reporting.records.rounding import as_json as as_json, read_record as read_record
from geoprint.reporting.robot_summary import program_digest as program_digest
from geoprint.reporting.run_sheet import (
    check_summary as check_summary,
    check_text as check_text,
    run_sheet as run_sheet,
)
from geoprint.reporting.tables import csv_text as csv_text, save_table as save_table
from geoprint.reporting.values import (
    GAP as GAP,
    MOST_FRAMES as MOST_FRAMES,
    OVERLAP as OVERLAP,
    BackendView as BackendView,
    Body as Body,
    Machine as Machine,
    MotionShades as MotionShades,
    PartReport as PartReport,
    PathDistances as PathDistances,
    Picture as Picture,
    Replay as Replay,
    Row as Row,
    TableReplay as TableReplay,
)
from geoprint.reporting.verdict import verdict as verdict
from geoprint.reporting.view import view_surface as view_surface
