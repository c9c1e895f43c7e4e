"""The command line: parse, call the API, print or write. Heavy imports wait until a command runs.

A person reads stderr; stdout carries results only (`--json`). Every refusal is one sentence and an exit status.
"""

from __future__ import annotations

import json
import sys
import time
import traceback
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from geoprint.errors import ExportError, GeoprintError, ResourceError, UsageError

app = typer.Typer(
    name="geoprint",
    help="Plan evenly spaced print paths on a curved surface and write the robot program that prints them.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

# Stages faster than this [s] are not worth a line.
QUICK_STAGE = 1.0
STOPPED_BY_USER = 130


def main() -> None:
    """Run the command line and end the process with the exit status of the outcome."""
    try:
        app()
    except GeoprintError as error:
        _say(f"geoprint: {error}")
        sys.exit(error.exit_status)
    except SystemExit as end:
        if end.code == STOPPED_BY_USER:
            _say("geoprint: stopped; nothing was written.")
        raise
    except MemoryError:
        _say("geoprint: out of memory; choose a larger spacing or a smaller part.")
        sys.exit(ResourceError.exit_status)
    except Exception:  # the one place where a defect may end: with its traceback
        traceback.print_exc()
        _say("geoprint: this is a defect of geoprint; please report it with the lines above.")
        sys.exit(GeoprintError.exit_status)


Part = Annotated[Path, typer.Argument(help="Mesh of the part: STL, OBJ, PLY or OFF.", show_default=False)]
Parts = Annotated[list[Path], typer.Argument(help="Meshes of the parts: STL, OBJ, PLY or OFF.", show_default=False)]
Out = Annotated[Path, typer.Option(help="Folder for the result.", show_default=False)]
Unit = Annotated[str | None, typer.Option(help="Length unit of the file: mm, cm, m, um or in.")]
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
Body = Annotated[Path | None, typer.Option(help="Mesh of what the part lies on, same coordinates.")]
CellPath = Annotated[Path | None, typer.Option(help="Cell file; `geoprint init` writes one.")]
Place = Annotated[str | None, typer.Option(help="'demo': over the pedestal; the program runs only dry.")]
MaxTilt = Annotated[float, typer.Option(help="How far the nozzle may lean from the surface normal, in degrees.")]
Slow = Annotated[
    str, typer.Option(help="Where joints cannot hold the speed: 'lower' it for the run, or let the flow 'follow'.")
]
Flip = Annotated[bool, typer.Option("--flip", help="Print on the other side of the surface.")]
NoRobot = Annotated[bool, typer.Option("--no-robot", help="Leave the robot out: paths only.")]
Samples = Annotated[
    bool, typer.Option("--samples", help="Also write spacing.csv for each backend: every measured spacing.")
]
Figures = Annotated[bool, typer.Option("--figures", help="Also write figures for papers, as PNG and SVG.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing result.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result object on stdout.")]


def _show_version(wanted: bool) -> None:  # noqa: FBT001  (the form that typer calls)
    if wanted:
        from importlib.metadata import version

        typer.echo(version("geoprint"))
        raise typer.Exit


@app.callback()
def _root(
    *,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and end.")
    ] = False,
) -> None:
    """Hold what every command shares."""


@app.command()
def plan(
    surface: Part,
    *,
    out: Out,
    unit: Unit = None,
    backend: Annotated[str, typer.Option(help="Planning backend.")] = "heat",
    spacing: Spacing = None,
    rounds: Rounds = None,
    step: Step = None,
    resolution: Resolution = None,
    seed: SeedPoint = None,
    body: Body = None,
    cell: CellPath = None,
    place: Place = None,
    max_tilt: MaxTilt = 15.0,
    on_slowdown: Slow = "lower",
    flip: Flip = False,
    no_robot: NoRobot = False,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Plan one part with one backend and write the program, the tables and plan.json."""
    from geoprint.config import job_of
    from geoprint.export import check_writable
    from geoprint.pipeline import outcome_text, save_plan, summary
    from geoprint.pipeline import plan as run

    job = job_of(
        surface=surface, unit=unit, flip=flip, backend=backend, resolution=resolution, spacing=spacing,
        rounds=_rounds(rounds, step), seed=seed, body=body, cell=cell, place=place, robot=not no_robot,
        max_tilt=max_tilt, on_slowdown=on_slowdown,
    )  # fmt: skip
    check_writable(out, overwrite=overwrite)
    with _watch() as observe:
        planned = run(job, observe=observe)
        observe("writing")
        save_plan(planned, out, overwrite=overwrite)
    if as_json:
        typer.echo(json.dumps(summary(planned), indent=2))
    _say(f"{outcome_text(planned)}\nwritten and verified: {out}")


@app.command()
def compare(
    surfaces: Parts,
    *,
    out: Out,
    unit: Unit = None,
    backends: Annotated[str, typer.Option(help="Backends to compare, with commas between them, or all.")] = "lscm,heat",
    spacing: Spacing = None,
    rounds: Rounds = None,
    step: Step = None,
    resolution: Resolution = None,
    seed: SeedPoint = None,
    body: Body = None,
    cell: CellPath = None,
    place: Place = None,
    max_tilt: MaxTilt = 15.0,
    on_slowdown: Slow = "lower",
    flip: Flip = False,
    no_robot: NoRobot = False,
    samples: Samples = False,
    figures: Figures = False,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Plan parts with several backends and show which covers them more evenly, and whether they can be printed."""
    from geoprint.config import job_of
    from geoprint.export import check_writable
    from geoprint.pipeline import compare_parts, comparison_summary, comparison_table, save_comparisons

    jobs = [
        job_of(
            surface=surface, unit=unit, flip=flip, resolution=resolution, spacing=spacing, rounds=_rounds(rounds, step),
            seed=seed, body=body, cell=cell, place=place, robot=not no_robot, max_tilt=max_tilt,
            on_slowdown=on_slowdown,
        )
        for surface in surfaces
    ]  # fmt: skip
    check_writable(out, overwrite=overwrite)
    with _watch() as observe:
        compared = compare_parts(jobs, backends=_backend_names(backends), observe=observe)
        observe("writing")
        save_comparisons(compared, out, samples=samples, figures=figures, overwrite=overwrite)
    if as_json:
        typer.echo(json.dumps(comparison_summary(compared), indent=2))
    _say(f"{comparison_table(compared)}\nwritten and verified: {out}")


@app.command()
def place(
    surface: Part,
    *,
    unit: Unit = None,
    backend: Annotated[str, typer.Option(help="Planning backend.")] = "heat",
    spacing: Spacing = None,
    rounds: Rounds = None,
    seed: SeedPoint = None,
    body: Body = None,
    cell: CellPath = None,
    flip: Flip = False,
    height: Annotated[float | None, typer.Option(help="Height of the part's centroid in mm; any if not given.")] = None,
    tilt: Annotated[float, typer.Option(help="How far from upright the part may be tilted, in degrees.")] = 0.0,
    as_json: AsJson = False,
) -> None:
    """Look for the place at which the arm prints a part farthest from its limits; writes nothing."""
    from geoprint.config import job_of
    from geoprint.pipeline import proposal_summary, proposal_text, propose_placement

    job = job_of(
        surface=surface, unit=unit, flip=flip, backend=backend, spacing=spacing, rounds=rounds, seed=seed, body=body,
        cell=cell, place="demo",
    )  # fmt: skip
    with _watch() as observe:
        proposal = propose_placement(job, height=height, tilt_deg=tilt, observe=observe)
    if as_json:
        typer.echo(json.dumps(proposal_summary(proposal), indent=2))
    _say(proposal_text(proposal))


@app.command()
def calibrate(
    touched: Annotated[
        Path | None, typer.Argument(help="Table of touched points: name,x,y,z in mm, base frame.", show_default=False)
    ] = None,
    *,
    model: Annotated[
        Path | None, typer.Option(help="Table of the fixture's points: name,x,y,z in mm, its own frame.")
    ] = None,
    tcp: Annotated[
        Path | None,
        typer.Option(
            help="Instead: table of poses in which the tip touched one point, x,y,z,q1,q2,q3,q4 or j1,...,j6."
        ),
    ] = None,
    part: Annotated[Path | None, typer.Option(help="Mesh of the part at which the uncertainty matters.")] = None,
    unit: Unit = None,
    cell: CellPath = None,
    out: Annotated[Path | None, typer.Option(help="Cell file to write; without it nothing is written.")] = None,
    noise_mm: Annotated[
        float | None, typer.Option(help="Standard deviation of a touch in each direction; estimated if not given.")
    ] = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Find where the fixture stands from touched points, or the tool centre point, and say how well that is known."""
    from geoprint.pipeline import calibrate as run
    from geoprint.pipeline import calibration_summary, calibration_text, check_cell_writable, save_calibrated

    if out is not None:
        check_cell_writable(out, overwrite=overwrite)
    found = run(touched, model=model, tcp=tcp, cell=cell, part=part, unit=unit, noise=noise_mm)
    if as_json:
        typer.echo(json.dumps(calibration_summary(found), indent=2))
    _say(calibration_text(found))
    if out is not None:
        save_calibrated(found, out, overwrite=overwrite)
        _say(f"written and read back: {out}")


@app.command()
def recommend(
    surface: Annotated[Path | None, typer.Argument(help="Mesh of a part, for rounds and mass.")] = None,
    *,
    pressure: Annotated[float, typer.Option(help="Air pressure in kPa.", show_default=False)],
    unit: Unit = None,
    spacing: Spacing = None,
    rounds: Rounds = None,
    step: Step = None,
    cell: CellPath = None,
    good: Annotated[
        tuple[float, int] | None,
        typer.Option(help="Pressure (kPa) and rounds of a print that worked, to compare with."),
    ] = None,
    as_json: AsJson = False,
) -> None:  # fmt: skip
    """Say which spacing, rounds, stand-off and speed fit a pressure, and warn of gaps and over-dispensing."""
    from geoprint.config import job_of
    from geoprint.pipeline import recommendation

    job = job_of(surface=surface or Path(), unit=unit, spacing=spacing, rounds=_rounds(rounds, step), cell=cell)
    found, text = recommendation(job, part=surface is not None, pressure_kpa=pressure, good=good)
    if as_json:
        typer.echo(json.dumps(found, indent=2))
    _say(text)


@app.command(name="fit-flow")
def fit_flow(
    measured: Annotated[
        Path,
        typer.Argument(
            help="CSV with the columns pressure_kpa,duration_s,mass_g or pressure_kpa,speed_mm_s,width_mm,height_mm.",
            show_default=False,
        ),
    ],
    *,
    density: Annotated[float, typer.Option(help="Density of the material in g/cm3.", show_default=False)],
    model: Annotated[str, typer.Option(help="newtonian, power-law or herschel-bulkley.")] = "power-law",
    cell: CellPath = None,
    as_json: AsJson = False,
) -> None:
    """Fit how the material flows to a few measured lines, and print the [material] table of the cell file."""
    from geoprint.pipeline import fit_flow as run
    from geoprint.pipeline import fit_summary, material_table

    fit = run(measured, cell=cell, density=density, model=model)
    if as_json:
        typer.echo(json.dumps(fit_summary(fit, density=density), indent=2))
    else:
        typer.echo(material_table(fit, density=density, source=measured.name))


@app.command()
def init(
    folder: Annotated[Path, typer.Argument(help="Where to write the cell files.")] = Path(),
) -> None:
    """Write the commented cell files that geoprint comes with, to be adapted to your cell."""
    from geoprint.config import PACKAGED_CELLS, packaged_cell_text

    paths = [folder / f"{name}.toml" for name in PACKAGED_CELLS]
    for path in paths:
        if path.exists():
            raise UsageError(f"{path} exists already; remove it or choose another folder: `geoprint init FOLDER`.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, path in zip(PACKAGED_CELLS, paths, strict=True):
            path.write_text(packaged_cell_text(name), encoding="utf-8")
            _say(f"wrote {path}")
    except OSError as error:
        raise ExportError(f"the cell files cannot be written to {folder} ({error}); choose another folder.") from error


@app.command()
def doctor() -> None:
    """Show versions and prove that kinematics and collision check work on this machine."""
    from geoprint.pipeline import examine

    for line in examine():
        typer.echo(line)


def _backend_names(text: str) -> list[str]:
    from geoprint.backends import BACKENDS

    return list(BACKENDS) if text.strip() == "all" else [name.strip() for name in text.split(",")]


def _rounds(rounds: int | None, step: str | None) -> int | None:
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


def _say(text: str) -> None:
    typer.echo(text, err=True)


@contextmanager
def _watch() -> Generator[Callable[[str], None]]:
    """Show the running stage on a terminal, and leave a line for each that took more than a second."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console

    console = Console(stderr=True)
    if not any((Path(__file__).parent / "backends" / "__pycache__").glob("*.nbi")):
        console.print("compiling the numerical kernels, once: later runs start faster", highlight=False)
    with console.status("starting") as status:
        running = ["starting"]
        since = [time.perf_counter()]

        def observe(name: str) -> None:
            seconds = time.perf_counter() - since[0]
            if seconds > QUICK_STAGE:
                console.print(f"  {running[0]:<16}{seconds:6.1f} s", highlight=False)
            running[0], since[0] = name, time.perf_counter()
            status.update(name)

        yield observe
        observe("done")
