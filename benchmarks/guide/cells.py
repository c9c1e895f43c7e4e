"""The guide's pictures of the cell: arm, calibration, needles, a program in time, its proof, and measured toolpaths."""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon, Rectangle

from benchmarks.guide.shaded import BLUE, GREEN, GREY, ORANGE, PART, bare, panels, small_png, smaller
from benchmarks.guide.stamps import with_figures
from geoprint.config import UR_CELL, job_of, load_cell
from geoprint.guide import page_named
from geoprint.model import Cell, FloatArray, TouchedPoints
from geoprint.reporting.evidence import WORDS
from geoprint.reporting.figures import png_bytes
from geoprint.results import RobotPlan
from geoprint.robot.arm import Arm
from geoprint.robot.collision import tool_solids
from geoprint.robot.collision.tool_solids import Solid, link_solids
from geoprint.robot.placing import calibrate_fixture, position_uncertainty
from geoprint.transforms import apply, inverse
from geoprint.workflow import measure_files, plan, save_plan

# The points of the page on calibration [mm].
CORNERS = np.array([[-50.0, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]])
TOUCHED = np.array([[250.1, 50, 0], [350, 50.1, 0], [350, -50, 0.1], [250, -50, 0]])
# Residuals are drawn so many times as long.
ENLARGED = 150


def your_cell(_data: Path) -> bytes:
    """Draw the packaged cell from its side: arm at home, tool, table and where `--place demo` puts a part."""
    cell = load_cell(None)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    frames = arm.link_poses(cell.robot.home[None])[0]
    figure, (axis,) = panels(1, width=6.6, height=4.4)
    for box in cell.obstacles:
        low = box.centre - box.size / 2
        axis.add_patch(Rectangle((low[0], low[2]), box.size[0], box.size[2], color="#b9a88f"))
        axis.annotate(box.name, (low[0] + box.size[0] - 60, low[2] - 34), fontsize=9)
    for link, pose in zip(link_solids(cell.robot.model), frames, strict=False):
        for solid in link.solids:
            _draw_solid(axis, solid, pose, colour="#e8a33d")
    for solid in tool_solids(cell.tool):
        _draw_solid(axis, solid, frames[-1], colour=GREY)
    x, z = float(np.hypot(*cell.demo_position[:2])), float(cell.demo_position[2])
    axis.add_patch(Polygon([[x - 20, z - 4], [x + 20, z - 4], [x + 12, z + 4], [x - 12, z + 4]], color=BLUE))
    _note(axis, "part, with --place demo", (x, z - 4), (x + 20, z - 34))
    tip = frames[-1][:3, 3]
    _note(axis, "tip of the nozzle, at home", (tip[0], tip[2]), (tip[0] + 150, tip[2] + 60))
    _note(axis, "base frame", (0, 0), (-60, -52))
    bare(axis)
    return small_png(figure)


def another_arm(_data: Path) -> bytes:
    """Draw the packaged cell with a UR5e from its side: the cylinders of its links at home, and its joints."""
    cell = load_cell(UR_CELL)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    frames = arm.link_poses(cell.robot.home[None])[0]
    figure, (axis,) = panels(1, width=6.6, height=4.6)
    for link, pose in zip(link_solids(cell.robot.model), frames, strict=False):
        for solid in link.solids:
            _draw_solid(axis, solid, pose, colour="#9cc7e4")
    for solid in tool_solids(cell.tool):
        _draw_solid(axis, solid, frames[-1], colour=GREY)
    (table,) = cell.obstacles
    low = table.centre - table.size / 2
    axis.add_patch(Rectangle((low[0], low[2]), table.size[0], table.size[2], color="#b9a88f"))
    x, _, z = cell.demo_position.tolist()
    axis.add_patch(Polygon([[x - 20, z - 4], [x + 20, z - 4], [x + 12, z + 4], [x - 12, z + 4]], color=BLUE))
    _note(axis, "part, with --place demo", (x, z - 4), (x - 90, z - 70))
    for joint, (right, up) in enumerate(((70, -10), (90, 0), (20, 60), (60, 40), (-170, 50), (-150, -10)), start=1):
        place = frames[joint][:3, 3]
        _note(axis, f"joint {joint}", (place[0], place[2]), (place[0] + right, place[2] + up))
    bare(axis)
    return small_png(figure)


def calibrate(_data: Path) -> bytes:
    """Draw touched points with their residuals, and how well a place is known over the fixture."""
    found = calibrate_fixture(TouchedPoints(model=CORNERS, touched=TOUCHED, T_fixture_work=None))
    T_base_fixture = found.placement.T_base_fixture
    across = np.linspace(-70.0, 70.0, 57)
    known = np.array([
        [position_uncertainty(found, apply(T_base_fixture, np.array([[x, y, 0.0]]))).deviation for x in across]
        for y in across
    ])  # fmt: skip
    figure, (axis,) = panels(1, width=5.8, height=4.2)
    levels = axis.contourf(across, across, known, levels=9, cmap="cividis")
    figure.colorbar(levels, label="standard deviation of a place there [mm]")
    residuals = apply(inverse(T_base_fixture), TOUCHED) - CORNERS
    axis.quiver(
        *CORNERS[:, :2].T, *residuals[:, :2].T * ENLARGED, angles="xy", scale_units="xy", scale=1, color=ORANGE,
        width=0.008,
    )  # fmt: skip
    axis.plot(*CORNERS[:, :2].T, "o", color="white", markeredgecolor="black", markersize=8)
    for name, (x, y, _) in zip("abcd", CORNERS, strict=True):
        axis.annotate(name, (x, y), xytext=(7, 5), textcoords="offset points", color="white", fontsize=11)
    axis.add_patch(Rectangle((-20, -15), 40, 30, fill=False, edgecolor="white", linewidth=1.6))
    axis.annotate("part", (0, 0), color="white", ha="center", va="center", fontsize=10)
    axis.set_aspect("equal")
    axis.set_xlabel(f"x of the fixture [mm]; arrows: residuals, {ENLARGED} times as long", fontsize=9)
    axis.set_ylabel("y [mm]", fontsize=9)
    return with_figures(small_png(figure), [f"{ENLARGED}"])


def fine_lines(_data: Path) -> bytes:
    """Draw lines 0.4 mm apart in section, below two needles, to scale."""
    figure, axes = panels(2, width=7.2, height=3.2)
    apart = 0.4
    needles = (("the needle that comes along", 0.91, 0.6, 0.5, 0.3), ("a fine needle", 0.52, 0.26, 0.2, 0.25))
    for axis, (title, outer, inner, layer, standoff) in zip(axes, needles, strict=True):
        for left in np.arange(-4.0 * apart, 0.01, apart):
            axis.add_patch(Rectangle((left - apart / 2.0, 0.0), apart, layer, facecolor="#9cc7e4", edgecolor=BLUE))
        for side in (-1.0, 1.0):
            wall = min(side * inner, side * outer) / 2
            axis.add_patch(Rectangle((wall, standoff), (outer - inner) / 2, 1.2, facecolor=GREY))
        axis.add_patch(Rectangle((-2.1, -0.15), 3.3, 0.15, facecolor=PART))
        axis.axhline(layer, color=ORANGE, linewidth=0.8, linestyle="--")
        below = "it ploughs through its neighbours" if standoff < layer else "it passes over its neighbours"
        heights = f"layer {layer:g}, stand-off {standoff:g} mm"
        axis.set_title(f"{title}: {outer:g} mm wide\n{heights}:\n{below}", fontsize=9, loc="left")
        axis.set_xlim(-2.1, 1.2)
        axis.set_ylim(-0.2, 1.4)
        axis.set_aspect("equal")
        axis.axis("off")
    return with_figures(small_png(figure), [f"{apart:g}", *(f"{outer:g}" for _, outer, *_ in needles)])


def controller(data: Path) -> bytes:
    """Draw the speed of the tip along a program, and when valve and lamp are open."""
    robot, cell = _program(data)
    times, joints = robot.trajectory.times, robot.trajectory.joints
    tips = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool).tool_poses(joints[::10])[:, :3, 3]
    speeds = np.linalg.norm(np.diff(tips, axis=0), axis=1) / np.diff(times[::10])
    figure, (axis,) = panels(1, height=2.9)
    axis.plot(times[::10][1:], np.minimum(speeds, 200.0), color=BLUE, linewidth=1.3)
    axis.set_ylim(-42, 130)
    axis.set_yticks([-32, -14, 0, 20, 60, 120], ["lamp on", "valve open", "0", "20", "60", "120"])
    axis.set_ylabel("tip [mm/s]", fontsize=9)
    axis.set_xlabel("time [s]", fontsize=9)
    for spans, height, colour in ((robot.switching.material, -14, ORANGE), (robot.switching.lamp, -32, GREEN)):
        axis.broken_barh([(first, last - first) for first, last in spans.tolist()], (height - 6, 12), color=colour)
    return small_png(figure)


def checked(data: Path) -> bytes:
    """Draw how near each joint comes to its limit of speed or acceleration, along a program."""
    robot, cell = _program(data)
    times, joints = robot.trajectory.times, robot.trajectory.joints
    speeds = np.gradient(joints, times, axis=0)
    accelerations = np.gradient(speeds, times, axis=0)
    shares = np.maximum(np.abs(speeds) / cell.robot.speeds, np.abs(accelerations) / cell.robot.accelerations)
    figure, (axis,) = panels(1, height=2.9)
    for joint in range(shares.shape[1]):
        axis.plot(times, shares[:, joint], linewidth=1.0, label=f"joint {joint + 1}")
    axis.axhline(1.0, color=ORANGE, linewidth=1.4, linestyle="--")
    axis.annotate("limit", (times[-1], 1.0), xytext=(-4, -12), textcoords="offset points", ha="right", fontsize=9)
    axis.set_ylim(0, 1.1)
    axis.set_ylabel("speed or acceleration,\nover its limit", fontsize=9)
    axis.set_xlabel("time [s]", fontsize=9)
    figure.legend(loc="outside right center", fontsize=8, frameon=False)
    return small_png(figure)


@cache
def _program(data: Path) -> tuple[RobotPlan, Cell]:
    planned = plan(job_of(surface=data / "plate.ply", unit="mm", spacing=5.0, place="demo"))
    assert planned.workpiece.cell is not None
    return planned.robot[0], planned.workpiece.cell


def _draw_solid(axis: Axes, solid: Solid, pose: FloatArray, *, colour: str) -> None:
    """Draw a cylinder or cone as seen along the y axis of the base: the hull of its two circles."""
    from scipy.spatial import ConvexHull

    angles = np.linspace(0.0, 2.0 * np.pi, 40)
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    rings = [
        middle + radius * circle @ solid.frame.T
        for middle, radius in ((solid.start, solid.start_radius), (solid.end, solid.end_radius))
    ]
    places = apply(pose, np.vstack(rings))[:, [0, 2]]
    hull = places[ConvexHull(places).vertices]
    axis.add_patch(Polygon(hull, facecolor=colour, edgecolor="#5c4a2a", linewidth=0.6, alpha=0.92))


def _note(axis: Axes, text: str, place: tuple[float, float], beside: tuple[float, float]) -> None:
    axis.annotate(
        text, place, beside, fontsize=9, va="center", arrowprops={"arrowstyle": "-", "color": "black", "linewidth": 0.8}
    )


# Each step stands so much higher than the one before, and is so wide.
RISE, WIDTH = 0.55, 1.9


def again(_data: Path) -> bytes:
    """Draw the steps from a program that was read back to one that printed, and who says so."""
    figure, (axis,) = panels(1, width=7.6, height=3.6)
    steps = [("parsed", BLUE), ("executed", BLUE), *((word, ORANGE) for word in WORDS.values())]
    for number, (word, colour) in enumerate(steps):
        left, top = number * WIDTH, (number + 1) * RISE
        axis.add_patch(Rectangle((left, 0.0), WIDTH - 0.06, top, color=colour, alpha=0.35 + 0.1 * number))
        axis.annotate(
            word.replace(" on a ", "\non a ").replace("virtual ", "virtual\n"), (left + WIDTH / 2, top + 0.08),
            ha="center", va="bottom", fontsize=9,
        )  # fmt: skip
    for text, first, last in (("geoprint itself", 0, 2), ("a person who saw it", 2, len(steps))):
        axis.annotate(text, ((first + last) / 2 * WIDTH, -0.3), ha="center", va="center", fontsize=10)
        axis.plot([first * WIDTH + 0.1, last * WIDTH - 0.16], [-0.12, -0.12], color=GREY, linewidth=1.5)
    axis.set_xlim(-0.1, len(steps) * WIDTH + 0.1)
    axis.set_ylim(-0.5, len(steps) * RISE + 0.3)
    bare(axis)
    axis.set_aspect("auto")
    return small_png(figure)


def measured(data: Path) -> bytes:
    """Draw what the page measures: contours of a plate beside its rows."""
    (rows,) = (block.text for block in page_named("measure").blocks if block.word == "rows.csv")
    job = job_of(surface=data / "plate.ply", unit="mm", spacing=5.0, backend="fast-marching", robot=False)
    with tempfile.TemporaryDirectory() as folder:
        save_plan(plan(job), Path(folder) / "ours")
        (Path(folder) / "rows.csv").write_text(rows, encoding="utf-8")
        found = measure_files(job, [Path(folder) / "ours", Path(folder) / "rows.csv"])
    figures = [f"{100.0 * each.measured.thickness.cv:.2f}" for each in found.files]
    return with_figures(smaller(png_bytes(found.figure()), width=800), figures)
