"""How evenly do stripes and streamlines of designed fields cover parts, and how well do they follow the field?

    python -m benchmarks.paths.fibres [--parts FILE ...] [--spacing MM] [--faces N ...] [--smoke]

Every part is cut as finely as heat wants it, and gets three fields of lines: the smoothest along its rim (none where it
is closed), the smoothest along its longest axis, and the smoothest along the smallest principal curvature. A row for
each and each laying: starts, and closed paths among them; how many were too short to be laid; their mean length; the
variation of the thickness with a constant flow; the share of the area that is covered once, missed and covered twice;
the variation of the spacing to the left and to the right over all, and farther than two spacings from ends within the
part, which is the place of branch points too, with the share of the length that is then left out; the mean angle to the
field, and what 99 of 100 mm have at most; crossings; how many ends rows exactly one spacing apart and along the field
would have, as the divergence of its lines says; and the processor time of field and paths.

The second table is of the same parts with a width that rises along their longest axis, by 0.75 to 1.35 spacings, with
paths along that axis and across it: everything is over the width that is wanted at each place then.

The third table is of processor time on bumpy sheets with paths 1 mm apart along their rim, and the exponent of the
number of faces, fitted to all but the smallest.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from benchmarks import DATA
from benchmarks.parts.surfaces import make
from benchmarks.parts.tables import row, script_parser, table
from geoprint.distance import BACKENDS
from geoprint.errors import GeoprintError, percent
from geoprint.fibers import AlongCurvature, AlongDirection, AlongRim, DirectionField, Preference, smoothest_field
from geoprint.fibers.net import net_of, senses_of
from geoprint.fibers.pattern import LAYINGS, FibrePattern
from geoprint.fibers.stripes import slopes_of
from geoprint.geometry import (
    PolylineDistance,
    arc_lengths,
    boundary_loops,
    boundary_source,
    point_source,
    prepare,
    refine,
)
from geoprint.geometry.files import load
from geoprint.metrics import measure_paths
from geoprint.model import BoolArray, FloatArray, Paths, Polylines, ScalarField, Surface
from geoprint.process import WidthsAlong
from geoprint.reporting.metrics import COVERED_ONCE, GAP, OVERLAP, SPACING, THICKNESS
from tests.fibers.fibres_measures import crossings, lines, off_field

OWN = ("plate.ply", "heart_flat_patch.ply", "heart_apex_patch.ply")
HEADINGS = (
    "part", "field", "laying", "starts", "closed", "dropped", "mean length", THICKNESS.column, COVERED_ONCE.column,
    GAP.column, OVERLAP.column, SPACING.column, "away from ends", "left out", "off the field", "99 of 100", "crossings",
    "ends demanded", "field", "paths",
)  # fmt: skip
# Ends within the part: farther than so many spacings from its rim; what is nearer than so many to one is left out.
WITHIN, AWAY = 0.5, 2.0
# Widths where a part begins and where it ends, over the spacing.
WIDENING = 0.75, 1.35


def main() -> None:
    """Print the table."""
    parser = script_parser(__doc__, smoke="a part of data/ at 6 mm, and small sheets")
    parser.add_argument(
        "--parts", type=Path, nargs="*", default=[], metavar="FILE", help="in mm, beside those of data/"
    )
    parser.add_argument("--spacing", type=float, default=1.1, metavar="MM")
    parser.add_argument(
        "--faces",
        type=int,
        nargs="*",
        default=[10_000, 100_000, 300_000, 1_000_000],
        help="of the sheets that are timed",
    )
    arguments = parser.parse_args()
    spacing = 6.0 if arguments.smoke else arguments.spacing
    parts = [*(DATA / name for name in OWN[: 1 if arguments.smoke else None]), *arguments.parts]
    for line in table(*HEADINGS):
        print(line, flush=True)
    for file in parts:
        part = prepare(load(file, unit="mm"))[0]
        fine = refine(part, edge_length=BACKENDS["heat"].edge_length(part, spacing=spacing))
        for name, preference in _preferences(part):
            for line in _rows(part, fine, name, preference, spacing=spacing):
                print(line, flush=True)
    for line in table(*HEADINGS):
        print(line, flush=True)
    for file in parts:
        for line in _widening(prepare(load(file, unit="mm"))[0], spacing=spacing):
            print(line, flush=True)
    for line in _times([200, 400] if arguments.smoke else arguments.faces):
        print(line, flush=True)


def _times(sizes: Sequence[int]) -> Iterator[str]:
    """Yield the table of processor times."""
    sheets = [make("bumpy", faces=size) for size in sizes]
    fields = [smoothest_field(sheet, symmetry=2, preferences=[AlongRim()]) for sheet in sheets]
    yield from table("laying", *(f"{len(sheet.faces)} faces" for sheet in sheets), "exponent")
    for laying in LAYINGS:
        # What is compiled at its first use is not counted.
        _strokes(fields[0], laying=laying, spacing=1.0)
        seconds = list[float]()
        for field in fields:
            begun = time.process_time()
            _strokes(field, laying=laying, spacing=1.0)
            seconds.append(time.process_time() - begun)
        counts, fitted = np.log([len(sheet.faces) for sheet in sheets[1:]]), np.log(seconds[1:])
        exponent = f"{np.polyfit(counts, fitted, 1)[0]:.2f}" if len(sizes) > 2 else ""
        yield row(laying, *(f"{each:.2f} s" for each in seconds), exponent)


def _strokes(field: DirectionField, *, laying: str, spacing: float, widths: WidthsAlong | None = None) -> Paths:
    surface = field.surface
    source = (
        boundary_source(surface)
        if boundary_loops(surface)
        else point_source(surface, surface.vertices[0], tolerance=1.0)
    )
    pattern = FibrePattern(field=lambda _: field, laying=laying)
    wanted = spacing if widths is None else ScalarField(widths(surface.vertices))
    return pattern.paths(surface, source, backend=BACKENDS["heat"](surface), spacing=wanted)


def _widening(part: Surface, *, spacing: float) -> Iterator[str]:
    """Yield rows for paths along and across the direction in which they grow wider."""
    _, _, axes = np.linalg.svd(part.vertices - part.vertices.mean(axis=0), full_matrices=False)
    heights = part.vertices @ axes[0]
    ends = part.vertices[[heights.argmin(), heights.argmax()]]
    widths = WidthsAlong(ends[0], ends[1], axes[0], spacing * np.array(WIDENING))
    fine = refine(part, edge_length=BACKENDS["heat"].edge_length(part, spacing=WIDENING[0] * spacing))
    for name, axis in (("along it", axes[0]), ("across it", axes[1])):
        yield from _rows(part, fine, name, AlongDirection(axis), spacing=spacing, widths=widths)


def _preferences(part: Surface) -> Sequence[tuple[str, Preference]]:
    _, _, axes = np.linalg.svd(part.vertices - part.vertices.mean(axis=0), full_matrices=False)
    rim: list[tuple[str, Preference]] = [("along the rim", AlongRim())] if boundary_loops(part) else []
    return [
        *rim,
        ("along the longest axis", AlongDirection(axes[0])),
        ("smallest curvature", AlongCurvature("smallest")),
    ]


def _rows(
    part: Surface,
    fine: Surface,
    name: str,
    preference: Preference,
    *,
    spacing: float,
    widths: WidthsAlong | None = None,
) -> Iterator[str]:
    begun = time.process_time()
    try:
        field = smoothest_field(fine, symmetry=2, preferences=[preference])
    except GeoprintError as error:
        yield _refused(fine, name, "", error)
        return
    made = time.process_time() - begun
    for laying in LAYINGS:
        begun = time.process_time()
        try:
            paths = _strokes(field, laying=laying, spacing=spacing, widths=widths)
        except GeoprintError as error:
            yield _refused(fine, name, laying, error)
            continue
        deposited = time.process_time() - begun
        figures = _figures(part, field, paths, spacing=spacing, widths=widths)
        yield row(fine.name, name, laying, *figures, f"{made:.2f} s", f"{deposited:.2f} s")


def _refused(fine: Surface, name: str, laying: str, error: GeoprintError) -> str:
    return row(fine.name, name, laying, str(error)[:110].replace("|", "/"), *[""] * (len(HEADINGS) - 4))


def _figures(
    part: Surface, field: DirectionField, paths: Paths, *, spacing: float, widths: WidthsAlong | None
) -> list[str]:
    fine = field.surface
    drawn = lines(fine, paths)
    found = measure_paths(part, Polylines(np.concatenate(drawn), paths.curves.offsets), spacing=spacing, wanted=widths)
    sides = found.sides.sides()
    away = _away(fine, paths, found.sides.places, spacing=spacing)
    off, lengths = off_field(field, paths.curves)
    order = np.argsort(off)
    most = off[order][np.searchsorted(np.cumsum(lengths[order]), 0.99 * lengths.sum())]
    return [
        str(paths.curves.count),
        str(int(paths.curves.closed.sum())),
        str(len(paths.dropped)),
        f"{np.mean([arc_lengths(line)[-1] for line in drawn]):.1f} mm",
        percent(found.thickness.cv, 1),
        percent(found.covered_once, 1),
        percent(found.gap, 1),
        percent(found.overlap, 1),
        _cv(sides),
        _cv(sides[away]),
        percent(1.0 - away.mean()),
        f"{np.degrees(np.average(off, weights=lengths)):.2f} deg",
        f"{np.degrees(most):.2f} deg",
        str(crossings(fine, paths.curves)),
        f"{_ends_demanded(field, spacing=spacing):.0f}",
    ]


def _ends_demanded(field: DirectionField, *, spacing: float) -> float:
    """Return the integral of the divergence of the lines, without its sign, over the spacing."""
    net = net_of(field, spacings=np.full(len(field.angles), spacing))
    slopes = slopes_of(field.surface, net, senses_of(field.surface, net))
    parted = slopes.pull(along=np.ones(slopes.areas.size), across=np.zeros(slopes.areas.size))
    inside = np.ones(parted.size, dtype=np.bool_)
    for loop in boundary_loops(field.surface):
        inside[loop] = False
    return float(np.abs(parted[inside & ~slopes.senses.odd]).sum()) / spacing


def _cv(sides: FloatArray) -> str:
    ratios = sides[np.isfinite(sides)]
    return percent(ratios.std() / ratios.mean(), 1) if ratios.size else ""


def _away(surface: Surface, paths: Paths, places: FloatArray, *, spacing: float) -> BoolArray:
    """Return which of (k, 3) places are farther than two spacings from the ends of paths within a part."""
    curves, xyz = paths.curves, paths.curves.points.xyz(surface)
    ends = xyz[np.concatenate([curves.offsets[:-1], curves.offsets[1:] - 1])[np.tile(~curves.closed, 2)]]
    rims = [surface.vertices[np.append(loop, loop[0])] for loop in boundary_loops(surface)]
    if rims and len(ends):
        ends = ends[PolylineDistance(rims, step=spacing)(ends) > WITHIN * spacing]
    if not len(ends):
        return np.ones(len(places), dtype=np.bool_)
    return np.asarray(KDTree(ends).query(places)[0] > AWAY * spacing)


if __name__ == "__main__":
    main()
