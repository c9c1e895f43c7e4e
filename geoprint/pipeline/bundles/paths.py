"""The paths of a bundle by its own tables: on its surface, and as long and as many as plan.json says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from geoprint.account.checked import Finding
from geoprint.account.records.plan import PlanRecord
from geoprint.account.records.rounding import as_json
from geoprint.export import PLAN, read_poses_table
from geoprint.model import FloatArray, PoseStream
from geoprint.surfaces import closest
from geoprint.surfaces.files import load

# What is deposited lies on the surface to this [mm]: both are written to six decimals or better, and a rounded corner
# cuts through no more than its triangles' curvature.
ON_SURFACE = 0.01
# Lengths that are summed over rows of six decimals agree to this [mm] and this share.
LENGTH_TOLERANCE, LENGTH_SHARE = 1e-3, 1e-6


def stream_of(folder: Path, told: PlanRecord) -> PoseStream:
    """Return the pose stream that a bundle's poses.csv holds; where the tool stops it does not say.

    Raises:
        VerificationError: it cannot be read.
        InputError: it is no stream of poses.
    """
    table = read_poses_table(folder / "poses.csv")
    (layer,) = told.layers
    # The paths of a layer of several lie in its middle.
    standoff = told.settings.standoff_mm - (layer.height_mm / 2.0 if is_layer(told) else 0.0)
    normals = _unit(table.normals)
    return PoseStream(
        tips=table.points + np.where(table.deposit, standoff, 0.0)[:, None] * normals,
        quaternions=_unit(table.quaternions),
        normals=normals,
        runs=table.runs,
        levels=table.levels,
        layers=table.layers,
        deposit=table.deposit,
        stops=np.zeros(table.runs.size, dtype=np.bool_),
        arcs=table.arcs,
        flow=table.flow,
        standoff=standoff,
    )


def is_layer(told: PlanRecord) -> bool:
    """Return whether a plan is of a layer over the part."""
    return as_json(told.settings).get("layer") is not None


def path_findings(folder: Path, told: PlanRecord) -> Iterator[Finding]:
    """Yield where the paths leave the surface that they were planned on, and which figures of plan.json are not theirs.

    Raises:
        VerificationError: a table cannot be read.
        InputError: surface.ply or poses.csv holds something else.
    """
    stream = stream_of(folder, told)
    laid = np.flatnonzero(stream.deposit)
    _, misses = closest(load(folder / "surface.ply", unit="mm"), stream.surface_points[laid])
    if misses.max(initial=0.0) > ON_SURFACE:
        worst = int(misses.argmax())
        yield Finding(
            "poses.csv",
            int(laid[worst]) + 2,
            f"the pose lies {misses[worst]:.3f} mm off surface.ply, allowed are {ON_SURFACE} mm",
        )
    lengths = np.linalg.norm(np.diff(stream.tips, axis=0), axis=1)
    found = {
        "runs": float(np.unique(stream.runs).size),
        "poses": float(stream.count),
        "deposit_mm": float(lengths[stream.laid].sum()),
        "travel_mm": float(lengths[~stream.laid].sum()),
    }
    for name, value in found.items():
        said = float(getattr(told.paths, name))
        if abs(value - said) > LENGTH_TOLERANCE + LENGTH_SHARE * abs(said):
            yield Finding(PLAN, 1, f"paths.{name} is {said:.10g}, by poses.csv it is {value:.10g}")


def _unit(rows: FloatArray) -> FloatArray:
    """Return rows of nine decimals at unit length again."""
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)
