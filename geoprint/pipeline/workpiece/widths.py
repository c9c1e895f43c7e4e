"""How wide the fibres of a job are over its part, and whether its cell can lay them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geoprint.config import Job, WidthTable, read_field
from geoprint.deposition import WidthRule, WidthsAbout, WidthsAlong, WidthsBetween, WidthsOver, strand_diameter
from geoprint.errors import InputError, UsageError
from geoprint.model import Cell, FloatArray, Surface
from geoprint.pipeline.choice import follows_field
from geoprint.pipeline.number_tables import read_widths
from geoprint.pipeline.workpiece.targets import check_on_part
from geoprint.results import StackPlace
from geoprint.surfaces import in_words

# A width may be beyond what a cell lays by this share: what is written has few digits.
ROUNDING = 1e-9
# A part that measures less along a direction [mm] does not extend along it.
SHORTEST = 1e-6


def widths_of(job: Job, part: Surface, place: StackPlace | None) -> WidthsOver | None:
    """Return how wide the fibres of a job are; None where all of its paths are one spacing wide.

    Args:
        job: its field file may have a table of it.
        part: that is planned on; of a layer its middle.
        place: of that layer, which has the widths of the part below it; None of a single skin.

    Raises:
        UsageError: the job has no spacing that widths could be held against, or as `read_field`.
        InputError: a table cannot be read, or one of its points lies off the part.
    """
    if job.field is None or not follows_field(job):
        return None
    table = read_field(job.field).width
    if table is None:
        return None
    if job.spacing is None:
        raise UsageError(
            f"{job.field.name}: [width] says how wide fibres are where that is not the spacing: give `--spacing`, from "
            "which the cell's shares of flow count, and no rounds."
        )
    base = part if place is None else place.base
    return WidthsOver(_rule(table, base, spacing=job.spacing), None if place is None else base)


def check_widths(widths: WidthsOver, job: Job, cell: Cell, place: StackPlace | None) -> None:
    """Check that a cell can lay the widths that a job asks for.

    Its flow follows from least to most of that of one spacing, and the strand must not be thinner than the stand-off:
    nothing presses it on then.

    Args:
        widths: of the job, which has a spacing.
        job: whose program they may be of.
        cell: as its file has it.
        place: of a layer, whose height counts instead of the cell's.

    Raises:
        UsageError: a program is asked for, and the cell cannot change its flow.
        InputError: a width is beyond what the cell can lay; says where.
    """
    assert job.spacing is not None  # noqa: S101  # Widths have one.
    name, process = "[width]" if job.field is None else f"{job.field.name}: [width]", cell.process
    if job.robot and cell.signals.mode != "analog":
        raise UsageError(
            f"{name} lets the width of fibres change, but the cell {cell.name} can only open and shut its valve "
            '(signals.mode "io"), which lays one width: give a cell with mode "analog", add `--no-robot`, or leave '
            "[width] out."
        )
    least, most = process.least_flow * job.spacing, process.most_flow * job.spacing
    places, values = widths.rule.ends()
    worst = int(np.argmax(np.maximum(least - values, values - most)))
    width, where = float(values[worst]), f"{name} asks for {values[worst]:.4g} mm at {in_words(places[worst])}"
    if not least * (1.0 - ROUNDING) <= width <= most * (1.0 + ROUNDING):
        raise InputError(
            f"{where}, but at a spacing of {job.spacing:g} mm the cell {cell.name} lays {least:.4g} to {most:.4g} mm "
            f"([process] least_flow_share {process.least_flow:g} and most_flow_share {process.most_flow:g}): ask for "
            "a width between them, or choose another spacing.",
            width=width, least=least, most=most,
        )  # fmt: skip
    thinnest = int(np.argmin(values))
    height = process.layer_height if place is None else place.height
    strand = strand_diameter(float(values[thinnest]) * height)
    if strand < process.standoff:
        raise InputError(
            f"{name} asks for {values[thinnest]:.4g} mm at {in_words(places[thinnest])}: in layers of "
            f"{height:.3g} mm that is a strand of {strand:.3g} mm, thinner than the stand-off of "
            f"{process.standoff:g} mm of the cell {cell.name}, so that nothing presses it on: ask for more there, or "
            "print nearer.",
            width=float(values[thinnest]), strand=strand, standoff=process.standoff,
        )  # fmt: skip


def least_spacing(widths: WidthsOver | None, spacing: float) -> float:
    """Return the least distance of paths of a spacing [mm], by which their surface is refined."""
    return spacing if widths is None else min(spacing, float(widths.rule.ends()[1].min()))


def _rule(table: WidthTable, base: Surface, *, spacing: float) -> WidthRule:
    """Return the widths that a table gives to a part."""
    if table.table is not None:
        places, values = read_widths(table.table)
        check_on_part(places, base, name=Path(table.table).name)
        return WidthsBetween(places, values)
    if table.places is not None and table.at_mm is not None and table.within_mm is not None:
        places = np.array(table.places)
        check_on_part(places, base, name="[width]")
        return WidthsAbout(places, table.at_mm, table.within_mm, spacing)
    widths = np.array([table.begin_mm, table.end_mm], dtype=np.float64)
    return _along(base, np.array(table.direction, dtype=np.float64), widths)


def _along(base: Surface, direction: FloatArray, widths: FloatArray) -> WidthsAlong:
    """Return widths that change along a direction.

    Raises:
        InputError: the part is flat along it, so that it neither begins nor ends.
    """
    unit = direction / np.linalg.norm(direction)
    heights = base.vertices @ unit
    if np.ptp(heights) < SHORTEST:
        raise InputError(
            f"[width] changes along {direction.tolist()}, but {base.name} measures {np.ptp(heights):.2g} mm along it: "
            "give a direction along which it extends."
        )
    return WidthsAlong(base.vertices[heights.argmin()], base.vertices[heights.argmax()], unit, widths)
