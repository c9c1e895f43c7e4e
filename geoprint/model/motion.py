"""Motion: joint angles for every pose, the timed trajectory, and what was found clear."""

from __future__ import annotations

from dataclasses import field, replace
from typing import Literal, final

import numpy as np

from geoprint.errors import InputError, how_many
from geoprint.model.path import PoseStream
from geoprint.model.values import (
    BoolArray,
    FloatArray,
    IntArray,
    Place,
    Rounded,
    comparable,
    freeze_arrays,
    frozen,
    recorded,
)


@final
@frozen
class JointPath:
    """Joint angles of every pose, all on one branch of the inverse kinematics.

    Attributes:
        poses: the stream as commanded: turned about the nozzle by `rotations`, and leaned by `leans`.
        joints: (p, 6) angles [rad], continuous from pose to pose, inside the limits.
        branch: index of the branch, 0 to 7.
        rotations: (p,) turn about the nozzle's axis that was added to each pose [rad], continuous from pose to pose.
        leans: (p, 2) lean that was added before that, about the tool's x and y axes [rad].
        T_base_work: (4, 4) where the part stands.
        via_rows: (e,) places on the straight moves between poses that the timed path has to pass as well, rising: row
            of the pose before, and the share of the move.
        via_joints: (e, 6) angles there [rad].
        bulges: (b, 2) how far the timed path is from the straight move to the next pose at most [mm and rad], of every
            pose, or of none (b = 0) where nobody has looked.
    """

    poses: PoseStream
    joints: FloatArray
    branch: int
    rotations: FloatArray
    leans: FloatArray
    T_base_work: FloatArray
    via_rows: FloatArray = field(default_factory=lambda: np.empty(0))
    via_joints: FloatArray = field(default_factory=lambda: np.empty((0, 6)))
    bulges: FloatArray = field(default_factory=lambda: np.empty((0, 2)))

    def __post_init__(self) -> None:
        sizes = freeze_arrays(
            self, joints="float: p 6", rotations="float: p", leans="float: p 2",
            T_base_work="float: 4 4", via_rows="float: e", via_joints="float: e 6", bulges="float: b 2",
        )  # fmt: skip
        if sizes["p"] != self.poses.count:
            raise InputError(f"the joint path has {sizes['p']} rows for {how_many(self.poses.count, 'pose')}.")

    def between(self, first: int, behind: int) -> JointPath:
        """Return the poses from row `first` to before row `behind`."""
        rows, vias = slice(first, behind), (self.via_rows > first) & (self.via_rows < behind - 1)
        return replace(
            self, poses=self.poses.between(first, behind), joints=self.joints[rows],
            rotations=self.rotations[rows], leans=self.leans[rows],
            via_rows=self.via_rows[vias] - first, via_joints=self.via_joints[vias], bulges=self.bulges[rows],
        )  # fmt: skip

    @property
    def smallest_wrist_angle(self) -> float:
        """Smallest |q5| over all poses [rad]: the distance from the wrist singularity."""
        return float(np.abs(self.joints[:, 4]).min())

    @property
    def turns_of_joint_6(self) -> float:
        """Turns between the lowest and the highest angle of joint 6, counted along the path."""
        return float(np.ptp(self.joints[:, 5]) / (2.0 * np.pi))


# What is done where joints or targets do not hold the set speed: find one for the whole print at which a valve that
# only opens and shuts deposits what was planned, or keep the one that is set.
OnSlowdown = Literal["auto", "follow"]


@final
@recorded(
    "SlowdownRecord", place="place_mm", arc="arc_mm", length="length_mm", set_speed="set_mm_s", held_speed="held_mm_s"
)
class Slowdown:
    """A stretch of deposit on which joints or targets do not hold the print's speed; the ramps of runs are none.

    Attributes:
        run: number of the run, from 0, as in the pose stream.
        place: position of the tip where the speed is smallest, in the work frame [mm].
        arc: arc length from the start of the run to where the speed is smallest [mm].
        length: length of the stretch [mm].
        set_speed: speed of the print that was set [mm/s].
        held_speed: smallest speed on the stretch [mm/s].
        joint: number of the joint that limits the speed there, 1 to 6; 0 where it is none.
        limit: limit of the joint that is met, or 'targets' where targets would follow each other sooner than a
            controller takes.
    """

    run: int
    place: Place
    arc: Rounded
    length: Rounded
    set_speed: float
    held_speed: Rounded
    joint: int
    limit: Literal["speed", "acceleration", "targets"]


@final
@frozen
class Trajectory:
    """The whole motion in time, from home to home, a row each millisecond.

    Attributes:
        times: (k,) [s], evenly spaced from 0.
        joints: (k, 6) [rad].
        runs: (k,) run of the pose stream, -1 from and to home.
        deposit: (k,) whether material is deposited.
        pose_times: (p,) when each pose of the stream is reached [s].
        stretched: runs that were slowed because the time parameterisation broke a limit between its grid points.
        slowest_deposit: smallest speed of the bead, away from the ends of runs [mm/s].
        slowdowns: every stretch of deposit below 99 % of the set speed, away from the ends of runs, in printing order.
        share_at_speed: share of the deposited length within 1 % of the set speed.
        share_on_ramps: share of it that is not, but lies on the ramps at the ends of runs.
    """

    times: FloatArray
    joints: FloatArray
    runs: IntArray
    deposit: BoolArray
    pose_times: FloatArray
    stretched: int
    slowest_deposit: float
    slowdowns: tuple[Slowdown, ...]
    share_at_speed: float
    share_on_ramps: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, times="float: k", joints="float: k 6", runs="int: k", deposit="bool: k", pose_times="float: p",
        )  # fmt: skip

    @property
    def duration(self) -> float:
        """Time from home to home [s]."""
        return float(self.times[-1])


@final
@comparable
class Bend:
    """A bend of the path that straight moves between its poses do not follow within tolerance and period.

    Attributes:
        run: run of the pose stream.
        kind: 'rounded' where targets stand outside of the bend, so that the controller's corners pass it; 'close' where
            targets follow each other sooner than a controller takes.
        place: tip in its middle, in the work frame [mm].
        arc: of that place, from the start of the run [mm].
        radius: of the path there [mm].
        targets: number of them in the bend.
        offset: largest distance of one of them from the path [mm].
        shortest: least time of a move in the bend [s].
    """

    run: int
    kind: Literal["rounded", "close"]
    place: tuple[float, float, float]
    arc: float
    radius: float
    targets: int
    offset: float
    shortest: float


@final
@frozen
class Targets:
    """The poses that are written as robtargets; the controller joins them by straight lines.

    Attributes:
        poses: (t,) ascending indices into the pose stream; all stops and all changes of deposit are among them.
        zones: (t,) radius in which the controller may round a target [mm]; 0 stops there (fine).
        speeds: (t,) speed of the tip in the move to each target [mm/s].
        moved: (m,) ascending indices of targets that stand beside their pose, so that the rounded corner passes it.
        places: (m, 3) where those stand [mm].
        bends: where that is, and where targets are closer than a controller takes, in printing order.
    """

    poses: IntArray
    zones: FloatArray
    speeds: FloatArray
    moved: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    places: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    bends: tuple[Bend, ...] = ()

    def __post_init__(self) -> None:
        freeze_arrays(self, poses="int: t", zones="float: t", speeds="float: t", moved="int: m", places="float: m 3")


@final
@frozen
class ControllerPath:
    """The motion as the controller interpolates it: joint moves from and to home, straight lines between targets.

    Sampled so finely that `step` bounds what happens between neighbouring rows. Where the controller may round a
    target, the rows pass halfway between the target and the widest path past it, off by at most `rounding`.

    Attributes:
        joints: (k, 6) [rad], from home to home.
        runs: (k,) run of the pose stream, -1 on the joint moves from and to home.
        deposit: (k,) whether material is deposited from this row to the next.
        rounding: (k, 6) from a row to where the controller passes if it rounds nothing [rad]; 0 on joint moves.
        step: largest movement of the tip between neighbouring rows [mm].
    """

    joints: FloatArray
    runs: IntArray
    deposit: BoolArray
    rounding: FloatArray
    step: float

    def __post_init__(self) -> None:
        freeze_arrays(self, joints="float: k 6", runs="int: k", deposit="bool: k", rounding="float: k 6")


@final
@comparable
class Clearance:
    """What the collision check found; it exists only where nothing was hit.

    Attributes:
        smallest: smallest distance found between the tool above its tip zone and part, body and obstacles [mm].
        at: where that is, as text: run and place.
        arm_smallest: smallest distance found between the arm's links and part, body and obstacles [mm], or None where
            the links were not checked.
        arm_at: where that is, as text, or None.
        kept: distance that was proven at every pose and between poses [mm].
        tip_margin: smallest room under the needle tip's rim on deposit [mm]; infinite where nothing is deposited.
        checks: number of tool placements tested.
        checked: pairs that were tested.
        not_checked: what was left out, said so that nobody takes it for clear.
    """

    smallest: float
    at: str
    arm_smallest: float | None
    arm_at: str | None
    kept: float
    tip_margin: float
    checks: int
    checked: tuple[str, ...]
    not_checked: tuple[str, ...]


@final
@comparable
class Program:
    """RAPID modules ready to be written.

    Attributes:
        modules: file name to text, in the order in which a controller loads them.
        targets: number of robtargets.
        dry_run: whether it can only run without material.
    """

    modules: tuple[tuple[str, str], ...]
    targets: int
    dry_run: bool
