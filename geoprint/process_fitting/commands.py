"""The commands that find process settings: recommend, fit-flow."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geoprint.cli.bounds import ADVISING, watch
from geoprint.cli.options import AsJson, Keys, job_asked, takes
from geoprint.cli.terminal import print_json, result, tell


@takes("unit", "spacing", "rounds", "cell", "needle")
def recommend(
    surface: Annotated[Path | None, typer.Argument(metavar="PART", help="Mesh of a part, for rounds and mass.")] = None,
    *,
    pressure: Annotated[
        float | None, typer.Option(metavar="KPA", help="Air pressure in kPa; that of the cell if not given.")
    ] = None,
    keys: Keys,
    good: Annotated[
        tuple[float, int] | None,
        typer.Option(metavar="KPA N", help="Pressure (kPa) and rounds of a print that worked, to compare with."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Say which spacing, rounds, stand-off and speed fit a pressure, and warn of gaps and over-dispensing."""
    from geoprint.process_fitting.recommending import recommendation
    from geoprint.process_fitting.text import recommendation_summary, recommendation_text

    job = job_asked(surface or Path(), keys)
    with watch(expected=ADVISING) as observe:
        found = recommendation(job, part=surface is not None, pressure_kpa=pressure, good=good, observe=observe)
    result(recommendation_text(found), lambda: recommendation_summary(found), as_json=as_json)


@takes()
def fit_flow(
    measured: Annotated[
        Path,
        typer.Argument(
            help="CSV with the columns pressure_kpa,duration_s,mass_g or pressure_kpa,speed_mm_s,width_mm,height_mm.",
            show_default=False,
        ),
    ],
    *,
    density: Annotated[
        float, typer.Option(metavar="G/CM3", help="Density of the material in g/cm3.", show_default=False)
    ],
    model: Annotated[
        str,
        typer.Option(metavar="newtonian|power-law|herschel-bulkley", help="newtonian, power-law or herschel-bulkley."),
    ] = "power-law",
    cell: Path | None = None,
    as_json: AsJson = False,
) -> None:
    """Fit how the material flows to a few measured lines, and print the [material] table of the cell file."""
    from geoprint.process_fitting.recommending import fit_flow as run
    from geoprint.process_fitting.text import fit_summary, material_table

    fit = run(measured, cell=cell, density=density, model=model)
    if as_json:
        print_json(fit_summary(fit, density=density))
    else:
        tell(material_table(fit, density=density, source=measured.name))
