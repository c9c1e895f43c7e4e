"""Functions of the URScript manual: their arguments, which take time, and what they do."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import cast

import numpy as np

from geoprint.model import FloatArray
from geoprint.postprocessor.urscript.log import HaltError, Run, Switch, Value
from geoprint.postprocessor.urscript.machine import Machine
from geoprint.postprocessor.urscript.motion import JointWay, pose_on
from geoprint.postprocessor.urscript.poses import Pose, pose_inv, pose_trans, position, turn, turned

# How near an inverse solution comes [mm, and rad times 100 mm], and in how many steps.
_NEAR, _STEPS = 1e-9, 60
# Outputs by the names of the functions that set them.
_OUTPUTS = {
    "set_standard_digital_out": "standard",
    "set_configurable_digital_out": "configurable",
    "set_tool_digital_out": "tool",
}
_RUN_STATES = {
    "set_runstate_standard_digital_output_to_value": "standard",
    "set_runstate_configurable_digital_output_to_value": "configurable",
    "set_runstate_tool_digital_output_to_value": "tool",
}
# How many outputs there are of each kind.
_COUNTS = {"standard": 8, "configurable": 8, "tool": 2}
# Names of the arguments of functions of the manual, in their order, and how many a call must have.
SIGNATURES: Mapping[str, tuple[int, tuple[str, ...]]] = {
    "movej": (1, ("q", "a", "v", "t", "r")),
    "movel": (1, ("pose", "a", "v", "t", "r")),
    "movep": (1, ("pose", "a", "v", "r")),
    "sleep": (1, ("t",)),
    "sync": (0, ()),
    "popup": (1, ("s", "title", "warning", "error", "blocking")),
    "textmsg": (1, ("s1", "s2")),
    "set_tcp": (1, ("pose", "tcp_name")),
    "set_target_payload": (2, ("m", "cog", "inertia", "transition_time")),
    "pose_trans": (2, ("p_from", "p_from_to")),
    "pose_inv": (1, ("p_from",)),
    "get_target_tcp_pose": (0, ()),
    "get_actual_joint_positions": (0, ()),
    "get_inverse_kin": (1, ("x", "qnear")),
    **dict.fromkeys(_OUTPUTS, (2, ("n", "b"))),
    **dict.fromkeys(_RUN_STATES, (2, ("outputId", "state"))),
}
# Those that take time.
BLOCKING = frozenset({"movej", "movel", "movep", "sleep", "sync", "popup"})


def bound(machine: Machine, name: str, values: Sequence[Value], named: Mapping[str, Value]) -> dict[str, Value]:
    """Return the arguments of a function of the manual by their names."""
    least, names = SIGNATURES[name]
    arguments = {**dict(zip(names, values, strict=False)), **named}
    if len(values) > len(names) or not set(named) <= set(names[len(values) :]) or len(arguments) < least:
        raise machine.refused(f"{name} is called with other arguments than ({', '.join(names)})")
    return arguments


def blocking(machine: Machine, name: str, arguments: dict[str, Value]) -> Run:
    """Run a function, which may take time, and return its value."""
    if name == "sync":
        yield None
    elif name == "sleep":
        until = machine.now + machine.number(arguments, "t", least=0.0)
        if machine.thread.name == machine.script.main.name:
            machine.log.rests.append((machine.now, until))
        yield lambda: machine.now >= until - 1e-9
    elif name == "popup":
        machine.log.asked.append(str(arguments["s"]))
        if arguments.get("blocking") is True:
            if not machine.scenario.goes_on:
                raise HaltError
            yield None
    elif name == "movej":
        yield from machine.move_joints(arguments)
    elif name in {"movel", "movep"}:
        yield from machine.move_tool(name, arguments)
    else:
        return instant(machine, name, arguments)
    return None


def instant(machine: Machine, name: str, arguments: dict[str, Value]) -> Value:
    """Return the value of a function that takes no time."""
    if name in _OUTPUTS:
        return _set_output(machine, name, arguments)
    if name in _RUN_STATES:
        output = _output(machine, _RUN_STATES[name], arguments["outputId"])
        state = arguments["state"]
        if isinstance(state, bool) or state not in range(8):
            raise machine.refused("a run state is a number from 0 to 7")
        machine.run_states[output] = cast("int", state)
        return None
    return _INSTANT[name](machine, arguments)


def _output(machine: Machine, kind: str, number: Value) -> str:
    if isinstance(number, bool) or number not in range(_COUNTS[kind]):
        raise machine.refused(f"there is no {kind} output {number!r}")
    return f"{kind} {number}"


def _set_output(machine: Machine, name: str, arguments: dict[str, Value]) -> None:
    output, on = _output(machine, _OUTPUTS[name], arguments["n"]), arguments["b"]
    if not isinstance(on, bool):
        raise machine.refused("an output is set to True or False")
    thread = machine.thread
    line = thread.line() if thread.name == machine.script.main.name else thread.stack[0]
    machine.log.switches.append(Switch(machine.now, output, on, line, thread.name))
    machine.outputs[output] = on


def _set_tcp(machine: Machine, arguments: dict[str, Value]) -> None:
    """Set the tool."""
    if machine.joints is None:
        raise machine.refused("the tool is set on the path")
    machine.tcp = machine.pose_in(arguments["pose"])
    machine.pose = machine.forward(machine.joints)
    machine.log.tools.append((machine.now, machine.tcp))


def _target_pose(machine: Machine, arguments: dict[str, Value]) -> Pose:
    """Return where the motion is in this frame."""
    del arguments
    if not machine.log.pieces:
        return machine.pose
    # The last piece that has begun.
    for piece in reversed(machine.log.pieces):
        if piece.begins <= machine.now:
            if isinstance(piece.way, JointWay):
                return machine.forward(piece.way.at(piece.share(machine.now)).tolist())
            return pose_on(piece, machine.now)
    return machine.pose


def _inverse(machine: Machine, arguments: dict[str, Value]) -> list[Value]:
    """Return the joints near given ones that have a pose, by Newton's method on the forward kinematics."""
    wanted = machine.pose_in(arguments["x"])
    near = machine.six(arguments.get("qnear", list(machine.joints or ())))
    joints: FloatArray = np.array(near, dtype=np.float64)
    T = _matrix(pose_trans(wanted, pose_inv(machine.tcp)))
    step = 1e-6 * np.eye(6)
    for _ in range(_STEPS):
        every = np.append(joints[None, :], joints + step, axis=0)
        errors: FloatArray = np.array([_twist(each, T) for each in machine.flange(every)])
        if np.abs(errors[0]).max() < _NEAR:
            return [float(angle) for angle in joints]
        jacobian: FloatArray = 1e6 * (errors[1:] - errors[0]).T
        if np.linalg.matrix_rank(jacobian) < 6:
            break
        joints = np.subtract(joints, np.clip(np.linalg.solve(jacobian, errors[0]), -0.3, 0.3))
    raise machine.refused("no joints near the given ones have this pose")


def _matrix(pose: Pose) -> FloatArray:
    """Return the (4, 4) transform of a pose in mm."""
    attitude = turn(pose)
    T = np.eye(4)
    T[:3, :3] = np.array([turned(attitude, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]).T
    T[:3, 3] = 1e3 * np.array(position(pose))
    return T


def _twist(found: FloatArray, wanted: FloatArray) -> list[float]:
    """Return by how much one pose is off another: mm, and rad times 100 mm."""
    R = found[:3, :3] @ wanted[:3, :3].T
    turns = 50.0 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return [*(found[:3, 3] - wanted[:3, 3]).tolist(), *turns.tolist()]


def _payload(machine: Machine, arguments: dict[str, Value]) -> None:
    machine.log.loads.append((machine.now, tuple(arguments.values())))


def _message(machine: Machine, arguments: dict[str, Value]) -> None:
    del machine, arguments


def _actual(machine: Machine) -> list[Value]:
    if machine.joints is None:
        raise machine.refused("joints on the path are not of the subset")
    return cast("list[Value]", list(machine.joints))


_INSTANT: Mapping[str, Callable[[Machine, dict[str, Value]], Value]] = {
    "set_tcp": _set_tcp,
    "set_target_payload": _payload,
    "textmsg": _message,
    "pose_trans": lambda machine, each: pose_trans(machine.pose_in(each["p_from"]), machine.pose_in(each["p_from_to"])),
    "pose_inv": lambda machine, each: pose_inv(machine.pose_in(each["p_from"])),
    "get_target_tcp_pose": _target_pose,
    "get_actual_joint_positions": lambda machine, _: _actual(machine),
    "get_inverse_kin": _inverse,
}
