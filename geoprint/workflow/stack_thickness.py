"""How a stack comes out: each layer's thickness over the part, simulated where it is planned, and their sum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from geoprint.config import Job
from geoprint.geometry import upright_of
from geoprint.layers import middle_planes, sliced, sliced_layer
from geoprint.layers.feet import Ground
from geoprint.metrics import LevelledLayer, Levelling, stretches_of_poses
from geoprint.metrics.executed_flow import deposited_volume, executed_flow, flow_of_all
from geoprint.metrics.stack_thickness import (
    column_feet,
    deposited_over,
    finished,
    have_met,
    wanted_over,
    within_sides,
)
from geoprint.model import FloatArray
from geoprint.results import FinishedStack, Plan, StackedLayer
from geoprint.workflow.layering import Stack
from geoprint.workflow.workpiece import read_part

# Columns over a part: of a thickness that varies by 2 % they tell the mean to 0.01 %.
COLUMNS = 40_000


def stacked_layer(planned: Plan) -> StackedLayer:
    """Return what is kept of a planned layer.

    Args:
        planned: with a place in a stack, and with the flow chosen.
    """
    place, deposited, poses = planned.workpiece.place, planned.deposited, planned.poses
    assert place is not None  # noqa: S101  # A stack's job names the layer.
    assert deposited is not None  # noqa: S101  # A whole plan has its flow.
    points, widths = poses.surface_points, planned.workpiece.widths
    nominal = place.height * (planned.contours.spacing if widths is None else widths(points))
    constant = np.where(poses.deposit, nominal, 0.0) if deposited.mode == "analog" else poses.flow
    # Constant, following, and as executed.
    flows = [constant, _at(planned, deposited.following_flow)]
    flows += [_executed(planned)] if planned.robot else []
    printed = 2 if planned.robot else int(deposited.mode == "analog")
    spacing = planned.contours.spacing
    pieces = stretches_of_poses(poses, spacing=spacing)
    levelling = Levelling(planned.workpiece.part, spacing=spacing, wanted=widths)
    layer = LevelledLayer(levelling, pieces.places)
    fields = layer.fields(np.column_stack([pieces.volumes(flow) for flow in flows])).T
    ground, feet = Ground(place.base), column_feet(place.base, count=COLUMNS)
    shown = replace(poses, flow=flows[printed])
    rows = np.flatnonzero(poses.deposit)
    return StackedLayer(
        bottom=place.bottom,
        height=place.height,
        spacing=spacing,
        deposited=deposited_over(feet, ground, levelling.surface, fields, bottom=place.bottom, height=place.height),
        printed=printed,
        met=have_met(feet, ground, height=place.bottom + place.height),
        within=within_sides(feet, ground, height=place.middle),
        volumes=np.array([deposited_volume(poses, flow) for flow in flows]),
        slices=tuple(
            sliced_layer(planned.workpiece.part, shown, plane, height=place.height)
            for plane in middle_planes(place.base, upright_of(place.base))
        ),
        places=points[rows],
        offsets=np.append(np.flatnonzero(np.diff(poses.runs[rows], prepend=-1)), rows.size),
    )


def _executed(planned: Plan) -> FloatArray:
    """Return the flow at the poses of a plan that its robot's parts deposit together, as they were executed."""
    cell = planned.workpiece.cell
    deposited = [
        (
            robot.joint_path.poses,
            executed_flow(robot.joint_path.poses, robot.trajectory.pose_times, robot.switching.material, cell=cell),
        )
        for robot in planned.robot
    ]
    # Over a table each part has poses of its own, for travel and attitude depend on how the part stands.
    return deposited[0][1] if planned.tilting is None else flow_of_all(planned.poses, deposited)


def finished_stack(job: Job, stack: Stack, layers: Sequence[StackedLayer]) -> FinishedStack:
    """Return how a stack comes out of its layers, the lowest first.

    Args:
        job: that was planned; its part is read once more.
        stack: in which layers it falls.
        layers: those in which something is printed.

    Raises:
        GeoprintError: as `read_part`.
    """
    layered = dict.fromkeys(("thickness", "target", "feather", "layer"))
    skin = job.model_copy(update={**layered, "pattern": job.drawing.name})
    read = read_part(skin)
    base = read.part
    feet, upright = column_feet(base, count=COLUMNS), upright_of(base)
    planes = middle_planes(base, upright)
    wanted = (
        np.full(COLUMNS, stack.thickness)
        if stack.target is None
        else wanted_over(feet, stack.target, height=stack.height)
    )
    met, within = (np.stack(each) for each in zip(*((layer.met, layer.within) for layer in layers), strict=True))
    bottoms = np.array([layer.bottom for layer in layers])
    return FinishedStack(
        base=base,
        inputs=tuple((file.name, file.digest) for file in read.files),
        upright=upright,
        planes=planes,
        ground=tuple(sliced(base, plane) for plane in planes),
        feet=feet,
        wanted=wanted,
        layers=tuple(layers),
        flows=tuple(
            finished(np.stack(deposited), wanted, met=met, within=within, bottoms=bottoms, height=stack.height)
            for deposited in zip(*(layer.deposited for layer in layers), strict=True)
        ),
        printed=layers[0].printed,
    )


def _at(planned: Plan, flow: FloatArray) -> FloatArray:
    """Return a flow at the poses of a plan that was chosen when other travel led between the same deposits."""
    found = np.zeros(planned.poses.count)
    found[planned.poses.deposit] = flow[flow > 0.0]
    return found
