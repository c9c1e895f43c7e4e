"""How true, how fast and how predictable are the conformal charts of `lscm`? Prints Markdown tables.

    python -m benchmarks.chart [--table NAME ...] [--parts FILE ...] [--smoke]

The peer is libigl's `igl.lscm`, run in the same process with the same two pins where it is installed (`pip install
libigl`). Area scales are chart over surface, relative to their mean, percentiles by area; a dilatation is the larger
over the smaller stretch of a triangle, 1 where angles are kept.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from types import MappingProxyType

import numpy as np

from benchmarks.parts.surfaces import make
from benchmarks.parts.tables import least_seconds, row, rule
from geoprint.backends import BACKENDS
from geoprint.backends.distortion import distortion, predicted_spacing
from geoprint.backends.lscm.chart import conformal_chart, farthest_pair
from geoprint.backends.lscm.seam_chart import flattened
from geoprint.errors import GeoprintError
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.surfaces import boundary_loops, boundary_seed, describe, positions
from geoprint.surfaces.files import load
from geoprint.surfaces.repair import prepare

DATA = Path(__file__).parents[1] / "data"
PARTS = tuple(DATA / name for name in ("heart_flat_patch.ply", "heart_apex_patch.ply"))
SHAPES = ("cap", "saddle", "bumpy", "half torus", "sheet with hole")
# Radii and height [mm] of the bands of revolution: low, high, height.
BANDS: Mapping[str, tuple[float, float, float]] = MappingProxyType(
    {
        "plane annulus": (20.0, 8.0, 0.0),
        "cylinder band, height = radius / 2": (12.0, 12.0, 6.0),
        "cylinder band, height = radius": (12.0, 12.0, 12.0),
        "cylinder band, height = 2.5 radii": (12.0, 12.0, 30.0),
        "cone frustum": (20.0, 8.0, 20.0),
        "steep cone frustum": (20.0, 8.0, 40.0),
    }
)
CAP_HALF_ANGLE = np.radians(70.0)
CAP_RADIUS = 30.0
ROUNDS = 44
WANTED_EXPONENT = 1.6


@dataclass(frozen=True, slots=True)
class Sizes:
    """How large the meshes of a run are, in faces."""

    distortion: int
    peer: tuple[int, ...]
    growth: tuple[int, ...]
    cap: int


FULL = Sizes(10_000, (10_000, 100_000), (1_000, 3_000, 10_000, 30_000, 100_000, 300_000), 20_000)
SMOKE = Sizes(600, (500,), (300, 600, 1_200), 3_000)


def main() -> None:
    """Print the tables asked for, all of them by default."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--table", nargs="*", choices=sorted(TABLES), help="only these tables")
    parser.add_argument("--parts", nargs="*", type=Path, default=PARTS, help="meshes [mm] for the distortion table")
    parser.add_argument("--smoke", action="store_true", help="small meshes, to see that the script runs")
    arguments = parser.parse_args()
    sizes = SMOKE if arguments.smoke else FULL
    for name in arguments.table or TABLES:
        print(f"\n### {name}\n")
        for line in TABLES[name](sizes, tuple(arguments.parts)):
            print(line, flush=True)


def distorted(sizes: Sizes, parts: tuple[Path, ...]) -> Iterator[str]:
    """Area scale and dilatation of the charts of parts from files and of shapes by formula."""
    yield row("part", "chart", "faces", "area scale p1 / p50 / p99", "dilatation mean / p99 / max")
    yield rule(5)
    bands = (_band(name, faces=sizes.distortion) for name in BANDS)
    shapes = (make(shape, faces=sizes.distortion) for shape in SHAPES)
    files = (prepare(load(path, unit="mm"))[0] for path in parts)
    for surface in chain(bands, shapes, files):
        kind = describe(surface)
        yield _distortion_row(surface, kind if kind != "annulus" else "annulus, uncut", conformal_chart)
        if kind == "annulus":
            yield _distortion_row(surface, "annulus, as lscm lays it", lambda band: flattened(band).flat)


def _distortion_row(surface: Surface, kind: str, flatten: Callable[[Surface], Surface]) -> str:
    named = (surface.name, kind, f"{len(surface.faces)}")
    try:
        measured = distortion(surface, flatten(surface))
    except GeoprintError as error:
        return row(*named, f"refused: {error}", "")
    scales = " / ".join(f"{measured.scale_percentile(percent):.3f}" for percent in (1, 50, 99))
    dilatations = (measured.mean_dilatation, measured.dilatation_percentile(99), measured.worst_dilatation)
    return row(*named, scales, " / ".join(f"{dilatation:.4f}" for dilatation in dilatations))


def peer(sizes: Sizes, _parts: tuple[Path, ...]) -> Iterator[str]:
    """Seconds beside libigl's, and the largest difference of the two maps over the distance of the pins."""
    if importlib.util.find_spec("igl") is None:
        yield "libigl is not installed: `pip install libigl`."
        return
    library = importlib.import_module("igl")
    yield row("faces", "conformal_chart with its checks, s", "igl.lscm, s", "ratio", "difference")
    yield rule(5)
    conformal_chart(make("cap", faces=300))  # Compiles.
    ends = np.array([[0.0, 0.0], [1.0, 0.0]])
    for faces in sizes.peer:
        surface = make("cap", faces=faces)
        pins = farthest_pair(surface, boundary_loops(surface)[0])
        own = least_seconds(partial(conformal_chart, surface))
        theirs = least_seconds(partial(library.lscm, surface.vertices, surface.faces, pins, ends))
        flat = np.asarray(library.lscm(surface.vertices, surface.faces, pins, ends)[0], dtype=np.float64)
        difference = float(np.abs(_between(conformal_chart(surface).vertices, pins) - _between(flat, pins)).max())
        yield row(f"{len(surface.faces)}", f"{own:.3f}", f"{theirs:.3f}", f"{own / theirs:.2f}", f"{difference:.1e}")


def growth(sizes: Sizes, _parts: tuple[Path, ...]) -> Iterator[str]:
    """Seconds of the chart over the number of faces N, with the exponent of a power of N fitted to them."""
    yield row("shape", *(f"{faces}" for faces in sizes.growth), "exponent", "paper's claim for the chart")
    yield rule(3 + len(sizes.growth))
    conformal_chart(make("cap", faces=300))  # Compiles.
    for shape in ("cap", "sheet with hole"):
        surfaces = [make(shape, faces=faces) for faces in sizes.growth]
        seconds = [least_seconds(partial(conformal_chart, surface)) for surface in surfaces]
        counts = [len(surface.faces) for surface in surfaces]
        exponent = float(np.polyfit(np.log(counts), np.log(seconds), 1)[0])
        shown = (f"{second:.3f} s" for second in seconds)
        yield row(shape, *shown, f"{exponent:.2f} (wanted <= {WANTED_EXPONENT})", "1, the N of O(N + M)")


def cap(sizes: Sizes, _parts: tuple[Path, ...]) -> Iterator[str]:
    """Ring spacing on a spherical cap beside what the chart's scale and the formula predict."""
    rim = 2 * CAP_RADIUS * np.sin(CAP_HALF_ANGLE / 2)
    wanted = rim / ROUNDS
    surface = _cap(faces=sizes.cap)
    contours = BACKENDS["lscm"](surface).contours(boundary_seed(surface), spacing=wanted)
    levels = np.repeat(contours.levels, np.diff(contours.curves.offsets))
    places = positions(surface, contours.curves.points)
    scale = predicted_spacing(surface, conformal_chart(surface), contours.curves.points)
    # The last ring is half a spacing wide and about the middle of the chart, which misses the pole by part of that.
    count = int(levels.max())
    heights = np.arccos(np.clip(places[:, 2] / CAP_RADIUS, -1.0, 1.0))
    polar, predicted = (_mean_by(levels, values)[:count] for values in (heights, scale))
    measured = -CAP_RADIUS * np.diff(polar) / wanted
    predicted = 0.5 * (predicted[1:] + predicted[:-1])
    formula = np.cos(0.25 * (polar[1:] + polar[:-1])) ** 2 / np.cos(CAP_HALF_ANGLE / 2)
    yield row("spacing over wanted", "at the rim", "at the centre", "centre over rim", "largest deviation")
    yield rule(5)
    for name, ratio in (("measured", measured), ("chart's scale", predicted), ("formula", formula)):
        first, last = float(ratio[0]), float(ratio[-1])
        off = float(np.abs(measured / ratio - 1.0).max())
        yield row(name, f"{first:.3f}", f"{last:.3f}", f"{last / first:.3f}", f"{off:.2%}")


TABLES: Mapping[str, Callable[[Sizes, tuple[Path, ...]], Iterator[str]]] = MappingProxyType(
    {"distortion": distorted, "libigl": peer, "growth": growth, "cap": cap}
)


def _band(name: str, *, faces: int) -> Surface:
    """Return a band of revolution: an irregular plate bent round, its two ends joined."""
    low, high, height = BANDS[name]
    slant = float(np.hypot(low - high, height))
    middle = np.pi * (low + high)
    across = max(round(float(np.sqrt(faces / 2 * slant / middle))), 2)
    around = max(round(faces / 2 / across), 8)
    rng = np.random.default_rng(0)
    turn, share = (index.ravel() for index in np.meshgrid(np.arange(around), np.arange(across + 1), indexing="ij"))
    jitter = rng.uniform(-0.2, 0.2, (2, turn.size)) * ((share > 0) & (share < across))
    angle, out = 2 * np.pi * (turn + jitter[0]) / around, (share + jitter[1]) / across
    radius = low + (high - low) * out
    i, j = (index.ravel() for index in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    a, b = i * (across + 1) + j, (i + 1) % around * (across + 1) + j
    triangles = np.concatenate([np.column_stack([a, b, b + 1]), np.column_stack([a, b + 1, a + 1])])
    places = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height * out])
    return Surface(places, triangles, name=name)


def _cap(*, faces: int) -> Surface:
    """Return a spherical cap of `CAP_HALF_ANGLE`: an irregular disc lifted with areas kept."""
    flat = make("disc", faces=faces).vertices
    scale = 2 * CAP_RADIUS * np.sin(CAP_HALF_ANGLE / 2) / float(np.hypot(flat[:, 0], flat[:, 1]).max())
    reach, turn = scale * np.hypot(flat[:, 0], flat[:, 1]), np.arctan2(flat[:, 1], flat[:, 0])
    polar = 2 * np.arcsin(np.clip(reach / (2 * CAP_RADIUS), 0.0, 1.0))
    outward = np.column_stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
    return Surface(CAP_RADIUS * outward, make("disc", faces=faces).faces, name="cap")


def _between(places: FloatArray, pins: IntArray) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    """Return places as complex numbers, moved, turned and scaled so that the pins are 0 and 1."""
    z = places[:, 0] + 1j * places[:, 1]
    return (z - z[pins[0]]) / (z[pins[1]] - z[pins[0]])


def _mean_by(levels: IntArray, values: FloatArray) -> FloatArray:
    return np.bincount(levels, values) / np.bincount(levels)


if __name__ == "__main__":
    main()
