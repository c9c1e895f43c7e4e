"""How high are layers over what lies below, and what does a stack cost?

    python -m benchmarks.layers [--parts FILE ...] [--thickness MM] [--height MM] [--spacing MM] [--smoke]

The first table is of shells by formula: area of each layer over a cap, a cylinder and a plate, inside and outside,
against the formula. The second is of parts: for the tops of the lowest and the highest layer, the share of the area
whose distance from the part is off by more than 2 % of a layer, by a distance computed here that shares nothing with
the one that made it; the same of the part pushed along its normals; triangles that cross; and the processor time. The
third is of their seams: how far the starts of closed runs are from those one layer below and two, in spacings, where
the run has a place two spacings from all of them.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh.triangles
from scipy.spatial import KDTree

from benchmarks.parts.tables import row, table
from geoprint.config import job_of
from geoprint.errors import GeoprintError
from geoprint.layers import layer_level, whole_layers
from geoprint.model import FloatArray, Surface
from geoprint.pipeline.covering import cover
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.workpiece import prepare_workpiece
from geoprint.surfaces import face_areas, turned_over, vertex_normals
from geoprint.surfaces.files import load
from geoprint.surfaces.remesh import refine
from geoprint.surfaces.repair.crossings import crossings
from tests.meshes import cylinder_patch, plate, spherical_cap

DATA = Path(__file__).parents[1] / "data"
OWN = ("heart_flat_patch.ply", "heart_apex_patch.ply")
SAMPLES = 20_000
SEED = 22
# Edges of the part for the judge [mm], and so many of its triangles with the nearest middles are looked at.
EDGE = 0.4
NEAREST = 12


class _Start(NamedTuple):
    """A run: its places from its start [mm], and whether it is closed."""

    places: FloatArray
    closed: bool


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--parts", type=Path, nargs="*", default=[], metavar="FILE", help="in mm, beside those of data/"
    )
    parser.add_argument("--thickness", type=float, default=3.2, metavar="MM")
    parser.add_argument("--height", type=float, default=0.4, metavar="MM", help="of a layer")
    parser.add_argument("--spacing", type=float, default=1.5, metavar="MM", help="of the paths, for their seams")
    parser.add_argument("--smoke", action="store_true", help="two layers of 1 mm")
    arguments = parser.parse_args()
    thickness, wanted = (2.0, 1.0) if arguments.smoke else (arguments.thickness, arguments.height)
    count, height = whole_layers(thickness, height=wanted)
    for line in table("shell", "layers", "area off the formula, worst"):
        print(line, flush=True)
    for name, part, curvature, bends in _shells(0.6 if arguments.smoke else 0.3):
        off = max(_off(part, (number + 0.5) * height, height, curvature, bends) for number in range(count))
        print(row(name, str(count), f"{off:.2%}"), flush=True)
    print()
    for line in table("part", "over it", "off by 2 %", "pushed", "faces", "crossing", "processor time"):
        print(line, flush=True)
    for file in [*(DATA / name for name in OWN), *arguments.parts]:
        part = load(file, unit="mm")
        for over in (height, count * height):
            print(_row(part, over, height), flush=True)
    print()
    for line in table(
        "part", "layers", "closed runs", "with room", "one below: least", "nearer than 2", "two: least", "nearer than 2"
    ):
        print(line, flush=True)
    for file in [*(DATA / name for name in OWN), *arguments.parts]:
        print(
            _seams_row(
                file, [_starts(file, layer, thickness, arguments.spacing) for layer in range(count)], arguments.spacing
            ),
            flush=True,
        )


def _shells(edge: float) -> Iterator[tuple[str, Surface, float, int]]:
    """Yield name and part, and its curvature [1/mm] in how many directions."""
    rings = round(10.0 / edge)
    cap = spherical_cap(radius=12.0, angle=0.8, rings=rings)
    tube = cylinder_patch(radius=12.0, angle=1.4, length=10.0, divisions=(2 * rings, 10))
    for sign, side in ((1.0, "outside"), (-1.0, "inside")):
        for name, part, power in (("cap", cap, 2), ("cylinder", tube, 1)):
            yield f"{name}, {side}", part if sign > 0.0 else turned_over(part), sign / 12.0, power
    yield "plate", plate((20.0, 15.0)), 0.0, 1


def _off(part: Surface, over: float, height: float, curvature: float, bends: int) -> float:
    """Return the deviation of a level's area from its formula, over that."""
    level = layer_level(part, over, height=height)
    wanted = float(face_areas(part).sum()) * (1.0 + over * curvature) ** bends
    return abs(float(face_areas(level).sum()) / wanted - 1.0)


def _row(part: Surface, over: float, height: float) -> str:
    begun = time.process_time()
    try:
        level = layer_level(part, over, height=height)
    except GeoprintError as error:
        return row(part.name, f"{over:.3g} mm", str(error)[:110].replace("|", "/"), *[""] * 4)
    took = time.process_time() - begun
    pushed = Surface(part.vertices + over * vertex_normals(part), part.faces, part.name)
    fine = refine(part, edge_length=EDGE)
    shares = [(np.abs(_distances(fine, _places(each)) - over) > 0.02 * height).mean() for each in (level, pushed)]
    crossing = len(np.unique(crossings(level, depth=1e-9).pairs))
    return row(
        part.name, f"{over:.3g} mm", f"{shares[0]:.3%}", f"{shares[1]:.1%}", str(len(level.faces)), str(crossing),
        f"{took:.1f} s",
    )  # fmt: skip


def _starts(file: Path, layer: int, thickness: float, spacing: float) -> list[_Start]:
    """Return where the runs of a layer start."""
    job = job_of(surface=file, unit="mm", spacing=spacing, thickness=thickness, layer=layer + 1, robot=False)
    stage = Stages(lambda _: None)
    workpiece = prepare_workpiece(job, stage, backends=[job.backend])
    curves = cover(job, workpiece, stage).toolpath.curves
    return [_Start(curves.xyz(workpiece.surface, run), bool(curves.closed[run])) for run in range(curves.count)]


def _seams_row(file: Path, layers: list[list[_Start]], spacing: float) -> str:
    """Return how far starts are from those of the layers below."""
    found: list[list[float]] = [[], []]
    closed, roomy = 0, 0
    for above, starts in enumerate(layers):
        below = [KDTree(np.array([start.places[0] for start in layer])) for layer in layers[max(above - 2, 0) : above]]
        for start in starts:
            away = [np.asarray(tree.query(start.places)[0], dtype=np.float64) / spacing for tree in reversed(below)]
            closed += start.closed
            if start.closed and away and np.min(away, axis=0).max() >= 2.0:
                roomy += 1
                for distances, nearest in zip(found, away, strict=False):
                    distances.append(float(nearest[0]))
    told = [text for each in found for text in (_least(each), f"{sum(away < 2.0 for away in each)} of {len(each)}")]
    return row(file.name, str(len(layers)), str(closed), str(roomy), *told)


def _least(values: list[float]) -> str:
    return f"{min(values):.2f}" if values else "-"


def _places(surface: Surface) -> FloatArray:
    """Return places drawn evenly from a surface [mm]."""
    random = np.random.default_rng(SEED)
    areas = face_areas(surface)
    faces = random.choice(len(areas), SAMPLES, p=areas / areas.sum())
    return np.einsum("kc,kcx->kx", random.dirichlet(np.ones(3), SAMPLES), surface.vertices[surface.faces[faces]])


def _distances(part: Surface, places: FloatArray) -> FloatArray:
    """Return the distances of places from a part of small triangles: to the planes of the nearest, within them [mm]."""
    corners = part.vertices[part.faces]
    near = np.asarray(KDTree(corners.mean(axis=1)).query(places, k=NEAREST)[1], dtype=np.int64)
    best = np.full(len(places), np.inf)
    for column in range(NEAREST):
        found: FloatArray = trimesh.triangles.closest_point(corners[near[:, column]], places)  # pyright: ignore[reportUnknownMemberType]
        best = np.minimum(best, np.linalg.norm(found - places, axis=1))
    return best


if __name__ == "__main__":
    main()
