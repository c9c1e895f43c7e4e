"""Loops that later stages need, precompiled by a process during the first run after an installation."""

from __future__ import annotations

import gc
import logging
import multiprocessing
import os
import signal
import tempfile
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from geoprint.config import job_of
from geoprint.geometry import vertex_points
from geoprint.geometry.files import save_ply
from geoprint.kernels import is_kept, keeps
from geoprint.metrics.oracle import Ask, GeodesicDistance, flat_mesh, flat_places, trace
from geoprint.metrics.oracle.tracing import connect
from geoprint.model import Surface
from geoprint.workflow.planning import plan
from geoprint.workflow.processes import end_with_parent, stopped_later

# Loops that later stages need, compiled by a process beside the first run after an installation.
#
# Compiling takes most of a first run, and a run compiles one loop after the other, each as it comes to it. So a
# process beside it begins with what comes late: the exact distances of evenness, which take longest, and then what a
# small plate needs up to its program. numba keeps what it compiled of each loop as soon as it is done and replaces
# files whole, so that the run finds it there, or compiles it itself where it comes first; what comes out is the same
# with and without.


# The stage that begins where all loops were called: what follows makes and reads files.
LAST_STAGE = "program"
# Size of the plate [mm], and triangles along each side.
SIDE, DIVISIONS = 8.0, 4
# Distance between its paths [mm].
SPACING = 2.0
# Objects between two searches for cycles while loops are compiled: some tens of megabytes.
GARBAGE = 100_000


@contextmanager
def precompiled() -> Generator[None]:
    """Compile beside the body what it will need, if nothing is kept of an earlier run, but can be, with a second core.

    The process ends with the body at the latest. Whether it did anything, or failed, makes no difference but of time.
    """
    if not keeps(connect) or is_kept(connect) or (os.cpu_count() or 1) < 2:
        yield
        return
    with tempfile.TemporaryDirectory(prefix="geoprint-") as folder:
        ahead = multiprocessing.get_context("spawn").Process(target=_quietly, args=(Path(folder),), daemon=True)
        with stopped_later():
            ahead.start()
        try:
            with _collected_seldom():
                yield
        finally:
            ahead.terminate()
            ahead.join()


def compile_later_stages(folder: Path) -> None:
    """Call the loops of the stages from evenness to the program, on a plate.

    Args:
        folder: for the file of the plate.
    """
    plate = _plate()
    _measure_across(plate)
    path = folder / "plate.ply"
    save_ply(plate, path)
    with suppress(_EnoughError):
        plan(job_of(surface=path, unit="mm", spacing=SPACING, place="demo"), observe=_until_last_stage)


@contextmanager
def _collected_seldom() -> Generator[None]:
    """Let Python look for cycles less often: numba makes many objects that stay, and each search goes through all."""
    before = gc.get_threshold()
    gc.freeze()
    gc.set_threshold(GARBAGE, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)
        gc.unfreeze()


class _EnoughError(Exception):
    """The last stage whose loops count has ended."""


def _until_last_stage(name: str) -> None:
    if name == LAST_STAGE:
        raise _EnoughError


def _measure_across(surface: Surface) -> None:
    """Ask how far the ends of a line over a surface are from it, as the measurement of evenness asks."""
    mesh = flat_mesh(surface)
    places = flat_places(mesh, vertex_points(surface, np.array([0, len(surface.vertices) - 1])))
    path = trace(mesh, places, runs=np.zeros(2, np.int64), levels=np.zeros(1, np.int64), closed=np.zeros(1, np.bool_))
    GeodesicDistance(mesh, path)(path.at(np.zeros(1, np.int64), np.zeros(1)), Ask.level(np.zeros(1, np.int64)))


def _plate() -> Surface:
    """Return a square of triangles."""
    side = np.linspace(0.0, SIDE, DIVISIONS + 1)
    x, y = (each.ravel() for each in np.meshgrid(side, side))
    first = np.arange((DIVISIONS + 1) * DIVISIONS).reshape(DIVISIONS, -1)[:, :-1].ravel()
    second, above, across = first + 1, first + DIVISIONS + 1, first + DIVISIONS + 2
    faces = np.vstack([np.column_stack([first, second, across]), np.column_stack([first, across, above])])
    return Surface(np.column_stack([x, y, np.zeros(x.size)]), faces, "plate")


def _quietly(folder: Path) -> None:
    """Compile, and let the run alone say what is to be said: it meets the same itself."""
    end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    logging.disable()
    with _collected_seldom(), suppress(Exception):
        compile_later_stages(folder)
