"""Where the stages meet: plan, compare, place, calibrate, cut, remesh, check, and how their results land on disk."""

from geoprint.workflow.bundles import record_seen as record_seen
from geoprint.workflow.calibrating import (
    calibrate as calibrate,
    calibrate_cell as calibrate_cell,
    calibrate_tool as calibrate_tool,
    check_cell_writable as check_cell_writable,
    save_calibrated as save_calibrated,
)
from geoprint.workflow.cell_comparison import compare_cells as compare_cells
from geoprint.workflow.check_folder import check_folder as check_folder
from geoprint.workflow.checking import check_bundle as check_bundle
from geoprint.workflow.comparison import compare as compare, compare_parts as compare_parts
from geoprint.workflow.editing import Planner as Planner
from geoprint.workflow.measuring import measure_files as measure_files
from geoprint.workflow.mesh_files import examine as examine, inspect_file as inspect_file, remesh_file as remesh_file
from geoprint.workflow.patches import PatchChoice as PatchChoice, cut_patch as cut_patch, patches_of as patches_of
from geoprint.workflow.placing import best_placed as best_placed, propose_placement as propose_placement
from geoprint.workflow.planning import plan as plan
from geoprint.workflow.precompile import precompiled as precompiled
from geoprint.workflow.processes import beside as beside
from geoprint.workflow.replan import job_file_of as job_file_of, job_from as job_from, written_bundle as written_bundle
from geoprint.workflow.saving import save as save, save_comparisons as save_comparisons, save_plan as save_plan
from geoprint.workflow.workpiece import check_stated as check_stated
