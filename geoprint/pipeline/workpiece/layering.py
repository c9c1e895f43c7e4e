"""A layer of a thickness as a workpiece of its own: its surface, what it lies on, and the tip's height over it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

from geoprint.config import Job
from geoprint.errors import FieldError, UsageError
from geoprint.layers import (
    Columns,
    LayerTarget,
    area_standing_out,
    cut,
    layer_level,
    whole_layers,
    with_sides,
    without_crumbs,
)
from geoprint.model import Cell, Surface
from geoprint.pipeline.workpiece.targets import target_over
from geoprint.results import StackPlace, TargetFile

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


def stack_of(job: Job, cell: Cell, part: Surface, file: TargetFile | None) -> Stack | None:
    """Return in which layers a job falls; None of a single skin.

    Args:
        job: its thickness or its target.
        cell: as its file has it: the height of its layers is adapted so that whole ones come out.
        part: that the lowest layer lies on.
        file: the target as read, or None.

    Raises:
        UsageError: a feather makes no sense.
        InputError: there are too many layers, or as `target_over`.
    """
    target = target_over(job, file, part)
    thickness = job.thickness if target is None else target.thickness
    return None if thickness is None else replace(even_stack(thickness, cell), target=target)


def layer_of(job: Job, cell: Cell, part: Surface, file: TargetFile | None) -> tuple[StackPlace, Surface] | None:
    """Return where the layer of a job lies in its stack and the surface in its middle; None of a single skin.

    Args:
        job: as `stack_of`, with its layer.
        cell: as `stack_of`.
        part: as `stack_of`.
        file: as `stack_of`.

    Raises:
        UsageError: no layer is named, there are not so many, or the stand-off ends within the layer.
        InputError: as `stack_of`.
        FieldError: nothing of the part's outer side is so far away, or nothing of the target, or nothing lies below.
        MeshError: sheets of a level lie too close together.
    """
    given = {f"--layer {job.layer}": job.layer, "--feather": job.feather, "--patterns": job.patterns}
    stray = [option for option, value in given.items() if value is not None]
    if stray and not job.layered:
        raise UsageError(
            f"`{stray[0]}` is of a thickness: give `--thickness` in mm or a `--target` too, or leave it out."
        )
    stack = stack_of(job, cell, part, file)
    if stack is None:
        return None
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
    return StackPlace(number, stack.count, bottom, height, part, ground, standing_out, left_out), surface


def stack_cell(cell: Cell, place: StackPlace | None) -> Cell:
    """Return a cell for a layer, with its height; the stand-off stays that from what the layer lies on."""
    return cell if place is None else replace(cell, process=replace(cell.process, layer_height=place.height))


def _asked(job: Job, cell: Cell, stack: Stack) -> int:
    """Return the number of the layer that is planned."""
    if job.layer is None:
        raise UsageError(
            f"{stack.thickness:.3g} mm are {stack.count} layers, which are planned one by one: give `--layer` 1 to "
            f"{stack.count}, or `geoprint plan` all of them."
        )
    if job.layer > stack.count:
        raise UsageError(
            f"there is no layer {job.layer}: {stack.thickness:.3g} mm are {stack.count} layers of {stack.height:.3g} "
            f"mm in the cell {cell.name}, counted from 1."
        )
    if cell.process.standoff <= stack.height / 2.0:
        raise UsageError(
            f"the stand-off of {cell.process.standoff:g} mm ends within the lower half of layers of {stack.height:.3g} "
            f"mm: raise `[process] standoff_mm` of {cell.name} to {stack.height:.2g}, or choose lower layers."
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
