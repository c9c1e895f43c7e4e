"""A law: what rounding changes of a part changes nothing of its plan that anybody would notice."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from geoprint import job_of, plan
from geoprint.distance import backend
from geoprint.distance.lscm_chart import farthest_pair
from geoprint.errors import GeoprintError
from geoprint.geometry import PolylineDistance, boundary_loops, boundary_source, positions, refine, shortest_edge_path
from geoprint.geometry.files import load, save_ply, suggested_unit
from geoprint.model import FloatArray, Surface
from tests.meshes import annulus, cylinder_patch, disc, plate
from tests.shared_data import shared

DATA = Path(__file__).parents[2] / "data"
# Standard deviation by which vertices are moved [mm].
MOVED = 1e-9
# Figures of a plan, and how far they may differ: as a share, or in points where they are percentages.
RELATIVE = MappingProxyType({"mm/s": 0.005, "targets": 0.01})
POINTS = MappingProxyType({"CV": 0.02, "gap": 0.02, "overlap": 0.02})
# Part, backend and spacing [mm]; those of the shared data first. The rectangle's plan differs where points that are
# equally far from a chord are told apart, and, as the apex does, where what is as long as a bound is longer than it.
SHARED = (("lv_lateral_disc_r15", "fast-marching", 2.0), ("lv_lateral_rect_40x30", "heat", 2.0))
OWN = (("plate", "lscm", 3.0), ("heart_apex_patch", "heat", 3.0))


def moved(path: Path, folder: Path) -> tuple[Path, Path]:
    """Return a part as it is, and with its vertices moved by a millionth of a micrometre."""
    surface = load(path, unit=suggested_unit(path)[0])
    noise = np.random.default_rng(1).normal(scale=MOVED, size=surface.vertices.shape)
    files = folder / "own.ply", folder / "moved.ply"
    for file, vertices in zip(files, (surface.vertices, surface.vertices + noise), strict=True):
        save_ply(Surface(vertices, surface.faces, "part"), file)
    return files


def figures(file: Path, *, backend: str, spacing: float) -> dict[str, float | str]:
    """Return what must not depend on the last bit: runs, speed, targets, evenness, or why there is no plan."""
    try:
        planned = plan(job_of(surface=file, unit="mm", spacing=spacing, backend=backend, place="demo"))
    except GeoprintError as error:
        return {"refused": type(error).__name__}
    measured, robot = planned.uniformity, planned.robot[0]
    assert measured is not None
    return {
        "runs": measured.run_count,
        "mm/s": planned.workpiece.cell.process.speed,
        "targets": len(robot.targets.poses),
        "CV": 100.0 * measured.thickness.cv,
        "gap": 100.0 * measured.gap,
        "overlap": 100.0 * measured.overlap,
    }


def differences(found: Mapping[str, float | str], other: Mapping[str, float | str]) -> list[str]:
    """Return a cell for each figure: what it is both times, and a mark where it differs by more than it may."""
    if "refused" in found or "refused" in other:
        same = found.get("refused") == other.get("refused")
        return [
            f"{found.get('refused', 'planned')}, {other.get('refused', 'planned')}{'' if same else ' !'}",
            *[""] * 5,
        ]
    cells = [f"{found['runs']}, {other['runs']}{'' if found['runs'] == other['runs'] else ' !'}"]
    for name, allowed in (*RELATIVE.items(), *POINTS.items()):
        one, two = float(found[name]), float(other[name])
        off = abs(two - one) / one if name in RELATIVE else abs(two - one)
        cells.append(f"{one:.4g}, {two:.4g}{' !' if off > allowed else ''}")
    return cells


@pytest.mark.parametrize(("name", "backend", "spacing"), [*OWN, *SHARED])
def test_a_part_moved_by_a_billionth_of_a_millimetre_has_the_same_plan(
    tmp_path: Path, name: str, backend: str, spacing: float
) -> None:
    path = DATA / f"{name}.ply" if (name, backend, spacing) in OWN else shared(f"patches/{name}.ply")
    own, other = (figures(file, backend=backend, spacing=spacing) for file in moved(path, tmp_path))
    cells = differences(own, other)
    assert not [cell for cell in cells if cell.endswith("!")], cells


@pytest.mark.parametrize("surface", [plate(), disc(), annulus(), cylinder_patch()], ids=lambda part: part.name)
def test_rounding_decides_neither_pins_nor_loops_nor_paths_along_edges(surface: Surface) -> None:
    noise = np.random.default_rng(2)

    def chosen(vertices: FloatArray) -> list[list[int]]:
        part = Surface(vertices, surface.faces)
        loops = [*boundary_loops(part)]
        ends = loops[-1] if len(loops) > 1 else np.array([len(vertices) // 2])
        found = farthest_pair(part, loops[0]), *loops, shortest_edge_path(part, loops[0], ends)
        return [each.tolist() for each in found]

    for _ in range(20):
        moved_vertices = surface.vertices + noise.normal(scale=MOVED, size=surface.vertices.shape)
        assert chosen(moved_vertices) == chosen(surface.vertices)


@pytest.mark.parametrize(
    ("name", "surface"),
    [
        *((name, part) for name in ("lscm", "heat") for part in (plate(), disc(), annulus(), cylinder_patch())),
        # On a round disc all fronts meet in one point, and marching on so regular a mesh finds it in two ways.
        *(("fast-marching", part) for part in (plate(), annulus(), cylinder_patch())),
    ],
)
def test_rounding_leaves_level_curves_of_symmetric_parts_as_they_are(name: str, surface: Surface) -> None:
    """Fronts meet at vertices here, four corners lie on one circle, and rows of vertices at a level."""
    part = refine(surface, edge_length=2.0)
    noise = np.random.default_rng(3).normal(scale=MOVED, size=part.vertices.shape)
    own, other = (level_curves(Surface(part.vertices + by, part.faces), name) for by in (0.0, noise))
    assert len(other) == len(own)
    for lines, others in ((own, other), (other, own)):
        assert PolylineDistance(lines, step=0.2)(np.vstack(others)).max() < 1e-6


def level_curves(surface: Surface, name: str) -> list[FloatArray]:
    """Return the corners of each level curve 4 mm apart."""
    curves = backend(name).factory(surface).contours(boundary_source(surface), spacing=4.0).curves
    places = positions(surface, curves.points)
    return [places[begin:end] for begin, end in pairwise(curves.offsets.tolist())]


def test_the_law_sees_what_it_is_for() -> None:
    own = {"runs": 4, "mm/s": 10.0, "targets": 200, "CV": 1.0, "gap": 0.1, "overlap": 0.1}
    for name, value in {"runs": 5, "mm/s": 10.06, "targets": 203, "CV": 1.03, "gap": 0.13, "overlap": 0.13}.items():
        assert sum(cell.endswith("!") for cell in differences(own, own | {name: value})) == 1, name
    assert not any(cell.endswith("!") for cell in differences(own, own | {"mm/s": 10.04, "targets": 201, "CV": 1.01}))
