"""Every planner of the yardstick: its name, what it needs to be installed, and its paths on a part."""

from __future__ import annotations

import importlib
import importlib.util
import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, final

import numpy as np
from matplotlib.tri import LinearTriInterpolator, Triangulation

from benchmarks.parts.streams import deposited
from benchmarks.paths.peers import METHODS
from geoprint import job_of, plan
from geoprint.errors import InputError
from geoprint.geometry import boundary_loops, mean_normal, refine
from geoprint.geometry.files import load
from geoprint.model import FloatArray, Polylines, Surface
from geoprint.transforms import smallest_rotation

# Edges of the meshes that other planners get, over the spacing: as fine as ours plan on, or finer.
EDGE_SHARE = 0.5

# From a file of a part [mm] and the spacing [mm] to the deposited paths in the part's coordinates.
Paths = Callable[[Path, float], Polylines]


@final
@dataclass(frozen=True, slots=True)
class Planner:
    """A planner.

    Attributes:
        paths: what it deposits on a part; raises a GeoprintError where it refuses the part.
        library: that must be installed, or an empty string.
        ours: whether it is geoprint's own.
    """

    paths: Paths
    library: str = ""
    ours: bool = False

    @property
    def present(self) -> bool:
        """Whether it is installed here."""
        return not self.library or importlib.util.find_spec(self.library) is not None


def _own(**options: str) -> Planner:
    def paths(part: Path, spacing: float) -> Polylines:
        return deposited(plan(job_of(surface=part, unit="mm", spacing=spacing, robot=False, **options)).poses)

    return Planner(paths, ours=True)


def _isolines(name: str) -> Planner:
    method = METHODS[name]

    def paths(part: Path, spacing: float) -> Polylines:
        lines, _ = method.isolines(_fine(part, spacing), spacing)
        return joined(lines)

    return Planner(paths, library=method.library)


def _sliced() -> Planner:
    def paths(part: Path, spacing: float) -> Polylines:
        return joined(plane_slices(load(part, unit="mm"), spacing=spacing))

    return Planner(paths)


def _projected() -> Planner:
    def paths(part: Path, spacing: float) -> Polylines:
        return joined(concentric_infill(_fine(part, spacing), spacing=spacing))

    return Planner(paths, library="shapely")


def joined(lines: list[FloatArray]) -> Polylines:
    """Return (k, 3) places of each line as one value [mm]; a single place is no line."""
    lines = [line for line in lines if len(line) > 1]
    return Polylines(np.concatenate([np.zeros((0, 3)), *lines]), np.cumsum([0, *map(len, lines)]))


def present_planners() -> Iterator[tuple[str, Planner]]:
    """Yield those that are installed here, ours first."""
    return ((name, planner) for name, planner in PLANNERS.items() if planner.present)


def missing_libraries() -> list[str]:
    """Return what has to be installed for the others."""
    return sorted({planner.library for planner in PLANNERS.values() if not planner.present})


def _fine(part: Path, spacing: float) -> Surface:
    return refine(load(part, unit="mm"), edge_length=EDGE_SHARE * spacing)


PLANNERS: Mapping[str, Planner] = MappingProxyType(
    {
        "heat, contours": _own(backend="heat"),
        "fast-marching, contours": _own(backend="fast-marching"),
        "lscm, contours": _own(backend="lscm"),
        "heat, spiral": _own(backend="heat", pattern="spiral"),
        "plane slicing": _sliced(),
        "potpourri3d, robust heat method": _isolines("potpourri3d robust"),
        "libigl, exact distance": _isolines("libigl exact"),
        "concentric infill, projected": _projected(),
    }
)


def plane_slices(surface: Surface, *, spacing: float) -> list[FloatArray]:
    """Return the lines (k, 3) in which planes cut a surface, one spacing apart [mm].

    The planes stand upright on the surface as seen from above, along its longer side: what a slicer for flat layers
    does with a part that lies on its side.
    """
    rotation = _upright(surface)
    flat = (surface.vertices @ rotation.T)[:, :2]
    # The direction in which the surface is the narrowest, by the spread of its points.
    across = np.append(np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)[2][1], 0.0) @ rotation
    along = surface.vertices @ across
    mesh: Any = importlib.import_module("trimesh").Trimesh(surface.vertices, surface.faces, process=False)
    heights = np.arange(along.min() + 0.5 * spacing, along.max(), spacing)
    sections = (mesh.section(plane_normal=across, plane_origin=height * across) for height in heights)
    # The entities are whole lines; what trimesh calls paths of a section are closed ones alone.
    return [
        np.asarray(line.discrete(section.vertices))
        for section in sections
        if section is not None
        for line in section.entities
    ]


def _upright(surface: Surface) -> FloatArray:
    """Return the (3, 3) rotation that turns a surface upwards."""
    mean = mean_normal(surface)
    return smallest_rotation(mean / np.linalg.norm(mean), np.array([[0.0, 0.0, 1.0]]))[0]


# Points along the projected lines lie so far apart at most, over the spacing.
STEP_SHARE = 0.2


def concentric_infill(surface: Surface, *, spacing: float) -> list[FloatArray]:
    """Return closed lines (k, 3) on a surface: its outline from above, offset inwards at (k + 1/2) spacings [mm].

    Raises:
        InputError: the surface overhangs as seen from above, or has no rim, so that nothing can be projected.
    """
    loops = boundary_loops(surface)
    if not loops:
        raise InputError(f"{surface.name or 'the part'} has no rim, so that it has no outline from above.")
    rotation = _upright(surface)
    upright = surface.vertices @ rotation.T
    try:
        heights = LinearTriInterpolator(Triangulation(upright[:, 0], upright[:, 1], surface.faces), upright[:, 2])
    except (RuntimeError, ValueError) as error:
        raise InputError(f"{surface.name or 'the part'} overhangs: it cannot be projected from above.") from error
    outlines = sorted((upright[loop, :2] for loop in loops), key=_extent, reverse=True)
    return [_lifted(ring, heights, step=STEP_SHARE * spacing) @ rotation for ring in _rings(outlines, spacing=spacing)]


def _rings(outlines: list[FloatArray], *, spacing: float) -> list[FloatArray]:
    """Return closed flat rings within the first outline and outside the others, each a spacing inside the last."""
    geometry: Any = importlib.import_module("shapely")
    region = geometry.Polygon(outlines[0], outlines[1:]).buffer(0.0)
    insets = (region.buffer(-(number + 0.5) * spacing) for number in itertools.count())
    polygons = (
        polygon
        for inset in itertools.takewhile(lambda inset: not inset.is_empty, insets)
        for polygon in getattr(inset, "geoms", [inset])
    )
    return [np.asarray(ring.coords)[:, :2] for each in polygons for ring in (each.exterior, *each.interiors)]


def _lifted(ring: FloatArray, heights: LinearTriInterpolator, *, step: float) -> FloatArray:
    """Return a flat closed ring, resampled, at the heights below it; points beside the part are left out."""
    lengths: FloatArray = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1)))
    whole = float(lengths[-1])
    places: FloatArray = np.linspace(0.0, whole, max(int(np.ceil(whole / step)), 3) + 1)
    flat: FloatArray = np.column_stack([np.interp(places, lengths, ring[:, axis]) for axis in (0, 1)])
    found: FloatArray = np.ma.filled(heights(flat[:, 0], flat[:, 1]), np.nan)
    return np.column_stack([flat, found])[np.isfinite(found)]


def _extent(outline: FloatArray) -> float:
    return float(np.ptp(outline, axis=0).prod())
