"""The view of a part that is drawn on: paths follow the mouse, figures and reach follow where it rests."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from html import escape
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple, final

import numpy as np
from scipy.spatial import KDTree

from geoprint.config import Job
from geoprint.distance import backend_names
from geoprint.errors import FieldError, GeoprintError
from geoprint.geometry import join, upright_of, vertex_normals, with_vertex
from geoprint.geometry.files import load_file
from geoprint.geometry.rays import RayTree
from geoprint.metrics.oracle import shortest_way
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.reporting.colouring import reach_scale, thickness_scale
from geoprint.reporting.evenness import record_evenness
from geoprint.reporting.figures import colour_range
from geoprint.reporting.metrics import CATALOGUE
from geoprint.reporting.scene import LIFT_SHARE
from geoprint.reporting.view import view_surface
from geoprint.results import Plan
from geoprint.robot.reach import ReachMap, reach_map
from geoprint.toolpath import pattern_names
from geoprint.viewer.drawing import STROKE, TOOLS, Drawing, Item, Tool
from geoprint.viewer.live import LiveView
from geoprint.viewer.loaded import load_viewed
from geoprint.viewer.page import light, look, on_ray, open_panel, scale_html, table_html
from geoprint.viewer.scene import MARK, PATH, PLAIN as GREY, lines_glb, surface_glb, thinned_rows
from geoprint.workflow import Planner, best_placed, save_plan
from geoprint.workflow.placement import arm_of

if TYPE_CHECKING:
    import viser

# Figures and reach are worked out once nothing has changed for so long [s].
REST: Final = 0.4
# So long a thread may take to end [s].
PATIENCE: Final = 2.0
# Faces of the body that are drawn, and the size of a place that is drawn over that of the part.
BODY_FACES, DOT_SHARE = 60_000, 0.008
LOOK: Final = "Look"
PATHS_ONLY, CALIBRATED = "Paths only", "At the calibrated place"
DRY_RUN, BEST = "Dry run at the demonstration place", "Dry run at the best place"
THICKNESS, REACH, PLAIN = "Thickness", "Reach", "Plain"
DRAWN, PENDING = (200, 30, 90), (240, 150, 40)
HINT: Final = "Choose what a click draws; drag a dot to move it. Every edit is in the job file at once."


class _Shown(NamedTuple):
    """What was worked out of a job: its paths with figures, and what the arm reaches, where that was asked for."""

    plan: Plan
    reach: ReachMap | None


@final
class EditView:
    """Shows a job on a page where it is drawn on, until it is closed.

    Args:
        drawing: of the job.
        server: of the page, which holds nothing else.

    Attributes:
        server: of the page.
        drawing: as it stands.
        body: what the file of the part holds.
        upright: (3, 3) rotation that turns its mean normal up, as it is seen first.
        replayed: the view of a plan that is shown in its place, or None.

    Raises:
        InputError: the part cannot be read.
    """

    def __init__(self, drawing: Drawing, server: viser.ViserServer) -> None:
        self.server, self.drawing = server, drawing
        job = drawing.job
        self.body = load_file(job.surface, unit=job.unit, label=job.label, threshold=job.threshold).surface
        self.upright = upright_of(self.body)
        self._joined = join(self.body).surface
        self._rays = RayTree(self.body)
        self._size = float(np.linalg.norm(np.ptp(self.body.vertices[self.body.faces].reshape(-1, 3), axis=0)))
        self._way = lru_cache(maxsize=1000)(self._line_between)
        self._planner: Planner | None = None
        self._replays: list[viser.GuiButtonHandle] = []
        self._folders: list[Path] = []
        self._field: bytes | None = None
        self._shown: _Shown | None = None
        self.replayed: LiveView | None = None
        self._wanted, self._pathed, self._measured = job, None, None
        self._since, self._dragging = 0.0, False
        self._asked: Callable[[], None] | None = None
        # Held while something is worked out, so that the page is not replaced meanwhile.
        self._busy = threading.Lock()
        self._changed, self._closed = threading.Event(), threading.Event()
        self._build()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def wait(self) -> None:
        """Return once it was closed by another thread; Ctrl-C ends the waiting."""
        self._closed.wait()

    def complete(self) -> None:
        """Return once all is shown that follows from the job."""
        while not (self.at_rest or self._closed.is_set()):
            time.sleep(0.1)

    def close(self) -> None:
        """End the drawing; the page stays."""
        self._closed.set()
        self._changed.set()
        # A plan that is being made is not waited for.
        self._thread.join(timeout=PATIENCE)
        if self.replayed is not None:
            self.replayed.close()

    @property
    def message(self) -> str:
        """What is said of the job now, as HTML."""
        return self._message.content

    @property
    def written(self) -> str:
        """What was written last, as HTML."""
        return self._written.content

    @property
    def replays(self) -> list[str]:
        """What the buttons say that show plans which were written."""
        return [button.label for button in self._replays]

    @property
    def figures(self) -> str:
        """The figures of the paths that were measured last, as HTML."""
        return self._figures.content

    @property
    def at_rest(self) -> bool:
        """Whether everything that follows from the job is shown."""
        return self._asked is None and self._measured is self._wanted

    def choose(self, tool: Tool | None) -> None:
        """Choose what a click draws; None looks alone."""
        self._tool.value = LOOK if tool is None else tool.name
        self._begins = True

    def pick(self, start: FloatArray, direction: FloatArray) -> None:
        """Draw with the tool that is chosen where a ray meets the part first.

        Args:
            start: (3,) of the ray [mm].
            direction: (3,) of the ray.
        """
        place, tool = self._hit(start, direction), self._tool_chosen()
        if place is None or tool is None:
            return
        with self.drawing.lock:
            begins, self._begins = self._begins, False
            self._edit(lambda: self.drawing.add(tool, place, begins=begins))

    def drag(self, item: int, point: int, start: FloatArray, direction: FloatArray, *, ends: bool) -> None:
        """Move a place that is drawn to where a ray meets the part first; only where the drag ends is it kept."""
        place = self._hit(start, direction)
        self._dragging = not ends
        if ends and place is not None:
            self._edit(lambda: self.drawing.move(item, point, place))
        elif ends:
            # It stays where it was.
            self._draw_items()
            self._want(self.drawing.job)
        if ends or place is None:
            return
        self._dots[item][point].position = place
        with suppress(GeoprintError):
            if self.drawing.items[item].tool is not STROKE:
                self._want(self.drawing.moved(item, point, place))

    def change(self, **keys: object) -> None:
        """Set keys of the job that are not drawn."""
        self._edit(lambda: self.drawing.change(**keys))

    def plan(self) -> None:
        """Plan the job with all of its checks and write it, where a robot is asked for as the program of a dry run."""
        self._asked = self._write_plan
        self._changed.set()

    def _build(self) -> None:
        with self.server.atomic():
            self.server.scene.reset()
            self.server.gui.reset()
            light(self.server, self.upright)
            corners = self.body.vertices[self.body.faces].reshape(-1, 3)
            middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
            look(self.server, middle, self.upright, distance=0.8 * self._size)
            drawn = view_surface(self.body, faces=BODY_FACES).surface
            self._body = self.server.scene.add_glb("/body", surface_glb(drawn, GREY, self.upright, flat=False))
            self._build_panel()
        self._begins = False
        self._pathed = self._measured = None
        self._draw_items()
        self._changed.set()

    def _build_panel(self) -> None:
        gui, job = self.server.gui, self.drawing.job
        open_panel(self.server, self.drawing.file.name)
        with gui.add_folder("Draw"):
            self._tool = gui.add_dropdown("A click draws", (LOOK, *(tool.name for tool in TOOLS)))
            buttons = gui.add_button_group("", ("Begin another", "Remove last", "Undo"))
            gui.add_markdown(HINT)
        with gui.add_folder("Job"):
            self._backend = gui.add_dropdown("Backend", backend_names(), initial_value=job.backend)
            self._pattern = gui.add_dropdown("Pattern", self._patterns(), initial_value=job.pattern)
            self._spacing = gui.add_number("Spacing [mm]", job.spacing or 1.0, min=0.05, step=0.05)
            self._rounds = gui.add_number("Rounds", job.rounds or 1, min=1, step=1)
            self._margin = gui.add_number("Margin [mm]", job.margin or 0.0, min=0.0, step=0.1)
            angle = None if job.source is None else job.source.angle
            self._angle = gui.add_slider("Rows at [degrees]", -90.0, 90.0, 1.0, angle or 0.0)
            self._program = gui.add_dropdown("Program", self._programs(), initial_value=_program_of(job))
            self._stand = gui.add_vector3("Stands at [mm]", np.array(self._standing()[:3]))
            self._yaw = gui.add_slider("Turned by [degrees]", -180.0, 180.0, 1.0, self._standing()[5])
        with gui.add_folder("Result"):
            self._colours = gui.add_dropdown("Colour", (THICKNESS, REACH, PLAIN))
            self._scale = gui.add_html("")
            self._figures = gui.add_html("")
            self._message = gui.add_html("")
            gui.add_button("Plan, check and write").on_click(lambda _: self.plan())
            self._written = gui.add_html("")
        self._replays = [self._add_replay(folder) for folder in self._folders]
        self._listen(buttons)
        self._show_fields()

    def _listen(self, buttons: viser.GuiButtonGroupHandle) -> None:
        def on(handle: viser.GuiInputHandle[Any], call: Callable[[], None]) -> None:
            handle.on_update(lambda event: call() if event.client is not None else None)

        def change(handle: viser.GuiInputHandle[Any], keys: Callable[[], dict[str, object]]) -> None:
            on(handle, lambda: self.change(**keys()))

        change(self._backend, lambda: {"backend": self._backend.value})
        change(self._pattern, lambda: {"pattern": self._pattern.value})
        change(self._spacing, lambda: {"spacing": float(self._spacing.value)})
        change(self._rounds, lambda: {"rounds": int(self._rounds.value)})
        change(self._margin, lambda: {"margin": float(self._margin.value) or None})
        change(self._angle, lambda: {"source": {"angle": float(self._angle.value)}})
        change(self._program, lambda: _PROGRAMS[self._program.value])
        for handle in (self._stand, self._yaw):
            change(handle, lambda: {"stand": self._stood()})
        on(self._tool, lambda: self._press("Begin another"))
        on(self._colours, self._colour)
        buttons.on_click(lambda _: self._press(buttons.value))
        on_ray(self.server, self.pick)

    def _patterns(self) -> tuple[str, ...]:
        """Return the patterns that can be chosen, that of the job among them: of layers it names several."""
        return tuple(dict.fromkeys([*pattern_names(), self.drawing.job.pattern]))

    def _programs(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys([PATHS_ONLY, DRY_RUN, BEST, _program_of(self.drawing.job)]))

    def _standing(self) -> tuple[float, ...]:
        """Return x, y, z, roll, pitch, yaw of the demonstration [mm, degrees]."""
        from geoprint.config import job_cell

        if self.drawing.job.stand is not None:
            return tuple(self.drawing.job.stand)
        return (*job_cell(self.drawing.job).demo_position.tolist(), 0.0, 0.0, 0.0)

    def _stood(self) -> list[float]:
        """Return what the fields say of where the part stands."""
        *_, roll, pitch, _ = self._standing()
        return [*map(float, self._stand.value), roll, pitch, float(self._yaw.value)]

    def _press(self, button: str) -> None:
        if button == "Begin another":
            self._begins = True
            return
        if button == "Undo":
            self._edit(self.drawing.undo)
            return
        tool = self._tool_chosen()
        mine = [number for number in self.drawing.drawn if tool in {None, self.drawing.items[number].tool}]
        if mine:
            self._edit(lambda: self.drawing.remove(mine[-1]))

    def _tool_chosen(self) -> Tool | None:
        return next((tool for tool in TOOLS if tool.name == self._tool.value), None)

    def _edit(self, edit: Callable[[], object]) -> None:
        """Make an edit, and show what follows from it; what is refused has changed nothing."""
        try:
            edit()
        except GeoprintError as error:
            self._say(str(error), refused=True)
        self._draw_items()
        self._show_fields()
        self._want(self.drawing.job)

    def _show_fields(self) -> None:
        """Let fields say what the job does, and show those that it heeds."""
        job = self.drawing.job
        self._backend.value, self._pattern.value = job.backend, job.pattern
        self._rounds.visible, self._spacing.visible = job.rounds is not None, job.rounds is None
        if job.rounds is not None:
            self._rounds.value = job.rounds
        elif job.spacing is not None:
            self._spacing.value = job.spacing
        self._margin.value = job.margin or 0.0
        self._angle.visible = job.pattern == "guided"
        self._angle.value = (None if job.source is None else job.source.angle) or 0.0
        standing = self._standing()
        self._stand.value, self._yaw.value = (standing[0], standing[1], standing[2]), standing[5]
        self._program.value = _program_of(job)
        self._stand.visible = self._yaw.visible = self._program.value == DRY_RUN

    def _want(self, job: Job) -> None:
        self._wanted, self._since = job, time.monotonic()
        self._changed.set()

    def _hit(self, start: FloatArray, direction: FloatArray) -> FloatArray | None:
        hits = self._rays.first_hits(start[None], direction[None])
        return hits.points.xyz(self.body)[0] if hits.met.any() else None

    def _draw_items(self) -> None:
        """Draw what is drawn: dots that can be dragged, joined by shortest lines."""
        scene = self.server.scene
        with self.server.atomic():
            scene.remove_by_name("/drawn")
            self._dots = [
                [self._dot(number, point, item) for point in range(len(item.places))]
                for number, item in enumerate(self.drawing.items)
            ]
            for number, item in enumerate(self.drawing.items):
                lines = self._ways(item)
                if lines:
                    pieces = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
                    colour = DRAWN if item.complete else PENDING
                    scene.add_line_segments(
                        f"/drawn/{number}/line", pieces, colour, thickness=3.0, thickness_units="screen"
                    )

    def _dot(self, number: int, point: int, item: Item) -> viser.IcosphereHandle:
        place, radius = item.places[point], DOT_SHARE * self._size
        colour = MARK if item.complete else PENDING
        dot = self.server.scene.add_icosphere(
            f"/drawn/{number}/{point}", radius, colour, position=place, cast_shadow=False, receive_shadow=False
        )

        # As a coroutine: viser hands other functions to threads that may overtake one another.
        @dot.on_drag
        async def dragged(event: viser.SceneNodeDragEvent[viser.IcosphereHandle]) -> None:  # pyright: ignore[reportUnusedFunction]
            eye = np.array(event.client.camera.position)
            self.drag(number, point, eye, np.array(event.end_position) - eye, ends=event.phase == "end")

        return dot

    def _ways(self, item: Item) -> list[FloatArray]:
        """Return the (k, 3) shortest lines that join the places of an item, a little above the part."""
        places = [*item.places, item.places[0]] if item.tool.closed and item.complete else [*item.places]
        return [self._way(*ends) for ends in pairwise(places)]

    def _line_between(self, start: tuple[float, ...], end: tuple[float, ...]) -> FloatArray:
        """Return the (k, 3) shortest line between two places, straight where none is found."""
        try:
            surface, first = with_vertex(self._joined, np.array(start))
            surface, last = with_vertex(surface, np.array(end))
            line = shortest_way(surface, first, last).places(surface) if first != last else np.array([start, end])
        except FieldError:
            line = np.array([start, end])
        return self._lifted(line, self.body)

    def _lifted(self, places: FloatArray, surface: Surface, *, times: float = 2.0) -> FloatArray:
        """Return places a little above a surface, so that it does not swallow them."""
        _, nearest = KDTree(surface.vertices).query(places)
        return places + times * LIFT_SHARE * self._size * vertex_normals(surface)[nearest]

    def _work(self) -> None:
        """Follow the job: paths at once, figures and reach at rest, and the plan where it is asked for."""
        while not self._closed.is_set():
            self._changed.wait(timeout=0.1)
            self._changed.clear()
            with self._busy:
                if self.replayed is None:
                    self._follow(self._wanted, self._asked)

    def _follow(self, job: Job, asked: Callable[[], None] | None) -> None:
        """Do what is next; the panel is there meanwhile."""
        try:
            if asked is not None:
                asked()
            elif job is not self._pathed:
                self._pathed = job
                self._draw_paths(job)
            elif job is not self._measured and not self._dragging and time.monotonic() - self._since > REST:
                self._measure(job)
                self._measured = job
        except GeoprintError as error:
            self._refused(job, str(error), asked=asked is not None)
        except Exception as error:  # a defect ends what is done, and not the drawing
            traceback.print_exception(error)
            words = "this is a defect of geoprint; the terminal says where: please report it."
            self._refused(job, words, asked=asked is not None)
        finally:
            if asked is not None and self._asked is asked:
                self._asked = None

    def _refused(self, job: Job, words: str, *, asked: bool) -> None:
        """Say why a job is not followed, and show nothing of an earlier one beside that."""
        self._say(words, refused=True)
        if asked:
            return
        self._measured = job
        self._shown = None
        self._figures.content = self._scale.content = ""
        self.server.scene.remove_by_name("/paths")

    def _planner_of(self, job: Job) -> Planner:
        """Return the planner of a job; a field that was drawn on is read anew."""
        field = None if job.field is None or not job.field.is_file() else job.field.read_bytes()
        if self._planner is None or field != self._field:
            self._planner = Planner(_sketched(job))
            self._field = field
        return self._planner

    def _draw_paths(self, job: Job) -> None:
        drawn = self._planner_of(job).paths(_sketched(job))
        paths = drawn.paths
        whole = sum(map(len, paths))
        part = drawn.workpiece.part
        thinned = [self._lifted(path[thinned_rows(len(path), whole=whole)], part, times=3.0) for path in paths]
        with self.server.atomic():
            self.server.scene.add_glb("/paths", lines_glb(thinned, PATH))
            self._draw_part(part, None)
        self._say(f"{len(paths)} runs")

    def _measure(self, job: Job) -> None:
        self._say("measuring ...")
        plan = self._planner_of(job).figures(_sketched(job))
        placement, cell = plan.workpiece.placement, plan.workpiece.cell
        reached = None
        if placement is not None and cell.table is None:
            reached = reach_map(
                plan.poses, arm_of(plan.workpiece), T_base_work=placement.T_base_work, weights=cell.search
            )
        if job is not self._wanted:
            return
        self._shown = _Shown(plan, reached)
        assert plan.uniformity is not None  # noqa: S101  # It was measured.
        record = record_evenness(plan.uniformity)
        rows = [(metric.label, metric.text(record)) for metric in CATALOGUE if metric.decides]
        rows += [("runs", str(plan.toolpath.curves.count)), ("spacing", f"{plan.contours.spacing:g} mm")]
        if reached is not None:
            rows.append(("out of reach", "nothing" if reached.complete else f"{100.0 * reached.lost:.1f} %"))
        self._figures.content = table_html(rows)
        self._colour()
        refused = reached is not None and not reached.complete
        self._say(reached.describe(reached.worst(1)[0]) if reached is not None and refused else "", refused=refused)

    def _colour(self) -> None:
        """Colour the part by what is chosen, as far as it was worked out."""
        shown, name = self._shown, self._colours.value
        if shown is None:
            return
        part = shown.plan.workpiece.part
        scale, values = None, None
        if name == THICKNESS and shown.plan.uniformity is not None:
            values = shown.plan.uniformity.field[: len(part.vertices)]
            scale = thickness_scale(*colour_range([values]))
        elif name == REACH and shown.reach is not None:
            _, nearest = KDTree(shown.plan.poses.surface_points).query(part.vertices)
            values, scale = shown.reach.reasons[nearest].astype(np.float64), reach_scale()
        self._scale.content = "" if scale is None else scale_html(scale)
        self._draw_part(part, None if scale is None or values is None else scale.rgb(values))

    def _draw_part(self, part: Surface, rgb: IntArray | None) -> None:
        job = self.drawing.job
        cut = bool(job.patches or job.keep_outs)
        lifted = Surface(self._lifted(part.vertices, part, times=1.0), part.faces) if cut else part
        glb = surface_glb(lifted, GREY if rgb is None else rgb, self.upright, flat=False)
        self.server.scene.add_glb("/part", glb)
        self._body.visible = cut

    def _write_plan(self) -> None:
        """Plan the job and write it beside its file."""
        self._say("planning and checking ...")
        job = best_placed(self.drawing.job)
        planned = self._planner_of(job).plan(job)
        folder = _free(self.drawing.file.with_name(f"{self.drawing.file.stem}-plan"))
        save_plan(planned, folder, report=True)
        self._say("")
        self._written.content = _said(f"written and verified: {folder}")
        if planned.robot:
            self._folders.append(folder)
            self._replays.append(self._add_replay(folder))

    def _add_replay(self, folder: Path) -> viser.GuiButtonHandle:
        button = self.server.gui.add_button(f"Replay {folder.name}")
        button.on_click(lambda _: self.replay(folder))
        return button

    def replay(self, folder: Path) -> None:
        """Show a plan that was written, in place of the drawing."""
        viewed = load_viewed(folder)
        with self._busy:
            self.server.gui.reset()
            self.server.scene.reset()
            self.replayed = LiveView(viewed, self.server, back=self.draw_again)

    def draw_again(self) -> None:
        """Show the drawing again."""
        if self.replayed is not None:
            self.replayed.close()
            self.replayed = None
        self._build()

    def _say(self, words: str, *, refused: bool = False) -> None:
        self._message.content = _said(words, style="color:#b2182b;font-weight:600" if refused else "")


def _said(words: str, *, style: str = "") -> str:
    return f'<div style="padding:4px 12px;font-size:12px;{style}">{escape(words)}</div>'


def _program_of(job: Job) -> str:
    return PATHS_ONLY if not job.robot else {"demo": DRY_RUN, "best": BEST, None: CALIBRATED}[job.place]


def _sketched(job: Job) -> Job:
    """Return a job as it is shown while it is edited: where the part stands best is sought for its plan alone."""
    return job.model_copy(update={"robot": False}) if job.place == "best" else job


_PROGRAMS: Final[dict[str, dict[str, object]]] = {
    PATHS_ONLY: {"robot": False},
    DRY_RUN: {"robot": True, "place": "demo"},
    BEST: {"robot": True, "place": "best"},
    CALIBRATED: {"robot": True, "place": None},
}


def _free(folder: Path) -> Path:
    """Return a folder of that name that does not exist yet, with a number behind it where one does."""
    found, number = folder, 2
    while found.exists():
        found, number = folder.with_name(f"{folder.name}-{number}"), number + 1
    return found
