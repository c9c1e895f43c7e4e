"""Layers through a ventricle's wall from its cavity outwards, as a person plans them, and their strokes by the rule."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geoprint.config import job_of, packaged_cell_text
from geoprint.model import FloatArray
from geoprint.pipeline import plan
from geoprint.pipeline.workpiece import read_stack
from geoprint.results import Plan
from geoprint.surfaces import face_normals
from geoprint.surfaces.files import load_file, save_ply
from geoprint.surfaces.remesh import remesh
from tests.fields.tetrahedra import Solved

# Edges of cavity and wall as meshes [mm]: those of their voxels.
EDGES = 1.0


class Ventricle(NamedTuple):
    """A wall in a label volume, and a patch of its cavity.

    Attributes:
        labels: the volume.
        wall: labels of the wall, that of the part of it over the patch first.
        cavity: that of the cavity.
        base: those beyond its base.
        at: middle of the patch [mm].
        radius: of the patch [mm].
        epicardial: helix angle outside [degrees].
        endocardial: that at the cavity.
    """

    labels: Path
    wall: tuple[int, ...]
    cavity: int
    base: tuple[int, ...]
    at: tuple[float, ...]
    radius: float
    epicardial: float = -60.0
    endocardial: float = 60.0


class Strokes(NamedTuple):
    """The strokes of a layer, piece by piece, against the rule.

    Attributes:
        paths: the plan of the layer.
        lengths: (k,) of pieces [mm].
        wanted: (k,) helix angle by the rule [degrees].
        found: (k,) that of the stroke.
        off: (k,) angle between the stroke and the rule's line [degrees].
        within: (k,) the same of what of the rule's line lies within the layer.
        up: (3,) the mean direction from apex to base.
    """

    paths: Plan
    lengths: FloatArray
    wanted: FloatArray
    found: FloatArray
    off: FloatArray
    within: FloatArray
    up: FloatArray

    def mean(self, values: FloatArray) -> float:
        """Return the mean of (k,) values over the length of all strokes."""
        return float(np.average(values, weights=self.lengths))


def layers_through(one: Ventricle, own: Solved, folder: Path, *, height: float, spacing: float) -> Iterator[Strokes]:
    """Plan the layers from the cavity to the outside of a wall, without a robot, and yield their strokes.

    Args:
        one: the wall and the patch.
        own: the rule, solved by itself.
        folder: that files are written into.
        height: of a layer [mm].
        spacing: between strokes [mm].
    """
    for name, label in (("cavity", one.cavity), ("wall", one.wall[0])):
        save_ply(
            remesh(load_file(one.labels, unit="mm", label=label).surface, edge_length=EDGES), folder / f"{name}.ply"
        )
    cell = packaged_cell_text("irb120-bent45")
    for key in ("layer_height_mm", "standoff_mm"):
        cell = re.sub(rf"(?m)^{key} = .*", f"{key} = {height}", cell)
    (folder / "cell.toml").write_text(cell, encoding="utf-8")
    (folder / "field.toml").write_text(
        f'[wall]\nvolume = "{one.labels.resolve()}"\nlabels = {list(one.wall)}\ncavity = [{one.cavity}]\n'
        f"base = {list(one.base)}\nepicardial_deg = {one.epicardial}\nendocardial_deg = {one.endocardial}\n",
        encoding="utf-8",
    )
    job = job_of(
        surface=folder / "cavity.ply", unit="mm", patches=[{"at": list(one.at), "radius": one.radius}], spacing=spacing,
        target=folder / "wall.ply", cell=folder / "cell.toml", pattern="fibres", field=folder / "field.toml",
        robot=False,
    )  # fmt: skip
    for number in range(1, read_stack(job).count + 1):
        yield _strokes(plan(job.model_copy(update={"layer": number})), one, own)


def _strokes(paths: Plan, one: Ventricle, own: Solved) -> Strokes:
    """Return the strokes of a layer against the rule."""
    surface, curves = paths.workpiece.surface, paths.toolpath.curves
    places = curves.points.xyz(surface)
    starts = np.setdiff1d(np.arange(len(places)), curves.offsets[1:] - 1)
    steps, middles = places[starts + 1] - places[starts], (places[starts + 1] + places[starts]) / 2.0
    lengths: FloatArray = np.linalg.norm(steps, axis=1)
    kept = lengths > 0.0
    steps, middles, lengths = steps[kept] / lengths[kept, None], middles[kept], lengths[kept]
    line, wanted = own.fibres(
        middles, epicardial=np.radians(one.epicardial), endocardial=np.radians(one.endocardial)
    )  # fmt: skip
    _, around, up = own.frames(middles)
    right, high = (np.einsum("kx,kx->k", steps, axis) for axis in (around, up))
    upright = face_normals(surface)[curves.points.faces[starts[kept]]]
    within = line - np.einsum("kx,kx->k", line, upright)[:, None] * upright
    within /= np.linalg.norm(within, axis=1)[:, None]
    off, inside = (
        np.degrees(np.arccos(np.clip(np.abs(np.einsum("kx,kx->k", steps, each)), 0.0, 1.0))) for each in (line, within)
    )
    found = np.degrees(np.arctan(high / np.where(right == 0.0, np.finfo(np.float64).tiny, right)))
    return Strokes(paths, lengths, np.degrees(wanted), found, off, inside, up.mean(axis=0))
