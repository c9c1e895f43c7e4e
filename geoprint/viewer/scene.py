"""The 3D scene of the view: part, paths, robot and beads of each plan as nodes of a viser server.

Measured in headless Chromium with software rendering [viser 1.1, two cores, 1280 x 800]: a frame of 15 000 faces and
50 000 poses costs 80 ms of processor time with paths as lines of one pixel from a GLB file, 240 ms with viser's own
lines, whose width is drawn by triangles; an environment map costs 15 s at the start. Hence GLB lines and plain lights.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias, final

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from geoprint.geometry import face_areas, face_normals, gradient, vertex_normals
from geoprint.geometry.rays import RayTree
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.reporting.colouring import (
    Scale,
    clearance_scale,
    coverage_scale,
    curvature_scale,
    distance_scale,
    lean_scale,
    margin_scale,
    overhang_scale,
    speed_scale,
    thickness_scale,
)
from geoprint.reporting.figures import colour_range
from geoprint.reporting.replaying import PrintMotion
from geoprint.reporting.scene import LIFT_SHARE, thinned
from geoprint.reporting.values import Machine
from geoprint.robot.arm import tilts
from geoprint.robot.reach import bead_steps
from geoprint.viewer.loaded import Motion, ViewedPlan

if TYPE_CHECKING:
    import viser

# Samples of a path that are drawn at most: finer than a pixel on any part, and few enough for software rendering.
MOST_SAMPLES: Final = 10_000
# Stretches in which deposited material appears during a replay.
STRETCHES: Final = 120
# Poses at which clearance and margin are worked out, at most.
MOST_SAMPLED: Final = 400
# Where light comes from, in a part that stands upright, and the share of it that comes from everywhere.
KEY_LIGHT: Final = np.array([0.4, -0.6, 1.0])
AMBIENT: Final = 0.45
PLAIN: Final = (205, 205, 205)
PATH, TRAVEL, BEAD, MARK = (23, 33, 43), (150, 160, 170), (214, 96, 20), (200, 30, 90)
KINDS: Final = {"arm": (232, 119, 34), "tool": (90, 98, 106), "cell": (176, 184, 190), "table": (140, 150, 158),
                "body": (196, 168, 158)}  # fmt: skip


@final
class PlanScene:
    """The nodes of one plan.

    Args:
        server: that shows them.
        plan: what is shown.
        offset: (3,) by which everything is shifted, so that plans stand side by side [mm].
        named: whether its name stands above it.

    Attributes:
        plan: what is shown.
        offset: of all nodes.
    """

    def __init__(self, server: viser.ViserServer, plan: ViewedPlan, *, offset: FloatArray, named: bool) -> None:
        self._server, self.plan, self.offset = server, plan, offset
        self._root = f"/{plan.name}"
        self._values: dict[str, FloatArray] = {}
        self._normals = vertex_normals(plan.surface)
        self._lift = LIFT_SHARE * float(np.linalg.norm(np.ptp(plan.surface.vertices, axis=0)))
        self._rays = RayTree(plan.surface)
        self._frame = server.scene.add_frame(self._root, show_axes=False, position=offset)
        # What moves with the part where a table turns it.
        self._work = server.scene.add_frame(f"{self._root}/work", show_axes=False)
        if named:
            top = plan.surface.vertices[np.argmax(plan.surface.vertices @ plan.upright[2])]
            server.scene.add_label(f"{self._root}/name", plan.name, position=top + 8.0 * self._lift * plan.upright[2])
        self._paths = self._add_paths()
        self._beads: list[tuple[float, viser.GlbHandle]] = []
        self._links: dict[int, viser.GlbHandle] = {}
        self._solids: list[tuple[viser.GlbHandle, FloatArray]] = []
        self._robot: list[viser.GlbHandle] = []
        if plan.moving is not None:
            self._add_machine(plan.machine)
            self._beads = self._add_beads(plan.moving)

    def colour(self, scale: Scale | None, key: str) -> None:
        """Colour the part by a quantity on a scale; plain without one."""
        surface = self.plan.surface
        rgb = PLAIN if scale is None else scale.rgb(self.values(key))
        self._server.scene.add_glb(f"{self._root}/work/part", surface_glb(surface, rgb, self.plan.upright, flat=False))

    def values(self, key: str) -> FloatArray:
        """Return the (n,) values of a quantity at the vertices of the part; each is computed once."""
        if key not in self._values:
            self._values[key] = QUANTITIES[key].values(self.plan)
        return self._values[key]

    def show(self, *, all_of_it: bool, paths: bool, travel: bool, robot: bool) -> None:
        """Show or hide all of the plan, and what is drawn besides the part."""
        self._frame.visible = all_of_it
        self._paths[0].visible, self._paths[1].visible = paths, travel
        for each in self._robot:
            each.visible = robot

    def move(self, time: float) -> None:
        """Show arm, table, part and deposited material as they are at a moment of the print [s]."""
        if self.plan.moving is None:
            return
        moved = self.plan.moving.links(time)
        for link, handle in self._links.items():
            _place(handle, moved[link])
        if self.plan.moving.table is not None:
            part, solids = self.plan.moving.table_poses(time)
            _place(self._work, part)
            self._frame.position = self._shift(part)
            for (handle, rest), motion in zip(self._solids, solids, strict=True):
                # A solid that grows is stretched along its own axis.
                stands = motion[:, :3] @ rest[:, :3]
                lengths = np.linalg.norm(stands, axis=0)
                x, y, z = lengths.tolist()
                handle.scale = (x, y, z)
                _place(handle, np.column_stack([stands / lengths, motion[:, :3] @ rest[:, 3] + motion[:, 3]]))
        for end, handle in self._beads:
            # Each change is sent.
            if handle.visible != (end <= time):
                handle.visible = end <= time

    def hit(self, start: FloatArray, direction: FloatArray, *, time: float) -> FloatArray | None:
        """Return the (3,) place of the part that a ray meets first at a moment, in the part's frame [mm], or None."""
        moving = self.plan.moving
        part = np.eye(4)[:3] if moving is None else moving.table_poses(time)[0]
        own, from_part = np.linalg.inv(part[:, :3]), start - self._shift(part) - part[:, 3]
        hits = self._rays.first_hits((own @ from_part)[None], (own @ direction)[None])
        return hits.points.xyz(self.plan.surface)[0] if hits.met.any() else None

    def mark(self, place: FloatArray) -> None:
        """Mark a (3,) place of the part, in the part's frame [mm]."""
        self._server.scene.add_icosphere(
            f"{self._root}/work/picked", radius=0.35 * self.plan.spacing, color=MARK, position=place
        )

    def _shift(self, part: FloatArray) -> FloatArray:
        """Return the (3,) shift of everything at which a part that has moved so is still in the middle of the view."""
        low, high = self.plan.surface.vertices.min(axis=0), self.plan.surface.vertices.max(axis=0)
        middle = 0.5 * (low + high)
        return self.offset + middle - part[:, :3] @ middle - part[:, 3]

    def _add_machine(self, machine: Machine) -> None:
        """Add the robot and what stands about it, all joints at zero and a table at rest."""

        def add(surface: Surface, name: str, *, kind: str) -> viser.GlbHandle:
            glb = surface_glb(surface, KINDS[kind], self.plan.upright, flat=kind != "body")
            handle = self._server.scene.add_glb(f"{self._root}/{name}", glb)
            self._robot.append(handle)
            return handle

        joined = sorted(machine.bodies, key=lambda body: (body.kind, body.joint))
        for (kind, joint), bodies in groupby(joined, key=lambda body: (body.kind, body.joint)):
            surface = _together([body.surface for body in bodies])
            if kind == "table":
                rest = _own_frame(surface)
                own = Surface((surface.vertices - rest[:, 3]) @ rest[:, :3], surface.faces)
                self._solids.append((add(own, f"robot/{kind}-{joint}", kind=kind), rest))
                continue
            handle = add(surface, f"{'work' if kind == 'body' else 'robot'}/{kind}-{joint}", kind=kind)
            if kind in {"arm", "tool"} and joint:
                self._links[7 if kind == "tool" else joint] = handle

    def _lifted(self, places: FloatArray, *, times: float = 1.0) -> FloatArray:
        """Return places a little above the part, so that it does not swallow them."""
        _, nearest = KDTree(self.plan.surface.vertices).query(places)
        return places + times * self._lift * self._normals[nearest]

    def _add_paths(self) -> tuple[viser.GlbHandle, viser.GlbHandle]:
        """Add what is deposited and what is travel, as lines."""
        poses = self.plan.poses
        on = _stretches(poses.deposited)
        kept = [one[thinned_rows(one.size, whole=int(poses.deposited.sum()))] for one in on]
        deposit = [self._lifted(poses.surface_points[rows]) for rows in kept]
        off = [poses.tips[rows] for rows in _stretches(~poses.deposited)]
        return (
            self._server.scene.add_glb(f"{self._root}/work/paths", lines_glb(deposit, PATH)),
            self._server.scene.add_glb(f"{self._root}/work/travel", lines_glb(off, TRAVEL), visible=False),
        )

    def _add_beads(self, moving: PrintMotion) -> list[tuple[float, viser.GlbHandle]]:
        """Add deposited material in stretches, each with the moment from which it is shown."""
        found: list[tuple[float, viser.GlbHandle]] = []
        for begin, motion in zip(moving.begins.tolist(), self.plan.motions, strict=True):
            poses = motion.poses
            rows = np.flatnonzero(poses.deposited)
            share = 1 + int(STRETCHES * float(motion.table.times[-1]) / moving.end)
            for piece in np.array_split(rows, min(share, rows.size)):
                marks = np.zeros(poses.count, dtype=bool)
                marks[piece] = True
                lines = [
                    self._lifted(poses.surface_points[one[thinned_rows(one.size, whole=rows.size)]], times=2.0)
                    for one in _stretches(marks)
                ]
                name = f"{self._root}/work/beads/{len(found)}"
                handle = self._server.scene.add_glb(name, lines_glb(lines, BEAD), visible=False)
                found.append((begin + float(motion.pose_times[min(piece[-1] + 1, poses.count - 1)]), handle))
        return found


def _place(handle: viser.SceneNodeHandle, motion: FloatArray) -> None:
    """Place a node by a (3, 4) or (4, 4) motion, what is no turn in it left out."""
    handle.wxyz = Rotation.from_matrix(motion[:3, :3]).as_quat(scalar_first=True)
    handle.position = motion[:3, 3]


def _own_frame(surface: Surface) -> FloatArray:
    """Return the (3, 4) frame of a long solid, with one axis along it."""
    middle = surface.vertices.mean(axis=0)
    _, _, axes = np.linalg.svd(surface.vertices - middle, full_matrices=False)
    return np.column_stack([axes.T * np.sign(np.linalg.det(axes)), middle])


def thinned_rows(count: int, *, whole: int) -> IntArray:
    """Return which of so many rows of a stretch are drawn, as part of a whole; both ends always."""
    kept, _ = thinned(np.array([0, count]), step=1 + whole // MOST_SAMPLES)
    return kept


def surface_glb(
    surface: Surface, colours: IntArray | tuple[int, int, int], upright: FloatArray, *, flat: bool
) -> bytes:
    """Return a surface as a GLB file whose shading is in its colours, so that a browser has nothing to light.

    Without a graphics card lighting each pixel costs more than all else. Colours of vertices are linear in light there
    [glTF2, section 3.7.2.1].

    Args:
        surface: n vertices.
        colours: (n, 3) of its vertices, 0 to 255, or one of all.
        upright: (3, 3) rotation that turns it as it is seen first: light comes from above, a little from the front.
        flat: whether each face has one shade.
    """
    import trimesh
    from trimesh.exchange.gltf import export_glb  # pyright: ignore[reportUnknownVariableType]

    corners, rgb = surface, np.broadcast_to(np.asarray(colours, dtype=np.float64), (len(surface.vertices), 3))
    if flat:
        rgb = rgb[surface.faces.ravel()]
        corners = Surface(surface.vertices[surface.faces].reshape(-1, 3), np.arange(surface.faces.size).reshape(-1, 3))
    normals = np.repeat(face_normals(surface), 3, axis=0) if flat else vertex_normals(surface)
    towards = KEY_LIGHT @ upright / np.linalg.norm(KEY_LIGHT)
    shares = rgb / 255.0
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    shaded = linear * (AMBIENT + (1.0 - AMBIENT) * np.abs(normals @ towards))[:, None]
    mesh = trimesh.Trimesh(
        corners.vertices, corners.faces, vertex_colors=(255.0 * shaded).round().astype(np.int64), process=False
    )

    def unlit(tree: dict[str, Any]) -> None:
        tree["materials"] = [{"extensions": {"KHR_materials_unlit": {}}, "doubleSided": True}]
        tree["extensionsUsed"] = ["KHR_materials_unlit"]
        for each in tree["meshes"]:
            for primitive in each["primitives"]:
                primitive["material"] = 0

    return export_glb(trimesh.Scene(mesh), tree_postprocessor=unlit)


def lines_glb(lines: Sequence[FloatArray], colour: tuple[int, int, int]) -> bytes:
    """Return polylines as a GLB file, which a browser draws one pixel wide."""
    import trimesh
    from trimesh.path import Path3D
    from trimesh.path.entities import Line

    ends: list[int] = np.cumsum([len(line) for line in lines]).tolist()
    entities = [Line(np.arange(end - len(line), end)) for line, end in zip(lines, ends, strict=True)]
    path = Path3D(
        entities=entities, vertices=np.concatenate(lines), process=False,
        colors=np.tile([*colour, 255], (len(entities), 1)),
    )  # fmt: skip
    return trimesh.Scene(path).export(file_type="glb")


def _stretches(marked: np.ndarray) -> list[IntArray]:
    """Return the rows of each stretch of marked steps, the row behind it included."""
    edges = np.diff(np.concatenate([[0], marked.astype(np.int8), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return [np.arange(start, min(end + 1, marked.size)) for start, end in zip(starts, ends, strict=True)]


def _together(surfaces: Sequence[Surface]) -> Surface:
    shifts = np.cumsum([0, *(len(each.vertices) for each in surfaces[:-1])])
    return Surface(
        np.concatenate([each.vertices for each in surfaces]),
        np.concatenate([each.faces + shift for each, shift in zip(surfaces, shifts, strict=True)]),
    )


def _thickness(plan: ViewedPlan) -> FloatArray:
    return plan.evenness.field[: len(plan.surface.vertices)]


def _coverage(plan: ViewedPlan) -> FloatArray:
    _, nearest = KDTree(plan.evenness.judged_places).query(plan.surface.vertices)
    return plan.coverage[nearest].astype(np.float64)


def _lean(plan: ViewedPlan) -> FloatArray:
    rows = np.flatnonzero(plan.poses.deposit)
    _, nearest = KDTree(plan.poses.surface_points[rows]).query(plan.surface.vertices)
    return np.degrees(tilts(plan.poses))[rows][nearest]


def _speed(plan: ViewedPlan) -> FloatArray:
    if not plan.motions:
        return np.full(len(plan.surface.vertices), np.nan)
    middles: list[FloatArray] = []
    shares: list[FloatArray] = []
    for motion in plan.motions:
        poses, lengths, durations = motion.poses, bead_steps(motion.poses), np.diff(motion.pose_times)
        rows = np.flatnonzero(poses.deposited[: lengths.size] & (lengths > 0.0) & (durations > 0.0))
        middles.append((poses.surface_points[rows] + poses.surface_points[rows + 1]) / 2.0)
        shares.append(lengths[rows] / durations[rows] / plan.record.settings.speed_mm_s)
    _, nearest = KDTree(np.concatenate(middles)).query(plan.surface.vertices)
    return np.concatenate(shares)[nearest]


def _at_deposit(plan: ViewedPlan, values: Callable[[Motion, IntArray], FloatArray]) -> FloatArray:
    """Return values of poses that deposit at the vertices of the part, each from the nearest of so many poses."""
    places: list[FloatArray] = []
    found: list[FloatArray] = []
    for motion in plan.motions:
        rows = np.flatnonzero(motion.poses.deposit)
        rows = rows[:: 1 + rows.size // MOST_SAMPLED]
        places.append(motion.poses.surface_points[rows])
        found.append(values(motion, rows))
    _, nearest = KDTree(np.concatenate(places)).query(plan.surface.vertices)
    return np.concatenate(found)[nearest]


def _margin(plan: ViewedPlan) -> FloatArray:
    return np.degrees(_at_deposit(plan, lambda motion, rows: motion.margins(rows)))


def _clearance(plan: ViewedPlan) -> FloatArray:
    return _at_deposit(plan, lambda motion, rows: motion.clearances(rows))


def _distance(plan: ViewedPlan) -> FloatArray:
    surface, values = plan.distance
    _, nearest = KDTree(surface.vertices).query(plan.surface.vertices)
    return values[nearest]


def _overhang(plan: ViewedPlan) -> FloatArray:
    return np.degrees(np.arccos(np.clip(vertex_normals(plan.surface) @ plan.upright[2], -1.0, 1.0)))


def _curvature(plan: ViewedPlan) -> FloatArray:
    return mean_curvature(plan.surface)


def mean_curvature(surface: Surface) -> FloatArray:
    """Return the (n,) mean curvature at the vertices, half the divergence of their normals [1/mm]."""
    normals = vertex_normals(surface)
    slopes = [gradient(surface, normals[:, axis])[:, axis] for axis in range(3)]
    of_faces = (slopes[0] + slopes[1] + slopes[2]) / 2.0
    areas = face_areas(surface)
    sums = [np.bincount(surface.faces.ravel(), np.repeat(each, 3), len(normals)) for each in (areas * of_faces, areas)]
    return sums[0] / np.where(sums[1] > 0.0, sums[1], 1.0)


_Values: TypeAlias = Sequence[FloatArray]
_Plans: TypeAlias = Sequence[ViewedPlan]


def _thickness_scale(_: _Plans, values: _Values) -> Scale:
    return thickness_scale(*colour_range(values))


def _coverage_scale(_: _Plans, _values: _Values) -> Scale:
    return coverage_scale()


def _lean_scale(_: _Plans, values: _Values) -> Scale:
    return lean_scale(max(float(each.max()) for each in values))


def _speed_scale(_: _Plans, _values: _Values) -> Scale:
    return speed_scale()


def _distance_scale(_: _Plans, values: _Values) -> Scale:
    return distance_scale(max(float(each.max()) for each in values))


def _margin_scale(_: _Plans, values: _Values) -> Scale:
    return margin_scale(max(float(each.max()) for each in values))


def _clearance_scale(_: _Plans, values: _Values) -> Scale:
    return clearance_scale(max(float(each.max()) for each in values))


def _overhang_scale(plans: _Plans, _values: _Values) -> Scale:
    overhang = plans[0].record.overhang
    return overhang_scale(90.0 if overhang is None else overhang.critical_deg)


def _curvature_scale(_: _Plans, values: _Values) -> Scale:
    return curvature_scale(max(1e-6, *(float(np.percentile(np.abs(each), 98)) for each in values)))


class Quantity(NamedTuple):
    """What a part can be coloured by.

    Attributes:
        heading: its name in the list.
        values: at the vertices of a plan's part.
        scale: of those of all plans that are shown, so that their colours can be compared.
    """

    heading: str
    values: Callable[[ViewedPlan], FloatArray]
    scale: Callable[[_Plans, _Values], Scale]


QUANTITIES: Final[Mapping[str, Quantity]] = {
    "thickness": Quantity("Thickness", _thickness, _thickness_scale),
    "coverage": Quantity("Gaps and overlaps", _coverage, _coverage_scale),
    "distance": Quantity("Distance from border or source", _distance, _distance_scale),
    "lean": Quantity("Lean of the nozzle", _lean, _lean_scale),
    "speed": Quantity("Speed of the tip", _speed, _speed_scale),
    "margin": Quantity("Margin of the joints", _margin, _margin_scale),
    "clearance": Quantity("Clearance", _clearance, _clearance_scale),
    "overhang": Quantity("Overhang", _overhang, _overhang_scale),
    "curvature": Quantity("Mean curvature", _curvature, _curvature_scale),
}


# What paths alone do not have.
OF_A_MOTION: Final = frozenset({"speed", "margin", "clearance"})


def scale_of(scenes: Sequence[PlanScene], key: str) -> Scale:
    """Return the one scale of a quantity over all plans that are shown."""
    return QUANTITIES[key].scale([scene.plan for scene in scenes], [scene.values(key) for scene in scenes])


def quantities(plan: ViewedPlan) -> dict[str, str]:
    """Return the quantities that a plan can be coloured by: what they are called, and their keys."""
    return {each.heading: key for key, each in QUANTITIES.items() if key not in OF_A_MOTION or plan.motions}
