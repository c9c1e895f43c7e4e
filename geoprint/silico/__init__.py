"""A print in silico: what a plan or its program lays with errors put in, and a photograph or a scan of it.

All of it is known. It shares no code with `appraisal`, so that errors which are put in here are errors that must be
found there.
"""

from geoprint.silico.dispensed import (
    Dispenser as Dispenser,
    dispensed_beads as dispensed_beads,
)
from geoprint.silico.height_field import heights as heights
from geoprint.silico.laid import (
    Break as Break,
    Faults as Faults,
    LaidBeads as LaidBeads,
    laid_beads as laid_beads,
)
from geoprint.silico.pictured import (
    Development as Development,
    Lighting as Lighting,
    developed as developed,
    pictured as pictured,
    png as png,
)
from geoprint.silico.plant import (
    Plant as Plant,
    ValveTimes as ValveTimes,
    plant_beads as plant_beads,
)
from geoprint.silico.scanned import (
    Sensor as Sensor,
    SilicoScan as SilicoScan,
    scanned as scanned,
)
from geoprint.silico.viewpoint import (
    Viewpoint as Viewpoint,
    looking_at as looking_at,
)
