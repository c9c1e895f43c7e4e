"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geoprint.errors import UsageError

_PARTS = (
    "File of the part: STL, OBJ, PLY, OFF or 3MF, or one of these in a ZIP; with the extras also STEP, IGES, label "
    "volumes and point clouds"
)
Part = Annotated[
    Path,
    typer.Argument(help=f"{_PARTS}.", show_default=False),
]
PartOrJob = Annotated[
    Path,
    typer.Argument(
        help=f"{_PARTS}; or a job file (.toml), which `geoprint init` writes: its keys count where no option is given "
        "here.",
        show_default=False,
    ),
]
PartsOrJobs = Annotated[
    list[Path],
    typer.Argument(
        help="Files of parts, as `geoprint plan` takes them; or job files (.toml), whose keys count where no option is "
        "given here.",
        show_default=False,
    ),
]
Out = Annotated[Path, typer.Option(help="Folder for the result.", show_default=False)]
Unit = Annotated[str | None, typer.Option(help="Length unit of the file: mm, cm, m, um or in.")]
OneBackend = Annotated[str | None, typer.Option(help="Planning backend.", show_default="heat")]
Spacing = Annotated[float | None, typer.Option(help="Distance between neighbouring paths in mm.")]
Rounds = Annotated[int | None, typer.Option(help="Number of rounds from the seed inwards.")]
Step = Annotated[str | None, typer.Option(help="Step of the normalised distance, 0.05 or 1/20 for 20 rounds.")]
Resolution = Annotated[
    int | None, typer.Option(help="Pixels along the longer side of lscm's raster; by default 16 a spacing.")
]
SeedPoint = Annotated[
    tuple[float, float, float] | None,
    typer.Option(help="Point X Y Z (mm) from which distance is measured, instead of the border."),
]
Label = Annotated[int | None, typer.Option(help="Which label of a label volume (.nii, .nii.gz, .nrrd, .dcm).")]
At = Annotated[
    tuple[float, float, float] | None,
    typer.Option(help="Cut the part out of the file: the piece about the point X Y Z (mm) ..."),
]
Radius = Annotated[float | None, typer.Option(help="... up to this far along the surface in mm ...")]
Cone = Annotated[float | None, typer.Option(help="... and where its normal turns at most this far, in degrees.")]
PatchBox = Annotated[
    tuple[float, float, float, float, float, float] | None,
    typer.Option("--box", help="Cut the part out of the file by a box: lowest and highest X Y Z in mm."),
]
Curve = Annotated[
    Path | None,
    typer.Option(
        help="Cut the part out of the file along a closed curve: a CSV file x,y,z (mm) of points in order round it; "
        "`--at` says which side, by default the smaller."
    ),
]
Region = Annotated[
    str | None,
    typer.Option(help="Cut the part out of the file by a group, object or label of it; `geoprint inspect` lists them."),
]
Body = Annotated[Path | None, typer.Option(help="Mesh of what the part lies on, same coordinates.")]
CellPath = Annotated[Path | None, typer.Option(help="Cell file; `geoprint init` writes one.")]
Place = Annotated[str | None, typer.Option(help="'demo': over the pedestal; the program runs only dry.")]
MaxTilt = Annotated[
    float | None,
    typer.Option(help="How far the nozzle may lean from the surface normal, in degrees.", show_default="15"),
]
Slow = Annotated[
    str | None,
    typer.Option(
        help="Where joints cannot hold the speed: 'lower' it for the run, or let the flow 'follow'.",
        show_default="lower",
    ),
]
Flip = Annotated[
    bool | None,
    typer.Option("--flip/--no-flip", help="Print on the other side of the surface.", show_default="no-flip"),
]
WithRobot = Annotated[
    bool | None,
    typer.Option("--robot/--no-robot", help="Plan the robot too, or leave it out: paths only.", show_default="robot"),
]
Samples = Annotated[
    bool, typer.Option("--samples", help="Also write spacing.csv for each backend: every measured spacing.")
]
Figures = Annotated[bool, typer.Option("--figures", help="Also write figures for papers, as PNG and SVG.")]
FillHoles = Annotated[
    float | None, typer.Option(help="Close holes whose border is up to this long in mm; by default missing triangles.")
]
MaxMemory = Annotated[float | None, typer.Option(help="Stop with status 6 beyond this much memory in GB.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing result.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result object on stdout.")]


def region_of(
    *,
    at: tuple[float, float, float] | None,
    radius: float | None,
    cone: float | None,
    box: tuple[float, ...] | None,
    curve: Path | None,
    region: str | None,
) -> dict[str, object] | None:
    """Return the bounds of a patch as a job states them, None where not one is given."""
    from geoprint.pipeline import read_curve

    given: dict[str, object] = {
        "at": at and [*at],
        "radius": radius,
        "cone_deg": cone,
        "box": box and [*box],
        "curve": curve and read_curve(curve),
        "region": region,
    }
    return given if any(value is not None for value in given.values()) else None


def backends_of(text: str | None) -> list[str] | None:
    """Return the names in a comma-separated list; `all` stands for every backend, None where nothing is said."""
    from geoprint.backends import backend_names

    if text is None:
        return None
    return list(backend_names()) if text.strip() == "all" else [name.strip() for name in text.split(",")]


def rounds_of(rounds: int | None, step: str | None) -> int | None:
    """Turn the paper's step of the normalised distance into rounds."""
    if step is None:
        return rounds
    if rounds is not None:
        raise UsageError("give either `--rounds` or `--step`, not both: rounds are 1 / step.")
    top, _, bottom = step.partition("/")
    try:
        value = float(top) / float(bottom or 1)
        count = round(1.0 / value)
    except (ValueError, ZeroDivisionError, OverflowError):
        count, value = 0, 0.0
    if count < 1 or abs(count * value - 1.0) > 1e-6:
        raise UsageError(f"`--step {step}` does not divide the distance into whole rounds; write 0.05 or 1/20.")
    return count
