"""The command that prints a bundle in silico."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geoprint.cli.bounds import limit_memory, watch
from geoprint.cli.options import AsJson, MaxMemory, Overwrite
from geoprint.cli.terminal import say, tell_json

Bundle = Annotated[Path, typer.Argument(help="Folder that `geoprint plan` or `compare` wrote.", show_default=False)]
Viscosity = Annotated[float, typer.Option(help="Of the material, over what the flow was set for.")]
Spread = Annotated[
    float, typer.Option(help="Width of beads over what their flow asks for, as much lower: below 1 they stand apart.")
]
Flow = Annotated[float, typer.Option(help="Volume that is set, over that of the plan.")]
WidthNoise = Annotated[float, typer.Option(help="Standard deviation of the width along a bead, over its mean.")]
Offset = Annotated[float, typer.Option(metavar="MM", help="By which all beads lie to the left of their paths.")]
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
    viscosity: Viscosity = 1.0,
    flow: Flow = 1.0,
    spread: Spread = 1.0,
    noise: WidthNoise = 0.0,
    offset: Offset = 0.0,
    seed: RandomSeed = 0,
    out: OutOrNone = None,
    max_memory: MaxMemory = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Print a bundle in silico: execute its program as it stands there, and lay what that commands, run by run."""
    from geoprint.account import as_json as json_of
    from geoprint.account.texts.simulating import simulated_text
    from geoprint.export import check_writable
    from geoprint.pipeline.appraised.simulated import record_simulated, save_simulated, simulated_print
    from geoprint.silico import Faults

    limit_memory(max_memory)
    if out is not None:
        check_writable(out, overwrite=overwrite)
    faults = Faults(offset=offset, width_scale=spread, width_noise=noise, flow=flow, viscosity=viscosity)
    with watch() as observe:
        observe("program")
        found = simulated_print(bundle, faults=faults, seed=seed)
        observe("writing")
        told = record_simulated(found) if out is None else save_simulated(found, out, overwrite=overwrite)
    if as_json:
        tell_json(json_of(told))
    say(simulated_text(told))
    if out is not None:
        say(f"written and verified: {out}")
