"""How a part may be turned where it stands, so that the arm reaches all of it and only the nozzle comes near it.

The centroid stays; tilt and yaw are tried on a coarse grid. An orientation is judged by the margin of `angle_margins`
on one branch, at each sample with the turn about the nozzle that suits it best and keeps the tool off the obstacles:
more than one motion along the path can have, so that what fails here fails for certain at the turns tried. The
best are followed by `reach`, and what does not depend on the lean of the nozzle is looked at for collisions: bracket,
lamp and links against everything, all of the tool against obstacles. Needle, cone and barrel stand over the part as
they do in any orientation. Nothing is drawn by chance.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import final

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import ReachError
from geoprint.model import BoolArray, Box, FloatArray, IntArray, JointPath, PoseStream, Process, Surface, Tool, frozen
from geoprint.robot.arm import BRANCHES, JOINTS, Arm, about_nozzle
from geoprint.robot.collision import (
    NOT_TESTED,
    CollisionWorld,
    box_target,
    inflated_solids,
    link_solids,
    mesh_target,
    tool_solids,
)
from geoprint.robot.collision.tool_solids import Solid
from geoprint.robot.placing.placement_search import FixturePose, Room, judged_samples
from geoprint.robot.reach import PoseSamples, angle_margins, reach, sample_poses

# Tilts that are tried [degrees] and in how many directions; in each so many yaws, and turns about the nozzle.
RINGS = ((0.0, 1), (15.0, 8), (30.0, 12), (45.0, 16), (60.0, 16), (75.0, 16))
YAWS = 24
SPINS = 12
# Samples that tell what is hopeless, before all are judged.
FIRST_SAMPLES = 12
# Orientations that are followed along the whole path, and those that are enough.
FOLLOWED = 10
ENOUGH_FOUND = 3
# A larger margin than this is worth no larger tilt [rad].
ENOUGH_MARGIN = float(np.radians(10.0))
# Poses at which collisions are looked for, and room beyond what is to be kept: what the proof needs, and what lies
# between two of them [mm].
LOOKED_AT = 120
CLEAR = 1.0
# The first of `tool_solids`, tip to barrel, are round about the nozzle.
ROUND_SOLIDS = 4
# The link that holds the middle of the wrist.
WRIST = 5
# Orientations are told, and stated in cell files, with so many decimals of a degree.
DECIMALS = 1


@final
@frozen
class Scene:
    """What stands around, and what the arm carries.

    Attributes:
        tool: with its solids.
        process: with the clearance to keep.
        part: in the work frame.
        body: what it lies on, or None.
        room: where both may stand; its obstacles count.
    """

    tool: Tool
    process: Process
    part: Surface
    body: Surface | None
    room: Room

    @property
    def obstacles(self) -> tuple[Box, ...]:
        """Boxes in the base frame."""
        return self.room.obstacles


@final
@frozen
class Oriented:
    """An orientation that serves, as far as the search can tell.

    Attributes:
        pose: where the part's centroid is, and how it is turned.
        margin: smallest over the poses of the motion that reaches it [rad].
        tilt: angle of the mean normal from upright [rad].
    """

    pose: FixturePose
    margin: float
    tilt: float


def search_orientation(
    poses: PoseStream, arm: Arm, *, T_fixture_work: FloatArray, position: FloatArray, scene: Scene
) -> tuple[tuple[Oriented, ...], int]:
    """Search tilt and yaw of a part about its centroid.

    Args:
        poses: the stream to print, in the work frame; its attitudes are taken to turn with the part.
        arm: with its tool; its inverse has a closed form.
        T_fixture_work: (4, 4) the part with its mean normal up and its centroid at the origin.
        position: (3,) where the centroid stays, in the base frame [mm].
        scene: what must not be touched.

    Returns:
        Up to three orientations: those with more margin first, up to ten degrees of it; of these, and of equal ones,
        the less tilted, then the less turned. And how many were tried.
    """
    samples = sample_poses(poses, T_base_work=T_fixture_work)
    judge = _OrientationJudge(samples, arm, rows=judged_samples(samples.Ts_base_tool), scene=scene)
    candidates = list(_grid(position))
    judged = [(pose, tilt, judge.margin(pose)) for pose, tilt in candidates if scene.room.permits(pose)]
    hopeful = [(pose, tilt, margin) for pose, tilt, margin in judged if margin > 0.0]
    hopeful.sort(key=lambda each: _merit(each[2], each[1]))
    found: list[Oriented] = []
    for pose, tilt, _ in hopeful[:FOLLOWED]:
        try:
            path = reach(poses, arm, T_base_work=pose.T_base_fixture @ T_fixture_work)
        except ReachError:
            continue
        if not _hits(path, arm, scene=scene):
            margins = angle_margins(path.joints, arm, deposit=path.poses.deposit)
            found.append(Oriented(pose, float(margins.min()), tilt))
        if len(found) == ENOUGH_FOUND:
            break
    found.sort(key=lambda each: _merit(each.margin, each.tilt))
    return tuple(found), len(candidates)


def _merit(margin: float, tilt: float) -> tuple[float, float]:
    """Return what orders orientations: the least is best; equal ones stay in the order of the grid."""
    return (-min(margin, ENOUGH_MARGIN), tilt)


def _grid(position: FloatArray) -> Iterator[tuple[FixturePose, float]]:
    """Yield places and their tilts [rad]: upright first, then tilted more; the least turned first."""
    yaws = sorted((transforms.wrapped(2.0 * np.pi * np.arange(YAWS) / YAWS)).tolist(), key=abs)
    for tilt, directions in RINGS:
        for direction in 2.0 * np.pi * np.arange(directions) / directions:
            tilted = Rotation.from_rotvec(np.radians(tilt) * np.array([np.cos(direction), np.sin(direction), 0.0]))
            for yaw in yaws:
                rpy = (Rotation.from_euler("z", yaw) * tilted).as_euler("xyz", degrees=True).round(DECIMALS) + 0.0
                yield FixturePose(position, np.radians(rpy)), float(np.radians(tilt))


@final
class _OrientationJudge:
    """Judges places on samples of a stream, each at the turn about the nozzle that suits it best."""

    def __init__(self, samples: PoseSamples, arm: Arm, *, rows: IntArray, scene: Scene) -> None:
        first = rows[np.linspace(0, rows.size - 1, min(FIRST_SAMPLES, rows.size)).round().astype(np.int64)]
        self._arm, self._scene, self._stages = arm, scene, (first, np.setdiff1d(rows, first))
        self._Ts, self._deposit = samples.Ts_base_tool, samples.deposit
        # A nozzle on the flange's axis turns by joint 6 alone.
        self._round = _rounds(arm, scene.tool)
        self._spins = about_nozzle(2.0 * np.pi * np.arange(1 if arm.sense_of_turn else SPINS) / SPINS)[:, None]

    def margin(self, pose: FixturePose) -> float:
        """Return the margin of the best branch [rad]; minus infinity where none serves every sample."""
        worst = np.full(BRANCHES, np.inf)
        for rows in self._stages:
            if rows.size and worst.max() > 0.0:
                worst = np.minimum(worst, self._margins(pose, rows))
        return float(worst.max())

    def _margins(self, pose: FixturePose, rows: IntArray) -> FloatArray:
        """Return (8,) the smallest margin on each branch over some samples."""
        Ts = pose.T_base_fixture @ self._Ts[rows] @ self._spins
        joints = self._arm.solutions(Ts.reshape(-1, 4, 4)).reshape(*Ts.shape[:2], BRANCHES, JOINTS)
        margins = angle_margins(np.moveaxis(joints, 1, 2), self._arm, deposit=self._deposit[rows]).min(axis=-1)
        margins = np.where(np.isnan(margins), -np.inf, margins)
        close = _near_obstacles(Ts, self._round, self._scene)
        margins[np.broadcast_to(close[:, None], margins.shape)] = -np.inf
        return margins.max(axis=0).min(axis=-1)


def _rounds(arm: Arm, tool: Tool) -> tuple[Solid, ...]:
    """Return in the frame of the tool what stays there on any branch: the tool's solids but its tip, and the wrist.

    Where its axes 4 to 6 meet, the wrist is about as wide as link 5 is.
    """
    frames = arm.link_poses(arm.robot.home[None])[0]
    wrist = (transforms.inverse(frames[-1]) @ frames[WRIST])[:3, 3]
    links = link_solids(arm.robot.model, urdf=arm.robot.urdf, flange=arm.robot.flange)
    radius = max(solid.start_radius for link in links if link.joint == WRIST for solid in link.solids)
    axis = np.array([0.0, 0.0, radius / np.sqrt(3.0)])
    return (*tool_solids(tool)[1:], Solid("wrist", wrist - axis, wrist + axis, radius, radius))


def _near_obstacles(Ts_base_tool: FloatArray, solids: tuple[Solid, ...], scene: Scene) -> BoolArray:
    """Return (...) whether the box about a solid in the tool's frame, at (..., 4, 4) poses, comes near an obstacle."""
    close = np.zeros(Ts_base_tool.shape[:-2], dtype=np.bool_)
    for solid in solids:
        ends = [Ts_base_tool[..., :3, :3] @ end + Ts_base_tool[..., :3, 3] for end in (solid.start, solid.end)]
        across = np.sqrt((1.0 - ((ends[1] - ends[0]) / solid.length) ** 2).clip(0.0))
        radii = (solid.start_radius, solid.end_radius)
        least = np.minimum(*(end - radius * across for end, radius in zip(ends, radii, strict=True)))
        most = np.maximum(*(end + radius * across for end, radius in zip(ends, radii, strict=True)))
        for box in scene.obstacles:
            near = scene.process.clearance + CLEAR
            bottom, top = box.centre - box.size / 2.0 - near, box.centre + box.size / 2.0 + near
            close |= ((least < top) & (most > bottom)).all(axis=-1)
    return close


def _hits(path: JointPath, arm: Arm, *, scene: Scene) -> bool:
    """Say whether bracket, lamp or a link comes near something at some poses, or the tool near an obstacle."""
    rows = np.unique(np.linspace(0, path.poses.count - 1, LOOKED_AT).round().astype(np.int64))
    joints, T_work_base = path.joints[rows], transforms.inverse(path.T_base_work)
    surfaces = [mesh_target(scene.part, role="part")]
    surfaces += [] if scene.body is None else [mesh_target(scene.body, role="body")]
    boxes = [box_target(box, T_work_base=T_work_base) for box in scene.obstacles]
    solids = tool_solids(scene.tool)
    world = CollisionWorld(
        inflated_solids(solids, (0.0,) + (scene.process.clearance,) * (len(solids) - 1), (CLEAR,)),
        targets=(*surfaces, *boxes),
    )
    reaches = np.full((rows.size, len(solids)), CLEAR)
    reaches[:, 0] = NOT_TESTED
    touching = world.touches(T_work_base @ arm.tool_poses(joints), reaches=reaches)
    if touching[:, ROUND_SOLIDS:].any() or touching[:, :, len(surfaces) :].any():
        return True
    beside = [target for target, box in zip(boxes, scene.obstacles, strict=True) if _above_the_foot(box)]
    frames = T_work_base @ arm.link_poses(joints)
    for link in link_solids(arm.robot.model, urdf=arm.robot.urdf, flange=arm.robot.flange):
        # The base stands on what ends below its foot, and link 1 turns above it.
        targets = (*surfaces, *(boxes if link.joint > 1 else beside))
        kept = (scene.process.clearance,) * len(link.solids)
        moving = CollisionWorld(inflated_solids(link.solids, kept, (CLEAR,)), targets=targets)
        if moving.touches(frames[:, link.joint], reaches=np.full((rows.size, len(kept)), CLEAR)).any():
            return True
    return False


def _above_the_foot(box: Box) -> bool:
    return float(box.centre[2] + box.size[2] / 2.0) > 0.0
