"""How the material is laid: process, outputs of the controller, priming and final exposure. Lengths in mm."""

from __future__ import annotations

from typing import Literal, final

from geoprint.model.arrays import FloatArray, freeze_arrays
from geoprint.model.values import comparable, frozen

SignalMode = Literal["io", "analog"]
# Files and people name the pressure of the air in kPa.
PASCAL_PER_KPA = 1000.0
# Least and most of a flow that follows the width of a strip, over that of a strip one spacing wide, where a cell says
# nothing else.
FLOW_SHARES = (0.5, 1.5)
# Surface farther than the first from every path is a gap, within the second of two stretches an overlap, in spacings.
GAP_SHARE, OVERLAP_SHARE = 0.55, 0.45


@final
@comparable
class Process:
    """How the material is laid.

    Attributes:
        speed: of the tip on deposit [mm/s].
        travel_speed: of the tip between runs [mm/s].
        joint_speed_share: share of the joint speeds used from and to home, in (0, 1].
        standoff: height of the tip over the surface [mm].
        clearance: smallest distance kept between tool and anything else, above the tip zone [mm].
        retract: lift between runs along the normal [mm].
        layer_height: [mm].
        pressure: of the air on the syringe [Pa], or None where nobody has said it.
        rounds: levels that a part gets where a job names neither rounds nor spacing, or None.
        least_flow: of flow that follows the strip, over that of a strip one spacing wide; in (0, 1].
        most_flow: likewise, at least 1.
        layer_pause: how long the arm waits at home between two layers of a stack [s].
    """

    speed: float
    travel_speed: float
    joint_speed_share: float
    standoff: float
    clearance: float
    retract: float
    layer_height: float
    pressure: float | None = None
    rounds: int | None = None
    least_flow: float = FLOW_SHARES[0]
    most_flow: float = FLOW_SHARES[1]
    layer_pause: float = 0.0

    @property
    def flow_shares(self) -> tuple[float, float]:
        """Least and most of a flow that follows the width."""
        return self.least_flow, self.most_flow


@final
@comparable
class GoodPrint:
    """A print that worked with the same part, material, nozzle and speed, to compare with where no fluid is known.

    Attributes:
        pressure: of the air [Pa].
        rounds: levels on the part.
    """

    pressure: float
    rounds: int


@final
@comparable
class Signals:
    """The controller's outputs that a program switches, and how late their equipment follows.

    Attributes:
        mode: 'io' switches valve and lamp; 'analog' also lets the flow follow the speed.
        dispenser: digital output that opens the valve.
        uv_lamp: digital output that turns the lamp on.
        valve_open: time from the command until material flows [s].
        valve_close: time from the command until no material flows [s].
        uv_lead: how long before the material the lamp is switched on [s].
        uv_tail: how long after the material the lamp is switched off [s].
        settle: how long after `valve_open` the flow still rises, evenly, until it is that of the print; so long the tip
            rests at the start of each run [s].
        flow: analog output that sets the flow, in mode 'analog'; None where nobody has stated it: such a cell runs only
            dry.
        flow_per_mm3_s: value of that output for a flow of 1 mm3/s, in the output's own unit.
        flow_lag: time from a new value of that output until the flow follows [s].
        vacuum: digital output that draws the material back into the nozzle while the valve is shut between runs, or
            None where the cell has none.
    """

    mode: SignalMode
    dispenser: str
    uv_lamp: str
    valve_open: float = 0.0
    valve_close: float = 0.0
    uv_lead: float = 0.0
    uv_tail: float = 0.0
    flow: str | None = None
    flow_per_mm3_s: float = 0.0
    flow_lag: float = 0.0
    vacuum: str | None = None
    settle: float = 0.0

    @property
    def sets_flow(self) -> bool:
        """Whether a program sets an output from which the flow follows the speed."""
        return self.mode == "analog" and self.flow is not None

    @property
    def flow_unstated(self) -> bool:
        """Whether the flow is to follow the speed by an output that nobody has stated."""
        return self.mode == "analog" and self.flow is None


@final
@frozen
class Purge:
    """Where the nozzle is primed before the first run.

    Attributes:
        joints: (6,) the arm over a cup or a pad [rad].
        duration: how long the valve stays open there [s].
    """

    joints: FloatArray
    duration: float

    def __post_init__(self) -> None:
        freeze_arrays(self, joints="float: 6")


@final
@frozen
class Flood:
    """The final exposure of the whole part.

    Attributes:
        duration: how long the lamp shines [s].
        joints: (6,) the arm with its lamp over the part [rad], or None where a person does it.
    """

    duration: float
    joints: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.joints is not None:
            freeze_arrays(self, joints="float: 6")
