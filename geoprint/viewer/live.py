"""The live view: a page in a browser or notebook with the scene, a panel of controls, and what a picked point is."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from html import escape
from typing import TYPE_CHECKING, Any, Final, NamedTuple, final

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import UsageError
from geoprint.model import FloatArray
from geoprint.reporting.metrics import CATALOGUE
from geoprint.robot.arm import tilts
from geoprint.viewer.loaded import Viewed, ViewedPlan
from geoprint.viewer.page import (
    PORT,
    TIME_FIELD,
    light,
    look,
    on_ray,
    open_panel,
    plot_html,
    plots_of,
    scale_html,
    served,
    table_html,
)
from geoprint.viewer.scene import PlanScene, quantities, scale_of

if TYPE_CHECKING:
    import viser
from contextlib import closing
from pathlib import Path

from geoprint.reporting.notebook import NotebookView
from geoprint.viewer.loaded import load_viewed

# Frames a second at most, and how many times as fast as in the cell.
FRAMES: Final = 30.0
# While it plays the panel follows so often [s]: a browser takes longer for it than for the scene.
PANEL_PERIOD: Final = 0.25
SPEEDS: Final = ("0.2", "1", "5", "20", "50")
# A step of the replay [s].
STEP: Final = 0.1
# Plans stand so far apart, over their size.
APART: Final = 1.25
PLAIN: Final = "Plain"
PICK: Final = "Click the part: run, level, thickness, normal, lean, joints and the line of the program."


class _Place(NamedTuple):
    """A place worth a look, in a plan, with the time when the arm is there [s]."""

    words: str
    plan: int
    time: float


@final
class LiveView:
    """Shows what a folder holds on a page until it is closed.

    Args:
        viewed: what is shown.
        server: of the page, which holds nothing else.
        back: shows what was on the page before, where there is a way back.

    Attributes:
        server: of the page.
        scenes: one a plan.
    """

    def __init__(self, viewed: Viewed, server: viser.ViserServer, *, back: Callable[[], None] | None = None) -> None:
        self.server, self._back = server, back
        self.viewed = viewed
        self._lock = threading.RLock()
        self._moment = 0.0
        server, plans = self.server, viewed.plans
        size = float(np.linalg.norm(np.ptp(plans[0].surface.vertices, axis=0)))
        across = plans[0].upright[0]
        middle = 0.5 * (plans[0].surface.vertices.min(axis=0) + plans[0].surface.vertices.max(axis=0))
        gap = 0.0 if viewed.kind == "stack" else APART * size
        shifts = gap * (np.arange(len(plans)) - (len(plans) - 1) / 2.0)
        with server.atomic():
            light(server, plans[0].upright)
            self.scenes = [
                PlanScene(server, plan, offset=shift * across, named=viewed.kind == "comparison")
                for plan, shift in zip(plans, shifts, strict=True)
            ]
            width = size + float(np.ptp(shifts))
            look(server, middle, plans[0].upright, distance=0.62 * width)
            self._build()
        for scene in self.scenes:
            scene.colour(None, "")
        self._shown()
        self._at(0.0)
        self._closed, self._finished = threading.Event(), threading.Event()
        self._failure: Exception | None = None
        # What takes longer than opening the page comes when it is there.
        self._threads = [threading.Thread(target=work, daemon=True) for work in (self._play, self._finish)]
        for thread in self._threads:
            thread.start()

    def wait(self) -> None:
        """Return once it was closed by another thread; Ctrl-C ends the waiting."""
        self._closed.wait()

    def complete(self) -> None:
        """Return once all is shown that comes after the page has opened: colours, plots, lines of the program.

        Raises:
            GeoprintError: what prevents it.
        """
        self._finished.wait()
        if self._failure is not None:
            raise self._failure

    def close(self) -> None:
        """End the replay; the page stays."""
        self._closed.set()
        for thread in self._threads:
            thread.join()

    def go_to_line(self, line: int) -> None:
        """Show the moment at which the arm makes the move at a line of the program.

        Raises:
            UsageError: there is no program, or no move stands there or behind it.
        """
        plan = self._active.plan
        for number, motion in enumerate(plan.motions):
            target = motion.target_of(line)
            if target is not None:
                self._set(plan.moment(number, float(motion.orders.times[target])))
                return
        raise UsageError(f"`--line {line}`: no move of the program stands there or behind it.")

    def show_moment(self, moment: float) -> None:
        """Show arm and deposited material as they are at a moment [s]."""
        self._set(moment)

    @property
    def moment(self) -> float:
        """The moment that is shown [s]."""
        return self._moment

    @property
    def picked(self) -> str:
        """What is said of the point that was picked last, as Markdown."""
        return self._picked.content

    def play(self) -> None:
        """Replay from the moment that is shown."""
        self._press("Play")

    def show_robot(self) -> None:
        """Show the robot."""
        self._robot.value = True
        self._shown()

    @property
    def _active(self) -> PlanScene:
        return self.scenes[[scene.plan.name for scene in self.scenes].index(self._plan.value)]

    @property
    def end(self) -> float:
        """How long the print that is shown takes [s]; 0 without a robot."""
        moving = self._active.plan.moving
        return 0.0 if moving is None else moving.end

    def _build(self) -> None:
        gui, plans = self.server.gui, self.viewed.plans
        open_panel(self.server, self.viewed.name)
        if self._back is not None:
            back = self._back
            gui.add_button("Back to drawing", color="gray").on_click(lambda _: back())
        names = tuple(plan.name for plan in plans)
        self._plan = gui.add_dropdown("Plan", names, visible=len(names) > 1)
        self._figures = gui.add_html("")
        with gui.add_folder("Show"):
            named = {**quantities(plans[0]), PLAIN: ""}
            self._colours = gui.add_dropdown("Colour", tuple(named))
            self._keys = named
            self._scale = gui.add_html("")
            self._paths = gui.add_checkbox("Paths", initial_value=True)
            self._travel = gui.add_checkbox("Travel", initial_value=False)
            self._robot = gui.add_checkbox("Robot", initial_value=False, visible=bool(plans[0].motions))
            self._layer = gui.add_slider(
                "Layers", 1, max(len(plans), 2), 1, len(plans), visible=self.viewed.kind == "stack"
            )
        attitudes = tuple(str(number) for number in range(1, len(plans[0].motions) + 1)) or ("1",)
        with gui.add_folder("Replay", visible=bool(plans[0].motions)):
            self._attitude = gui.add_dropdown("Attitude", attitudes, visible=len(attitudes) > 1)
            self._buttons = gui.add_button_group("", ("Play", "Pause", "Back", "Step"))
            self._slider = gui.add_slider("Moment [%]", 0.0, 100.0, 0.1, 0.0)
            self._time = gui.add_number(TIME_FIELD, 0.0, min=0.0, step=0.001)
            self._speed = gui.add_dropdown("Times as fast", SPEEDS, initial_value="5")
            self._words = gui.add_html("")
            self._line = gui.add_number("Line of the program", 0, min=0, step=1)
        self._places = _places(self.viewed)
        with gui.add_folder("Worst places", visible=bool(self._places)):
            for place in self._places:
                gui.add_button(place.words, color="gray").on_click(lambda _, place=place: self._jump(place))
        with gui.add_folder("Point"):
            self._picked = gui.add_markdown(PICK)
        with gui.add_folder("Plots", visible=bool(plans[0].motions)):
            self._plots = [gui.add_html("") for _ in range(3)]
        self._is_playing = False
        self._listen()
        self._said()

    def _listen(self) -> None:
        def on(handle: viser.GuiInputHandle[Any], call: Callable[[], None]) -> None:
            handle.on_update(lambda event: call() if event.client is not None or handle is self._time else None)

        on(self._plan, lambda: self._choose(self._plan.value))
        on(self._colours, lambda: self._colour(self._colours.value))
        for each in (self._paths, self._travel, self._robot, self._layer):
            on(each, self._shown)
        on(self._attitude, lambda: self.show_attitude(int(self._attitude.value)))
        on(self._slider, lambda: self._set(self._slider.value / 100.0 * self.end))
        on(self._time, lambda: self._at(self._time.value))
        on(self._line, self._find_line)
        self._buttons.on_click(lambda _: self._press(self._buttons.value))
        on_ray(self.server, self.pick)

    def _set(self, moment: float) -> None:
        self._time.value = round(float(np.clip(moment, 0.0, self.end)), 3)

    def _press(self, button: str) -> None:
        self._is_playing = button == "Play"
        if button == "Play" and self._moment >= self.end - STEP:
            self._set(0.0)
        if button in {"Back", "Step"}:
            self._set(self._moment + (STEP if button == "Step" else -STEP))

    def _play(self) -> None:
        """Move on in time while it plays; frames that take longer than their time are left out."""
        before, said = time.monotonic(), 0.0
        while not self._closed.wait(1.0 / FRAMES):
            now = time.monotonic()
            if self._is_playing:
                moment = min(self._moment + (now - before) * float(self._speed.value), self.end)
                if moment >= self.end or now - said > PANEL_PERIOD:
                    self._set(moment)
                    said = now
                else:
                    self._move(moment)
                self._is_playing = moment < self.end
            before = now

    def _at(self, moment: float) -> None:
        """Show a moment in the scene and in words."""
        if self._active.plan.moving is None:
            return
        self._move(moment)
        with self._lock, self.server.atomic():
            share = 100.0 * moment / self.end
            if abs(self._slider.value - share) > 0.05:
                self._slider.value = float(np.clip(share, 0.0, 100.0))
            self._words.content = _moment_html(self._active.plan, moment)

    def _move(self, moment: float) -> None:
        """Show a moment in the scene alone."""
        with self._lock, self.server.atomic():
            self._moment = moment
            self._active.move(moment)

    def _choose(self, name: str) -> None:
        """Make a plan the one that figures, robot, replay and plots are of."""
        self._plan.value = name
        self._said()
        self._shown()
        self._plotted()

    def show_attitude(self, number: int) -> None:
        """Show the moment at which the arm begins in an attitude of a table, from 1."""
        self._attitude.value = str(number)
        self._set(self._active.plan.moment(min(number, len(self._active.plan.motions)) - 1, 0.0))

    def _shown(self) -> None:
        """Show what is ticked; the robot only of the plan that is chosen, for they would stand in one another."""
        for number, scene in enumerate(self.scenes, start=1):
            there = self.viewed.kind != "stack" or number <= self._layer.value
            robot = self._robot.value and scene is self._active
            scene.show(all_of_it=there, paths=self._paths.value, travel=self._travel.value, robot=robot)

    def _colour(self, name: str) -> None:
        key = self._keys[name]
        scale = scale_of(self.scenes, key) if key else None
        for scene in self.scenes:
            scene.colour(scale, key)
        self._scale.content = "" if scale is None else scale_html(scale)

    def _said(self) -> None:
        plan = self._active.plan
        measured, rows = plan.record.uniformity, list[tuple[str, str]]()
        if measured is not None:
            rows += [(metric.label, metric.text(measured)) for metric in CATALOGUE if metric.decides]
        if plan.record.robot:
            seconds = sum(robot.motion.duration_s for robot in plan.record.robot)
            rows += [("print time", f"{seconds:.0f} s"), ("speed", f"{plan.record.settings.speed_mm_s:g} mm/s")]
        rows += [("runs", str(plan.record.paths.runs)), ("spacing", f"{plan.spacing:g} mm")]
        self._figures.content = table_html(rows)

    def _jump(self, place: _Place) -> None:
        self._choose(self.scenes[place.plan].plan.name)
        self._set(place.time)

    def _find_line(self) -> None:
        try:
            self.go_to_line(int(self._line.value))
        except UsageError as error:
            self._picked.content = str(error)

    def pick(self, start: FloatArray, direction: FloatArray) -> None:
        """Say what a ray meets first of the parts, and show the moment when the arm is there.

        Args:
            start: (3,) of the ray [mm].
            direction: (3,) of the ray.
        """
        for scene in self.scenes:
            place = scene.hit(start, direction, time=self._moment)
            if place is None:
                continue
            self._choose(scene.plan.name)
            self._picked.content = point_text(scene, place)
            scene.mark(place)
            number, pose = nearest_pose(scene.plan, place)
            if scene.plan.motions:
                self._set(scene.plan.moment(number, float(scene.plan.motions[number].pose_times[pose])))
            return

    def _plotted(self) -> None:
        if self._active.plan.moving is not None:
            times, plots = plots_of(self._active.plan)
            for handle, plot in zip(self._plots, plots, strict=True):
                handle.content = plot_html(times, plot)

    def _finish(self) -> None:
        """Draw the plots, colour the part, and execute the program, whose lines a picked point names."""
        try:
            self._plotted()
            self._colour(self._colours.value)
            for motion in (motion for plan in self.viewed.plans for motion in plan.motions):
                if self._closed.is_set():
                    return
                _ = motion.switching
            self._at(self._moment)
        except Exception as error:  # whoever waits for it is to hear of it
            self._failure = error
        finally:
            self._finished.set()


def notebook_scene(folder: Path | str) -> NotebookView:
    """Return the scene that `geoprint view FOLDER` shows first as a page within a notebook, to be turned.

    It needs no server, and so has no panel.

    Args:
        folder: that `geoprint plan` or `compare` wrote.

    Raises:
        GeoprintError: as `load_viewed`; `UsageError` where viser is not installed.
    """
    viewed = load_viewed(folder)
    with served(PORT, label=viewed.name) as server, closing(LiveView(viewed, server)) as view:
        view.complete()
        return NotebookView(server.scene.as_html().encode())


def nearest_pose(plan: ViewedPlan, place: FloatArray) -> tuple[int, int]:
    """Return attitude, from 0, and pose that deposit nearest to a place."""
    nearest: list[tuple[float, int, int]] = []
    for number, poses in enumerate(plan.streams):
        rows = np.flatnonzero(poses.deposit)
        distance, row = KDTree(poses.surface_points[rows]).query(place)
        nearest.append((float(distance), number, int(rows[row])))
    return min(nearest)[1:]


def point_text(scene: PlanScene, place: FloatArray) -> str:
    """Return what a place on the part is, as Markdown."""
    plan = scene.plan
    (number, pose), vertex = nearest_pose(plan, place), int(KDTree(plan.surface.vertices).query(place)[1])
    poses = plan.streams[number]
    thickness = float(scene.values("thickness")[vertex])
    x, y, z = place.tolist()
    attitude = f"attitude {number + 1}, " if len(plan.streams) > 1 else ""
    lines = [
        f"**{plan.name}**, {x:z.2f}, {y:z.2f}, {z:z.2f} mm",
        f"{attitude}run {poses.runs[pose] + 1}, level {poses.levels[pose]}, layer {poses.layers[pose] + 1}",
        scale_of([scene], "thickness").said(thickness),
        "normal " + ", ".join(f"{each:.3f}" for each in poses.normals[pose].tolist())
        + f"; nozzle {np.degrees(tilts(poses)[pose]):.1f} degrees from it",
    ]  # fmt: skip
    if plan.motions:
        motion = plan.motions[number]
        moment = float(motion.pose_times[pose])
        angles = np.degrees(motion.table.joints[motion.row(moment)]).tolist()
        lines.append(
            f"at {plan.moment(number, moment):.3f} s; joints "
            + ", ".join(f"{angle:.1f}" for angle in angles)
            + " degrees"
        )
        line = motion.line_of(motion.target(moment))
        lines.append(f"program: `{line}`" if line else "no program that runs")
    return "  \n".join(lines)


def _moment_html(plan: ViewedPlan, moment: float) -> str:
    number, local = plan.at(moment)
    motion, words = plan.motions[number], list[str]()
    if len(plan.motions) > 1:
        words.append(f"attitude {number + 1} of {len(plan.motions)}")
    if local < 0.0:
        return _small(" · ".join([*words, "the table moves"]))
    row, target = motion.row(local), motion.target(local)
    run, count = int(motion.table.runs[row]), int(motion.orders.runs.max()) + 1
    words.append(f"run {run + 1} of {count}" if run >= 0 else "on the way")
    # Both are worked out in the background: what waits for them would stand still.
    if "speeds" in motion.__dict__:
        words.append(f"{motion.speeds[row]:.1f} mm/s")
    if "switching" in motion.__dict__ and motion.switching is not None:
        opened, lit = (
            bool(((spans[:, 0] <= local) & (local < spans[:, 1])).any())
            for spans in (motion.switching.material, motion.switching.lamp)
        )
        words += [f"valve {'open' if opened else 'shut'}", f"lamp {'on' if lit else 'off'}"]
        line = motion.line_of(target)
        words += [line] if line else []
    return _small(" · ".join(words))


def _small(words: str) -> str:
    return f'<div style="padding:4px 12px;font-size:12px">{escape(words)}</div>'


def _places(viewed: Viewed) -> tuple[_Place, ...]:
    """Return the places worth a look: where spacing, lean and speed are worst in each plan."""
    return tuple(
        _Place(f"{plan.name}: {words}" if len(viewed.plans) > 1 else words, number, time)
        for number, plan in enumerate(viewed.plans)
        if plan.motions
        for words, time in _worst(plan)
    )


def _worst(plan: ViewedPlan) -> Iterator[tuple[str, float]]:
    """Yield what is worst in a plan with a robot, and the moments when the arm is there [s]."""

    def passed(number: int, pose: int) -> float:
        return plan.moment(number, float(plan.motions[number].pose_times[pose]))

    levels = plan.record.uniformity.levels if plan.record.uniformity else None
    for place in levels.worst_places[:2] if levels else ():
        yield f"spacing {place.ratio:.3f} of the wanted one", passed(*nearest_pose(plan, np.array(place.place)))
    slowed = [each for robot in plan.record.robot for each in robot.motion.slowdowns]
    if slowed:
        worst = min(slowed, key=lambda each: each.held_speed)
        yield f"slowed to {worst.held_speed:.1f} mm/s", passed(*nearest_pose(plan, np.array(worst.place)))
    wrists = [np.where(motion.table.deposit, np.abs(motion.table.joints[:, 4]), np.inf) for motion in plan.motions]
    number = int(np.argmin([each.min() for each in wrists]))
    row = int(wrists[number].argmin())
    degrees = np.degrees(wrists[number][row])
    yield f"wrist at {degrees:.1f} degrees", plan.moment(number, float(plan.motions[number].table.times[row]))
    leans = [np.where(motion.poses.deposit, tilts(motion.poses), 0.0) for motion in plan.motions]
    number = int(np.argmax([each.max() for each in leans]))
    yield f"lean {np.degrees(leans[number].max()):.1f} degrees", passed(number, int(leans[number].argmax()))
