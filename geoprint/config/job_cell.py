"""The cell of a job: what its file says, with what the job says otherwise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.config.cells import load_cell
from geoprint.config.job import Job
from geoprint.config.needles import needle_with_bore, with_needle
from geoprint.errors import UsageError
from geoprint.model import Cell, FloatArray
from geoprint.transforms import inverse, rigid

# What is proposed is rounded before it is verified, so that what is printed was checked [decimals of mm and degrees].
STAND_DECIMALS = 1


def job_cell(job: Job) -> Cell:
    """Return the cell of a job: with its needle, layer height, stand-off and stand, and no faster than it allows.

    Raises:
        UsageError: as `load_cell`; no needle has that bore; the speed is above that of the cell.
    """
    cell = load_cell(job.cell)
    if job.stand is not None:
        turn = Rotation.from_euler("xyz", job.stand[3:], degrees=True).as_matrix()
        cell = standing(cell, rigid(turn, np.array(job.stand[:3])))
    process = replace(
        cell.process,
        layer_height=job.layer_height or cell.process.layer_height,
        standoff=job.standoff or cell.process.standoff,
    )
    tool = cell.tool if job.needle is None else with_needle(cell.tool, needle_with_bore(job.needle, cell.tool))
    if job.speed is None:
        return replace(cell, process=process, tool=tool)
    if job.speed > cell.process.speed:
        raise UsageError(
            f"`--speed {job.speed:g}` is above the speed_mm_s of {cell.name}, {cell.process.speed:g}: give less, or "
            "raise that key."
        )
    return replace(cell, process=replace(process, speed=job.speed), tool=tool)


def standing(cell: Cell, T_base_fixture: FloatArray) -> Cell:
    """Return the cell with its demonstration at another place; a table goes with the part, rounded as the stand is.

    Args:
        cell: of which `demo_turn` and `demo_position` are where the part stood.
        T_base_fixture: (4, 4) where it stands.
    """
    table = cell.table
    if table is not None:
        start = rigid(cell.demo_turn, cell.demo_position)
        T_base_table = T_base_fixture @ inverse(start) @ table.T_base_table
        rpy = Rotation.from_matrix(T_base_table[:3, :3]).as_euler("xyz", degrees=True).round(STAND_DECIMALS)
        turn = Rotation.from_euler("xyz", rpy, degrees=True).as_matrix()
        table = replace(table, T_base_table=rigid(turn, T_base_table[:3, 3].round(STAND_DECIMALS)))
    return replace(cell, demo_position=T_base_fixture[:3, 3], demo_rotation=T_base_fixture[:3, :3], table=table)
