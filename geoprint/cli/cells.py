"""Commands about the cell: init, calibrate, doctor."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geoprint.cli.ending import wrote
from geoprint.cli.options import AsJson, Overwrite, takes
from geoprint.cli.terminal import columns, result, show
from geoprint.errors import ExportError, UsageError, reason_of


def init(
    folder: Annotated[Path, typer.Argument(help="Where to write the files.")] = Path(),
    *,
    urdf: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Instead: a cell for the arm that this URDF describes.", show_default=False),
    ] = None,
    flange: Annotated[str, typer.Option(metavar="NAME", help="Flange frame of that arm.")] = "tool0",
) -> None:
    """Write commented files: the cells that geoprint comes with, to be adapted to your cell, a job and a field."""
    from geoprint.config import (
        FIELD_EXAMPLE,
        PACKAGED_CELLS,
        TILTING_CELL,
        UR_CELL,
        job_file_text,
        packaged_cell_text,
    )
    from geoprint.workflow.arm_cell import arm_cell

    notes: tuple[str, ...] = ()
    if urdf is not None:
        own = arm_cell(urdf, flange=flange)
        texts, notes = {folder / name: text for name, text in own.files.items()}, own.notes
    else:
        texts = {folder / f"{name}.toml": packaged_cell_text(name) for name in (*PACKAGED_CELLS, TILTING_CELL, UR_CELL)}
        texts[folder / "job.toml"] = job_file_text()
        texts[folder / "field.toml"] = FIELD_EXAMPLE
    for path in texts:
        if path.exists():
            raise UsageError(f"{path} exists already; remove it or choose another folder: `geoprint init FOLDER`.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, text in texts.items():
            path.write_text(text, encoding="utf-8")
            wrote(path)
    except OSError as error:
        raise ExportError(
            f"the files cannot be written to {folder} ({reason_of(error)}); choose another folder."
        ) from error
    for note in notes:
        show(note)


@takes()
def calibrate(
    touched: Annotated[
        Path | None, typer.Argument(help="Table of touched points: name,x,y,z in mm, base frame.", show_default=False)
    ] = None,
    *,
    model: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Table of the fixture's points: name,x,y,z in mm, its own frame."),
    ] = None,
    tcp: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Instead: table of poses in which the tip touched one point, x,y,z,q1,q2,q3,q4 or j1,...,j6.",
        ),
    ] = None,
    part: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Mesh of the part at which the uncertainty matters.")
    ] = None,
    unit: str | None = None,
    cell: Path | None = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Cell file to write; omitted: only print the result.")
    ] = None,
    noise_mm: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Standard deviation of a touch in each direction; estimated if not given."),
    ] = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Find where the fixture stands from touched points, or the tool centre point, and say how well that is known."""
    from geoprint.reporting import calibration_summary, calibration_text
    from geoprint.workflow import calibrate as run, check_cell_writable, save_calibrated

    if out is not None:
        check_cell_writable(out, overwrite=overwrite)
    found = run(touched, model=model, tcp=tcp, cell=cell, part=part, unit=unit, noise=noise_mm)
    result(calibration_text(found, width=columns()), lambda: calibration_summary(found), as_json=as_json)
    if out is not None:
        save_calibrated(found, out, overwrite=overwrite)
        wrote(out, "written and read back")


def doctor() -> None:
    """Show versions and prove that kinematics and collision check work on this machine."""
    from geoprint.workflow import examine

    for line in examine():
        show(line)
