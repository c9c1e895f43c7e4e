"""Arguments and options that several commands share, besides those of a job's keys."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

_PARTS = (
    "File of the part: STL, OBJ, PLY, OFF or 3MF, or one of these in a ZIP; with the extras also STEP, IGES, label "
    "volumes and point clouds"
)
Part = Annotated[
    Path,
    typer.Argument(metavar="PART", help=f"{_PARTS}.", show_default=False),
]
_PART_OR_JOB = typer.Argument(
    metavar="PART",
    help=f"{_PARTS}; or a job file (.toml), which `geoprint init` writes: its keys count where no option is given "
    "here.",
    show_default=False,
)
PartOrJob = Annotated[Path, _PART_OR_JOB]
PartOrJobOrNone = Annotated[Path | None, _PART_OR_JOB]
PartsOrJobs = Annotated[
    list[Path],
    typer.Argument(
        metavar="PARTS",
        help="Files of parts, as `geoprint plan` takes them; or job files (.toml), whose keys count where no option is "
        "given here.",
        show_default=False,
    ),
]
Out = Annotated[Path, typer.Option(metavar="FOLDER", help="Folder for the result.", show_default=False)]
Samples = Annotated[
    bool, typer.Option("--samples", help="Also write spacing.csv for each backend: every measured spacing.")
]
Figures = Annotated[bool, typer.Option("--figures", help="Also write figures for papers, as PNG and SVG.")]
MaxMemory = Annotated[float | None, typer.Option(help="Stop with status 6 beyond this much memory in GB.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing result.")]
Verbose = Annotated[bool, typer.Option("--verbose", help="List all that was not checked.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result, or the error, as one object on stdout.")]


def backends_of(text: str | None) -> list[str] | None:
    """Return the names in a comma-separated list; `all` stands for every backend, None where nothing is said."""
    from geoprint.backends import backend_names

    if text is None:
        return None
    return list(backend_names()) if text.strip() == "all" else [name.strip() for name in text.split(",")]
