"""The data of a 3D scene as JSON: arrays in base64, in so many bits as can be seen, as data.js reads them."""

from __future__ import annotations

import base64
from collections.abc import Callable
from dataclasses import fields

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray, IntArray, Surface
from geoprint.reporting.colouring import (
    Scale,
    coverage_scale,
    distance_scale,
    lean_scale,
    overhang_scale,
    spacing_scale,
    speed_scale,
)
from geoprint.reporting.figures import colour_range
from geoprint.reporting.html import Json
from geoprint.reporting.values import BackendView, Machine, PartReport, Replay, TableReplay
from geoprint.reporting.view import bead_sides, shading_normals

# Samples of a path that are drawn at most; between them it is straight.
MOST_SAMPLES = 30_000
# Paths are drawn this share of the part's size above its surface, so that it does not swallow them.
LIFT_SHARE = 0.002
# Decimals of a motion's turn and shift [-, mm]: finer than a pixel at any size of a cell.
MOTION_DECIMALS = 6
# Of 16 bits, what stands for NaN.
NOT_A_NUMBER = 65_535


def scene_data(part: PartReport) -> Json:
    """Return everything page.js needs to draw the part.

    All places are turned upright and counted from the middle of the part's box: then x, y and z say how large
    something is, and single precision is enough wherever the part lies in its own coordinates.

    Returns:
        `vertices` (3, n), `faces` (3, m), `backends`, `rotation` and `middle`, which lead back to the part's own
        coordinates, `spacing` [mm], `winner`, `machine`, and `scales` of the quantities that colour the part.
    """
    surface = part.surface
    upright, head = turned(surface, R_view_work=part.R_view_work, spacing=part.spacing)
    lift = LIFT_SHARE * float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    normals = shading_normals(surface)
    tree = KDTree(surface.vertices)

    def lifted(places: FloatArray) -> FloatArray:
        _, nearest = tree.query(places)
        return upright(places + lift * normals[nearest])

    return {
        **head,
        "winner": part.winner,
        "scales": {key: scale_data(scale) for key, scale in part_scales(part).items()},
        "overhang": None if part.critical_deg is None else numbers(_from_upright(normals, part.R_view_work)),
        "machine": None if part.machine is None else _machine(part.machine, upright, R_view_work=part.R_view_work),
        "backends": [
            {
                **_backend(backend, lifted(backend.places)),
                "half": None if backend.widths is None else _half_beads(part, backend, backend.widths),
                "replay": None
                if backend.replay is None
                else _replay(backend.replay, upright, R_view_work=part.R_view_work),
            }
            for backend in part.backends
        ],
    }


def part_scales(part: PartReport) -> dict[str, Scale]:
    """Return the scale of each quantity that a part can be coloured by, by the name of its values in the scene.

    They are the same for all backends, so that colours can be compared.
    """
    scales = {
        "spacing": spacing_scale(*colour_range([backend.ratios for backend in part.backends])),
        "coverage": coverage_scale(),
    }
    # Measured paths of others have no distance from anywhere.
    farthest = max(float(backend.distance.max()) for backend in part.backends)
    if farthest > 0.0:
        scales["distance"] = distance_scale(farthest)
    if part.critical_deg is not None:
        scales["overhang"] = overhang_scale(part.critical_deg)
    shades = [backend.shades for backend in part.backends if backend.shades is not None]
    if shades:
        scales |= {"lean": lean_scale(max(float(each.lean.max()) for each in shades)), "speed": speed_scale()}
    return scales


def scale_data(scale: Scale) -> Json:
    """Return a scale as page.js reads it."""
    return {field.name: getattr(scale, field.name) for field in fields(scale)}


def turned(
    surface: Surface, *, R_view_work: FloatArray, spacing: float
) -> tuple[Callable[[FloatArray], FloatArray], dict[str, Json]]:
    """Return what turns places upright about the middle of a surface's box, and the data of the surface."""
    middle = 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))

    def upright(places: FloatArray) -> FloatArray:
        return (places - middle) @ R_view_work.T

    return upright, {
        "vertices": numbers(upright(surface.vertices).T),
        "faces": _faces(surface),
        "rotation": R_view_work.tolist(),
        "middle": middle.tolist(),
        "spacing": spacing,
    }


def _from_upright(normals: FloatArray, R_view_work: FloatArray) -> FloatArray:
    """Return the (n,) angles of unit normals from upright [degrees]."""
    return np.degrees(np.arccos(np.clip(normals @ R_view_work[2], -1.0, 1.0)))


def _backend(backend: BackendView, places: FloatArray) -> dict[str, Json]:
    kept, offsets = thinned(backend.offsets, step=step(len(places)))
    return {
        "name": backend.name,
        "distance": numbers(backend.distance),
        "ratios": numbers(backend.spacing_ratios),
        "coverage": _encoded(backend.coverage, "u1"),
        "path": numbers(with_breaks(places[kept], offsets).T),
        "lean": None if backend.shades is None else numbers(backend.shades.lean),
        "speed": None if backend.shades is None else numbers(backend.shades.speed),
    }


def _half_beads(part: PartReport, backend: BackendView, widths: FloatArray) -> Json:
    """Return what leads from each sample of the path to the left side of its bead, with the breaks of the path."""
    left, _ = bead_sides(part.surface, backend.places, backend.offsets, width=widths)
    kept, offsets = thinned(backend.offsets, step=step(len(left)))
    return numbers(with_breaks(((left - backend.places) @ part.R_view_work.T)[kept], offsets).T)


def _machine(machine: Machine, upright: Callable[[FloatArray], FloatArray], *, R_view_work: FloatArray) -> Json:
    bodies: list[Json] = [
        {
            "kind": body.kind,
            "joint": body.joint,
            "vertices": numbers(upright(body.surface.vertices).T),
            "faces": _faces(body.surface),
        }
        for body in machine.bodies
    ]
    axes = {"points": upright(machine.points).tolist(), "directions": (machine.directions @ R_view_work.T).tolist()}
    return {**axes, "bodies": bodies}


def _replay(replay: Replay, upright: Callable[[FloatArray], FloatArray], *, R_view_work: FloatArray) -> Json:
    kept, offsets = thinned(replay.bead_offsets, step=step(len(replay.bead)))
    times = with_breaks(replay.bead_times[kept, None], offsets)[:, 0]
    # A break counts as deposited with what is before it, so that the times can be searched.
    times[np.isnan(times)] = replay.bead_times[kept][offsets[1:-1] - 1]
    return {
        "times": _encoded(replay.times, "f4"),
        "joints": _encoded(replay.joints, "f4"),
        "speeds": _encoded(replay.speeds, "f4"),
        "valve": replay.valve.round(3).tolist(),
        "lamp": replay.lamp.round(3).tolist(),
        "bead": numbers(with_breaks(upright(replay.bead[kept]), offsets).T),
        "beadTimes": _encoded(times, "f4"),
        "table": None if replay.table is None else _table(replay.table, upright, R_view_work=R_view_work),
    }


def _table(table: TableReplay, upright: Callable[[FloatArray], FloatArray], *, R_view_work: FloatArray) -> Json:
    """Return when the table moves, and the motions of part and solids frame by frame, in the view."""
    # What is shown as x stands at R.T @ x + middle in the work frame.
    middle = -R_view_work.T @ upright(np.zeros((1, 3)))[0]

    def viewed(motions: FloatArray) -> Json:
        turns = R_view_work @ motions[..., :3] @ R_view_work.T
        shifts = upright(motions[..., :3] @ middle + motions[..., 3])
        return np.concatenate([turns, shifts[..., None]], axis=-1).round(MOTION_DECIMALS).tolist()

    return {
        "turning": table.turning.round(3).tolist(),
        "times": table.times.round(3).tolist(),
        "part": viewed(table.part),
        "solids": viewed(table.solids),
    }


def step(count: int) -> int:
    """Return which of so many samples are kept: every first, second and so on."""
    return 1 + count // MOST_SAMPLES


def thinned(offsets: IntArray, *, step: int) -> tuple[IntArray, IntArray]:
    """Return every step-th row of each stretch, its last one always, and the offsets of what is kept."""
    rows: IntArray = np.arange(int(offsets[-1]))
    within = rows - np.repeat(offsets[:-1], np.diff(offsets))
    kept = np.flatnonzero((within % step == 0) | np.isin(rows, offsets[1:] - 1))
    return kept, np.searchsorted(kept, offsets)


def with_breaks(rows: FloatArray, offsets: IntArray) -> FloatArray:
    """Return the rows with one of NaN between stretches, where a line breaks off."""
    return np.insert(rows, offsets[1:-1], np.nan, axis=0)


def numbers(values: FloatArray) -> Json:
    """Return numbers in 16 bits between their lowest and highest, far finer than a pixel; the last value is NaN."""
    measured = values[~np.isnan(values)]
    low, high = (float(measured.min()), float(measured.max())) if measured.size else (0.0, 0.0)
    step = (high - low) / (NOT_A_NUMBER - 1) or 1.0
    steps = np.nan_to_num((values - low) / step, nan=NOT_A_NUMBER)
    return {**_encoded(steps.round(), "u2"), "low": low, "step": step}


def _faces(surface: Surface) -> Json:
    return _encoded(surface.faces.T, "u2" if len(surface.vertices) <= NOT_A_NUMBER else "i4")


def _encoded(values: FloatArray | IntArray, dtype: str) -> dict[str, Json]:
    return {"dtype": dtype, "bdata": base64.b64encode(values.astype(f"<{dtype}").tobytes()).decode("ascii")}
