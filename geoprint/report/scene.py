"""The data of a 3D scene as JSON: arrays in base64, single precision, as plotly.js and page.js read them."""

from __future__ import annotations

import base64
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from geoprint.model import FloatArray, IntArray
from geoprint.report.figures import COLOUR_RANGE
from geoprint.report.markup import Json
from geoprint.report.values import BackendView, PartReport, Replay
from geoprint.report.view_surface import shading_normals

# Samples of a path that are drawn at most; between them it is straight.
MOST_SAMPLES = 30_000
# Paths are drawn this share of the part's size above its surface, so that it does not swallow them.
LIFT_SHARE = 0.002


def scene_data(part: PartReport) -> Json:
    """Return everything page.js needs to draw the part.

    All places are turned upright and counted from the middle of the part's box: then x, y and z say how large
    something is, and single precision is enough wherever the part lies in its own coordinates.

    Returns:
        `vertices` (3, n), `faces` (3, m), `backends`, `rotation` and `middle`, which lead back to the part's own
        coordinates, `spacing` [mm], and the ranges of the colour scales: the same for all backends, so that colours
        can be compared.
    """
    surface = part.surface
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    middle = 0.5 * (low + high)
    lift = LIFT_SHARE * float(np.linalg.norm(high - low))
    normals = shading_normals(surface)
    tree = KDTree(surface.vertices)

    def upright(places: FloatArray) -> FloatArray:
        return (places - middle) @ part.R_view_work.T

    def lifted(places: FloatArray) -> FloatArray:
        _, nearest = tree.query(places)
        return upright(places + lift * normals[nearest])

    return {
        "vertices": _floats(upright(surface.vertices).T),
        "faces": _integers(surface.faces.T),
        "rotation": part.R_view_work.tolist(),
        "middle": middle.tolist(),
        "spacing": part.spacing,
        "farthest": max(float(backend.distance.max()) for backend in part.backends),
        "ratios": list(COLOUR_RANGE),
        "backends": [
            {
                **_backend(backend, lifted(backend.places)),
                "replay": None if backend.replay is None else _replay(backend.replay, upright),
            }
            for backend in part.backends
        ],
    }


def _backend(backend: BackendView, places: FloatArray) -> dict[str, Json]:
    kept, offsets = _thinned(backend.offsets, step=_step(len(places)))
    return {
        "name": backend.name,
        "distance": _floats(backend.distance),
        "ratios": _floats(backend.spacing_ratios),
        "coverage": _encoded(backend.coverage.astype(np.uint8), "u1"),
        "path": _floats(_with_breaks(places[kept], offsets).T),
    }


def _replay(replay: Replay, upright: Callable[[FloatArray], FloatArray]) -> Json:
    kept, offsets = _thinned(replay.bead_offsets, step=_step(len(replay.bead)))
    times = _with_breaks(replay.bead_times[kept, None], offsets)[:, 0]
    # A break counts as laid with what is before it, so that the times can be searched.
    times[np.isnan(times)] = replay.bead_times[kept][offsets[1:-1] - 1]
    elbows = replay.tips - replay.needle * replay.axes
    return {
        "times": _floats(replay.times),
        "arm": _floats(upright(replay.joints)),
        "joints": replay.joints.shape[1],
        "elbows": _floats(upright(elbows)),
        "tips": _floats(upright(replay.tips)),
        "deposit": _encoded(replay.deposit.astype(np.uint8), "u1"),
        "bead": _floats(_with_breaks(upright(replay.bead[kept]), offsets).T),
        "beadTimes": _floats(times),
    }


def _step(count: int) -> int:
    return 1 + count // MOST_SAMPLES


def _thinned(offsets: IntArray, *, step: int) -> tuple[IntArray, IntArray]:
    """Return every step-th row of each stretch, its last one always, and the offsets of what is kept."""
    rows: IntArray = np.arange(int(offsets[-1]))
    within = rows - np.repeat(offsets[:-1], np.diff(offsets))
    kept = np.flatnonzero((within % step == 0) | np.isin(rows, offsets[1:] - 1))
    return kept, np.searchsorted(kept, offsets)


def _with_breaks(rows: FloatArray, offsets: IntArray) -> FloatArray:
    """Return the rows with one of NaN between stretches, where a line breaks off."""
    return np.insert(rows, offsets[1:-1], np.nan, axis=0)


def _floats(values: FloatArray) -> Json:
    return _encoded(values.astype("<f4"), "f4")


def _integers(values: IntArray) -> Json:
    return _encoded(values.astype("<i4"), "i4")


def _encoded(values: NDArray[np.generic], dtype: str) -> Json:
    return {"dtype": dtype, "bdata": base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")}
