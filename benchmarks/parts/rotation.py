"""What the search for turn about the nozzle and branch takes and finds: tables of `benchmarks.motion`."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.parts.spirals import spiral
from benchmarks.parts.tables import row, table
from geoprint import transforms
from geoprint.model import FloatArray, PoseStream, SearchWeights
from geoprint.motion.arm import Arm
from geoprint.motion.arm.closed_form import BRANCHES
from geoprint.motion.reach import reach_margin
from geoprint.motion.reach.attitude_search import Attitudes, UprightSearch
from geoprint.motion.reach.costs import Terms, cost_terms
from geoprint.motion.reach.keyframes import path_lengths
from geoprint.motion.reach.ladder import Rungs, climb
from geoprint.motion.reach.margins import MINIMUM_WRIST_ANGLE
from geoprint.motion.reach.pose_samples import tool_poses

REPEATS = 5
DOME = transforms.rigid(np.eye(3), np.array([300.0, 0.0, 50.0]))  # where the dome stands for the search
ARC_RADIUS, ARC_ANGLE = 320.0, 1.5  # of the long arc about the base [mm, rad]
DENSE_TURNS = 720  # of the dense ladder
# Where the dome stands beside the dense ladder [mm]: where the part is put, near the base, aside, far and high.
DENSE_PLACES = ((300.0, 0.0, 50.0), (220.0, 60.0, 50.0), (150.0, 280.0, 80.0), (420.0, -80.0, 120.0))


def rotation(arm: Arm, *, counts: tuple[int, ...], dense: int) -> Iterator[str]:
    """Yield a table of the search for turn and branch, and the cost of its climb beside that of a dense ladder."""
    terms = cost_terms(arm, weights=SearchWeights(), minimum_wrist_angle=MINIMUM_WRIST_ANGLE)
    yield from table("poses", "turn and branch, us a pose", "with exact inverse and its checks", "peak bytes a pose")
    for count in counts:
        poses = spiral(count, standoff=0.3)
        search = partial(_searched, poses, arm, terms, T_base_work=DOME)
        times = [_least_cpu_seconds(work) for work in (search, partial(reach_margin, poses, arm, T_base_work=DOME))]
        yield row(
            str(count), *(f"{seconds / count * 1e6:.1f}" for seconds in times), f"{_peak_bytes(search) / count:.0f}"
        )
    yield from table("path", "cost of the climb", "cost of the dense ladder", "ratio")
    streams = [("dome", place, spiral(dense, standoff=0.3)) for place in DENSE_PLACES]
    for name, place, poses in [*streams, ("arc about the base", (0.0, 0.0, 80.0), _arc(dense))]:
        T_base_work = transforms.rigid(np.eye(3), np.array(place))
        found = _cost_of(_searched(poses, arm, terms, T_base_work=T_base_work), poses, terms, T_base_work)
        least = _dense_cost(poses, terms, T_base_work)
        yield row(f"{name} at {place}", f"{found:.3f}", f"{least:.3f}", f"{found / least:.4f}")


def _arc(count: int) -> PoseStream:
    """Return poses on a wide arc about the base, the nozzle straight down and not turned with it."""
    azimuths = np.linspace(-ARC_ANGLE, ARC_ANGLE, count)
    tips = ARC_RADIUS * np.column_stack([np.cos(azimuths), np.sin(azimuths), np.zeros(count)])
    down = np.tile(transforms.quaternion_of(np.diag([1.0, -1.0, -1.0])), (count, 1))
    return replace(
        spiral(count, standoff=0.3), tips=tips, quaternions=down, normals=np.tile([0.0, 0.0, 1.0], (count, 1))
    )


def _searched(poses: PoseStream, arm: Arm, terms: Terms, *, T_base_work: FloatArray) -> Attitudes:
    search = UprightSearch(poses, arm, T_base_work=T_base_work, terms=terms)
    return search.attitudes(search.branches[0], dense=np.zeros(poses.count, dtype=np.bool_))


def _cost_of(attitudes: Attitudes, poses: PoseStream, terms: Terms, T_base_work: FloatArray) -> float:
    """Return what the smooth climb costs with every pose a rung."""
    rungs = _every_pose(poses, attitudes.rotations[:, None], T_base_work=T_base_work)
    return float(climb(rungs, terms, branches=np.arange(BRANCHES) == attitudes.branch).costs[attitudes.branch])


def _dense_cost(poses: PoseStream, terms: Terms, T_base_work: FloatArray) -> float:
    """Return the least cost over all branches and 720 turns at every pose."""
    turns = 2.0 * np.pi * np.arange(DENSE_TURNS) / DENSE_TURNS - np.pi
    rungs = _every_pose(poses, np.tile(turns, (poses.count, 1)), T_base_work=T_base_work)
    return float(climb(rungs, terms, branches=np.ones(BRANCHES, dtype=np.bool_)).costs.min())


def _every_pose(poses: PoseStream, turns: FloatArray, *, T_base_work: FloatArray) -> Rungs:
    each = turns.shape[1]
    return Rungs(
        Ts_base_tool=tool_poses(poses, T_base_work=T_base_work),
        deposit=poses.deposit,
        steps=np.diff(path_lengths(poses)),
        candidates=np.column_stack([turns.reshape(-1), np.zeros((turns.size, 2))]),
        offsets=each * np.arange(poses.count + 1, dtype=np.int64),
        extra=np.zeros(turns.size),
    )


def _peak_bytes(work: Callable[[], object]) -> int:
    tracemalloc.start()
    work()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def _least_cpu_seconds(work: Callable[[], object]) -> float:
    """Return the least processor time of several runs: others on the machine lengthen the clock's."""
    work()
    times: list[float] = []
    for _ in range(REPEATS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)
