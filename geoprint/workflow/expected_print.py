"""What the cell makes of a plan: its errors, and how even prints are expected to be."""

from __future__ import annotations

from dataclasses import replace

from geoprint.metrics import printed
from geoprint.model import Cell, FloatArray, Placement, PrintErrors
from geoprint.results import Plan
from geoprint.robot.placing import calibrate_fixture, position_uncertainty, turn_uncertainty
from geoprint.transforms import apply
from geoprint.workflow.stages import Stages


def with_print(plan: Plan, stage: Stages) -> Plan:
    """Return a plan with the thickness that prints of it are expected to have; as it is where it was not measured."""
    if plan.uniformity is None or plan.deposited is None:
        return plan
    with stage("expected print"):
        part, placement = plan.workpiece.part, plan.workpiece.placement
        errors = errors_of(plan.workpiece.cell, placement, middle=part.vertices.mean(axis=0))
        measured = plan.uniformity
        layer, along = measured.layer(follows=plan.deposited.mode == "analog")
        found = printed(
            layer, along, measured, errors, poses=plan.poses,
            wanted=plan.workpiece.widths,
        )  # fmt: skip
    return replace(plan, printed=found, timings=tuple(stage.timings))


def errors_of(cell: Cell, placement: Placement | None, *, middle: FloatArray) -> PrintErrors:
    """Return how far a print strays: what the cell says, and of the placement what its touched points tell.

    Args:
        cell: without errors of its own those of the packaged cells count.
        placement: where the part stands, or None without a robot.
        middle: (3,) of the part [mm].
    """
    errors = cell.errors or PrintErrors()
    if placement is None or not placement.calibrated or cell.fixture is None:
        return errors
    calibration = calibrate_fixture(cell.fixture)
    shift = position_uncertainty(calibration, apply(placement.T_base_work, middle[None]))
    turn = turn_uncertainty(calibration)
    return replace(errors, placement=shift.deviation, placement_turn=turn.deviation)
