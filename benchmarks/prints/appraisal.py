"""How well are lines, widths, breaks and offsets found in photographs, and thickness in scans, whose truth is known?

    python -m benchmarks.prints.appraisal [FOLDER] [--scans N] [--outlines N] [--tones N] [--smoke]

The first table: known answers. Rows of beads on a plate are simulated (`geoprint.simulation`, which shares no code
with what judges them) with one error each, photographed from above and aslant, and held against their plan. A pixel
covers 0.1 mm. The second, where the folder of real photographs is there (`pacamera_*.jpg` of 21 printed lines, with
masks of others): lines found of 21, and the share of their length whose middle lies within 3 pixels of the mask's, for
each photograph under several lightings, with nothing else changed. A line is found where 80 % of it is.

The third, where open3d is installed: simulated scans of a print on a patch of a heart, with 0.05 mm noise and 30 %
missing, taken 5 degrees and 10 mm from where they are thought to be; with each error put in so many seeds. Largest and
mean distance of the pose from the truth, the standard deviation of the turn that is told, in how many of the seeds the
pose is within the stated uncertainty of 95 %, the mean error of the thickness over the surface, the volume found, and
the share of its cells within their uncertainty. About the apex runs are rings: how far a scan is turned about their
middle is known to 0.10 degrees (standard deviation) from 9,000 points with that noise, even if all else were known, so
there a scan twice as fine is tried as well.

The fourth: scans of narrow and wide beads, thinned at random to 15 to 100 % of their points. In how many of them the
true volume and the true crest of the longest run lie within the stated 95 %, and so for the crest and volume of all
runs; the mean error of crests, with its sign, and the mean half width of their interval.

The fifth: simulated photographs of parts that stand free, each from another place, up to 45 degrees aslant, whose
camera the part's outline places. How many were placed, of these the share in which every place of the part is seen
within what is told with 95 % confidence, what that is in the mean, the largest distance of any place in any photograph
from where it is seen, and by how much width and offset of the beads differ at most from those measured with the true
camera; beside it the same with eight fiducials that somebody clicked to half a pixel (standard deviation).

The sixth: simulated photographs of four parts, with tone curves of gamma 1 to 2.4 or sRGB's, exposures of 0.3 to 2,
blurs of 0 to 4 pixels, noise, gradients of light and slants drawn at random, some turned, mirrored or negative. How
many were right (every width that is given within 0.03 mm, every offset within 0.02 mm, and no false fault), how many
were refused with a reason or gave no figure, and in how many a fault that was planted was found.
"""

from __future__ import annotations

import contextlib
import importlib.util
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks import ROOT
from benchmarks.parts.tables import row, rule, script_parser
from benchmarks.prints.print_outlines import (
    APEX as DOME,
    FLAT,
    ON_HEART,
    PLATE,
    ROWS,
    SIZE,
    OutlinedPhotograph,
    placed_by_outline,
)
from benchmarks.prints.print_photographs import (
    LINES,
    PHOTOGRAPHS,
    WIDTH,
    judged,
    lightings,
    mask_of,
    plate_print,
    reference_lines,
)
from benchmarks.prints.print_scans import APEX, Registered, registered_scan, thinned_scan
from benchmarks.prints.print_tones import OFFSET_OFF, PLANTED, WIDTH_OFF, Judged, judged_photograph
from geoprint.errors import InputError, percent
from geoprint.inspection import Held, bead_width, beads_of, middles_of, paired_edges, read_photograph
from geoprint.model import BoolArray, FloatArray
from geoprint.simulation import Break, Faults

IMAGES = ROOT / "shared" / "data" / "images"
# What goes wrong in prints that are scanned, and the volume that is laid then.
SCANNED = {
    "nothing": Faults(),
    "flow x 1.1": Faults(flow=1.1),
    "viscosity x 1.2": Faults(viscosity=1.2),
    "narrow beads, x 0.7": Faults(width_scale=0.7),
    "0.2 mm to the left": Faults(offset=0.2),
    "width of beads +/- 5 %": Faults(width_noise=0.05),
}
SEEDS = 50
# Places of the camera in photographs that are placed by outlines.
VIEWS = 20
# Size of one in the smoke run [pixels].
SMALL = (480, 405)
# Photographs through tone curves, without a fault and with each.
TONES = 60
# By how much closer the lines of sight lie at the apex.
FINER = (1, 2)
OFFSETS, SCALES, BREAKS = (-0.5, 0.2, 0.5, 1.0), (0.7, 1.0, 1.3), (1.0, 2.5, 5.0)


def main() -> None:
    """Print the tables."""
    parser = script_parser(__doc__, smoke="the smallest case only, to see that the script runs")
    parser.add_argument("folder", nargs="?", type=Path, default=IMAGES, metavar="FOLDER", help="of real photographs")
    parser.add_argument("--scans", type=int, default=SEEDS, metavar="N", help="seeds of each error in scans")
    parser.add_argument("--outlines", type=int, default=VIEWS, metavar="N", help="photographs of each part's outline")
    parser.add_argument("--tones", type=int, default=TONES, metavar="N", help="photographs through tone curves")
    arguments = parser.parse_args()
    for line in known_answers(smoke=arguments.smoke):
        print(line, flush=True)
    print()
    for line in outlines(1 if arguments.smoke else arguments.outlines, smoke=arguments.smoke):
        print(line, flush=True)
    print()
    for line in tones(1 if arguments.smoke else arguments.tones, smoke=arguments.smoke):
        print(line, flush=True)
    # A scan is registered and measured by tests/benchmarks/test_appraisal.py.
    if importlib.util.find_spec("open3d") is not None and not arguments.smoke:
        print()
        for line in scans(arguments.scans, smoke=False):
            print(line, flush=True)
        print()
        for line in thinned(arguments.scans):
            print(line, flush=True)
    if arguments.smoke or not arguments.folder.is_dir():
        return
    print()
    for line in real_photographs(arguments.folder):
        print(line, flush=True)


def known_answers(*, smoke: bool) -> Iterator[str]:
    """Yield a Markdown table: an error that was put in, and what was found."""
    yield row("error put in", "put in [mm]", "found [mm]", "off [mm]")
    yield rule(4)
    for offset in OFFSETS[:1] if smoke else OFFSETS:
        held = plate_print(Faults(offset=offset))
        yield _answer("all beads to the left", offset, float(held.offsets[held.sized].mean()))
    for scale in () if smoke else SCALES:
        held = plate_print(Faults(width_scale=scale))
        yield _answer(f"width x {scale:g}", scale * WIDTH, float(held.widths[held.sized].mean()))
    for length in () if smoke else BREAKS:
        held = plate_print(Faults(breaks=(Break(2, 10.0, 10.0 + length),)))
        yield _answer("a break, its length", length, _bare(held, run=2))


def scans(seeds: int, *, smoke: bool) -> Iterator[str]:
    """Yield a Markdown table: an error that was put in, and how well its scans were registered and measured."""
    yield row(
        "error put in", "points", "seeds", "shift [mm]", "turn [deg]", "stated", "pose within", "thickness [mm]",
        "volume", "cells within",
    )  # fmt: skip
    yield rule(10)
    for name, faults in list(SCANNED.items())[: 1 if smoke else None]:
        yield _scans_row(name, faults, [registered_scan(faults, seed=seed) for seed in range(seeds)])
    for finer in () if smoke else FINER:
        found = [registered_scan(Faults(), seed=seed, part=APEX, finer=finer) for seed in range(seeds)]
        yield _scans_row("nothing, at the apex", Faults(), found)


def _scans_row(name: str, faults: Faults, found: list[Registered]) -> str:
    """Return the row of an error: means over its seeds, and the largest."""
    shifts, turns = np.array([each.shift for each in found]), np.array([each.turn for each in found])
    ratios = np.array([each.ratio for each in found]) / faults.volume
    return row(
        name,
        f"{np.mean([each.points for each in found]):.0f}",
        str(len(found)),
        f"{shifts.mean():.4f}, at most {shifts.max():.4f}",
        f"{turns.mean():.4f}, at most {turns.max():.4f}",
        f"{np.mean([each.stated for each in found]):.4f}",
        percent(float(np.mean([each.within for each in found]))),
        f"{np.mean([each.thickness for each in found]):.4f}",
        f"{ratios.mean():.3f} +/- {ratios.std():.3f} of the truth",
        percent(float(np.mean([each.cells for each in found])), 1),
    )


def thinned(seeds: int) -> Iterator[str]:
    """Yield a Markdown table: narrow and wide beads, and how often what is stated of thinned scans holds."""
    yield row(
        "beads", "scans", "points", "volume within", "crest of the longest run within", "crests of all runs",
        "volumes of all runs", "crest off", "crest +/-",
    )  # fmt: skip
    yield rule(9)
    for name, wide in (("narrow", False), ("wide", True)):
        found = [thinned_scan(wide=wide, seed=seed) for seed in range(wide, seeds, 2)]
        longest = [_holds(each.crests[[int(each.lengths.argmax())]])[0] for each in found]
        crests, ratios = (np.concatenate([each.crests for each in found]), np.concatenate([e.ratios for e in found]))
        yield row(
            name,
            str(len(found)),
            f"{min(each.points for each in found)} to {max(each.points for each in found)}",
            f"{sum(bool(_holds(np.array([each.volume]))[0]) for each in found)}",
            f"{sum(longest)}",
            *(f"{_holds(each).sum()} of {len(each)}" for each in (crests, ratios)),
            percent(((crests[:, 0] - crests[:, 2]) / crests[:, 2]).mean(), 2, signed=True),
            percent((1.96 * crests[:, 1] / crests[:, 2]).mean(), 2),
        )


def _holds(stated: FloatArray) -> BoolArray:
    """Return which of (k, 3) values lie within 1.96 of their standard deviations of the truth."""
    return np.abs(stated[:, 0] - stated[:, 2]) < 1.96 * stated[:, 1]


def outlines(views: int, *, smoke: bool) -> Iterator[str]:
    """Yield a Markdown table: a part, and how well its outline places a camera."""
    yield row(
        "part", "placed", "within 95 %", "told [px]", "farthest [px]", "[mm]", "width off [mm]", "offset off [mm]",
        "by fiducials: width", "offset",
    )  # fmt: skip
    yield rule(10)
    for part in (ROWS,) if smoke else (FLAT, DOME, ON_HEART, ROWS, PLATE):
        found: list[OutlinedPhotograph] = []
        for seed in range(views):
            with contextlib.suppress(InputError):
                found.append(placed_by_outline(part, seed=seed, size=SMALL if smoke else SIZE))
        yield _outline_row(part, found, views=views)


def _outline_row(part: str, found: list[OutlinedPhotograph], *, views: int) -> str:
    """Return the row of a part: means over its photographs, and the largest."""
    if not found:
        return row(part, f"0 of {views}", *8 * ("-",))
    offs, record = np.array([each.off for each in found]), np.array([each.within for each in found])
    measured = [[each.width, each.offset, each.clicked_width, each.clicked_offset] for each in found]
    return row(
        part,
        f"{len(found)} of {views}",
        percent((offs <= record).mean()),
        f"{record.mean():.2f}",
        f"{offs.max():.2f}",
        f"{max(each.off_mm for each in found):.3f}",
        *(f"{most:.3f}" if most >= 0.0 else "-" for most in np.nanmax(np.abs(measured), axis=0, initial=-1.0).tolist()),
    )


def tones(count: int, *, smoke: bool) -> Iterator[str]:
    """Yield a Markdown table: what was planted, and how photographs through tone curves were judged."""
    yield row("planted", "photographs", "right", "refused", "no figure", "wrong", "false faults in", "found in")
    yield rule(8)
    whole = [judged_photograph(seed) for seed in range(count)]
    yield _tones_row("nothing", whole)
    for number, planted in enumerate(PLANTED[: 0 if smoke else None]):
        # Of every part in turn.
        seeds = [seed for seed in range(count) if (seed + seed // len(PLANTED)) % len(PLANTED) == number]
        yield _tones_row(planted, [judged_photograph(seed, planted=planted) for seed in seeds])


def _tones_row(planted: str, found: list[Judged]) -> str:
    refused = sum(bool(each.refused) for each in found)
    unknown = sum(not each.refused and not each.runs for each in found)
    given = [each for each in found if each.runs]
    right = sum(each.width <= WIDTH_OFF and each.offset <= OFFSET_OFF and not each.faults for each in given)
    return row(
        planted, str(len(found)), str(right), str(refused), str(unknown), str(len(given) - right),
        str(sum(each.faults > 0 for each in found)), "" if planted == "nothing" else str(sum(e.found for e in found)),
    )  # fmt: skip


def real_photographs(folder: Path) -> Iterator[str]:
    """Yield a Markdown table: lines found, and how near to the mask's."""
    yield row("photograph", "lighting", "width [px]", f"lines of {LINES}", "within 3 px")
    yield rule(5)
    for name in PHOTOGRAPHS:
        grey = read_photograph(folder / f"{name}.jpg").grey
        lines = reference_lines(mask_of(folder / f"{name}_mask.png"))
        for lighting, shown in lightings(grey).items():
            width = bead_width(shown)
            found, share = judged(middles_of(beads_of(shown, paired_edges(shown, width=width))), lines)
            yield row(name, lighting, f"{width:.1f}", str(found), percent(share, 2))


def _answer(what: str, truth: float, found: float) -> str:
    return row(what, f"{truth:.2f}", f"{found:.3f}", f"{found - truth:+.3f}")


def _bare(held: Held, *, run: int) -> float:
    return float(np.sum([end - start for start, end in held.gaps(run)]))


if __name__ == "__main__":
    main()
