"""How high are layers over what lies below, and what does a stack cost?

    python -m benchmarks.layers [--parts FILE ...] [--thickness MM] [--height MM] [--smoke]

The first table is of shells by formula: area of each layer over a cap and a cylinder of ever shorter edges and over a
plate, inside and outside, against the formula. The second plans the layers of a cap and of a tube and holds area,
length of the paths and laid volume against theirs. The third is of parts on both sides: for the tops of the lowest and
the highest layer, the share of the area whose distance from the part, or from the top of the layer below, is off by
more than 2 % of a layer, by a distance computed here that shares nothing with the one that made it; the same of the
part pushed along its normals; faces that cross and faces that look at the part; and the processor time.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable, Sequence
from itertools import islice
from pathlib import Path

import numpy as np
import trimesh.triangles
from scipy.spatial import KDTree

from benchmarks.parts.shells import EDGES, JITTER_SEED, PathShell, Shell, flat_shell, path_shells, shells
from benchmarks.parts.tables import row, table
from geoprint.config import load_cell
from geoprint.errors import GeoprintError
from geoprint.layers import layer_level, whole_layers
from geoprint.model import FloatArray, Surface
from geoprint.surfaces import face_areas, face_normals, turned_over, vertex_normals
from geoprint.surfaces.files import load
from geoprint.surfaces.remesh import refine
from geoprint.surfaces.repair import prepare
from geoprint.surfaces.repair.crossings import crossings

DATA = Path(__file__).parents[1] / "data"
OWN, SMOKE_OWN = ("heart_flat_patch.ply", "heart_apex_patch.ply"), ("plate.ply",)
SAMPLES = 20_000
SEED = 22
SMOKE_SAMPLES = 500
# Edges of the part for the judge [mm], and so many of its triangles with the nearest middles are looked at: in a crease
# 3 mm over the part the closest one may not be among fewer.
EDGE, SMOKE_EDGE = 0.4, 2.0
NEAREST = 48
# A lower bottom is the part itself [mm].
SMALLEST = 1e-9
HEADINGS = (
    "part", "side", "over it", "off by 2 %", "over the layer below", "pushed", "faces", "crossing", "flipped",
    "processor time",
)  # fmt: skip


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--parts", type=Path, nargs="*", default=[], metavar="FILE", help="in mm, beside those of data/"
    )
    parser.add_argument("--thickness", type=float, default=3.2, metavar="MM")
    parser.add_argument("--height", type=float, default=0.4, metavar="MM", help="of a layer")
    parser.add_argument("--smoke", action="store_true", help="a layer on a plate, coarsely judged")
    arguments = parser.parse_args()
    smoke: bool = arguments.smoke
    thickness, wanted = (0.5, 0.5) if smoke else (arguments.thickness, arguments.height)
    samples, edge = (SMOKE_SAMPLES, SMOKE_EDGE) if smoke else (SAMPLES, EDGE)
    count, height = whole_layers(thickness, height=wanted)
    _print_areas(count, height, edges=EDGES[:1] if smoke else EDGES, most=1 if smoke else None)
    _print_paths(thickness, shells=islice(path_shells(), 1 if smoke else None))
    print(*table(*HEADINGS), sep="\n", flush=True)
    for file in [*(DATA / name for name in (SMOKE_OWN if smoke else OWN)), *arguments.parts]:
        part = prepare(load(file, unit="mm"))[0]
        for side, printed in (("outside", part), ("turned over", turned_over(part)))[: 1 if smoke else None]:
            for over in sorted({height, count * height}):
                print(_row(printed, side, over, height, samples=samples, edge=edge), flush=True)


def _print_areas(count: int, height: float, *, edges: Sequence[float], most: int | None) -> None:
    """Print the table of areas, of at most so many shells of each edge."""
    print(*table("shell", "edge over radius", "layers", "area off the formula, worst", "irregular"), sep="\n")
    for edge in edges:
        pairs = zip(shells(edge), shells(edge, jitter_seed=JITTER_SEED), strict=True)
        for even, uneven in islice(pairs, most):
            off = [_worst(shell, count, height) for shell in (even, uneven)]
            print(row(even.name, f"{edge:g}", str(count), *(f"{one:+.2%}" for one in off)), flush=True)
    flat = flat_shell()
    print(row(flat.name, "", str(count), f"{_worst(flat, count, height):+.2%}", ""), flush=True)


def _worst(shell: Shell, count: int, height: float) -> float:
    return max((shell.off((number + 0.5) * height, height=height) for number in range(count)), key=abs)


def _print_paths(thickness: float, *, shells: Iterable[PathShell]) -> None:
    print(*table("shell", "layers", "area off, worst", "path length", "laid volume"), sep="\n")
    count, _ = whole_layers(thickness, height=load_cell(None).process.layer_height)
    for shell in shells:
        off = np.array([shell.off(layer, thickness=thickness) for layer in range(1, count + 1)])
        worst = off[np.abs(off).argmax(axis=0), np.arange(3)]
        print(row(shell.name, str(count), *(f"{one:+.2%}" for one in worst)), flush=True)


def _row(part: Surface, side: str, over: float, height: float, *, samples: int, edge: float) -> str:
    """Return what is said of the top of a layer, which lies between it and what is a height lower.

    Args:
        part: that is printed on.
        side: its name.
        over: how far the top is over the part [mm].
        height: of a layer [mm].
        samples: places of each surface that are judged.
        edge: of the part for the judge [mm].
    """
    begun = time.process_time()
    try:
        level = layer_level(part, over, height=height)
        took = time.process_time() - begun
        bottom = over - height
        below = part if bottom < SMALLEST else layer_level(part, bottom, height=height)
    except GeoprintError as error:
        return row(part.name, side, f"{over:.3g} mm", str(error)[:110].replace("|", "/"), *[""] * 6)
    pushed = Surface(part.vertices + over * vertex_normals(part), part.faces, part.name)
    fine, lower = refine(part, edge_length=edge), refine(below, edge_length=edge)
    shares = [
        (np.abs(_away(ground, _places(each, samples)) - wanted) > 0.02 * height).mean()
        for each, ground, wanted in ((level, fine, over), (level, lower, height), (pushed, fine, over))
    ]
    crossing = len(np.unique(crossings(level, depth=1e-9).pairs))
    return row(
        part.name, side, f"{over:.3g} mm", *(f"{share:.3%}" for share in shares[:2]), f"{shares[2]:.1%}",
        str(len(level.faces)), str(crossing), str(_flipped(level, fine)), f"{took:.1f} s",
    )  # fmt: skip


def _flipped(level: Surface, part: Surface) -> int:
    """Return how many faces of a level face the part: their normal has none of the direction away from it."""
    middles = level.vertices[level.faces].mean(axis=1)
    upright = np.einsum("kx,kx->k", face_normals(level), middles - _feet(part, middles))
    return int((upright <= 0.0).sum())


def _places(surface: Surface, samples: int) -> FloatArray:
    """Return so many places drawn evenly from a surface [mm]."""
    random = np.random.default_rng(SEED)
    areas = face_areas(surface)
    faces = random.choice(len(areas), samples, p=areas / areas.sum())
    return np.einsum("kc,kcx->kx", random.dirichlet(np.ones(3), samples), surface.vertices[surface.faces[faces]])


def _away(part: Surface, places: FloatArray) -> FloatArray:
    """Return how far places are away from a part [mm]."""
    found: FloatArray = np.linalg.norm(places - _feet(part, places), axis=1)
    return found


def _feet(part: Surface, places: FloatArray) -> FloatArray:
    """Return the closest places of a part of small triangles: in those with the nearest middles [mm]."""
    corners = part.vertices[part.faces]
    near = np.asarray(KDTree(corners.mean(axis=1)).query(places, k=NEAREST)[1], dtype=np.int64)
    best, least = np.zeros_like(places), np.full(len(places), np.inf)
    for column in range(NEAREST):
        found: FloatArray = trimesh.triangles.closest_point(corners[near[:, column]], places)  # pyright: ignore[reportUnknownMemberType]
        away = np.linalg.norm(found - places, axis=1)
        nearer = away < least
        best[nearer], least[nearer] = found[nearer], away[nearer]
    return best


if __name__ == "__main__":
    main()
