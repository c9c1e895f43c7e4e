"""Every planner of the yardstick: its name, what it needs to be installed, and its paths on a part."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import final

import numpy as np

from benchmarks.field.planar import concentric_infill
from benchmarks.parts.streams import deposited
from benchmarks.peers import METHODS
from geoprint import job_of, plan
from geoprint.model import FloatArray, Polylines, Surface
from geoprint.surfaces.files import load
from geoprint.surfaces.remesh import refine

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
        return joined([line for line in lines if len(line) > 1])

    return Planner(paths, library=method.library)


def _projected() -> Planner:
    def paths(part: Path, spacing: float) -> Polylines:
        return joined(concentric_infill(_fine(part, spacing), spacing=spacing))

    return Planner(paths, library="shapely")


def joined(lines: list[FloatArray]) -> Polylines:
    """Return (k, 3) places of each line as one value [mm]."""
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
        "lscm, plain contours": _own(backend="lscm", middle="plain"),
        "heat, plain contours": _own(backend="heat", middle="plain"),
        "fast-marching, plain contours": _own(backend="fast-marching", middle="plain"),
        "heat, contours": _own(backend="heat"),
        "fast-marching, contours": _own(backend="fast-marching"),
        "heat, contours from the best source": _own(backend="heat", source="best"),
        "heat, spiral": _own(backend="heat", pattern="spiral"),
        "fast-marching, spiral": _own(backend="fast-marching", pattern="spiral"),
        "potpourri3d, heat method": _isolines("potpourri3d heat"),
        "potpourri3d, robust heat method": _isolines("potpourri3d robust"),
        "libigl, heat method": _isolines("libigl heat"),
        "libigl, exact distance": _isolines("libigl exact"),
        "concentric infill, projected": _projected(),
    }
)
