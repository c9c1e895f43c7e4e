"""Where the stages meet: plan, compare, place, calibrate, cut, remesh, check, and how their results land on disk."""

from geoprint.pipeline.ahead import compiled_ahead as compiled_ahead
from geoprint.pipeline.bundles.again import (
    job_file_of as job_file_of,
    job_from as job_from,
    written_bundle as written_bundle,
)
from geoprint.pipeline.bundles.proof import record_seen as record_seen
from geoprint.pipeline.calibrating import (
    calibrate as calibrate,
    calibrate_cell as calibrate_cell,
    calibrate_tool as calibrate_tool,
    save_calibrated as save_calibrated,
)
from geoprint.pipeline.cell_writer import check_cell_writable as check_cell_writable
from geoprint.pipeline.checking import check_bundle as check_bundle
from geoprint.pipeline.comparison import (
    compare as compare,
    compare_parts as compare_parts,
)
from geoprint.pipeline.doctor import examine as examine
from geoprint.pipeline.folders.checking import check_folder as check_folder
from geoprint.pipeline.measured.files import measure_files as measure_files, save_measurement as save_measurement
from geoprint.pipeline.mesh_files import (
    inspect_file as inspect_file,
    remesh_file as remesh_file,
)
from geoprint.pipeline.placing import best_placed as best_placed, propose_placement as propose_placement
from geoprint.pipeline.planning import plan as plan
from geoprint.pipeline.processes import beside as beside
from geoprint.pipeline.saving import save_comparisons as save_comparisons, save_plan as save_plan
from geoprint.pipeline.stacks.comparing import compare_stacks as compare_stacks
from geoprint.pipeline.stacks.stacking import plan_stack as plan_stack
from geoprint.pipeline.workpiece.patches import (
    PatchChoice as PatchChoice,
    cut_patch as cut_patch,
)
from geoprint.pipeline.workpiece.several_patches import patches_of as patches_of
