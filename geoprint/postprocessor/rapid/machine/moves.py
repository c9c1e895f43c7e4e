r"""Executes one move: where the tip goes, how long it takes, when the program goes on, and what switches along it.

A move takes its length over the speed of its speeddata, or its turn over the turning speed where that is longer, both
scaled by VelSet and the panel; or the time that it is given (`\T`), scaled likewise. A stop (`fine`) holds the program
until the arm is there; where a zone lets it fly by, the program goes on as the zone is entered, which is no larger than
half of the move. Ramps and the corner's own dynamics are left out: the program's clock passes a corner in the time of
its two lines; how much sooner its parabola leads round it, `corners` says.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Never, cast, final

import numpy as np

from geoprint.model import FloatArray
from geoprint.postprocessor.rapid.language.syntax import Value
from geoprint.postprocessor.rapid.machine.execution import Switching
from geoprint.postprocessor.rapid.machine.state import PACKED_ROW, Leg, Moving, State, joints_of, tip_of
from geoprint.postprocessor.rapid.machine.values import (
    Orient,
    Pos,
    Pose,
    angle,
    circle,
    compose,
    distance,
    fault,
    normalised,
    pose_of,
)

# How far the tip goes where a controller rounds its corners by parabolas.
#
# At the edge of a zone the tip leaves the straight line for a parabola that joins the next line as far behind the
# target [ABBRapid, zonedata]: the quadratic Bezier curve from the entry over the target to the exit, whose length
# has a closed form. A zone is never larger than half the distance to the nearer neighbour.


# Shorter moves turn on the spot: no corner lies at their ends [mm].
ON_THE_SPOT = 1e-6
# At smaller halves of a turn [rad] a corner is as long as its two lines, by far less than a rounding.
_STRAIGHT = 1e-6


def rounded_lengths(places: FloatArray, zones: FloatArray) -> FloatArray:
    """Return how far the tip goes in each move to the next target, from the middle of a corner to that of the next.

    Args:
        places: (t, 3) of the targets [mm].
        zones: (t,) radius of the zone of each, 0 for a stop [mm].

    Returns:
        (t - 1,) lengths [mm].

    Examples:
        >>> places = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0]])
        >>> rounded_lengths(places, np.array([0.0, 1.0, 0.0])).round(4).tolist()
        [3.8116, 3.8116]
    """
    steps = np.diff(places, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    saved = np.zeros(len(places))
    along = steps / np.maximum(lengths, ON_THE_SPOT)[:, None]
    nearer = np.minimum(lengths[1:], lengths[:-1])
    sizes = np.where(nearer > ON_THE_SPOT, np.minimum(zones[1:-1], nearer / 2.0), 0.0)
    saved[1:-1] = sizes * _saved_share(along[:-1], along[1:])
    return lengths - saved[1:] - saved[:-1]


def _saved_share(before: FloatArray, behind: FloatArray) -> FloatArray:
    """Return (k,) by how much half a parabola is shorter than the radius of its zone, by that radius.

    With h half the angle by which the tip turns, half of it is (1 + cos(h)^2 / sin(h) asinh(tan(h))) / 2 long.
    """
    sine = np.linalg.norm(behind - before, axis=1) / 2.0
    cosine = np.linalg.norm(behind + before, axis=1) / 2.0
    turns = sine > _STRAIGHT
    sine = np.where(turns, sine, 1.0)
    half = (1.0 + cosine**2 / sine * np.arcsinh(sine / np.maximum(cosine, _STRAIGHT))) / 2.0
    return np.where(turns, 1.0 - half, 0.0)


# Axes at or above this do not exist; a num holds 9E9 only nearly.
NO_AXIS = 8.9e9
# The next move must be known as the zone of the one before is entered, but for rounding [s].
_ROUNDING = 1e-9
_SAMPLES = 16


@final
@dataclass(frozen=True, slots=True)
class Trigger:
    """What a triggdata holds: a switching whose time and move are yet to come, and whether its place is a time."""

    switching: Switching
    by_time: bool
    lead: float = 0.0


@final
@dataclass(frozen=True, slots=True)
class Order:
    """A move as it is ordered: verb, module and line by number, names of tool and work object by number."""

    verb: int
    file: int
    line: int
    tool_name: int
    work_name: int


def target_frame(state: State, work: Value) -> tuple[Pose, int]:
    """Return the frame in which targets are given now, in base coordinates, and its number.

    Raises:
        Fault: the work object is held by the robot or moved by another unit, which this machine does not know.
    """
    displacement = state.motion.displacement
    known = state.frame
    if known is not None and known[0] is work and known[1] is displacement:
        return known[2], known[3]
    held, fixed, _, user, part = cast("tuple[bool, bool, str, Value, Value]", work)
    if held or not fixed:
        fault("ERR_NORUNUNIT", "the work object is held by the robot, or moved by another unit")
    pose = compose(compose(pose_of(user), pose_of(part)), displacement)
    number = state.log.frames.setdefault(pose, len(state.log.frames))
    state.frame = (work, displacement, pose, number)
    return pose, number


def tool_frame(state: State, tool: Value) -> Pose:
    """Return the frame of a tool on the flange.

    Raises:
        Fault: the robot does not hold it.
    """
    known = state.tool
    if known is not None and known[0] is tool:
        return known[1]
    held, frame, _ = cast("tuple[bool, Value, Value]", tool)
    if not held:
        fault("ERR_NORUNUNIT", "the tool is not held by the robot")
    pose = pose_of(frame)
    state.tool = (tool, pose)
    return pose


def mode_number(state: State) -> int:
    """Return the number of the present modal state in the log."""
    known, modes = state.mode, state.motion.modes
    if known is None or known[0] is not modes:
        known = state.mode = modes, state.log.modes.setdefault(modes, len(state.log.modes))
    return known[1]


def scale(state: State) -> float:
    """Return the share of the programmed speed at which the arm moves."""
    share = state.motion.modes.override * state.scenario.override / 10000.0
    if share <= 0.0:
        fault("ERR_SPEED_REFRESH_LIM", "the speed is 0: the arm would never arrive")
    return share


def run_line(
    state: State, order: Order, target: Value, *, speed: Value, zone: Value, tool: Value, work: Value,
    options: Mapping[str, Value], through: Value | None = None, triggers: tuple[object, ...] = (),
) -> None:  # fmt: skip
    """Move the tip to a target, in a straight line or along the arc through another place."""
    place, turn, configuration, axes = cast("tuple[Pos, Orient, Orient, tuple[float, ...]]", target)
    written, turn = turn, normalised(turn)
    frame, number = target_frame(state, work)
    held = tool_frame(state, tool)
    motion = state.motion
    start = tip_of(motion, state, held)
    end = compose(frame, (place, turn))
    length = distance(start[0], end[0])
    if through is not None:
        middle = compose(frame, (cast("tuple[Pos, Value]", through)[0], turn))
        length, _ = circle(start[0], middle[0], end[0])
    speeds = _speeds(speed, options)
    duration = _duration(state, length, angle(start[1], end[1]), speeds, options)
    check_axes(motion, axes)
    # Where joints were known they stay the nearest ones that are known.
    motion.near = motion.joints if motion.joints is not None else motion.near
    row = (*place, *written, *configuration, *axes, speeds[0])
    _book(state, order, row, zone, number, length=length, duration=duration, triggers=triggers, tips=(start, end))
    motion.tip, motion.joints, motion.tool = end, None, held


def run_joints(
    state: State, order: Order, target: Value, *, speed: Value, zone: Value, tool: Value, options: Mapping[str, Value]
) -> None:
    """Move all joints together to a jointtarget."""
    angles, axes = cast("tuple[tuple[float, ...], tuple[float, ...]]", target)
    motion = state.motion
    start, end = joints_of(motion, state), tuple(math.radians(each) for each in angles)
    held = tool_frame(state, tool)
    length, turn = _swept(state, start, end, held)
    speeds = _speeds(speed, options)
    duration = _duration(state, length, turn, speeds, options)
    if "t" not in options:
        limits = state.arm.robot.speeds.tolist()
        slowest = max(abs(b - a) / limit for a, b, limit in zip(start, end, limits, strict=True))
        duration = max(duration, slowest / scale(state))
    if (min(axes) < NO_AXIS) != bool(motion.unit):
        _refuse_axes(motion)
    motion.axes = axes
    row = (*end, 0.0, 0.0, 0.0, 0.0, 0.0, *axes, speeds[0])
    _book(state, order, row, zone, 0, length=length, duration=duration, triggers=(), joints=(start, end))
    motion.tip, motion.joints, motion.near, motion.tool = None, end, end, held


def check_axes(motion: Moving, axes: tuple[float, ...]) -> None:
    """Check that a move along the path leaves what moves the part where it stands.

    Numbers of axes that are not active are ignored by a controller, and missing ones of active axes an error
    [ABBRapid, extjoint]: both are an error here.

    Raises:
        Fault: the move names axes while none is active, or names other values than where the active ones stand.
    """
    if (min(axes) < NO_AXIS) != bool(motion.unit):
        _refuse_axes(motion)
    if motion.unit and axes != motion.axes:
        fault("ERR_NORUNUNIT", f"the mechanical unit {motion.unit} would move along a move of the tip")


def _refuse_axes(motion: Moving) -> Never:
    if motion.unit:
        fault("ERR_NORUNUNIT", f"a move does not say where the active mechanical unit {motion.unit} should be")
    fault("ERR_NORUNUNIT", "a move names external axes, but no mechanical unit is active")


def _swept(state: State, start: tuple[float, ...], end: tuple[float, ...], tool: Pose) -> tuple[float, float]:
    """Return how far the tip goes and turns as the joints move together, seen at a few places."""
    import numpy as np

    from geoprint.postprocessor.rapid.machine.state import poses_of_matrices

    shares = np.linspace(0.0, 1.0, _SAMPLES + 1)[:, None]
    rows = np.array(start) + shares * (np.array(end) - np.array(start))
    tips = [compose(pose, tool) for pose in poses_of_matrices(state.arm.flange_poses(rows))]
    length = sum(distance(a[0], b[0]) for a, b in pairwise(tips))
    return length, sum(angle(a[1], b[1]) for a, b in pairwise(tips))


def _speeds(speed: Value, options: Mapping[str, Value]) -> tuple[float, float]:
    """Return the programmed speeds of the tip [mm/s] and of its turning [degrees/s]."""
    v_tip, v_turn, _, _ = cast("tuple[float, float, float, float]", speed)
    return float(cast("float", options.get("v", v_tip))), v_turn


def _duration(
    state: State, length: float, turn: float, speeds: tuple[float, float], options: Mapping[str, Value]
) -> float:
    share = scale(state)
    timed = options.get("t")
    if timed is not None:
        return cast("float", timed) / share
    v_tip, v_turn = speeds
    if v_tip <= 0.0 or v_turn <= 0.0:
        fault("ERR_SPEED_REFRESH_LIM", "the speed of a move is 0: the arm would never arrive")
    fastest = min(v_tip * share, state.motion.modes.fastest)
    return max(length / fastest, turn / (math.radians(v_turn) * share))


def _book(
    state: State, order: Order, row: tuple[float, ...], zone: Value, frame: int, *, length: float, duration: float,
    triggers: tuple[object, ...], tips: tuple[Pose, Pose] | None = None,
    joints: tuple[tuple[float, ...], tuple[float, ...]] | None = None,
) -> None:  # fmt: skip
    """Note a move, plan what it switches, and let the program go on when it may."""
    log, motion = state.log, state.motion
    begin = begins(state)
    end = begin + duration
    stop, size, *_ = cast("tuple[bool, float]", zone)
    size = 0.0 if stop else size
    rounded = min(size, length / 2.0) / length * duration if length > ON_THE_SPOT else 0.0
    log.open += PACKED_ROW.pack(
        order.file, order.line, order.verb, *row, size, order.tool_name, order.work_name, frame, begin, end, length,
        mode_number(state),
    )  # fmt: skip
    for trigger in triggers:
        pull(state, trigger, move=log.count, begin=begin, end=end, length=length)
    log.count += 1
    motion.end, motion.entry = end, end - rounded
    motion.legs = (*motion.legs[-1:], Leg(begin, end, tips, joints))
    state.clock = motion.entry


def begins(state: State) -> float:
    """Return when a move that is ordered now begins; where it comes too late for a corner, the arm stopped there."""
    motion = state.motion
    if motion.entry < motion.end and state.clock > motion.entry + _ROUNDING:
        state.log.missed.append(state.log.count - 1)
    return max(state.clock, motion.end)


def pull(state: State, trigger: object, *, move: int, begin: float, end: float, length: float) -> None:
    """Plan what a trigger switches along a move of this number.

    Raises:
        Fault: it is none.
    """
    if not isinstance(trigger, Trigger):
        fault("ERR_ARGVALERR", "a move uses a trigger that is not defined")
    asked = trigger.switching
    share = min(asked.distance / length, 1.0) if length > ON_THE_SPOT else 0.0
    if trigger.by_time:
        moment = begin + asked.distance if asked.from_start else end - asked.distance
    else:
        moment = begin + share * (end - begin) if asked.from_start else end - share * (end - begin)
    moment = min(max(moment - trigger.lead, begin), end)
    state.plan(
        Switching(
            moment, asked.signal, asked.value, asked.file, asked.line, move, asked.distance,
            asked.from_start, asked.flow, asked.lag, asked.dip_lag,
        )
    )  # fmt: skip
