"""Why poses of a stream cannot be served: reason, place and deposited length lost, by one motion of the arm.

A motion is a branch of the inverse kinematics with a turn about the nozzle and a lean for each pose.
"""

from __future__ import annotations

from enum import IntEnum
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import InputError, PlanError, ReachError
from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen
from geoprint.robot.arm import Arm
from geoprint.robot.reach.keyframes import PoseSamples

# What the details of a refusal begin with that say a share lost for a reason.
LOST = "lost_"
# Shares below this are rounding, not worth a word.
NOTABLE_SHARE = 5e-5


@final
class Reason(IntEnum):
    """Why a pose cannot be served; where several hold, the first of these that does."""

    REACHED = 0
    OUT_OF_REACH = 1
    JOINT_LIMIT = 2
    WRIST = 3
    FLIP = 4
    WINDING = 5


@final
@frozen
class ReachMap:
    """Which poses of a stream a motion serves, and why not the others.

    A pose stands for the straight move that leads to it too: what fails along it is its failure.

    Attributes:
        reasons: (p,) `Reason` of each pose.
        joints: (p,) joint 1 to 6 that the reason is about; 0 where it is about none.
        found: (p,) what was found: distance of the wrist centre from axis 2 [mm] where out of reach, the joint's angle,
            |q5|, or the turn at once [rad]; 0 where reached.
        allowed: (p, 2) least and most of that; 0 where reached.
        servable: (p,) whether any branch and turn about the nozzle serves the pose by itself.
        lengths: (p,) deposited length that belongs to the pose [mm].
        runs: (p,) run.
        places: (p, 3) where the tip fails, or else the pose, in the work frame [mm].
        base_places: (p, 3) the same in the base frame [mm].
        branch: index of the branch, 0 to 7.
    """

    reasons: IntArray
    joints: IntArray
    found: FloatArray
    allowed: FloatArray
    servable: BoolArray
    lengths: FloatArray
    runs: IntArray
    places: FloatArray
    base_places: FloatArray
    branch: int

    def __post_init__(self) -> None:
        freeze_arrays(
            self, reasons="int: p", joints="int: p", found="float: p", allowed="float: p 2", servable="bool: p",
            lengths="float: p", runs="int: p", places="float: p 3", base_places="float: p 3",
        )  # fmt: skip
        if not np.isin(self.reasons, [*Reason]).all():
            raise InputError("the reasons of a reach map must be known ones.")
        if self.lengths.min(initial=0.0) < 0.0:
            raise InputError("the lengths of a reach map must not be negative.")

    @property
    def complete(self) -> bool:
        """Whether every pose is served."""
        return not self.reasons.any()

    @property
    def reached(self) -> int:
        """How many poses are served."""
        return int((self.reasons == Reason.REACHED).sum())

    @property
    def excess(self) -> FloatArray:
        """(p,) by how much each pose is beyond what is allowed [mm where out of reach, else rad]; 0 where reached."""
        return np.maximum(np.maximum(self.allowed[:, 0] - self.found, self.found - self.allowed[:, 1]), 0.0)

    @property
    def lost(self) -> float:
        """Share of the deposited length that cannot be printed, in [0, 1]."""
        return self._share(self.reasons != Reason.REACHED)

    @property
    def unservable(self) -> float:
        """Share of the deposited length that no branch and turn serves even by itself, in [0, 1]."""
        return self._share(~self.servable)

    def shares(self) -> dict[str, float]:
        """Return the share of the deposited length lost for each reason, largest first.

        Reasons are named `out_of_reach`, `joint_1` to `joint_6` (beyond a limit), `wrist_singularity`, `flip` and
        `winding`; those that lose nothing on deposit but refuse the plan have the share 0.
        """
        names = np.array([_name(reason, joint) for reason, joint in zip(self.reasons, self.joints, strict=True)])
        shares = {str(name): self._share(names == name) for name in np.unique(names) if name}
        return dict(sorted(shares.items(), key=lambda item: -item[1]))

    def worst(self, count: int) -> tuple[int, ...]:
        """Return the poses of the worst places: one a stretch of equal reason, the worst reason and excess first."""
        failing = np.flatnonzero(self.reasons)
        keys = np.column_stack([failing - np.arange(failing.size), self.reasons[failing], self.joints[failing]])
        _, stretch = np.unique(keys, axis=0, return_inverse=True)
        order = np.lexsort([-self.excess[failing], self.reasons[failing]])
        _, first = np.unique(stretch.reshape(-1)[order], return_index=True)
        return tuple(int(row) for row in failing[order[np.sort(first)][:count]])

    def describe(self, pose: int) -> str:
        """Say why a pose is not served and where that is, from its run on."""
        found, (low, high) = self.found[pose], self.allowed[pose]
        angle, least, most = np.degrees([found, low, high])
        joint = self.joints[pose]
        what = {
            Reason.REACHED: "is reached",
            Reason.OUT_OF_REACH: f"is out of reach: the wrist would be {found:.0f} mm from axis 2, allowed is "
            f"{low:.0f} to {high:.0f} mm{' in any attitude' if low <= found <= high else ''}",
            Reason.JOINT_LIMIT: f"needs joint {joint} at {angle:.2f} degrees, allowed is {least:.0f} to {most:.0f}",
            Reason.WRIST: f"is near the wrist singularity: joint 5 at {angle:.1f} degrees, at least {least:.1f} is "
            "needed on deposit",
            Reason.FLIP: f"flips the wrist: joint {joint} turns by {angle:.0f} degrees at once, allowed are {most:.0f}",
            Reason.WINDING: (
                f"ends a winding: joint {joint} turns along the runs up to {angle:.0f} degrees, allowed is "
                f"{least:.0f} to {most:.0f}, at any whole turn"
            ),
        }[Reason(int(self.reasons[pose]))]
        where = f"{_place(self.places[pose])} mm (base {_place(self.base_places[pose])} mm)"
        return f"run {self.runs[pose] + 1} at {where} {what}"

    def refusal(self) -> ReachError:
        """Return the error that says which share is lost, for which main reason, and where first."""
        shares = self.shares()
        first = int(np.argmax(self.reasons != Reason.REACHED))
        listed = ", ".join(f"{name.replace('_', ' ')} {_percent(share)}" for name, share in shares.items())
        alone = f"; no motion serves {_percent(self.unservable)}" if self.unservable > NOTABLE_SHARE else ""
        return ReachError(
            f"{self.describe(first)}. The best branch and nozzle rotation reaches {self.reached} of "
            f"{self.reasons.size} poses and loses {_percent(self.lost)} of the deposited length ({listed}{alone}). "
            "Move or turn the part (`geoprint place` looks for a better placement), or use another nozzle.",
            run=int(self.runs[first]),
            work_mm=tuple(self.places[first].tolist()),
            base_mm=tuple(self.base_places[first].tolist()),
            share=self.reached / self.reasons.size,
            lost=self.lost,
            unservable=self.unservable,
            travelling=self.lost == 0.0,
            **{f"{LOST}{name}": share for name, share in shares.items()},
        )

    def _share(self, chosen: BoolArray) -> float:
        total = float(self.lengths.sum())
        return float(self.lengths[chosen].sum()) / total if total > 0.0 else 0.0


@final
@frozen
class Failures:
    """What fails at s samples of a motion.

    Attributes:
        reasons: (s,) `Reason` of each.
        joints: (s,) joint 1 to 6 that the reason is about; 0 where it is about none.
        found: (s,) what was found, in the unit of the reason: mm where out of reach, else rad; 0 where reached.
        allowed: (s, 2) least and most of that; 0 where reached.
    """

    reasons: IntArray
    joints: IntArray
    found: FloatArray
    allowed: FloatArray


def mapped(
    failures: Failures,
    samples: PoseSamples,
    *,
    servable: BoolArray,
    lengths: FloatArray,
    branch: int,
) -> ReachMap:
    """Return the map over poses of what fails at the samples of a motion.

    Args:
        failures: of each sample.
        samples: s samples of p poses.
        servable: (s,) whether any branch and turn serves the sample.
        lengths: (p,) deposited length of each pose [mm].
        branch: of the motion.
    """
    count = failures.reasons.size
    rows = np.where(failures.reasons != Reason.REACHED, np.arange(count), count)
    moves = np.append(0, samples.starts[:-1] + 1)
    first = np.minimum.reduceat(rows, moves)
    at = np.where(first < count, first, samples.starts)
    tips = samples.Ts_base_tool[at, :3, 3]
    return ReachMap(
        reasons=failures.reasons[at],
        joints=failures.joints[at],
        found=failures.found[at],
        allowed=failures.allowed[at],
        servable=np.logical_and.reduceat(servable, moves),
        lengths=lengths,
        runs=samples.runs[at],
        places=transforms.apply(transforms.inverse(samples.T_base_work), tips),
        base_places=tips,
        branch=branch,
    )


def lost_shares(error: PlanError) -> tuple[tuple[str, float], ...]:
    """Return reasons and shares of the deposited length that a refusal says are lost; empty where it says none."""
    details = error.details.items()
    return tuple(
        (name.removeprefix(LOST), float(share))
        for name, share in details
        if name.startswith(LOST) and isinstance(share, float)
    )


def wrist_distances(Ts_base_tool: FloatArray, arm: Arm) -> tuple[FloatArray, FloatArray]:
    """Return the (k,) distances of the wrist centre from axis 2 with the arm facing it, and their (2,) bounds [mm]."""
    return arm.inverse.wrist_distances(Ts_base_tool @ transforms.inverse(arm.T_flange_tool))


def _name(reason: int, joint: int) -> str:
    return {
        Reason.REACHED: "",
        Reason.OUT_OF_REACH: "out_of_reach",
        Reason.JOINT_LIMIT: f"joint_{joint}",
        Reason.WRIST: "wrist_singularity",
        Reason.FLIP: "flip",
        Reason.WINDING: "winding",
    }[Reason(reason)]


def _place(position: FloatArray) -> str:
    return f"({', '.join(f'{value:.1f}' for value in position)})"


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
