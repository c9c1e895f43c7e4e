"""Photographs of a print: lines of material, how wide and how far apart they are, and how they lie beside a plan.

Folders in, results out, which `geoprint.save` writes as the commands do: `simulated_print`, `appraise_photographs`,
`appraise_scan`. Stages on frozen values: `read_photograph`, `bead_width`,
`paired_edges`, `beads_of`; with a plan `camera_by`, `measured_stretches`, `held_against`; `apart` measures two sets of
anything. Pixels are (u, v), places mm.
"""

from typing import TYPE_CHECKING

from geoprint.inspection.against_plan import (
    PlannedRuns as PlannedRuns,
    PrintShift as PrintShift,
    planned_runs as planned_runs,
    print_shift as print_shift,
)
from geoprint.inspection.beads import (
    BeadLine as BeadLine,
    Shade as Shade,
    bead_width as bead_width,
    beads_of as beads_of,
    middles_of as middles_of,
    paired_edges as paired_edges,
)
from geoprint.inspection.calibrating import Fiducials as Fiducials, camera_by as camera_by, lens_of as lens_of
from geoprint.inspection.camera import Camera as Camera, Lens as Lens
from geoprint.inspection.held import (
    Held as Held,
    PhotographedParts as PhotographedParts,
    RunEstimate as RunEstimate,
    doubts as doubts,
    held_against as held_against,
)
from geoprint.inspection.measured import (
    MeasuredStretches as MeasuredStretches,
    measured_stretches as measured_stretches,
)
from geoprint.inspection.on_part import (
    Directed as Directed,
    SetDistances as SetDistances,
    apart as apart,
    in_sight as in_sight,
)
from geoprint.inspection.photograph import Photograph as Photograph, read_photograph as read_photograph
from geoprint.inspection.print import (
    Appraisal as Appraisal,
    AppraisedPhotograph as AppraisedPhotograph,
    OnPlan as OnPlan,
)
from geoprint.inspection.skeleton import edges as edges
from geoprint.lazy import attached

if TYPE_CHECKING:
    from geoprint.inspection.appraise_photographs import (
        PlanAsked as PlanAsked,
        appraise_photographs as appraise_photographs,
    )
    from geoprint.inspection.appraise_scans import (
        ScanAsked as ScanAsked,
        appraise_scan as appraise_scan,
    )
    from geoprint.inspection.simulated import (
        SimulatedPrint as SimulatedPrint,
        simulated_print as simulated_print,
    )

# The planner and its checks come with these.
_LATER = {
    "appraise_photographs": "PlanAsked appraise_photographs",
    "appraise_scans": "ScanAsked appraise_scan",
    "simulated": "SimulatedPrint simulated_print",
}

if not TYPE_CHECKING:
    __getattr__, __dir__ = attached(__name__, modules="", names=_LATER)
