"""Where the stages meet: plan, compare, place, calibrate, cut, remesh, check, and how their results land on disk."""

from geoprint.account.comparison_summary import (
    comparison_picture as comparison_picture,
    comparison_report as comparison_report,
    comparison_summary as comparison_summary,
)
from geoprint.account.patch_figures import patch_summary as patch_summary
from geoprint.account.run_sheet import (
    Checked as Checked,
    Finding as Finding,
    check_summary as check_summary,
    run_sheet as run_sheet,
)
from geoprint.account.summary import (
    outcome_text as outcome_text,
    summary as summary,
)
from geoprint.account.table import comparison_table as comparison_table
from geoprint.account.verdict import verdict as verdict
from geoprint.pipeline.calibrating import (
    CalibratedFixture as CalibratedFixture,
    CalibratedTool as CalibratedTool,
    calibrate as calibrate,
    calibrate_cell as calibrate_cell,
    calibrate_tool as calibrate_tool,
    save_calibrated as save_calibrated,
)
from geoprint.pipeline.calibration_text import (
    calibration_summary as calibration_summary,
    calibration_text as calibration_text,
)
from geoprint.pipeline.cell_writer import check_cell_writable as check_cell_writable
from geoprint.pipeline.checking import (
    check_bundle as check_bundle,
)
from geoprint.pipeline.comparison import (
    compare as compare,
    compare_parts as compare_parts,
)
from geoprint.pipeline.doctor import examine as examine
from geoprint.pipeline.drawn_curve import read_curve as read_curve
from geoprint.pipeline.inspecting import (
    FileInspection as FileInspection,
    inspect_file as inspect_file,
    inspection_summary as inspection_summary,
    inspection_text as inspection_text,
)
from geoprint.pipeline.patches import (
    PatchChoice as PatchChoice,
    cut_patch as cut_patch,
    patch_text as patch_text,
)
from geoprint.pipeline.placing import (
    Proposal as Proposal,
    propose_placement as propose_placement,
)
from geoprint.pipeline.planning import (
    plan as plan,
)
from geoprint.pipeline.proposal_text import (
    proposal_summary as proposal_summary,
    proposal_text as proposal_text,
)
from geoprint.pipeline.remeshing import (
    Remeshed as Remeshed,
    remesh_file as remesh_file,
    remeshing_summary as remeshing_summary,
    remeshing_text as remeshing_text,
)
from geoprint.pipeline.saving import save_comparisons as save_comparisons, save_plan as save_plan
from geoprint.pipeline.several_patches import patches_of as patches_of
