"""How material is deposited: process, outputs, material, what a program commands, and how far a print strays."""

from __future__ import annotations

from typing import Literal, final

import numpy as np

from geoprint.errors import InputError
from geoprint.model.values import BoolArray, FloatArray, IntArray, comparable, freeze_arrays, frozen

# How the material is deposited: process, outputs of the controller, priming and final exposure. Lengths in mm.


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
    """How the material is deposited.

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


# The material: how it flows and how it cures.


@final
@comparable
class Fluid:
    """A Herschel-Bulkley fluid: shear stress = yield stress + consistency * shear rate ** index.

    Without yield stress it is a power law, with an index of 1 besides a Newtonian fluid.

    Attributes:
        consistency: [Pa s^index], above 0; the viscosity of a Newtonian fluid [Pa s].
        index: above 0; below 1 the fluid thins where it is sheared.
        yield_stress: below which nothing flows [Pa], 0 or more.
    """

    consistency: float
    index: float = 1.0
    yield_stress: float = 0.0

    def __post_init__(self) -> None:
        values = (self.consistency, self.index, self.yield_stress)
        if not np.isfinite(values).all() or self.consistency <= 0.0 or self.index <= 0.0 or self.yield_stress < 0.0:
            raise InputError(
                f"a fluid needs a consistency and an index above 0 and a yield stress of 0 or more, found {values}."
            )


@final
@comparable
class Material:
    """What the syringe holds.

    Attributes:
        density: [mg/mm3], the same number as in g/cm3.
        fluid: how it flows.
        irradiance: of the lamp's spot [mW/cm2], or None where nobody has measured it.
        spot_diameter: of that spot on the surface [mm], or None with the irradiance.
        dose: that cures the material [mJ/cm2], or None where nobody knows it.
        penetration: depth in it at which 1/e of the lamp's light is left [mm], or None where nobody has measured it.
    """

    density: float
    fluid: Fluid
    irradiance: float | None = None
    spot_diameter: float | None = None
    dose: float | None = None
    penetration: float | None = None


# What a program that was executed commands: where its tip is when, and what its outputs say to valve and flow.


@final
@frozen
class Dispensing:
    """The tip of a program and its commands: k moments along the path, v and f commands.

    Attributes:
        times: (k,) not falling [s].
        tips: (k, 3) in the part's coordinates [mm].
        runs: (k,) run that the program has entered, from 0; -1 before the first.
        arcs: (k,) length of path from where the run's material is to begin, below 0 before that [mm].
        wanted: (k,) flow that the plan wants there, 0 where it wants none [mm3/mm].
        valve_times: (v,) when the valve is commanded to open or to shut, not falling [s].
        valve_open: (v,) whether it is commanded to open.
        flow_times: (f,) when a flow that follows the speed is set, not falling [s]; none where the valve alone doses.
        flows: (f,) that are set [mm3/mm].
    """

    times: FloatArray
    tips: FloatArray
    runs: IntArray
    arcs: FloatArray
    wanted: FloatArray
    valve_times: FloatArray
    valve_open: BoolArray
    flow_times: FloatArray
    flows: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, times="float: k", tips="float: k 3", runs="int: k", arcs="float: k", wanted="float: k",
            valve_times="float: v", valve_open="bool: v", flow_times="float: f", flows="float: f",
        )  # fmt: skip


# How far a print strays from its plan: how arm and flow err, where the part stands, how the needle runs.


# Repeatability is given as mean plus three standard deviations of the distance from the mean place [ISO9283]. For an
# error that is alike in all directions and has the standard deviation 1 in each, that distance has, in space (pose
# repeatability, RP), the mean 2 sqrt(2 / pi) and the variance 3 - 8 / pi; in the plane square to the path (path
# repeatability, RT) the mean sqrt(pi / 2) and the variance 2 - pi / 2.
POSE_FACTOR = float(2.0 * np.sqrt(2.0 / np.pi) + 3.0 * np.sqrt(3.0 - 8.0 / np.pi))
PATH_FACTOR = float(np.sqrt(np.pi / 2.0) + 3.0 * np.sqrt(2.0 - np.pi / 2.0))
# Path accuracy is given as the mean of the distance from the commanded path, in that plane.
ACCURACY_FACTOR = float(np.sqrt(np.pi / 2.0))
# Length over the part along which the arm's deviation from its paths changes [mm]. ASSUMED: some paths of a part, and
# less than the links of a small arm, with whose angles it changes.
ACCURACY_LENGTH = 100.0


@final
@comparable
class PrintErrors:
    """What moves a print: standard deviations, but for both repeatabilities, as [ISO9283] has them, and path accuracy.

    Unless a cell says otherwise they are those of the packaged cells.

    Attributes:
        repeatability: of a pose (RP): each run as a whole lies so far off [mm].
        path_repeatability: of a path (RT): along a run the tip strays so far, slowly [mm].
        path_accuracy: mean distance of the arm's paths from the commanded ones, of an IRB 120 as in [MAPS]: alike in
            every print, nearly alike for paths beside one another; 0 where nobody has measured it [mm].
        correlation: length along a run over which that fades: its correlation is exp(-(s / length)^2 / 2) [mm].
        placement: of where the part stands, along each axis; touched points tell it better [mm].
        placement_turn: of how it stands, about each axis [rad].
        needle_runout: of the needle's tip from the tool frame's z axis, along x and y [mm].
        flow: of the flow of a whole print, over the wanted one.
        run_flow: of the flow from run to run.
    """

    repeatability: float = 0.01
    path_repeatability: float = 0.03
    path_accuracy: float = 0.114
    correlation: float = 20.0
    placement: float = 0.1
    placement_turn: float = float(np.radians(0.1))
    needle_runout: float = 0.05
    flow: float = 0.05
    run_flow: float = 0.02

    @property
    def run_deviation(self) -> float:
        """Standard deviation of where a run lies, along each axis [mm]."""
        return self.repeatability / POSE_FACTOR

    @property
    def path_deviation(self) -> float:
        """Standard deviation of where the tip is along a run, along each axis [mm]."""
        return self.path_repeatability / PATH_FACTOR

    @property
    def accuracy_deviation(self) -> float:
        """Standard deviation of how far the arm's paths lie off, along each axis [mm]."""
        return self.path_accuracy / ACCURACY_FACTOR
