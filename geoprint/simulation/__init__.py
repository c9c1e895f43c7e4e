"""A simulated print: what a plan or its program deposits with errors put in, and a photograph or a scan of it.

All of it is known. It shares no code with `inspection`, so that errors which are put in here are errors that must be
found there.
"""

from geoprint.simulation.deposited import (
    Break as Break,
    DepositedBeads as DepositedBeads,
    Faults as Faults,
    deposited_beads as deposited_beads,
)
from geoprint.simulation.plant import (
    Dispenser as Dispenser,
    Plant as Plant,
    ValveTimes as ValveTimes,
    dispensed_beads as dispensed_beads,
    plant_beads as plant_beads,
)
from geoprint.simulation.scan import (
    Sensor as Sensor,
    SimulatedScan as SimulatedScan,
    heights as heights,
    scanned as scanned,
)
from geoprint.simulation.viewpoint import (
    Development as Development,
    Lighting as Lighting,
    Viewpoint as Viewpoint,
    developed as developed,
    looking_at as looking_at,
    pictured as pictured,
    png as png,
)
