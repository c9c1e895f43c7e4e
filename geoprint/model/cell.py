"""The robot cell: arm, tool, process and where the part stands. Lengths in mm, angles in rad."""

from __future__ import annotations

from dataclasses import field, replace
from math import radians
from typing import TypeAlias, final

import numpy as np

from geoprint.errors import InputError
from geoprint.model.process import Flood, GoodPrint, Material, PrintErrors, Process, Purge, Signals
from geoprint.model.table import Cylinder, Hexapod, TablePose, TiltTurn
from geoprint.model.values import FloatArray, OptionValue, comparable, freeze_arrays, frozen

# Critical angle of overhang that the paper gives as an example for its silicone [rad].
PAPER_OVERHANG = radians(30.0)


@final
@comparable
class LoadLimits:
    """What an arm's flange may carry, by its maker.

    Attributes:
        mass_kg: largest mass.
        axis_5_kg_m2: largest moment of inertia about axis 5.
        axis_6_kg_m2: largest moment of inertia about axis 6.
    """

    mass_kg: float
    axis_5_kg_m2: float
    axis_6_kg_m2: float


@final
@frozen
class Robot:
    """The arm and what its joints may do.

    Attributes:
        model: name of the arm; without a URDF of its own that of the package data which has this name.
        limits: (6, 2) lowest and highest angle of each joint [rad].
        speeds: (6,) largest speed of each joint [rad/s].
        accelerations: (6,) largest acceleration of each joint [rad/s2]; an assumption unless the maker states it.
        home: (6,) joint angles where every program starts and ends [rad].
        target_period: shortest time between targets that the controller takes without slowing down [s].
        response: time in which the arm answers, over which it rounds on deposit [s]; assumed unless measured.
        urdf: text of the arm's URDF, or None where it is package data.
        flange: name of the URDF's flange frame.
        load: what the flange may carry, or None where nobody has said it.
        post_processor: name of what writes its programs, or None for the default.
    """

    model: str
    limits: FloatArray
    speeds: FloatArray
    accelerations: FloatArray
    home: FloatArray
    target_period: float = 0.02
    response: float = 0.01
    urdf: str | None = None
    flange: str = "tool0"
    load: LoadLimits | None = None
    post_processor: str | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self, limits="float: 6 2", speeds="float: 6", accelerations="float: 6", home="float: 6")
        if not (self.limits[:, 0] < self.limits[:, 1]).all():
            raise InputError("Robot.limits must rise from lower to upper.")
        if self.speeds.min() <= 0 or self.accelerations.min() <= 0:
            raise InputError("Robot.speeds and Robot.accelerations must be positive.")
        outside = (self.home < self.limits[:, 0]) | (self.home > self.limits[:, 1])
        if outside.any():
            joint = int(np.argmax(outside))
            raise InputError(
                f"home: joint {joint + 1} at {np.degrees(self.home[joint]):.1f} degrees is outside its "
                f"limits {np.degrees(self.limits[joint]).round(1).tolist()}."
            )


@final
@frozen
class Lamp:
    """The housing of the UV lamp: a cylinder that the flange carries.

    Attributes:
        T_flange_lamp: (4, 4) lamp frame in the flange frame; the cylinder runs from its origin along its z axis.
        length: [mm].
        diameter: [mm].
    """

    T_flange_lamp: FloatArray
    length: float
    diameter: float

    def __post_init__(self) -> None:
        freeze_arrays(self, T_flange_lamp="float: 4 4")


@final
@frozen
class Tool:
    """What the flange carries: the tool frame, the solids that may collide, and the load.

    The nozzle is a solid of revolution about the tool's z axis: a needle, a cone that widens to the barrel, the
    barrel. The bracket is a cylinder about the flange's z axis, from the flange to where the syringe is held.

    Attributes:
        T_flange_tool: (4, 4) tool frame in the flange frame; its z axis points out of the nozzle.
        needle_length: [mm].
        needle_diameter: outer [mm].
        inner_diameter: bore of the needle [mm].
        cone_half_angle: between needle and barrel [rad].
        barrel_diameter: [mm].
        barrel_top: distance of the barrel's far end from the tip [mm].
        bracket_length: [mm].
        bracket_diameter: [mm].
        mass_kg: of everything behind the flange.
        cog: (3,) centre of gravity in the flange frame [mm].
        inertia_kg_m2: (3,) principal moments about the centre of gravity.
        principal_axes: (3, 3) directions of those in the flange frame, one a column.
        lamp: housing of the UV lamp, or None where nobody has said where it is.
    """

    T_flange_tool: FloatArray
    needle_length: float
    needle_diameter: float
    inner_diameter: float
    cone_half_angle: float
    barrel_diameter: float
    barrel_top: float
    bracket_length: float
    bracket_diameter: float
    mass_kg: float
    cog: FloatArray
    inertia_kg_m2: FloatArray
    lamp: Lamp | None = None
    principal_axes: FloatArray = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        freeze_arrays(
            self, T_flange_tool="float: 4 4", cog="float: 3", inertia_kg_m2="float: 3", principal_axes="float: 3 3"
        )

    @property
    def cone_length(self) -> float:
        """Length of the cone between needle and barrel [mm]."""
        return float((self.barrel_diameter - self.needle_diameter) / 2 / np.tan(self.cone_half_angle))


@final
@frozen
class Box:
    """An obstacle: a box with its sides along the base axes.

    Attributes:
        name: what messages call it.
        centre: (3,) in the base frame [mm].
        size: (3,) edge lengths [mm].
    """

    name: str
    centre: FloatArray
    size: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, centre="float: 3", size="float: 3")


@final
@frozen
class TouchedPoints:
    """Points of the fixture that the tool touched, and where they are in the fixture's own frame.

    Attributes:
        model: (k, 3) in the fixture frame [mm].
        touched: (k, 3) in the base frame [mm].
        T_fixture_work: (4, 4) where the part stands on the fixture, or None where nobody has stated it.
        noise: standard deviation of each coordinate of a touch [mm], or None to estimate it from the points.
    """

    model: FloatArray
    touched: FloatArray
    T_fixture_work: FloatArray | None
    noise: float | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self, model="float: k 3", touched="float: k 3")
        if self.T_fixture_work is not None:
            freeze_arrays(self, T_fixture_work="float: 4 4")


# What stands in a cell, in the robot's base: boxes, and the solids of a table as it holds the part.
Obstacle: TypeAlias = "Box | Cylinder"


@final
@frozen
class Placement:
    """Where the part stands: T_base_work = T_base_fixture @ T_fixture_work.

    Attributes:
        T_base_fixture: (4, 4) from touched points (RAPID uframe).
        T_fixture_work: (4, 4) the part on its fixture (RAPID oframe).
        calibrated: whether touched points stand behind the fixture.
        part_stated: whether somebody has stated where the part stands on it.
        misses: (k,) distance of each touched point from where the others put it [mm]; empty for a demonstration.
        table: how the table of the cell holds the part there, or None where the part stands still.
        flow_unstated: whether the flow is to follow the speed by an output of the cell that nobody has stated.
    """

    T_base_fixture: FloatArray
    T_fixture_work: FloatArray
    calibrated: bool
    part_stated: bool
    misses: FloatArray
    table: TablePose | None = None
    flow_unstated: bool = False

    def __post_init__(self) -> None:
        freeze_arrays(self, T_base_fixture="float: 4 4", T_fixture_work="float: 4 4", misses="float: k")

    @property
    def missing(self) -> tuple[str, ...]:
        """What nobody has stated, in words; a program may deposit only where that is nothing."""
        stated = {
            "the pose of the fixture (touched points)": self.calibrated,
            "the pose of the part on the fixture (part_mm)": self.part_stated,
            "the flow output (signals.flow and flow_per_mm3_s)": not self.flow_unstated,
        }
        return tuple(what for what, known in stated.items() if not known)

    @property
    def T_base_work(self) -> FloatArray:
        """(4, 4) part coordinates to base coordinates."""
        return self.T_base_fixture @ self.T_fixture_work


@final
@comparable
class SearchWeights:
    """What the choice of rotation, lean and branch counts, each against the others; 1 unless the cell says otherwise.

    Attributes:
        motion: of the joints along the path.
        limits: nearness of joint limits.
        singularities: nearness of wrist, elbow and shoulder singularity.
        lean: of the nozzle from the attitude of the path.
    """

    motion: float = 1.0
    limits: float = 1.0
    singularities: float = 1.0
    lean: float = 1.0


@final
@frozen
class Cell:
    """A robot cell: arm, tool, process, outputs and surroundings.

    Attributes:
        name: of the cell file.
        robot: the arm.
        tool: nozzle, bracket and lamp on its flange.
        process: speeds, stand-off, layer height and limits of the deposit.
        signals: outputs of the controller.
        obstacles: boxes in the base frame.
        demo_position: (3,) where `--place demo` puts the part's centroid, in the base frame [mm].
        demo_rotation: (3, 3) rotation of the part there, after its mean normal was turned up; None if it is not stated,
            so that a rotation is searched if the part cannot be printed as it is.
        fixture: touched points of the fixture, or None if it is not calibrated.
        purge: where the nozzle is primed, or None if a person primes it.
        flood: final exposure of the whole part, or None if there is none.
        material: the material in the syringe, or None if it is not measured.
        overhang: angle between outward normal and upright beyond which beads may sag [rad], or None if not stated.
        good_print: a print to compare with, or None.
        search: weights for choosing rotation, lean and branch.
        errors: errors of a print, or None if the cell does not state them.
        table: what tilts the part, or None if the part is fixed.
        options: of features, by their names; options of a job take precedence.
    """

    name: str
    robot: Robot
    tool: Tool
    process: Process
    signals: Signals
    obstacles: tuple[Box, ...]
    demo_position: FloatArray
    demo_rotation: FloatArray | None
    fixture: TouchedPoints | None
    purge: Purge | None = None
    flood: Flood | None = None
    material: Material | None = None
    overhang: float | None = None
    good_print: GoodPrint | None = None
    search: SearchWeights = SearchWeights()
    errors: PrintErrors | None = None
    table: Hexapod | TiltTurn | None = None
    options: dict[str, dict[str, OptionValue]] = field(default_factory=dict[str, dict[str, OptionValue]])

    def __post_init__(self) -> None:
        freeze_arrays(self, demo_position="float: 3")
        if self.demo_rotation is not None:
            freeze_arrays(self, demo_rotation="float: 3 3")
        self._check_joints("purge", None if self.purge is None else self.purge.joints, over="the cup")
        self._check_joints("flood", None if self.flood is None else self.flood.joints, over="the part")

    @property
    def demo_turn(self) -> FloatArray:
        """(3, 3) `demo_rotation`; no turn where nobody states one."""
        return np.eye(3) if self.demo_rotation is None else self.demo_rotation

    @property
    def critical_overhang(self) -> float:
        """`overhang` [rad]; where nobody has stated it, the example of the paper."""
        return PAPER_OVERHANG if self.overhang is None else self.overhang

    @property
    def shortest_run(self) -> float:
        """Run that the valve can deposit at the speed of the print [mm].

        A run lasts until the valve has shut, which is told to shut `valve_close` before: a shorter one would be told
        before anything flows.
        """
        return self.process.speed * self.signals.valve_close

    def at_speed(self, speed: float) -> Cell:
        """Return the cell with another speed of printing [mm/s]."""
        return replace(self, process=replace(self.process, speed=speed))

    def _check_joints(self, table: str, joints: FloatArray | None, *, over: str) -> None:
        limits = self.robot.limits
        if joints is not None and ((joints < limits[:, 0]) | (joints > limits[:, 1])).any():
            raise InputError(
                f"{table}: the joints {np.degrees(joints).round(1).tolist()} degrees are outside the limits "
                f"of the robot; jog the arm over {over} and read them there."
            )
