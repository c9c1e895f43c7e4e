"""The command that measures toolpaths, of geoprint or anybody else."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geoprint.cli.bounds import limit_memory, watch
from geoprint.cli.ending import wrote
from geoprint.cli.options import AsJson, Keys, MaxMemory, Overwrite, job_asked, takes
from geoprint.cli.terminal import columns, result

Paths = Annotated[
    list[Path],
    typer.Argument(
        metavar="PATHS",
        help="Files of toolpaths: CSV (x, y, z, run), G-code, APT or CLS, RAPID modules, or bundles of geoprint; "
        "several stand side by side.",
        show_default=False,
    ),
]
CoveredPart = Annotated[
    Path, typer.Option(metavar="FILE", help="Mesh of the part that they cover.", show_default=False)
]
OffsetUpTo = Annotated[
    float | None,
    typer.Option(
        metavar="MM",
        help="Allow paths up to so far off the part; they are measured where they are nearest to it.",
        show_default="a tenth of the spacing",
    ),
]
Fit = Annotated[bool, typer.Option("--fit", help="First fit the paths to the part by a rigid motion.")]
Deposit = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help=(
            "What deposits, if the file does not say. RAPID: an output's name. G-code: two M-codes, as M3/M5 or M42 "
            "P4 S255/S0, or the extruder's axis, as A."
        ),
    ),
]
Dialect = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Dialect of G-code: marlin, klipper, reprap, linuxcnc or fanuc.",
        show_default="guessed from header or moves, and stated",
    ),
]
OutOrNone = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER", help="Also write report.html, figures and tables there.", show_default=False),
]


@takes("unit", "label", "spacing", "patches", "cell")
def measure(
    paths: Paths,
    *,
    part: CoveredPart,
    keys: Keys,
    offset_up_to: OffsetUpTo = None,
    fit: Fit = False,
    deposit: Deposit = None,
    dialect: Dialect = None,
    out: OutOrNone = None,
    max_memory: MaxMemory = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Measure how evenly toolpaths cover a part, whoever made them."""
    from geoprint.postprocessor import check_writable
    from geoprint.reporting import as_json as json_of, measure_table, record_measure_timings, record_measurement
    from geoprint.workflow import measure_files, save

    job = job_asked(part, keys)
    limit_memory(max_memory)
    if out is not None:
        check_writable(out, overwrite=overwrite)
    with watch() as observe:
        found = measure_files(
            job, paths, offset_up_to=offset_up_to, fit=fit, deposit=deposit, dialect=dialect, observe=observe
        )
        observe("writing")
        if out is not None:
            save(found, out, overwrite=overwrite)
    record = record_measurement(found)
    timings = record_measure_timings(found)
    text = measure_table(record, timings, width=columns())
    result(text, lambda: json_of(record) | {"timings": json_of(timings)}, as_json=as_json)
    if out is not None:
        wrote(out, "written and verified")
