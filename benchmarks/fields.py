"""Do fields have the singularities that they are asked for, how right are they, and how fast?

    python -m benchmarks.fields [--parts FILE ...] [--faces N ...] [--smoke]

The first table is of surfaces by formula and of parts: for vectors, lines and crosses, how many singularities a field
was asked for and how many others are measured on it, face by face around every vertex; then how many the smoothest
field chose, the sum of their indices with the turnings of the rims, and what it must be. The second is of fields with a
known formula: root mean square error on finer and finer meshes, and the order in the length of edges. The third is of
processor time on bumpy sheets, and the exponent of the number of faces, fitted to all but the smallest.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks.parts.surfaces import STYLES, make
from benchmarks.parts.tables import row, table
from geoprint.fields import SYMMETRIES, AlongRim, DirectionField, Singularities, prescribed_field, smoothest_field
from geoprint.fields.connection import angles_in_faces
from geoprint.model import FloatArray, Surface
from geoprint.surfaces import boundary_loops, describe, edge_lengths, euler_characteristic
from geoprint.surfaces.files import load
from geoprint.surfaces.repair import prepare
from tests.fields.measures import inner_vertices
from tests.meshes import annulus, disc, sphere, torus

NAMES = {1: "vectors", 2: "lines", 4: "crosses"}
SEED = 23
# Pairs of opposite indices that a field is asked for beside what its surface demands.
PAIRS = 3
# Fewer faces take as long as what does not depend on them.
LEAST_FITTED = 9_000
Made = Callable[[Surface], DirectionField]


def main() -> None:
    """Print the tables; end with status 1 where a field has other singularities than it was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", type=Path, nargs="*", default=[], metavar="FILE", help="in mm, beside the formulas")
    parser.add_argument(
        "--faces", type=int, nargs="*", default=[1_000, 10_000, 100_000, 1_000_000], help="of the sheets that are timed"
    )
    parser.add_argument("--smoke", action="store_true", help="small meshes, to see that the script runs")
    arguments = parser.parse_args()
    faces: list[int] = [500, 1_000] if arguments.smoke else arguments.faces
    parts = [prepare(load(file, unit="mm"))[0] for file in arguments.parts]
    wrong = sum(_checked([disc(jitter_seed=1), annulus(jitter_seed=1), sphere(jitter_seed=1), torus(), *parts]))
    for line in [*_orders([250, 500] if arguments.smoke else [1_000, 4_000, 16_000, 64_000]), *_times(faces)]:
        print(line, flush=True)
    if wrong:
        sys.exit(f"{wrong} singularities are others than those asked for")


def asked(surface: Surface, *, symmetry: int) -> Singularities:
    """Return singularities at vertices drawn at random: what a closed surface demands, and pairs beside it."""
    demanded = 0 if boundary_loops(surface) else symmetry * euler_characteristic(surface)
    signs = np.concatenate([np.full(abs(demanded), np.sign(demanded)), np.tile([1, -1], PAIRS)])
    vertices = np.random.default_rng(SEED).choice(inner_vertices(surface), signs.size, replace=False)
    order = np.argsort(vertices)
    return Singularities(vertices[order], signs[order] / symmetry)


def _checked(surfaces: Sequence[Surface]) -> Iterator[int]:
    """Print the table of singularities, and yield how many of each field are others than asked for."""
    for line in table("surface", "kind", "faces", "field", "asked", "others", "smoothest has", "sum", "must be"):
        print(line, flush=True)
    for surface in surfaces:
        for symmetry in SYMMETRIES:
            wanted = asked(surface, symmetry=symmetry)
            found = prescribed_field(surface, symmetry=symmetry, singularities=wanted).singularities()
            pairs = [set(zip(each.vertices.tolist(), each.indices.tolist(), strict=True)) for each in (wanted, found)]
            free = smoothest_field(surface, symmetry=symmetry)
            chosen = free.singularities()
            others = len(pairs[0] ^ pairs[1])
            print(
                row(
                    surface.name, describe(surface), str(len(surface.faces)), NAMES[symmetry], str(len(pairs[0])),
                    str(others), str(chosen.vertices.size), f"{chosen.indices.sum() + free.turnings().sum():g}",
                    str(euler_characteristic(surface)),
                ),
                flush=True,
            )  # fmt: skip
            yield others


def _orders(sizes: Sequence[int]) -> Iterator[str]:
    """Yield the table of errors against formulas."""
    yield from table("field", "triangles", *(f"{size} faces" for size in sizes), "order")
    for style in STYLES:
        for name, error in (
            ("index 1 on a disc, off the middle", _off_the_middle),
            ("circles along its rim", _circles),
        ):
            found = np.array([error(make("disc", faces=size, style=style)) for size in sizes])
            order = float(np.polyfit(np.log(found[:, 0]), np.log(found[:, 1]), 1)[0])
            yield row(name, style, *(f"{np.degrees(each):.2g} deg" for each in found[:, 1]), f"{order:.2f}")


def _off_the_middle(flat: Surface) -> tuple[float, float]:
    """Return mean edge [mm] and error [rad] of I (arg(z - a) - arg(1 - conj(a) z)) on the unit disc, away from a."""
    inner, middles = inner_vertices(flat), flat.vertices[flat.faces].mean(axis=1)
    vertex = int(inner[np.argmin(np.linalg.norm(flat.vertices[inner] - [6.0, 3.0, 0.0], axis=1))])
    field = prescribed_field(flat, symmetry=1, singularities=Singularities(np.array([vertex]), np.array([1.0])))
    a, z = complex(*flat.vertices[vertex, :2]) / 20.0, (middles @ [1.0, 1.0j, 0.0]) / 20.0
    turned = np.angle(z - a) - np.angle(1.0 - np.conj(a) * z)
    wanted = np.column_stack([np.cos(turned), np.sin(turned), np.zeros(turned.size)])
    return _error(field, wanted, away=np.abs(z - a))


def _circles(flat: Surface) -> tuple[float, float]:
    """Return mean edge [mm] and error [rad] of the smoothest vectors that follow the rim, away from the middle."""
    middles = flat.vertices[flat.faces].mean(axis=1)
    field = smoothest_field(flat, symmetry=1, preferences=[AlongRim()])
    return _error(field, np.cross([0.0, 0.0, 1.0], middles), away=np.linalg.norm(middles, axis=1) / 20.0)


def _error(field: DirectionField, wanted: FloatArray, *, away: FloatArray) -> tuple[float, float]:
    """Return mean edge [mm] and root mean square error [rad], up to one turn of all, where it is 0.2 away."""
    surface = field.surface
    turned = field.angles - angles_in_faces(surface, np.arange(len(surface.faces)), wanted)
    powers = np.exp(1j * field.symmetry * turned)[away > 0.2]
    errors = np.angle(powers / powers.mean()) / field.symmetry
    return float(edge_lengths(surface).mean()), float(np.sqrt((errors**2).mean()))


def _times(sizes: Sequence[int]) -> Iterator[str]:
    """Yield the table of processor times."""
    made: dict[str, Made] = {
        "lines, given singularities": lambda one: prescribed_field(
            one, symmetry=2, singularities=asked(one, symmetry=2)
        ),
        "lines, given singularities, along the rim": lambda one: prescribed_field(
            one, symmetry=2, singularities=asked(one, symmetry=2), preferences=[AlongRim()]
        ),
        "lines, smoothest": lambda one: smoothest_field(one, symmetry=2),
        "lines, smoothest along the rim": lambda one: smoothest_field(one, symmetry=2, preferences=[AlongRim()]),
    }
    sheets = [make("bumpy", faces=size) for size in sizes]
    # What is compiled at its first use is not counted.
    for make_field in made.values():
        make_field(make("bumpy", faces=500))
    yield from table("field", *(f"{len(sheet.faces)} faces" for sheet in sheets), "exponent")
    for name, make_field in made.items():
        seconds = [_seconds(make_field, sheet) for sheet in sheets]
        large = [number for number, sheet in enumerate(sheets) if len(sheet.faces) >= LEAST_FITTED]
        counts = np.log([len(sheets[number].faces) for number in large])
        fitted = np.log([seconds[number] for number in large])
        exponent = f"{np.polyfit(counts, fitted, 1)[0]:.2f}" if len(large) > 1 else ""
        yield row(name, *(f"{each:.2f} s" for each in seconds), exponent)


def _seconds(make_field: Made, surface: Surface) -> float:
    """Return the processor time of a field [s], the least of two where it is short."""
    least = np.inf
    for _ in range(2 if len(surface.faces) < 500_000 else 1):
        begun = time.process_time()
        make_field(surface)
        least = min(least, time.process_time() - begun)
    return float(least)


if __name__ == "__main__":
    main()
