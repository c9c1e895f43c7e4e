"""Photographs of a print: lines of material, how wide and how far apart they are, and how they lie beside a plan.

Stages on frozen values: `read_photograph`, `bead_width`, `paired_edges`, `beads_of`; with a plan `camera_by`,
`measured_stretches`, `held_against`; `apart` measures two sets of anything. Pixels are (u, v), places mm.
"""

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
