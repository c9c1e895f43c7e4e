"""What a program has to carry out: its targets with their times, and the places where outputs switch.

Plain values, which the writer and whoever checks it share: `ordering` and `switching` make them of a plan.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, TypeAlias, final

import numpy as np

from geoprint.model import BoolArray, Dispensing, FloatArray, IntArray, comparable
from geoprint.model.values import freeze_arrays, frozen

# Positions are written to four decimals: what is nearer than this [mm] is one place, and a move there only turns.
SMALLEST_STEP = 1e-4
Output = Literal["dispenser", "uv_lamp", "vacuum"]
# Tips (k, 3) in the work frame [mm] at (k,) times of the trajectory [s].
TipsAt: TypeAlias = Callable[[FloatArray], FloatArray]


@final
@frozen
class Orders:
    """The targets of a program.

    Attributes:
        poses: (t,) row of the pose stream (and of poses.csv) that each target is.
        tips: (t, 3) tip of the nozzle in the work frame [mm].
        quaternions: (t, 4) attitude of the tool, w x y z.
        joints: (t, 6) at each [rad].
        zones: (t,) radius in which the controller may round the target [mm]; 0 stops there.
        speeds: (t,) of the tip in the move to the target [mm/s].
        runs: (t,) run of each target.
        deposited: (t,) whether material is deposited from the target to the next one; not from the last.
        flow: (t,) volume to deposit per length from the target to the next [mm3/mm], 0 where none is deposited.
        times: (t,) when each is passed; home is left at 0 [s].
        lifted_joints: (t, 6) at the targets of the dry run, which is driven higher [rad].
        extent: (2, 3) lowest and highest coordinates of the part in the work frame [mm].
        duration: from home to home [s].
        frame: by how much the part's middle may shift, and at once its farthest point turn about it, until an axis of a
            target meets a border of its quadrants, printed or lifted [mm]; infinite where no joints are known.
    """

    poses: IntArray
    tips: FloatArray
    quaternions: FloatArray
    joints: FloatArray
    zones: FloatArray
    speeds: FloatArray
    runs: IntArray
    deposited: BoolArray
    flow: FloatArray
    times: FloatArray
    lifted_joints: FloatArray
    extent: FloatArray
    duration: float
    frame: float = np.inf

    def __post_init__(self) -> None:
        freeze_arrays(
            self, poses="int: t", tips="float: t 3", quaternions="float: t 4", joints="float: t 6",
            zones="float: t", speeds="float: t", runs="int: t", deposited="bool: t", flow="float: t", times="float: t",
            lifted_joints="float: t 6", extent="float: 2 3",
        )  # fmt: skip

    @property
    def count(self) -> int:
        """Number of targets t."""
        return int(self.poses.size)

    @property
    def deposits(self) -> tuple[tuple[int, int], ...]:
        """First and last target of each stretch on which material is deposited, in order."""
        edges = np.diff(self.deposited.astype(np.int8), prepend=0)
        starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
        return tuple(zip(starts.tolist(), ends.tolist(), strict=True))

    @property
    def shortest_move(self) -> float:
        """Shortest move of the tip from a target to the next, turns on the spot left out [mm]."""
        lengths = np.linalg.norm(np.diff(self.tips, axis=0), axis=1)
        return float(lengths.min(where=lengths > SMALLEST_STEP, initial=np.inf))

    @property
    def start(self) -> FloatArray:
        """(6,) joints at the first target [rad]."""
        return self.joints[0]

    @property
    def lifted(self) -> FloatArray:
        """(6,) joints at the first target of the dry run [rad]."""
        return self.lifted_joints[0]

    @property
    def there(self) -> float:
        """Time from home to the first target [s]."""
        return float(self.times[0])

    @property
    def back(self) -> float:
        """Time from the last target to home [s]."""
        return self.duration - float(self.times[-1])


def dispensing_along(
    orders: Orders,
    *,
    times: FloatArray,
    tips: FloatArray,
    moves: IntArray,
    runs: IntArray,
    valve: Sequence[tuple[float, bool]],
    flow: Sequence[tuple[float, float]] = (),
) -> Dispensing:
    """Return what a program commands along its path, from how it was executed.

    Args:
        orders: that it carries out.
        times: (k,) moments [s].
        tips: (k, 3) where its tip is then, in the work frame [mm].
        moves: (k,) target that it moves to then.
        runs: (k,) run that it prints then.
        valve: when the valve is switched [s], and whether it opens then.
        flow: when a flow is set [s], and to how much [mm3/mm].
    """
    deposited = orders.deposited[moves - 1]
    # Counted from the first place of each run where material is deposited.
    arcs = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(tips, axis=0), axis=1)))
    for run in np.unique(runs).tolist():
        own = runs == run
        begins = np.flatnonzero(own & deposited)
        arcs[own] -= arcs[begins[0] if begins.size else int(np.argmax(own))]
    return Dispensing(
        times=times,
        tips=tips,
        runs=runs,
        arcs=arcs,
        wanted=np.where(deposited, orders.flow[moves - 1], 0.0),
        valve_times=np.array([time for time, _ in valve]),
        valve_open=np.array([on for _, on in valve], dtype=np.bool_),
        flow_times=np.array([time for time, _ in flow]),
        flows=np.array([value for _, value in flow]),
    )


@final
@comparable
class Event:
    """An output that switches during the move to a target.

    Attributes:
        target: index of the target that the move leads to.
        distance: of the tip from the end of the move, or from its start [mm].
        from_start: whether the distance counts from the start of the move.
        output: which one.
        on: whether it is switched on.
    """

    target: int
    distance: float
    from_start: bool
    output: Output
    on: bool
