"""The guide's pictures of layers: a groove and a stack cut across, a ventricle's wall, and paths that a table tilts."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from benchmarks.guide.shaded import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    draw_curves,
    draw_lines,
    draw_surface,
    panels,
    small_png,
    smaller,
    view_from,
)
from benchmarks.guide.stamps import with_figures
from geoprint.config import TILTING_CELL, job_of, packaged_cell_text
from geoprint.distance import isolines
from geoprint.geometry import face_normals, mean_normal, remesh, vertex_normals
from geoprint.geometry.files import load_file, save_ply
from geoprint.layers import level_surface
from geoprint.layers.layering import read_stack
from geoprint.layers.stack_page import sliced_pictures
from geoprint.layers.stack_thickness import finished_stack, stacked_layer
from geoprint.model import FloatArray, ScalarField, Surface
from geoprint.reporting.evenness import record_overhang
from geoprint.results import Plan
from geoprint.transforms import angles_between
from geoprint.workflow import plan
from tests.fibers.tetrahedra import Solved, solved
from tests.shared_data import SHARED_DATA

# A groove between two ridges [mm]: how long, how wide, and how deep.
LENGTH, WIDTH, DEPTH = 4.0, 24.0, 4.0
LAYERS, HEIGHT = 5, 0.6


def layers(_data: Path) -> bytes:
    """Draw layers over a groove at even distances, and what pushing it along its normals makes."""
    part = _groove()
    figure, axes = panels(2, width=8.2, height=3.3)
    for axis, title in zip(axes, ("even distance", "pushed along normals"), strict=True):
        _section(axis, part, color="black", width=1.6)
        for number in range(1, LAYERS + 1):
            over = number * HEIGHT
            level = (
                level_surface(part, height=over, edge_length=0.3, tolerance=0.005)
                if axis is axes[0]
                else _pushed(part, over)
            )
            _section(axis, level, color=BLUE if axis is axes[0] else ORANGE, width=1.0)
        axis.set_title(title, fontsize=10)
        axis.set_aspect("equal")
        axis.set_xlim(-6.5, 6.5)
        axis.set_ylim(-0.8, 8.0)
        axis.axis("off")
    return small_png(figure)


def sliced(data: Path) -> bytes:
    """Draw a stack over a patch of a heart, sliced open as in its report."""
    job = job_of(surface=data / "heart_apex_patch.ply", unit="mm", spacing=1.0, thickness=2.0, robot=False)
    stack = read_stack(job)
    layers = [stacked_layer(plan(job.model_copy(update={"layer": number}))) for number in range(1, stack.count + 1)]
    return smaller(sliced_pictures(finished_stack(job, stack, layers))[0].content, width=1000)


def _groove() -> Surface:
    """Return a strip with two round ridges and a narrow groove between them."""
    across, along = np.linspace(-WIDTH / 2.0, WIDTH / 2.0, 97), np.linspace(0.0, LENGTH, 9)
    x, y = (each.ravel() for each in np.meshgrid(across, along, indexing="ij"))
    z = DEPTH * (1.0 - np.exp(-((x / 1.6) ** 2))) - 0.05 * x**2
    cell = (np.arange(96)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate([
        np.column_stack([cell, cell + 9, cell + 10]),
        np.column_stack([cell, cell + 10, cell + 1]),
    ])  # fmt: skip
    return Surface(np.column_stack([x, y, z]), faces, "groove")


def _pushed(part: Surface, height: float) -> Surface:
    """Return a part whose vertices are pushed along their normals [mm]."""
    return Surface(part.vertices + height * vertex_normals(part), part.faces, part.name)


def _section(axis: Axes, surface: Surface, *, color: str, width: float) -> None:
    """Draw where a surface is cut across the middle of the groove."""
    curves, _ = isolines(surface, ScalarField(surface.vertices[:, 1]), levels=np.array([LENGTH / 2.0 + 1e-6]))
    for curve in range(curves.count):
        places = curves.xyz(surface, curve)
        axis.plot(places[:, 0], places[:, 2], color=color, linewidth=width)
    if color == "black":
        (places,) = (curves.xyz(surface, curve) for curve in range(curves.count))
        axis.fill_between(places[:, 0], places[:, 2], places[:, 2].min() - 1.0, color=GREY, alpha=0.4, linewidth=0)


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


class Paths(NamedTuple):
    """The paths of a layer, piece by piece, against the rule.

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
        """Return the mean of (k,) values over the length of all paths."""
        return float(np.average(values, weights=self.lengths))


def layers_through(one: Ventricle, own: Solved, folder: Path, *, height: float, spacing: float) -> Iterator[Paths]:
    """Plan the layers from the cavity to the outside of a wall, without a robot, and yield their paths.

    Args:
        one: the wall and the patch.
        own: the rule, solved by itself.
        folder: that files are written into.
        height: of a layer [mm].
        spacing: between paths [mm].
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


def _strokes(paths: Plan, one: Ventricle, own: Solved) -> Paths:
    """Return the paths of a layer against the rule."""
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
    return Paths(paths, lengths, np.degrees(wanted), found, off, inside, up.mean(axis=0))


# A human heart [Rodero2021, no. 01], and a place on the free wall of its left ventricle where that is 10 mm thick.
HEART = Ventricle(
    SHARED_DATA / "labels" / "rodero01_labels_1mm_ras.nii.gz", wall=(1, 7), cavity=11, base=(3, 5),
    at=(115.8, 69.1, 21.2), radius=12.0,
)  # fmt: skip
WALL_HEIGHT, WALL_SPACING = 1.3, 1.5


def through(_data: Path) -> bytes:
    """Draw layers through the wall of a real ventricle, whose labels are no part of this tree.

    Raises:
        RuntimeError: they are not here.
    """
    if not HEART.labels.exists():
        raise RuntimeError(f"no labels of a heart here: {HEART.labels}")
    own = solved(HEART.labels, wall=list(HEART.wall), cavity=[HEART.cavity], base=list(HEART.base))
    with tempfile.TemporaryDirectory() as folder:
        layers = list(layers_through(HEART, own, Path(folder), height=WALL_HEIGHT, spacing=WALL_SPACING))
    return through_picture(layers)


def through_picture(layers: Sequence[Paths]) -> bytes:
    """Draw the paths of the first, the middle and the last whole layer, and the helix angles of all."""
    figure, axes = panels(4, width=10.0, height=3.0)
    last = len(layers) - 2 if len(layers) > 2 else len(layers) - 1
    for axis, number, colour in zip(axes, (0, last // 2, last), (ORANGE, GREEN, BLUE), strict=False):
        paths = layers[number].paths
        view = view_from(mean_normal(layers[0].paths.workpiece.surface), up=layers[0].up)
        draw_surface(axis, paths.workpiece.surface, view)
        draw_curves(axis, paths.workpiece.surface, paths.toolpath.curves, view, colour=colour)
        # Over the middle of each, as far from it, whatever the height of its axes becomes.
        axis.text(0.5, 0.98, f"layer {number + 1}", fontsize=10, ha="center", va="top", transform=axis.transAxes)
        axis.margins(y=0.16)
    heights = [each.paths.workpiece.place.middle for each in layers if each.paths.workpiece.place is not None]
    found = np.array([each.mean(each.found) for each in layers])
    spread = [np.sqrt(each.mean((each.found - mean) ** 2)) for each, mean in zip(layers, found, strict=True)]
    axes[3].errorbar(heights, found, yerr=spread, fmt="o", color=BLUE, markersize=4, capsize=2, label="paths")
    axes[3].plot(heights, [each.mean(each.wanted) for each in layers], color=ORANGE, label="rule")
    axes[3].set_xlabel("from the cavity [mm]", fontsize=9)
    axes[3].set_ylabel("helix angle [degrees]", fontsize=9)
    axes[3].legend(fontsize=8, frameon=False)
    return small_png(figure)


# Colours of matplotlib's cycle.
CYCLE = 10


def tilted(data: Path) -> bytes:
    """Draw what overhangs while an apex stands still, and a colour for each attitude in which nothing does.

    Raises:
        ValueError: the plan has no table.
    """
    with tempfile.TemporaryDirectory() as folder:
        cell = Path(folder) / "cell.toml"
        # As high above the part as the cell of the page, which gives the same share.
        cell.write_text(packaged_cell_text(TILTING_CELL).replace("standoff_mm = 0.5", "standoff_mm = 0.3"))
        planned = plan(
            job_of(
                surface=data / "heart_apex_patch.ply", unit="mm", spacing=4.0, backend="heat", robot=False, cell=cell
            )
        )
    if planned.tilting is None:
        raise ValueError("the plan has no table")
    rows = np.flatnonzero(planned.poses.deposit)
    places, normals = planned.poses.surface_points[rows], planned.poses.normals[rows]
    view = view_from(mean_normal(planned.workpiece.surface), up=np.array([0.0, 1.0, 0.0]))
    every = np.ones(len(rows), dtype=np.bool_)
    figure, axes = panels(2, width=7.2, height=3.6)
    for axis in axes:
        draw_surface(axis, planned.workpiece.surface, view)
    over = angles_between(normals, planned.workpiece.upright[2]) > planned.workpiece.cell.critical_overhang
    cuts = np.union1d(np.flatnonzero(np.diff(over)), np.flatnonzero(np.diff(planned.poses.runs[rows]))) + 1
    for piece in np.split(np.arange(len(rows)), cuts):
        colour = ORANGE if over[piece[0]] else BLUE
        draw_lines(axes[0], (places[piece] @ view.T)[:, :2], every[piece], colour=colour, width=1.2)
    axes[0].set_title("standing still: what overhangs in orange", fontsize=10)
    for number, one in enumerate(planned.tilting.attitudes):
        for start, end in one.pieces.tolist():
            colour = f"C{number % CYCLE}"
            draw_lines(axes[1], (places[start:end] @ view.T)[:, :2], every[start:end], colour=colour, width=1.2)
    count = len(planned.tilting.attitudes)
    axes[1].set_title(f"{count} attitudes of a tilt-turn table", fontsize=10)
    return with_figures(small_png(figure), [f"{100.0 * record_overhang(planned).share:.1f}", str(count)])
