"""A layer of a thickness as a workpiece of its own: its surface, what it lies on, and the tip's height over it."""

from __future__ import annotations

from dataclasses import replace

from geoprint.config import Job
from geoprint.errors import UsageError, naming
from geoprint.layers import layer_level, whole_layers
from geoprint.model import Cell, Surface
from geoprint.results import StackPlace


def stack_place(job: Job, cell: Cell, part: Surface) -> StackPlace | None:
    """Return where the layer of a job lies in its stack; None where the job has no thickness.

    Args:
        job: its thickness and its layer.
        cell: as its file has it: the height of its layers is adapted so that whole ones come out.
        part: that the lowest layer lies on.

    Raises:
        UsageError: no layer is named, there are not so many, or the stand-off ends within the layer.
        InputError: there are too many.
        FieldError: nothing of the part's outer side is so far away as the layer below ends.
        MeshError: sheets of what that ends in lie too close together.
    """
    if job.thickness is None and job.layer is not None:
        raise UsageError(f"`--layer {job.layer}` is one of a thickness: give `--thickness` in mm too, or leave it out.")
    if job.thickness is None:
        return None
    count, height = whole_layers(job.thickness, height=cell.process.layer_height)
    if job.layer is None:
        raise UsageError(
            f"{job.thickness:g} mm are {count} layers, which are planned one by one: give `--layer` 1 to {count}, or "
            "`geoprint plan` all of them."
        )
    if job.layer > count:
        raise UsageError(
            f"there is no layer {job.layer}: {job.thickness:g} mm are {count} layers of {height:.3g} mm in the cell "
            f"{cell.name}, counted from 1."
        )
    if cell.process.standoff <= height / 2.0:
        raise UsageError(
            f"the stand-off of {cell.process.standoff:g} mm ends within the lower half of layers of {height:.3g} mm: "
            f"raise `[process] standoff_mm` of {cell.name} to {height:.2g}, or choose lower layers."
        )
    bottom = (job.layer - 1) * height
    ground = part if job.layer == 1 else _level(part, bottom, height=height, number=job.layer - 1)
    return StackPlace(job.layer, count, bottom, height, part, ground)


def stack_cell(cell: Cell, place: StackPlace | None) -> Cell:
    """Return a cell for a layer: its height, and the stand-off from its middle, where its paths lie."""
    if place is None:
        return cell
    standoff = cell.process.standoff - place.height / 2.0
    return replace(cell, process=replace(cell.process, layer_height=place.height, standoff=standoff))


def layer_surface(place: StackPlace) -> Surface:
    """Return the surface in the middle of a layer.

    Raises:
        FieldError: nothing of the part's outer side is so far away.
        MeshError: sheets of it lie too close together.
    """
    return _level(place.base, place.middle, height=place.height, number=place.number)


def _level(part: Surface, over: float, *, height: float, number: int) -> Surface:
    """Return the surface at a height over the part [mm]; a refusal names the layer."""
    with naming(f"layer {number}"):
        return layer_level(part, over, height=height)
