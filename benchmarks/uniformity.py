"""How even are the paths of each backend, on the parts in data/? Prints the README's table and makes its picture.

python -m benchmarks.uniformity [--picture FILE] [--smoke]
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

from geoprint.config import Job, job_of
from geoprint.pipeline import COMPARED, Comparison, Planned, compare, comparison_picture

DATA = Path(__file__).parents[1] / "data"


@dataclass(frozen=True, slots=True)
class Part:
    """A row of the table: what is planned, on which body, how fine."""

    title: str
    file: str
    body: str | None
    spacing: float


PARTS = (
    Part("plate, flat", "plate.ply", None, 1.0),
    Part("heart, free wall, nearly flat", "heart_flat_patch.ply", "heart.ply", 1.0),
    Part("heart, apex, strongly curved", "heart_apex_patch.ply", "heart.ply", 1.0),
)
SMOKE = Part("plate, flat, coarse", "plate.ply", None, 4.0)
BACKENDS = ("lscm", "heat", "fast-marching")
PICTURED = "heart_apex_patch.ply"


def main() -> None:
    """Print the table; with `--picture` also write the picture of the apex."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--picture", type=Path, help="where to write the picture of the apex, a PNG")
    parser.add_argument("--smoke", action="store_true", help="the smallest case only, to see that the script runs")
    arguments = parser.parse_args()
    print("| part | backend | spacing CV | p95 | area uncovered | overlapped | width CV | printable |")
    print("|---|---|---|---|---|---|---|---|")
    for part in (SMOKE,) if arguments.smoke else PARTS:
        compared = compare(_job(part), backends=BACKENDS)
        for line in _rows(part, compared):
            print(line)
        if arguments.picture is not None and part.file == PICTURED:
            arguments.picture.parent.mkdir(parents=True, exist_ok=True)
            pair = tuple((name, outcome) for name, outcome in compared.outcomes if name in COMPARED)
            arguments.picture.write_bytes(comparison_picture(replace(compared, outcomes=pair)))


def _job(part: Part) -> Job:
    return job_of(
        surface=DATA / part.file,
        unit="mm",
        spacing=part.spacing,
        body=None if part.body is None else DATA / part.body,
        place="demo",
    )


def _rows(part: Part, compared: Comparison) -> list[str]:
    rows: list[str] = []
    for name, outcome in compared.outcomes:
        if isinstance(outcome, Planned):
            measured = outcome.uniformity
            printable = "yes" if outcome.plan.robot is not None else f"no: {outcome.not_printable}"
            rows.append(
                f"| {part.title} | {name} | {measured.cv:.2%} | {measured.percentile(95):.3f} | "
                f"{measured.uncovered:.2%} | {measured.overlap:.2%} | {measured.width_cv:.2%} | {printable} |"
            )
        else:
            rows.append(f"| {part.title} | {name} | - | - | - | - | - | refused: {outcome.reason} |")
    return rows


if __name__ == "__main__":
    main()
