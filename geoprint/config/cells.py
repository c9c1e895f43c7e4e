"""Cell files: those of a person and those that come with geoprint, needles, and the cell of a job."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from csv import DictReader
from dataclasses import replace
from importlib import resources
from math import pi
from pathlib import Path
from string import Template
from typing import final

import numpy as np
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from geoprint.config.job import Job
from geoprint.config.strict import describe, line_of, parsed_toml, text_of
from geoprint.errors import InputError, UsageError, reason_of
from geoprint.model import Cell, FloatArray, Tool, comparable
from geoprint.transforms import inverse, rigid

# Cell files: those of a person and those that come with geoprint.


# A 1 inch needle of 20 gauge, the widest of `geoprint/robots/needles.csv` that passes between paths 1 mm apart.
_NEEDLE = {"inner": "0.6", "outer": "0.91", "needle": "25.4", "standoff": "0.3"}
# Demonstrations stand straight ahead of the arm, as in the paper, although the border of two quadrants of axis 1 lies
# there: 45 degrees aside parts were refused that print here.
# What each cell that comes with geoprint says where `geoprint/robots/cell.toml.in` leaves it open, the default first.
_PACKAGED = {
    "irb120-bent45": {
        "about": "nozzle on a bracket bent by 45 degrees: the default, which keeps the wrist far from its singularity.",
        "home": "[0, 28, 20, 0, 87, 180]",
        "reach": "40 mm flange piece, then 120 mm along the bent nozzle.",
        "tcp": "[84.8528137, 0, 124.8528137]",
        "rpy": "[0, 45, 0]",
        "cog": "[25, 0, 65]",
        "demo_position": "[300, 0, 50]",
        "table": "",
        **_NEEDLE,
    },
    "irb120-straight160": {
        "about": "straight nozzle of 160 mm along the flange axis; the part stands higher and farther out.",
        "home": "[0, 9, 9, 0, 72, 0]",
        "reach": "160 mm straight ahead of the flange.",
        "tcp": "[0, 0, 160]",
        "rpy": "[0, 0, 0]",
        "cog": "[0, 0, 70]",
        "demo_position": "[350, 0, 200]",
        "table": "",
        **_NEEDLE,
    },
}
_PACKAGED["irb120-slim45"] = _PACKAGED["irb120-bent45"] | {
    "about": "nozzle on the bent bracket with a longer and thinner needle, for narrow hollows: 38.1 mm of 23 gauge,\n"
    "# its tip where that of the other needle is. A liquid of constant viscosity asks for about 15 times the\n"
    "# pressure. The part stands higher.",
    "demo_position": "[300, 0, 100]",
    "inner": "0.34",
    "outer": "0.64",
    "needle": "38.1",
    "standoff": "0.5",
}
# Cells with the first arm in which the part stands still: who has no table, or another arm, cannot take one of them.
PACKAGED_CELLS = tuple(_PACKAGED)
TILTING_CELL = "irb120-tilting45"
_PACKAGED[TILTING_CELL] = _PACKAGED["irb120-slim45"] | {
    "about": "nozzle on the bent bracket with the slim needle, over a tilt-turn table that holds the part.\n"
    "# At home the arm stands behind the table, so that part and plate tilt before it.",
    "home": "[0, -20, 0, 0, 90, 180]",
    "demo_position": "[340, 0, 150]",
    "table": """# The table of this cell, its tilting axis along the y axis of the base. All figures are ASSUMED.
[table]
kind = "tilt-turn"
position_mm = [340, 0, 120]
rpy_deg = [0, 0, 90]
hub_length_mm = 80
stand_height_mm = 120

""",
}
# A cell with another arm.
UR_CELL = "ur5e"
_PACKAGED[UR_CELL] = _PACKAGED["irb120-straight160"] | {
    "about": "straight nozzle of 160 mm along the flange axis.",
    "home": "[-17, -100, 98, -88, -90, 0]",
    "demo_position": "[-450, 0, 200]",
}


def load_cell(path: Path | str | None) -> Cell:
    """Read and validate a cell file.

    Args:
        path: the TOML file, the name of a packaged cell, or None for the first of these.

    Returns:
        The cell in mm, s and rad.

    Raises:
        UsageError: the file is missing, not TOML, or has an unknown, missing or meaningless key.
    """
    path = Path(PACKAGED_CELLS[0] if path is None else path)
    name = f"{path.name}.toml" if _is_packaged(path) else path.name
    return cell_of(cell_text(path), name=name, folder=path.parent)


def cell_text(path: Path | str) -> str:
    """Return the text of a cell file, or of the packaged cell of that name where there is no such file.

    Raises:
        UsageError: the file is missing or cannot be read.
    """
    path = Path(path)
    if _is_packaged(path):
        return packaged_cell_text(path.name)
    try:
        return text_of(path)
    except (OSError, ValueError) as error:
        found = "does not exist" if isinstance(error, FileNotFoundError) else f"cannot be read ({reason_of(error)})"
        raise UsageError(f"the cell file {path} {found}; `geoprint init` writes one.") from error


def cell_of(text: str, *, name: str, folder: Path | str = Path()) -> Cell:
    """Return the cell that a text describes, in mm, s and rad.

    Args:
        text: of a cell file.
        name: what messages call it.
        folder: from which the files that it names are found.

    Raises:
        UsageError: it is not TOML, or has an unknown, missing or meaningless key.
    """
    # The arm and its URDF take longer to import than the help of a command may take.
    from geoprint.config.cell_file import CellFile, machine_of

    table = parsed_toml(text, name=name)
    try:
        return machine_of(table, name=name, folder=Path(folder))
    except ValidationError as error:
        where = line_of(error, text, name=name)
        raise UsageError(
            f"{where}: {describe(error, kind=CellFile)}; `geoprint init` writes a cell with every key."
        ) from error
    except (InputError, UsageError) as error:
        raise UsageError(f"{name}: {error}", **error.details) from error


def _is_packaged(path: Path) -> bool:
    return path.name in _PACKAGED and not path.exists()


def packaged_cell_text(name: str) -> str:
    """Return the text of a packaged cell file."""
    return filled_cell(packaged_parts(name))


def filled_cell(parts: Mapping[str, str]) -> str:
    """Return the text of a cell file.

    Args:
        parts: what an arm and its tool say where `geoprint/robots/cell.toml.in` leaves it open.
    """
    template = resources.files("geoprint.robots").joinpath("cell.toml.in").read_text(encoding="utf-8")
    return Template(template).substitute(parts)


def packaged_parts(name: str) -> dict[str, str]:
    """Return what a packaged cell says of its arm and its tool where the template leaves it open."""
    arm = resources.files("geoprint.robots").joinpath(f"{name.partition('-')[0]}.toml")
    return {key: str(value) for key, value in tomllib.loads(arm.read_text(encoding="utf-8")).items()} | _PACKAGED[name]


# Common dispensing needles, and what a cell and a job are with one that is screwed on instead of another.


# Lengths in which makers list them: 1/4, 1/2, 1 and 1 1/2 inch [mm].
NEEDLE_LENGTHS = (6.35, 12.7, 25.4, 38.1)
# Decimals of the lengths [mm] that are reported: a cell file with them is the cell that was tried.
DECIMALS = 4
# A needle is meant that differs by so much [mm] at most: half of what the bores of neighbouring gauges do.
SAME_BORE = 0.035
# Decimals of spacing, layer height and stand-off [mm], and of the speed [mm/s], that follow from a needle.
LENGTH_DECIMALS, SPEED_DECIMALS = 3, 1


@final
@comparable
class Needle:
    """A dispensing needle.

    Attributes:
        length: [mm].
        outer: diameter [mm].
        inner: diameter of the bore [mm].
        gauge: number of the gauge, or None of one that stands in no table.
    """

    length: float
    outer: float
    inner: float
    gauge: int | None = None

    @property
    def words(self) -> str:
        """What a person asks a shop for."""
        width = f"{self.gauge} gauge" if self.gauge is not None else f"{self.outer:g} mm"
        return f"a {self.length:g} mm needle of {width}"


def needle_of(tool: Tool) -> Needle:
    """Return the needle that a tool carries."""
    return Needle(tool.needle_length, tool.needle_diameter, tool.inner_diameter)


def common_needles() -> tuple[Needle, ...]:
    """Return needles of all lengths and gauges of the table, the widest first."""
    text = resources.files("geoprint.robots").joinpath("needles.csv").read_text(encoding="utf-8")
    rows = DictReader(line for line in text.splitlines() if not line.startswith("#"))
    gauges = [(int(row["gauge"]), float(row["outer_mm"]), float(row["inner_mm"])) for row in rows]
    return tuple(Needle(length, outer, inner, gauge) for gauge, outer, inner in gauges for length in NEEDLE_LENGTHS)


def with_needle(tool: Tool, needle: Needle) -> Tool:
    """Return a tool with another needle: it is as much longer as the needle is, along its axis; its mass stays."""
    longer = round(needle.length - tool.needle_length, DECIMALS)
    T_flange_tool = tool.T_flange_tool.copy()
    T_flange_tool[:3, 3] = (T_flange_tool[:3, 3] + longer * T_flange_tool[:3, 2]).round(DECIMALS)
    return replace(
        tool,
        T_flange_tool=T_flange_tool if longer else tool.T_flange_tool,
        needle_length=needle.length,
        needle_diameter=needle.outer,
        inner_diameter=needle.inner,
        barrel_top=round(tool.barrel_top + longer, DECIMALS),
    )


def needle_with_bore(bore: float, tool: Tool) -> Needle:
    """Return the needle with a bore [mm]: what a tool carries, or a common one of the same length.

    Raises:
        UsageError: there is none.
    """
    own = needle_of(tool)
    common = [replace(needle, length=own.length) for needle in common_needles() if needle.length == NEEDLE_LENGTHS[0]]
    found = min((own, *common), key=lambda needle: abs(needle.inner - bore))
    if abs(found.inner - bore) > SAME_BORE:
        bores = ", ".join(f"{needle.inner:g} ({needle.gauge} gauge)" for needle in common)
        raise UsageError(
            f"no needle has an inner diameter of {bore:g} mm: `--needle` takes {bores}, or {own.inner:g} of the cell. "
            "Describe another one under [nozzle] of the cell file."
        )
    return found


def with_needle_settings(keys: Mapping[str, object]) -> dict[str, object]:
    """Return the keys of a job with what follows from its needle, where they do not say it themselves.

    The strand leaves the needle as fast as the tip moves: spacing times layer height is the area of the bore, and paths
    are one bore apart. The tip rides on top of the layer. The speed is as much below that of the cell as the bore is
    narrower: what is sheared at the wall of the needle goes with speed over diameter [Rabinowitsch1929].

    Raises:
        UsageError: as `load_cell`.
    """
    bore = keys.get("needle")
    if not isinstance(bore, float | int) or bore <= 0.0:
        return dict(keys)
    asked, path = keys.get("spacing"), keys.get("cell")
    spacing = asked if isinstance(asked, float | int) and asked > 0.0 else bore
    cell = load_cell(path if isinstance(path, Path) else None)
    layer = round(pi / 4.0 * bore**2 / spacing, LENGTH_DECIMALS)
    slower = min(1.0, bore / cell.tool.inner_diameter)
    set_by_it: dict[str, object] = {"layer_height": layer, "standoff": layer}
    set_by_it["speed"] = max(round(slower * cell.process.speed, SPEED_DECIMALS), 10.0**-SPEED_DECIMALS)
    if keys.get("rounds") is None:
        set_by_it["spacing"] = float(spacing)
    return set_by_it | dict(keys)


def needle_keys(before: Tool, after: Tool) -> str:
    """Return the keys of a cell file that change with a needle, and their values, as a person writes them."""
    nozzle = {
        "needle_length_mm": (before.needle_length, after.needle_length),
        "outer_diameter_mm": (before.needle_diameter, after.needle_diameter),
        "inner_diameter_mm": (before.inner_diameter, after.inner_diameter),
        "barrel_top_mm": (before.barrel_top, after.barrel_top),
    }
    keys = "[nozzle] " + ", ".join(f"{key} = {new:g}" for key, (old, new) in nozzle.items() if new != old)
    if (tip := after.T_flange_tool[:3, 3]).tolist() == before.T_flange_tool[:3, 3].tolist():
        return keys
    return f"{keys}, [tool] tcp_mm = [{', '.join(f'{value:.{DECIMALS}f}'.rstrip('0').rstrip('.') for value in tip)}]"


# The cell of a job: what its file says, with what the job says otherwise.


# What is proposed is rounded before it is verified, so that what is printed was checked [decimals of mm and degrees].
PLACEMENT_DECIMALS = 1


def job_cell(job: Job) -> Cell:
    """Return the cell of a job: with its needle, layer height, stand-off and place, and no faster than it allows.

    Raises:
        UsageError: as `load_cell`; no needle has that bore; the speed is above that of the cell.
    """
    cell = load_cell(job.cell)
    if job.stand is not None:
        turn = Rotation.from_euler("xyz", job.stand[3:], degrees=True).as_matrix()
        cell = cell_at(cell, rigid(turn, np.array(job.stand[:3])))
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


def cell_at(cell: Cell, T_base_fixture: FloatArray) -> Cell:
    """Return the cell with its demonstration at another place; a table goes with the part, rounded as the place is.

    Args:
        cell: of which `demo_turn` and `demo_position` are where the part stood.
        T_base_fixture: (4, 4) where it stands.
    """
    table = cell.table
    if table is not None:
        start = rigid(cell.demo_turn, cell.demo_position)
        T_base_table = T_base_fixture @ inverse(start) @ table.T_base_table
        rpy = Rotation.from_matrix(T_base_table[:3, :3]).as_euler("xyz", degrees=True).round(PLACEMENT_DECIMALS)
        turn = Rotation.from_euler("xyz", rpy, degrees=True).as_matrix()
        table = replace(table, T_base_table=rigid(turn, T_base_table[:3, 3].round(PLACEMENT_DECIMALS)))
    return replace(cell, demo_position=T_base_fixture[:3, 3], demo_rotation=T_base_fixture[:3, :3], table=table)
