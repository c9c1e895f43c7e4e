"""What is wrong with a mesh, and how it is mended."""

from geoprint.surfaces.repair.inspection import (
    Defect as Defect,
    Inspection as Inspection,
    inspect as inspect,
)
from geoprint.surfaces.repair.preparation import (
    Joined as Joined,
    PreparationReport as PreparationReport,
    join as join,
    prepare as prepare,
    stays_open as stays_open,
)
from geoprint.surfaces.repair.repairs import Repairs as Repairs, described as described
from geoprint.surfaces.repair.terraces import terrace_height as terrace_height
