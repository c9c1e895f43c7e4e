"""The command that appraises prints by photographs of them."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, final

import typer

from geoprint.cli.bounds import limit_memory, watch
from geoprint.cli.options import AsJson, MaxMemory, Overwrite
from geoprint.cli.terminal import say, tell_json
from geoprint.errors import UsageError

Photographs = Annotated[
    list[Path],
    typer.Argument(
        metavar="PHOTOGRAPHS",
        help="Photographs of prints: JPEG, PNG, TIFF or BMP; several are of one camera that stood still, and are also "
        "held against each other.",
        show_default=False,
    ),
]
Bundle = Annotated[
    Path | None,
    typer.Option("--plan", metavar="FOLDER", help="Bundle of the plan that was printed.", show_default=False),
]
FiducialTables = Annotated[
    list[Path] | None,
    typer.Option(
        "--fiducials",
        metavar="FILE",
        help="Table of places that the photograph shows: name,u,v,x,y,z in pixels and mm; for all, or once for each.",
        show_default=False,
    ),
]
Lenses = Annotated[
    list[Path] | None,
    typer.Option(
        "--lens",
        metavar="FILE",
        help="Lens of the camera: a .toml file, or three photographs of a checkerboard or more, one option each.",
        show_default=False,
    ),
]
Corners = Annotated[
    str | None, typer.Option(metavar="NxM", help="Inner corners of the checkerboard, as 9x6.", show_default=False)
]
Reach = Annotated[
    float | None,
    typer.Option(
        metavar="MM", help="How far from a run its material may lie.", show_default="half the spacing of the plan"
    ),
]
Width = Annotated[
    float | None,
    typer.Option(metavar="PX", help="Width of beads in pixels.", show_default="the one of the highest contrast"),
]
Threshold = Annotated[
    float | None,
    typer.Option(
        help="Contrast from which on it is a bead, over the spread of the grey values around it.", show_default="Otsu's"
    ),
]
OutOrNone = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER", help="Also write pictures, tables and appraisal.json there.", show_default=False),
]


@final
class BeadShade(StrEnum):
    """What beads are, beside what they lie on."""

    LIGHTER = "lighter"
    DARKER = "darker"


def appraise(
    photographs: Photographs,
    *,
    plan: Bundle = None,
    fiducials: FiducialTables = None,
    lens: Lenses = None,
    corners: Corners = None,
    reach: Reach = None,
    shade: Annotated[BeadShade, typer.Option(help="What beads are, beside what they lie on.")] = BeadShade.LIGHTER,
    width: Width = None,
    threshold: Threshold = None,
    out: OutOrNone = None,
    max_memory: MaxMemory = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Appraise prints by photographs of them: lines, widths, breaks, and how they lie beside the plan."""
    from geoprint.account import as_json as json_of
    from geoprint.account.appraised.figures import record_appraisal
    from geoprint.account.texts.appraising import appraisal_text
    from geoprint.export import check_writable
    from geoprint.pipeline.appraised.photographs import PlanAsked, appraise_photographs, save_appraisal

    given = {"--fiducials": fiducials, "--lens": lens, "--corners": corners, "--reach": reach}
    useless = [flag for flag, value in given.items() if value]
    if plan is None and useless:
        raise UsageError(f"`{useless[0]}` needs `--plan`: without a plan nothing is placed on a part.")
    limit_memory(max_memory)
    if out is not None:
        check_writable(out, overwrite=overwrite)
    asked = None if plan is None else PlanAsked(plan, tuple(fiducials or ()), tuple(lens or ()), corners, reach)
    with watch() as observe:
        found = appraise_photographs(
            photographs, against=asked, shade=shade.value, width=width, threshold=threshold, observe=observe
        )
        observe("writing")
        told = record_appraisal(found) if out is None else save_appraisal(found, out, overwrite=overwrite)
    if as_json:
        tell_json(json_of(told))
    say(appraisal_text(told))
    if out is not None:
        say(f"written and verified: {out}")
