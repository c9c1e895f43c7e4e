"""The command that prints a bundle in silico."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geoprint.cli.bounds import limit_memory, watch
from geoprint.cli.options import AsJson, MaxMemory, Overwrite
from geoprint.cli.terminal import print_json, say
from geoprint.errors import UsageError

Bundle = Annotated[Path, typer.Argument(help="Folder that `geoprint plan` or `compare` wrote.", show_default=False)]
Spread = Annotated[
    float, typer.Option(help="Width of beads over what their flow asks for, as much lower: below 1 they stand apart.")
]
Flow = Annotated[
    float, typer.Option(help="Volume that flows, over that of the plan; 1 over the viscosity if that differs.")
]
WidthNoise = Annotated[float, typer.Option(help="Standard deviation of the width along a bead, over its mean.")]
Offset = Annotated[float, typer.Option(metavar="MM", help="By which all beads lie to the left of their paths.")]
Tone = Annotated[
    str, typer.Option(metavar="GAMMA", help="Tone curve of the photograph: its gamma, 1 for none, or srgb.")
]
Exposure = Annotated[float, typer.Option(help="Of the photograph: what comes to more than white is cut off.")]
Blur = Annotated[float, typer.Option(metavar="PX", help="Of the photograph (standard deviation).")]
Defocus = Annotated[float, typer.Option(metavar="PX", help="Of the photograph: the circle that a point is seen as.")]
RandomSeed = Annotated[int, typer.Option(min=0, help="Of all noise.")]
OutOrNone = Annotated[
    Path | None,
    typer.Option(
        metavar="FOLDER",
        help="Also write simulated.json, and a scan and a photograph for `geoprint appraise`.",
        show_default=False,
    ),
]


def simulate(
    bundle: Bundle,
    *,
    flow: Flow = 1.0,
    spread: Spread = 1.0,
    noise: WidthNoise = 0.0,
    offset: Offset = 0.0,
    tone: Tone = "1",
    exposure: Exposure = 1.0,
    blur: Blur = 0.7,
    defocus: Defocus = 0.0,
    seed: RandomSeed = 0,
    out: OutOrNone = None,
    max_memory: MaxMemory = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Print a bundle in silico: execute its program as it stands there, and lay what that commands, run by run."""
    from geoprint.inspection.simulated import record_simulated, save_simulated, simulated_print, simulated_text
    from geoprint.postprocessor import check_writable
    from geoprint.reporting import as_json as json_of
    from geoprint.simulation import Development, Faults

    limit_memory(max_memory)
    if out is not None:
        check_writable(out, overwrite=overwrite)
    faults = Faults(offset=offset, width_scale=spread, width_noise=noise, flow=flow)
    development = Development(exposure=exposure, tone=_gamma(tone), blur=blur, defocus=defocus)
    with watch() as observe:
        observe("program")
        found = simulated_print(bundle, faults=faults, seed=seed)
        observe("writing")
        record = (
            record_simulated(found) if out is None else save_simulated(found, out, development, overwrite=overwrite)
        )
    if as_json:
        print_json(json_of(record))
    say(simulated_text(record))
    if out is not None:
        say(f"written and verified: {out}")


def _gamma(tone: str) -> float:
    """Return the gamma of a tone curve, 0 for sRGB's."""
    if tone.strip().lower() == "srgb":
        return 0.0
    try:
        gamma = float(tone)
    except ValueError:
        gamma = 0.0
    if not 0.2 <= gamma <= 5.0:
        raise UsageError(f"`--tone {tone}`: it must be a gamma from 0.2 to 5, or srgb.")
    return gamma
