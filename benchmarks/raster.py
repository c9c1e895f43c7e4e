"""How does the raster of the flattening backend grow, and what does its exact border bring? Prints Markdown tables.

    python -m benchmarks.raster [--table NAME ...] [--smoke]

The paper says O(N + M) for N vertices and M pixels. Of this the raster's part holds: marking what is inside is linear
in M; so is the distance of all pixels, each of which looks at a number of border segments that does not grow with M.
Level curves measure only the pixels near them, all levels in one pass; with levels 1/20 of the depth apart these are
fewer and fewer of M, until the pass itself, which looks at each pixel, remains. The lookup is linear in the curves'
nodes, which grow with the square root of M. What does not hold is the N: the conformal map is a sparse direct solve,
about N^1.5 with nested dissection.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise
from types import MappingProxyType
from typing import TypeVar

import numpy as np
from scipy.ndimage import distance_transform_edt

from benchmarks.parts.surfaces import make
from geoprint.backends.chart_lookup import locate
from geoprint.backends.lscm.marching_squares import Band, level_lines
from geoprint.backends.lscm.raster import region_image
from geoprint.backends.lscm.segment_distance import point_distances
from geoprint.model import FloatArray
from geoprint.surfaces import PolylineDistance, closest, even_points

Result = TypeVar("Result")

# Level curves between the border and the farthest point.
LEVELS = 20
# The border: a flower with bays and a hole, in so many segments.
SEGMENTS = 1_200
# The least of so many runs counts: the machine is rarely alone.
REPEATS = 3
# Nodes that are looked up, as many as 100 levels have on a raster of 1024 pixels.
NODES = 100_000
FULL = {"growth": (256, 512, 1024, 2048, 4096), "staircase": (4, 8, 16, 32), "lookup": (10_000, 100_000)}
SMOKE = {"growth": (64, 128, 256), "staircase": (4, 8), "lookup": (1_000,)}


def main() -> None:
    """Print the tables asked for, all of them by default."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--table", nargs="*", choices=sorted(TABLES), help="only these tables")
    parser.add_argument("--smoke", action="store_true", help="small images, to see that the script runs")
    arguments = parser.parse_args()
    region_image(flower(), resolution=64)  # Compiles.
    for name in arguments.table or TABLES:
        print(f"\n### {name}\n")
        for line in TABLES[name]((SMOKE if arguments.smoke else FULL)[name]):
            print(line, flush=True)


def growth(resolutions: tuple[int, ...]) -> Iterator[str]:
    """Seconds of each step on rasters of growing resolution, and the exponent of each in the number of pixels."""
    yield "| pixels across | in all | marks | 20 levels | together | all distances | binary transform |"
    yield "|" + "---|" * 7
    border = flower()
    seconds: list[list[float]] = []
    pixels: list[int] = []
    for resolution in resolutions:
        image, marked = _timed(lambda size=resolution: region_image(border, resolution=size))
        values, measured = _timed(lambda drawn=image: drawn.values)
        levels = _levels(float(values.max()) / LEVELS)
        _, traced = _timed(lambda drawn=image, at=levels: drawn.contours(at))
        _, binary = _timed(lambda mask=values > 0.0: distance_transform_edt(mask))
        pixels.append(values.size)
        seconds.append([marked, traced, marked + traced, measured, binary])
        yield f"| {resolution} | {pixels[-1]} | " + " | ".join(f"{value:.4f}" for value in seconds[-1]) + " |"
    exponents = np.polyfit(np.log(pixels), np.log(seconds), 1)[0]
    yield "| exponent | | " + " | ".join(f"{value:.2f}" for value in exponents) + " |"


def staircase(pixels_per_spacing: tuple[int, ...]) -> Iterator[str]:
    """Spacing of neighbouring level curves on the plane: distance to the border's segments, and to outside pixels."""
    yield "| pixels a spacing | exact: CV | p99 | level 0 off, of a spacing | binary: CV | p99 | level 0 off |"
    yield "|" + "---|" * 7
    border = flower()
    spacing = float(region_image(border, resolution=512).values.max()) / LEVELS
    for count in pixels_per_spacing:
        image = region_image(border, resolution=int(count * np.ptp(border, axis=(0, 1)).max() / spacing))
        values = np.asarray(distance_transform_edt(image.values > 0.0)) * image.pixel
        binary = [
            [line * image.pixel + image.origin for line in lines]
            for lines in level_lines([Band(0, values)], levels=_levels(spacing))
        ]
        cells: list[str] = []
        for curves in (image.contours(_levels(spacing)), binary):
            ratios = _ratios(curves, spacing)
            off = np.abs(point_distances(border, np.vstack(curves[0])) / spacing - 0.5)
            cells += [f"{ratios.std() / ratios.mean():.2%}", f"{np.percentile(ratios, 99):.3f}", f"{off.mean():.2%}"]
        yield f"| {count} | " + " | ".join(cells) + " |"


def lookup(faces: tuple[int, ...]) -> Iterator[str]:
    """Seconds to find the triangles of points in a flat mesh, by bins and by the closest-point search."""
    yield "| faces | points | bins | closest points | ratio |"
    yield "|" + "---|" * 5
    for count in faces:
        surface = make("plate", faces=count, style="irregular")
        low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        places = np.random.default_rng(0).uniform(low, high, (NODES, 3))
        places[:, 2] = 0.0
        locate(surface, places[:1, :2])  # Compiles.
        _, bins = _timed(lambda mesh=surface, at=places: locate(mesh, at[:, :2]))
        start = time.perf_counter()
        closest(surface, places)
        search = time.perf_counter() - start
        yield f"| {len(surface.faces)} | {NODES} | {bins:.3f} | {search:.3f} | {search / bins:.0f} |"


TABLES: Mapping[str, Callable[[tuple[int, ...]], Iterator[str]]] = MappingProxyType(
    {"growth": growth, "staircase": staircase, "lookup": lookup}
)


def flower() -> FloatArray:
    """Return the segments of a smooth border with bays and a hole, 60 mm across, on no axis of the raster."""
    angles = 2 * np.pi * np.arange(SEGMENTS) / SEGMENTS
    reach = 24.0 + 6.0 * np.cos(3 * angles + 0.3) + 1.5 * np.sin(7 * angles)
    rim = np.column_stack([np.cos(angles), np.sin(angles)]) * reach[:, None]
    turn = 2 * np.pi * np.arange(5) / 5 + 0.2
    hole = 4.0 * np.column_stack([np.cos(turn), -np.sin(turn)]) + [2.0, 1.0]
    return np.concatenate([np.stack([loop, np.roll(loop, -1, axis=0)], axis=1) for loop in (rim, hole)])


def _levels(spacing: float) -> FloatArray:
    return (np.arange(LEVELS, dtype=np.float64) + 0.5) * spacing


def _ratios(levels: list[list[FloatArray]], spacing: float) -> FloatArray:
    """Return the distance from samples on every level to the level before, over the spacing."""
    return np.concatenate(
        [
            PolylineDistance(outer, step=spacing / 20)(
                np.vstack([even_points(line, step=spacing / 4) for line in inner])
            )
            / spacing
            for outer, inner in pairwise(level for level in levels if level)
        ]
    )


def _timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """Return a result and the least seconds of some runs."""
    times: list[float] = []
    while True:
        start = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - start)
        if len(times) == REPEATS:
            return result, min(times)


if __name__ == "__main__":
    main()
