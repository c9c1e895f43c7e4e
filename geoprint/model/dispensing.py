"""What a program that was executed commands: where its tip is when, and what its outputs say to valve and flow."""

from __future__ import annotations

from typing import final

from geoprint.model.arrays import BoolArray, FloatArray, IntArray, freeze_arrays
from geoprint.model.values import frozen


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
        valve_times: (v,) when the valve is told to open or to shut, not falling [s].
        valve_open: (v,) whether it is told to open.
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
