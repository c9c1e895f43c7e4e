"""A layer of a thickness as a workpiece of its own: what the layers fill, and the tip's height over it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from geoprint.config import Job, job_cell
from geoprint.distance import Piecewise, most_accurate_backend
from geoprint.errors import FieldError, InputError, UsageError, how_many
from geoprint.geometry import boundary_source, prepare, refine
from geoprint.geometry.files import load_file, stored_mesh
from geoprint.layers.slices import layer_level, whole_layers
from geoprint.layers.targets import (
    Columns,
    LayerTarget,
    TargetShape,
    TargetThickness,
    area_standing_out,
    cut,
    with_sides,
    without_crumbs,
)
from geoprint.model import Cell, FloatArray, Surface
from geoprint.process import between
from geoprint.results import StackPlace, TargetFile
from geoprint.workflow.number_tables import check_on_part, read_thicknesses
from geoprint.workflow.workpiece import read_skin

# What the layers of a job fill: read from a mesh or a table, and laid over the part.


TABLE = ".csv"
# A thickness is linear in triangles of this many across the part, and of as many up a feathered rim.
ACROSS, UP_A_RIM = 100, 6
# But in no more across the part than this.
MOST_ACROSS = 800


def read_target(job: Job) -> TargetFile | None:
    """Read the file of a job's target; None where it names none.

    Raises:
        UsageError: the unit of a mesh is unclear.
        InputError: it cannot be read.
    """
    if job.target is None:
        return None
    if job.target.suffix.lower() == TABLE:
        places, values = read_thicknesses(job.target)
        content = job.target.read_bytes()
        digest = hashlib.sha256(content).hexdigest()
        return TargetFile(job.target.name, digest, "mm", content, np.column_stack([places, values]))
    file = load_file(job.target, unit=job.unit)
    return TargetFile(file.name, file.digest, file.unit, stored_mesh(file), prepare(file.surface)[0])


def target_over(job: Job, file: TargetFile | None, part: Surface) -> LayerTarget | None:
    """Return what the layers of a job fill; None for one thickness everywhere.

    Args:
        job: its thickness and its feather.
        file: its target as read.
        part: that the lowest layer lies on.

    Raises:
        UsageError: a feather is given for a shape, or for a part without a rim.
        InputError: a point of the table lies off the part.
        FieldError: nothing of the target is over the part.
        MeshError: the shape is open.
    """
    table = None if file is None else file.content
    if isinstance(table, Surface):
        if job.feather is not None:
            raise UsageError(f"the target {table.name} ends where its shape ends: omit `feather`.")
        return TargetShape(table, part)
    if table is None and job.feather is None:
        return None
    size = float(np.linalg.norm(np.ptp(part.vertices, axis=0)))
    rise = size if job.feather is None else job.feather / UP_A_RIM
    fine = refine(part, edge_length=min(size / ACROSS, max(rise, size / MOST_ACROSS)))
    if file is None or table is None:
        thickness = np.full(len(fine.vertices), job.thickness)
    else:
        check_on_part(table[:, :3], fine, name=file.name)
        thickness = between(table[:, :3], table[:, 3], fine.vertices)
    if job.feather is not None:
        thickness = thickness * np.minimum(_from_rim(fine) / job.feather, 1.0)
    return TargetThickness(fine, thickness)


def _from_rim(part: Surface) -> FloatArray:
    """Return (n,) the distance of the vertices from the rim along the surface [mm].

    It is measured by the backend that is nearest to the true one, whichever plans the paths.
    """
    try:
        rim = boundary_source(part)
    except InputError as error:
        raise UsageError(f"{part.name} has no rim for the thickness to rise from: omit `feather`.") from error
    return Piecewise(part, most_accurate_backend().factory).distance(rim).values


# A layer of a thickness as a workpiece of its own: its surface, what it lies on, and the tip's height over it.


# The rim of a layer lies off its target by no more than this share of a layer's height, if halving edges reaches it.
RIM_SHARE = 0.1
# What `GeoprintError.details` say of a layer in which there is nothing to print.
EMPTY = "empty"


@final
@dataclass(frozen=True, slots=True, eq=False)
class Stack:
    """In which layers a job falls.

    Attributes:
        thickness: of all of them together, where it is largest [mm].
        count: how many.
        height: of each [mm].
        target: what they fill, or None for one thickness everywhere.
    """

    thickness: float
    count: int
    height: float
    target: LayerTarget | None

    def middle(self, number: int) -> float:
        """Return the height over the part at which a layer's paths lie [mm]; they are counted from 1."""
        return (number - 0.5) * self.height


def even_stack(thickness: float, cell: Cell) -> Stack:
    """Return the layers of one thickness [mm]: about as high as those of the cell.

    Raises:
        InputError: there are too many.
    """
    return Stack(thickness, *whole_layers(thickness, height=cell.process.layer_height), None)


def stack_of(job: Job, cell: Cell, part: Surface, file: TargetFile | None) -> Stack:
    """Return in which layers a job falls.

    Args:
        job: its thickness or its target.
        cell: as its file has it: the height of its layers is adapted so that whole ones come out.
        part: that the lowest layer lies on.
        file: the target as read, or None.

    Raises:
        UsageError: the job has no layers, or a feather makes no sense.
        InputError: there are too many layers, or as `target_over`.
    """
    target = target_over(job, file, part)
    thickness = job.thickness if target is None else target.thickness
    if thickness is None:
        raise UsageError("this job has one layer: give `--thickness` in mm, or a `--target`.")
    return replace(even_stack(thickness, cell), target=target)


def layer_of(job: Job, cell: Cell, part: Surface) -> tuple[StackPlace, Surface]:
    """Return where the layer of a job lies in its stack, and the surface in its middle.

    Args:
        job: as `stack_of`, with its layer.
        cell: as `stack_of`.
        part: as `stack_of`.

    Raises:
        UsageError: no layer is named, there are not so many, or the stand-off ends within the layer.
        InputError: as `stack_of`.
        FieldError: nothing of the part's outer side is so far away, or nothing of the target, or nothing lies below.
        MeshError: sheets of a level lie too close together.
    """
    file = read_target(job)
    stack = stack_of(job, cell, part, file)
    number = _asked(job, cell, stack)
    target, over, height = stack.target, stack.middle(number), stack.height
    left_out, standing_out = 0.0, 0.0
    surface = layer_level(part, over, height=height)
    if target is not None:
        surface, left_out = _cut(surface, part, target, over=over, job=job, tolerance=RIM_SHARE * height)
    if target is not None and number > 1:
        standing_out = area_standing_out(part, surface, target, below=stack.middle(number - 1), height=height)
    ground = part if number == 1 else _below(stack, part, number=number)
    bottom = (number - 1) * height
    return StackPlace(number, stack.count, bottom, height, part, ground, standing_out, left_out, file), surface


def read_stack(job: Job) -> Stack:
    """Return in which layers a job falls; the part is read only where that depends on it.

    Raises:
        UsageError: the job has no layers.
        GeoprintError: as `read_skin`, and as `stack_of`.
    """
    cell = job_cell(job)
    if job.thickness is not None and job.feather is None:
        return even_stack(job.thickness, cell)
    return stack_of(job, cell, read_skin(job).part, read_target(job))


def _asked(job: Job, cell: Cell, stack: Stack) -> int:
    """Return the number of the layer that is planned."""
    if job.layer is None:
        raise UsageError(
            f"{stack.thickness:.3g} mm are {how_many(stack.count, 'layer')}, which are planned one by one: give "
            f"`--layer` 1 to {stack.count}, or run `geoprint plan` for all of them."
        )
    if job.layer > stack.count:
        raise UsageError(
            f"there is no layer {job.layer}: {stack.thickness:.3g} mm are {how_many(stack.count, 'layer')} of "
            f"{stack.height:.3g} mm in the cell {cell.name}, counted from 1."
        )
    if cell.process.standoff <= stack.height / 2.0:
        raise UsageError(
            f"the stand-off of {cell.process.standoff:g} mm ends within the lower half of layers of "
            f"{stack.height:.3g} mm. Raise `[process] standoff_mm` of {cell.name} to {stack.height:.2g}, or choose "
            "lower layers."
        )
    return job.layer


def _cut(
    level: Surface, part: Surface, target: LayerTarget, *, over: float, job: Job, tolerance: float
) -> tuple[Surface, float]:
    """Return what of the middle of a layer is printed, and the area that is too narrow for that [mm2]."""
    try:
        surface = cut(part, level, target, height=over, tolerance=tolerance)
        return (surface, 0.0) if job.spacing is None else without_crumbs(surface, spacing=job.spacing)
    except FieldError as error:
        raise FieldError(str(error), **error.details, **{EMPTY: True}) from error


def _below(stack: Stack, part: Surface, *, number: int) -> Surface:
    """Return the top of what lies below a layer, with its sides.

    Of a target the columns of all layers below count, as high as the highest: that is no less than what is printed.
    """
    bottom = (number - 1) * stack.height
    level = layer_level(part, bottom, height=stack.height)
    if stack.target is not None:
        columns = Columns(part, stack.target, [stack.middle(below) for below in range(1, number)])
        level = cut(part, level, columns, height=bottom, tolerance=RIM_SHARE * stack.height)
    found = with_sides(part, level)
    return Surface(found.vertices, found.faces, f"{part.name} with the layers below")
