"""What people look at: figures of plans, comparisons and stacks. Takes plain values, knows no stage."""

from geoprint.report.chart_figure import (
    FlattenedPart as FlattenedPart,
    chart_figure as chart_figure,
)
from geoprint.report.figures import (
    CoveragePanel as CoveragePanel,
    coverage_figure as coverage_figure,
)
from geoprint.report.inspection_figure import inspection_figure as inspection_figure
from geoprint.report.lines_figure import lines_figure as lines_figure
from geoprint.report.page import html_report as html_report
from geoprint.report.stacked.page import stack_report as stack_report
from geoprint.report.stacked.slice_figure import (
    SlicedView as SlicedView,
    seams_figure as seams_figure,
    sliced_figure as sliced_figure,
    thickness_figure as thickness_figure,
)
from geoprint.report.stacked.values import (
    OF_BACKENDS as OF_BACKENDS,
    OF_FLOWS as OF_FLOWS,
    FlowView as FlowView,
    StackPaths as StackPaths,
    StackReport as StackReport,
)
from geoprint.report.switching_figure import switching_figure as switching_figure
from geoprint.report.values import (
    COVERED as COVERED,
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
from geoprint.report.view_surface import (
    ViewSurface as ViewSurface,
    shading_normals as shading_normals,
    view_surface as view_surface,
)
