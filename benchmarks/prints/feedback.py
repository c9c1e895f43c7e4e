"""How much evener do prints become that learn from scans of those before, on a dispenser that errs in other ways?

    python -m benchmarks.prints.feedback [--seeds N] [--smoke]

A layer on a patch of a heart is printed by a simulated plant (`geoprint.simulation.Plant`, which shares no code with
the corrector) with errors that the corrector's model lacks: viscosity is 1.3 times what was thought, the valve 0.5 mm
late, air lags behind by a length that grows as the syringe empties, material is thick after rest, beads slump, and
their volume varies by 3 %; lags and rest are drawn for each seed. A scan with 0.05 mm noise and 30 % missing is laid
onto the part and measured, `geoprint.process.feedback` corrects flow and valve, and the next print is laid. The
error is the root mean square of the true thickness over its cells, a spacing wide, off the wanted one, over the layer's
height; the scan has no part in it. The last column is what of it is left after two corrected prints: a third or less is
wanted of every seed.

The second table: programs of a plate for a slow arm, whose valve lets more through at corners, and for a flow that
follows the speed (`benchmarks.prints.closed_loop`): largest and root mean square deviation of the volume of a run from
the wanted one, print after print; by photographs from its share of the whole print, for these say no more. What a valve
printed is not fed back to the other dispenser: the first print there has no correction, as `geoprint plan` asks for.
Then how many prints of 100 that are as their programs deposit them change something, by noise of the measurement.

The third table: prints of which nothing but noise was measured that change something, and of prints that are off
everywhere by twice the deviation that each part of a run is known with.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np

from benchmarks.parts.tables import row, rule, script_parser
from benchmarks.prints.closed_loop import (
    BOUNDS,
    Measure,
    Mode,
    changed,
    closed_loop,
    deviations,
    measured_as_known,
    plant_of,
)
from benchmarks.prints.print_scans import RAYS, SIDE
from geoprint.errors import percent
from geoprint.model import FloatArray
from geoprint.process.feedback import corrected

SEEDS, PRINTS, NOISES = 10, 3, 100
# In the smoke run: lines of sight to either side of a scan, and places of a triangle by which the truth is found.
SMOKE_RAYS, SMOKE_SIDE = 60, 3
# With which deviation a part of a run is known in the second table, and what all parts share.
DEVIATION, COMMON = 0.04, 0.005


def main() -> None:
    """Print the tables."""
    parser = script_parser(__doc__, smoke="the smallest case only, to see that the script runs")
    parser.add_argument("--seeds", type=int, default=SEEDS, metavar="N", help="dispensers")
    arguments = parser.parse_args()
    smoke: bool = arguments.smoke
    seeds, prints = (1, 1) if smoke else (arguments.seeds, PRINTS)
    rays, side = (SMOKE_RAYS, SMOKE_SIDE) if smoke else (RAYS, SIDE)
    for line in loops(seeds, prints=prints, rays=rays, side=side):
        print(line, flush=True)
    print()
    # Plans of the plate take the time: one more print of them shows what is left.
    for line in programs(seeds, prints=max(prints, 2), quiet=1 if smoke else NOISES):
        print(line, flush=True)
    print()
    for line in silence(1 if smoke else NOISES):
        print(line, flush=True)


def loops(seeds: int, *, prints: int, rays: int, side: int) -> Iterator[str]:
    """Yield a Markdown table: the error of the thickness from print to print.

    Args:
        seeds: dispensers.
        prints: of each.
        rays: lines of sight to either side of a scan.
        side: places of each triangle, along either side, by which the truth is found.
    """
    yield row("seed", *(f"print {number}" for number in range(1, prints + 1)), "taken out", "valve earlier", "left")
    yield rule(prints + 4)
    shares: list[float] = []
    for seed in range(seeds):
        made = list(islice(closed_loop(plant_of(seed), seed=seed, rays=rays, side=side), prints))
        shares.append(made[-1].error / made[0].error)
        # What the last one teaches no print has shown; a single print teaches nevertheless.
        taught = [each.record for each in made[:-1] or made]
        causes, last = dict.fromkeys(change.name for record in taught for change in record.changes), taught[-1]
        yield row(
            str(seed),
            *(percent(each.error, 1) for each in made),
            ", ".join(causes),
            f"{last.opening:.2f}, {last.shutting:.2f} mm",
            f"{shares[-1]:.2f}",
        )
    yield row("worst", *[""] * prints, "", "", f"{max(shares):.2f}")


def programs(seeds: int, *, prints: int, quiet: int) -> Iterator[str]:
    """Yield a Markdown table: how far the volume of runs is off from print to print, the worst of all dispensers.

    Args:
        seeds: dispensers.
        prints: of each, on the dispenser that is corrected.
        quiet: prints without an error that are tried.
    """
    yield row(
        "measured by", "cells", "seeds", "print: largest / rms", "left, worst seed", "worse", "quiet prints changed"
    )
    yield rule(7)
    valve: tuple[Mode, ...] = ("io",)
    analog: tuple[Mode, ...] = ("analog",)
    chains: dict[str, tuple[Mode, ...]] = {
        "valve to valve": valve * prints,
        "analog to analog": analog * prints,
        "valve to analog": valve + analog * prints,
    }
    measures: tuple[Measure, ...] = ("scan", "photograph")
    for by in measures:
        for name, modes in chains.items():
            made = [[_off(each, by=by) for each in deviations(modes, seed=seed, by=by)] for seed in range(seeds)]
            worst: FloatArray = np.max(made, axis=0)
            left = max(chain[-1][1] / chain[0][1] for chain in made)
            worse = sum(bool((np.array(chain[-1]) > np.array(chain[0])).any()) for chain in made)
            changes = sum(changed(seed, mode=modes[0], by=by) for seed in range(quiet))
            each = ", ".join(f"{percent(most, 1)} / {percent(rms, 1)}" for most, rms in worst.tolist())
            yield row(by, name, str(seeds), each, f"{left:.2f}", str(worse), f"{changes} of {quiet}")


def _off(shares: FloatArray, *, by: Measure) -> tuple[float, float]:
    """Return the largest and the root mean square deviation of runs; by photographs of their share of the print."""
    off = shares if by == "scan" else (1.0 + shares) / float(np.mean(1.0 + shares)) - 1.0
    return float(np.abs(off).max()), float(np.sqrt(np.mean(off**2)))


def silence(count: int) -> Iterator[str]:
    """Yield a Markdown table: of prints that are off by so many deviations, how many change something."""
    yield row("off by, over the deviation of a part", "prints", "change something")
    yield rule(3)
    for off in (0.0, 1.0, 2.0, -2.0):
        changed = [
            bool(corrected(measured_as_known(off, DEVIATION, common=COMMON, seed=seed), bounds=BOUNDS).changes)
            for seed in range(count)
        ]
        yield row(f"{off:g}", str(count), str(int(np.sum(changed))))


if __name__ == "__main__":
    main()
