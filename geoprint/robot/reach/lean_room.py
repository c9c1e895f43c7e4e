"""Where a nozzle may lean: whether it has room and stays in the cone, at single poses, before anything is proved.

Needle, cone and barrel are round, so that the answer does not depend on how the tool is turned about the nozzle. On
deposit the rim of the needle needs room over the surface too, on travel its tip must not touch. What is found here
only chooses the lean; the proof is `clearance`, which looks at all of the tool and between the poses.
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream, Process, Tool, frozen
from geoprint.robot.collision import (
    NOT_TESTED,
    SMALLEST_ROOM,
    CheckedWorld,
    CollisionWorld,
    inflated_solids,
    tool_solids,
)

# Room that is asked for beyond what has to be kept [mm]: what the proof needs, and what lies between two poses.
MARGIN = 0.15
RIM_MARGIN = 0.01
# The first of `tool_solids`, which are asked: tip, needle, cone and barrel. Bracket and lamp depend on the turn.
ROUND_SOLIDS = 4
# Leans that are tried: shares of the cone, and directions.
LEAN_SHARES = (0.35, 0.7, 1.0)
LEAN_DIRECTIONS = 8
# A spline at a place depends on keyframes less than this far from it, and mostly on those nearer than one.
SPLINE_REACH = 2.0
# What a millimetre costs at full lean, and without room.
LEAN_COST = 1.0
LACKING_COST = 1e4
# Candidates stay inside the cone by this [rad], because a blend of leans may lean a little more than each of them.
CONE_MARGIN = float(np.radians(0.5))
# Rounding of angles that are compared with the cone [rad].
ROUNDING = 1e-9


@final
class NozzleRoom:
    """Everything that the nozzle must not touch.

    Args:
        tool: its solids.
        process: clearance to keep.
        standoff: height of the tip over the surface on deposit [mm].
        scene: what stands there, in the work frame.
        T_base_work: (4, 4) where the part stands [mm].

    Raises:
        VerificationError: the collision check fails on what is known.
    """

    __slots__ = ("_T_work_base", "_radius", "_standoff", "_world", "_zones")

    def __init__(
        self, tool: Tool, *, process: Process, standoff: float, scene: CheckedWorld, T_base_work: FloatArray
    ) -> None:
        self._T_work_base = transforms.inverse(T_base_work)
        solids = tool_solids(tool)[:ROUND_SOLIDS]
        kept = tuple(process.clearance if solid.reach_below > 0.0 else 0.0 for solid in solids)
        self._zones = scene.zones
        self._world = CollisionWorld(inflated_solids(solids, kept, (MARGIN,)), targets=scene.targets)
        self._radius = tool.needle_diameter / 2.0
        self._standoff = standoff

    def lacking(self, Ts_base_tool: FloatArray, *, deposit: BoolArray) -> BoolArray:
        """Return (k,) whether the nozzle lacks room at (k, 4, 4) poses [mm], which deposit material or not."""
        if not len(Ts_base_tool):
            return np.zeros(0, dtype=np.bool_)
        poses = self._T_work_base @ Ts_base_tool
        reaches = np.full((len(poses), ROUND_SOLIDS), MARGIN)
        reaches[deposit, 0] = NOT_TESTED
        lacking: BoolArray = np.asarray(self._world.touches(poses, reaches=reaches).any(axis=(1, 2)))
        asked = np.flatnonzero(deposit & ~lacking)
        for zone in self._zones if asked.size else ():
            rooms = zone.rooms(poses[asked], radius=self._radius, standoff=self._standoff)
            lacking[asked] |= rooms < SMALLEST_ROOM + RIM_MARGIN
        return lacking


@final
@frozen
class Leaning:
    """How far the nozzle may lean, and what it must not touch.

    Attributes:
        max_tilt: largest angle between nozzle and surface normal on deposit [rad].
        room: what the nozzle must not touch.
    """

    max_tilt: float
    room: NozzleRoom


def candidate_leans(max_tilt: float) -> FloatArray:
    """Return (l, 2) leans about the tool's x and y axes [rad], none first."""
    turns = 2.0 * np.pi * np.arange(LEAN_DIRECTIONS) / LEAN_DIRECTIONS
    widest = max(max_tilt - CONE_MARGIN, 0.0)
    rings = [share * widest * np.column_stack([np.cos(turns), np.sin(turns)]) for share in LEAN_SHARES]
    return np.concatenate([np.zeros((1, 2)), *rings])


def depositing(poses: PoseStream) -> BoolArray:
    """Return (p,) whether material is deposited before or behind a pose."""
    return np.append(poses.deposited, False) | np.append(False, poses.deposited)


def lean_costs(
    leans: FloatArray,
    *,
    poses: PoseStream,
    Ts_base_tool: FloatArray,
    places: FloatArray,
    rungs: IntArray,
    leaning: Leaning,
    weight: float,
) -> FloatArray:
    """Return what leans cost at keyframes, by what they do to the poses around.

    A keyframe's lean counts at the poses nearer than one keyframe, each by how near it is: without room there it costs
    `LACKING_COST`. A lean that leaves the cone at any pose that depends on it is not allowed; no lean always is.

    Args:
        leans: (l, 2) none first [rad].
        poses: p poses of the path.
        Ts_base_tool: (p, 4, 4) the same in the base frame [mm].
        places: (p,) of the poses among the keyframes.
        rungs: (r,) keyframes that may lean.
        leaning: the cone and what must not be touched.
        weight: of the lean itself.

    Returns:
        (r, l) [1/mm]; infinite where a lean is not allowed.
    """
    near = np.abs(places[:, None] - rungs).min(axis=1) < SPLINE_REACH
    rows = np.flatnonzero(near)
    deposited = depositing(poses)[rows]
    lacking, outside = np.empty((2, rows.size, len(leans)), dtype=np.bool_)
    for column, lean in enumerate(leans):
        turn = transforms.rigid(Rotation.from_rotvec([*lean, 0.0]).as_matrix(), np.zeros(3))
        leaned = Ts_base_tool[rows] @ turn
        lacking[:, column] = leaning.room.lacking(leaned, deposit=deposited)
        axes = transforms.rotation_of(poses.quaternions[rows]) @ turn[:3, 2]
        cosines = -np.einsum("ij,ij->i", axes, poses.normals[rows])
        outside[:, column] = deposited & (cosines < np.cos(max(leaning.max_tilt - CONE_MARGIN, 0.0) + ROUNDING))
    outside[:, 0] = False
    own = weight * LEAN_COST * (np.linalg.norm(leans, axis=1) / leaning.max_tilt) ** 2
    costs = np.empty((rungs.size, len(leans)))
    for index, rung in enumerate(rungs):
        away = np.abs(places[rows] - rung)
        shares = np.maximum(1.0 - away, 0.0)
        costs[index] = own + LACKING_COST * (shares @ lacking) / max(float(shares.sum()), np.finfo(np.float64).tiny)
        costs[index, outside[away < SPLINE_REACH].any(axis=0)] = np.inf
    return costs
