"""How even is the layer with constant flow, and with flow that follows the local width? For each backend.

    python -m benchmarks.thickness [FILE ...] [--smoke]

Parts are those in data/ and any mesh files [mm], planned `SPACING` apart. Thickness is simulated by
`geoprint.quality.LevelledLayer`: the laid volume spreads over the surface, and neither the widths that set the flow nor
any backend's field enters. Where fronts meet it is told apart. Below about 0.1 % the table shows no flow: circles on a
flat disc of 15 mm radius, which a constant flow covers exactly, come out at 0.07 %, and at 0.10 % with measured widths
(tests/quality/test_thickness.py). Between that and 0.5 % it is mostly the rim: a bead lies halfway to it, but the area
that it fills there lies farther out where the rim bends, and a ragged rim has corners that no bead reaches.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.parts.tables import row, rule
from geoprint.config import job_of
from geoprint.pipeline import compare

DATA = Path(__file__).parents[1] / "data"
OWN = ("plate.ply", "heart_flat_patch.ply", "heart_apex_patch.ply")
BACKENDS = ("lscm", "heat", "fast-marching")
SPACING = 1.0
SMOKE_SPACING = 4.0


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", type=Path, metavar="FILE", help="meshes [mm] besides")
    parser.add_argument("--smoke", action="store_true", help="the smallest case only, to see that the script runs")
    arguments = parser.parse_args()
    own = [DATA / name for name in (OWN[-1:] if arguments.smoke else OWN)]
    spacing = SMOKE_SPACING if arguments.smoke else SPACING
    for line in table([*own, *arguments.parts], spacing=spacing):
        print(line, flush=True)


def table(parts: Sequence[Path], *, spacing: float) -> Iterator[str]:
    """Yield a Markdown table: CV of the thickness in percent, with constant flow and with flow that follows."""
    yield row(
        "part", "backend", "away, share of the area", "away: constant", "follows", "times less", "near: constant",
        "follows", "flow over nominal",
    )  # fmt: skip
    yield rule(9)
    for part in parts:
        compared = compare(job_of(surface=part, unit="mm", spacing=spacing, robot=False), backends=BACKENDS)
        for name, outcome in compared.planned:
            laid = outcome.plan.laid
            if laid is None:
                continue
            constant, following = laid.constant, laid.following
            nominal = spacing * outcome.plan.workpiece.cell.process.layer_height
            flow = laid.following_flow[laid.following_flow > 0.0] / nominal
            yield row(
                part.stem, name, f"{constant.away_share:.2f}", _percent(constant.cv), _percent(following.cv),
                _times(constant.cv, following.cv), _percent(constant.near_cv), _percent(following.near_cv),
                f"{flow.min():.2f} - {flow.max():.2f}",
            )  # fmt: skip
        for name, reason in compared.refused:
            yield row(part.stem, name, f"refuses: {reason}", *[""] * 6)


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.2f}"


def _times(before: float | None, after: float | None) -> str:
    return "-" if before is None or after is None else f"{before / after:.1f}"


if __name__ == "__main__":
    main()
