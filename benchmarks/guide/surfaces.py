"""The guide's pictures of parts: patches, their paths, and what is found on them."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from benchmarks.guide.shaded import (
    BLUE,
    GREY,
    ORANGE,
    draw_curves,
    draw_surface,
    panels,
    small_png,
    smaller,
    view_from,
)  # fmt: skip
from benchmarks.guide.stamps import with_figures
from geoprint.config import job_of
from geoprint.errors import percent
from geoprint.geometry import inspect, mean_normal, positions
from geoprint.geometry.files import load
from geoprint.guide import page_named
from geoprint.model import FloatArray, Surface
from geoprint.reporting import inspection_figure
from geoprint.reporting.pictures import comparison_picture
from geoprint.reporting.view import bead_sides, normals_at
from geoprint.results import Plan
from geoprint.workflow import compare, plan

TIP = [1.5, 0.0, -57.5]
SECOND = [9.0, -10.0, -54.0]
BELOW = view_from(np.array([0.35, -0.55, -0.8]), up=np.array([0.0, 0.0, 1.0]))
# Width of a drawn bead over its own: a seam between it and the next.
BEAD_SHARE = 0.72
SIDE = view_from(np.array([0.2, -0.7, -1.0]), up=np.array([0.0, 0.0, 1.0]))


def first_comparison(data: Path) -> bytes:
    """Draw what `geoprint compare` writes as compare.png."""
    job = job_of(surface=data / "heart_apex_patch.ply", unit="mm", spacing=2.0, robot=False)
    found = compare(job)
    figures = [f"{100.0 * outcome.plan.evenness.thickness.cv:.2f}" for _, outcome in found.planned]
    return with_figures(smaller(comparison_picture(found), width=820), figures)


def your_part(data: Path) -> bytes:
    """Draw a heart with a patch, and that patch covered from its rim and from a point."""
    patch = {"at": TIP, "radius": 10.0}
    job = job_of(surface=data / "heart.ply", unit="mm", spacing=1.5, robot=False, patch=patch)
    plans = [plan(job), plan(job_of(**{**dict(job), "source": {"point": TIP}}))]
    figure, axes = panels(3)
    heart = load(data / "heart.ply", unit="mm")
    _draw_body(axes[0], heart, SIDE)
    _draw_patch(axes[0], plans[0], SIDE)
    axes[0].set_title("the patch on its body", fontsize=10)
    for axis, planned, title in zip(axes[1:], plans, ("from its rim", "from a point: --from point"), strict=True):
        view = view_from(mean_normal(planned.workpiece.surface), up=np.array([0.0, 1.0, 0.0]))
        _draw_paths(axis, planned, view, colour=BLUE)
        axis.set_title(title, fontsize=10)
    return small_png(figure)


def middle(data: Path) -> bytes:
    """Draw plain contours of a plate and fitted ones, and what either leaves open."""
    figure, axes = panels(2, width=8.2, height=3.3)
    figures = list[str]()
    for axis, kind in zip(axes, ("plain", "fitted"), strict=True):
        job = job_of(surface=data / "plate.ply", unit="mm", spacing=6.0, robot=False, middle=kind)
        planned = plan(job)
        _draw_paths(axis, planned, np.eye(3), colour=BLUE)
        found = planned.uniformity
        assert found is not None
        open_places = found.judged_places[found.gaps]
        axis.plot(open_places[:, 0], open_places[:, 1], ".", markersize=1.5, color=ORANGE)
        axis.set_title(
            f"{kind}: {percent(found.gap, 1)} missed, {percent(found.overlap, 1)} covered twice", fontsize=10
        )
        figures.append(f"{100.0 * found.gap:.1f}")
    return with_figures(small_png(figure), figures)


def spiral(data: Path) -> bytes:
    """Draw the tip of a heart covered by rings, and by one stroke."""
    figure, axes = panels(2, width=7.2, height=3.6)
    for axis, pattern in zip(axes, ("contours", "spiral"), strict=True):
        job = job_of(surface=data / "heart_apex_patch.ply", unit="mm", spacing=2.0, robot=False, pattern=pattern)
        planned = plan(job)
        view = view_from(mean_normal(planned.workpiece.surface), up=np.array([0.0, 1.0, 0.0]))
        _draw_paths(axis, planned, view, colour=BLUE)
        count = planned.toolpath.curves.count
        axis.set_title(f"{pattern}: {count} {'run' if count == 1 else 'runs'}", fontsize=10)
    return small_png(figure)


def guided(data: Path) -> bytes:
    """Draw the plate covered by rows beside the page's line, to the rim and within contours."""
    block = page_named("guided-rows").blocks[0]
    line = [[float(number) for number in place.split(",")] for place in re.findall(r"-?\d+,-?\d+,0", block.text)]
    figure, axes = panels(2, width=8.2, height=3.3)
    for axis, contours in zip(axes, (0, 2), strict=True):
        job = job_of(
            surface=data / "plate.ply", unit="mm", spacing=2.0, robot=False, pattern="guided", contours=contours,
            source={"curve": line},
        )  # fmt: skip
        planned = plan(job)
        _draw_paths(axis, planned, np.eye(3), colour=BLUE)
        axis.plot(*np.array(line)[:, :2].T, "--", linewidth=1.2, color=ORANGE)
        count = planned.toolpath.curves.count
        axis.set_title(f"{contours} contours around the rows: {count} {'run' if count == 1 else 'runs'}", fontsize=10)
    return small_png(figure)


def fibres(data: Path) -> bytes:
    """Draw the apex covered by the strokes along the page's fields."""
    block = page_named("fibres").blocks[0]
    figure, axes = panels(2, width=7.2, height=3.6)
    with tempfile.TemporaryDirectory() as folder:
        for axis, line in zip(axes, re.findall(r"(?s)printf '%s\\n' (.*?) > (\w+)\.toml", block.text), strict=True):
            file = Path(folder) / f"{line[1]}.toml"
            file.write_text("\n".join(re.findall(r"'(.*?)'", line[0])))
            planned = plan(
                job_of(
                    surface=data / "heart_apex_patch.ply",
                    unit="mm",
                    spacing=1.5,
                    robot=False,
                    pattern="fibres",
                    field=file,
                )
            )
            view = view_from(mean_normal(planned.workpiece.surface), up=np.array([0.0, 1.0, 0.0]))
            _draw_paths(axis, planned, view, colour=BLUE)
            axis.set_title(f"{line[1]}: {planned.toolpath.curves.count} runs", fontsize=10)
    return small_png(figure)


def widths(data: Path) -> bytes:
    """Draw the apex covered by the strokes of the page's field files, each as wide as it is."""
    blocks = [block for block in page_named("fibre-width").blocks if block.language == "toml"]
    figure, axes = panels(len(blocks), width=7.2, height=3.6)
    with tempfile.TemporaryDirectory() as folder:
        for axis, block in zip(axes, blocks, strict=True):
            file = Path(folder) / block.word
            file.write_text(block.text)
            job = job_of(
                surface=data / "heart_apex_patch.ply", unit="mm", spacing=1.4, robot=False, pattern="fibres", field=file
            )
            planned = plan(job)
            surface, curves = planned.workpiece.surface, planned.toolpath.curves
            view = view_from(mean_normal(surface), up=np.array([0.0, 1.0, 0.0]))
            draw_surface(axis, surface, view)
            places = positions(surface, curves.points)
            sides = bead_sides(surface, places, curves.offsets, width=BEAD_SHARE * planned.toolpath.spacings)
            left, right = (side @ view.T for side in sides)
            begins = np.setdiff1d(np.arange(len(places) - 1), curves.offsets[1:-1] - 1)
            seen = np.einsum("kx,x->k", normals_at(surface, places[begins]), view[2]) > 0.05
            begins = begins[seen]
            corners = np.stack([right[begins], right[begins + 1], left[begins + 1], left[begins]], axis=1)[:, :, :2]
            axis.add_collection(PolyCollection(list(corners), facecolors=BLUE, edgecolors=BLUE, linewidths=0.4))
            axis.set_title(f"{file.name}: {curves.count} runs", fontsize=10)
    return small_png(figure)


def several_patches(data: Path) -> bytes:
    """Draw two patches of a heart from below, with their runs numbered."""
    patches = [{"at": TIP, "radius": 6.0}, {"at": SECOND, "radius": 4.0}]
    planned = plan(job_of(surface=data / "heart.ply", unit="mm", spacing=2.0, robot=False, patches=patches))
    figure, (axis,) = panels(1, width=5.6, height=3.8)
    heart = load(data / "heart.ply", unit="mm")
    _draw_body(axis, heart, BELOW)
    _draw_patch(axis, planned, BELOW)
    draw_curves(axis, planned.workpiece.surface, planned.toolpath.curves, BELOW, colour=BLUE)
    places, runs = planned.poses.surface_points, planned.poses.runs
    for run in range(planned.toolpath.curves.count):
        first = places[np.flatnonzero(planned.poses.deposit & (runs == run))[0]] @ BELOW.T
        axis.annotate(
            f"{run + 1}", (first[0], first[1]), ha="center", va="center", fontsize=8, color="white",
            bbox={"boxstyle": "circle,pad=0.2", "facecolor": ORANGE, "edgecolor": "none"},
        )  # fmt: skip
    middle = np.mean([TIP, SECOND], axis=0) @ BELOW.T
    axis.set_xlim(middle[0] - 17, middle[0] + 17)
    axis.set_ylim(middle[1] - 11, middle[1] + 13)
    return small_png(figure)


def own_backend(data: Path) -> bytes:
    """Draw level curves of the page's own backend beside those of heat."""
    job = job_of(surface=data / "heart_apex_patch.ply", unit="mm", spacing=2.0, robot=False)
    found = dict(compare(job, backends=["straight-line", "heat"]).planned)
    figure, axes = panels(2, width=6.4)
    for axis, (name, outcome), colour in zip(axes, found.items(), (ORANGE, BLUE), strict=True):
        view = outcome.plan.workpiece.upright
        _draw_paths(axis, outcome.plan, view, colour=colour)
        axis.set_title(name, fontsize=10)
    return small_png(figure)


def refused(data: Path) -> bytes:
    """Draw what `geoprint inspect --picture` shows of a part with a hole."""
    part = load(data / "heart_flat_patch.ply", unit="mm")
    middles = part.vertices[part.faces].mean(axis=1)
    away = np.linalg.norm(middles - middles[np.argmin(np.linalg.norm(middles - middles.mean(axis=0), axis=1))], axis=1)
    torn = Surface(part.vertices, part.faces[away > 3.0], "torn.ply")
    return smaller(inspection_figure(inspect(torn), title="torn.ply"), width=800)


def words(data: Path) -> bytes:
    """Draw contours on a plate, and name what is to be seen."""
    planned = plan(job_of(surface=data / "plate.ply", unit="mm", spacing=4.0, robot=False, backend="fast-marching"))
    figure, (axis,) = panels(1, width=6.6, height=4.2)
    top = np.eye(3)
    draw_surface(axis, planned.workpiece.surface, top)
    draw_curves(axis, planned.workpiece.surface, planned.toolpath.curves, top, colour=BLUE, width=4.0)
    axis.plot([-20, 20, 20, -20, -20], [-15, -15, 15, 15, -15], color=GREY, linewidth=1.6)
    axis.plot([-20, -5, 5, 20], [-15, 0, 0, 15], color=ORANGE, linewidth=1.2, linestyle="--")
    axis.plot([-20, -5, 5, 20], [15, 0, 0, -15], color=ORANGE, linewidth=1.2, linestyle="--")
    axis.annotate(
        "", (-9.0, 9.0), (-9.0, 13.0), arrowprops={"arrowstyle": "<->", "color": "black", "shrinkA": 0, "shrinkB": 0}
    )
    _name(axis, "spacing (stepover)", (-9.0, 11.0), (-25.0, 19.5))
    _name(axis, "rim: the source", (12.0, 15.0), (16.0, 19.5))
    _name(axis, "where fronts meet\n(medial axis)", (13.0, -8.0), (27.0, -4.0))
    _name(axis, "a run of level 0;\nits material is a bead", (2.0, -13.0), (14.0, -20.5))
    _name(axis, "level 1", (-14.0, 3.0), (-27.0, 3.0))
    axis.set_xlim(-34, 38)
    axis.set_ylim(-23, 22)
    return small_png(figure)


def _draw_body(axis: Axes, body: Surface, view: FloatArray) -> None:
    draw_surface(axis, body, view, colours=np.tile(to_rgb("#d8b4ac"), (len(body.faces), 1)))


def _draw_patch(axis: Axes, planned: Plan, view: FloatArray) -> None:
    part = planned.workpiece.surface
    draw_surface(axis, part, view, colours=np.tile(to_rgb("#ffc20a"), (len(part.faces), 1)))


def _draw_paths(axis: Axes, planned: Plan, view: FloatArray, *, colour: str) -> None:
    draw_surface(axis, planned.workpiece.surface, view)
    draw_curves(axis, planned.workpiece.surface, planned.toolpath.curves, view, colour=colour)


def _name(axis: Axes, text: str, place: tuple[float, float], beside: tuple[float, float]) -> None:
    axis.annotate(
        text, place, beside, fontsize=9, ha="center", va="center",
        arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.9},
    )  # fmt: skip
