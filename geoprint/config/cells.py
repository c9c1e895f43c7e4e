"""Cell files: those of a person and those that come with geoprint."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from string import Template

from pydantic import ValidationError

from geoprint.config.strict import describe, line_of, parsed_toml, text_of
from geoprint.errors import InputError, UsageError
from geoprint.model import Cell

# A 1 inch needle of 20 gauge, the widest of `geoprint/robots/needles.csv` that passes between paths 1 mm apart.
_NEEDLE = {"inner": "0.6", "outer": "0.91", "needle": "25.4", "standoff": "0.3"}
# Demonstrations stand straight ahead of the arm, as in the paper, although the border of two quadrants of axis 1 lies
# there: 45 degrees aside parts were refused that print here.
# What each cell that comes with geoprint says where `geoprint/robots/irb120.toml.in` leaves it open, the default first.
_PACKAGED = {
    "irb120-bent45": {
        "about": "nozzle on a bracket bent by 45 degrees: the default, because the wrist stays far from its "
        "singularity.",
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
# Cells in which the part stands still: who has no table cannot take another cell that has one.
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


def load_cell(path: Path | str | None) -> Cell:
    """Read and validate a cell file.

    Args:
        path: the TOML file, or None for the first packaged cell.

    Returns:
        The cell in mm, s and rad.

    Raises:
        UsageError: the file is missing, not TOML, or has an unknown, missing or meaningless key.
    """
    if path is None:
        return cell_of(packaged_cell_text(PACKAGED_CELLS[0]), name=f"{PACKAGED_CELLS[0]}.toml")
    path = Path(path)
    return cell_of(cell_text(path), name=path.name, folder=path.parent)


def cell_text(path: Path | str) -> str:
    """Return the text of a cell file.

    Raises:
        UsageError: the file is missing or cannot be read.
    """
    try:
        return text_of(Path(path))
    except (OSError, ValueError) as error:
        raise UsageError(f"the cell file {path} cannot be read ({error}); `geoprint init` writes one.") from error


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
    from geoprint.config.machine import machine_of

    table = parsed_toml(text, name=name)
    try:
        return machine_of(table, name=name, folder=Path(folder))
    except ValidationError as error:
        where = line_of(error, text, name=name)
        raise UsageError(f"{where}: {describe(error)}; `geoprint init` writes a cell with every key.") from error
    except (InputError, UsageError) as error:
        raise UsageError(f"{name}: {error}", **error.details) from error


def packaged_cell_text(name: str) -> str:
    """Return the text of a packaged cell file."""
    template = resources.files("geoprint.robots").joinpath("irb120.toml.in").read_text(encoding="utf-8")
    return Template(template).substitute(_PACKAGED[name])
