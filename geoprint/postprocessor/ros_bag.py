"""A joint trajectory as a ROS 2 bag, which `ros2 bag play` publishes."""

# rosbags makes its types of messages while it runs.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from geoprint.errors import InputError, VerificationError
from geoprint.geometry.native import missing
from geoprint.postprocessor.bundle import changed_in, staging
from geoprint.postprocessor.execution import Switched
from geoprint.postprocessor.setup_file import read_setup
from geoprint.postprocessor.trajectory.reading import TABLE, Samples, read_outputs, read_samples
from geoprint.robot.arm import chain_of
from geoprint.robot.arm.urdf import urdf_of

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

TOPIC: Final = "/joint_trajectory"
# Of each output, with its name behind.
OUTPUT_TOPIC: Final = "/outputs/"
_TRAJECTORY, _BOOL = "trajectory_msgs/msg/JointTrajectory", "std_msgs/msg/Bool"
# Folder of the files in the bundle of a plan, and in the bag.
_FOLDER, _BAG = "joint-trajectory", "bag"
# Layout of the bag's metadata that every release of ROS 2 since Humble reads.
_VERSION: Final = 8
_NANOSECONDS = 1_000_000_000


def save_bag(plan: Path | str, bag: Path | str) -> Path:
    """Write the joint trajectory of a plan as a ROS 2 bag: read back and compared, or not at all.

    At its start stands one trajectory_msgs/JointTrajectory on `/joint_trajectory`, and at the time of each switching a
    std_msgs/Bool on `/outputs/NAME`. Where nobody has stated where the part stands, outputs are left out.

    Args:
        plan: folder of a plan whose cell has the post-processor "joint-trajectory".
        bag: folder that shall be made.

    Returns:
        The folder in it that `ros2 bag` takes.

    Raises:
        UsageError: rosbags is not installed, or the folder exists.
        InputError: the plan has no joint trajectory.
        VerificationError: a file is not as geoprint wrote it, or the bag reads back otherwise.
        ExportError: nothing can be written there.
    """
    try:
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise missing("rosbags", extra="ros", work="a ROS 2 bag") from error
    folder = Path(plan) / _FOLDER
    if not folder.is_dir():
        raise InputError(
            f'{plan} holds no joint trajectory: plan with `post_processor = "{_FOLDER}"` under [robot] of the cell.'
        )
    setup = read_setup(Path(plan) / "setup.json")
    robot, withheld = setup.cell.robot, bool(setup.placement.missing)
    chain = chain_of(urdf_of(robot), name=robot.model, flange=robot.flange)
    changed = changed_in(Path(plan))
    if changed is not None:
        raise VerificationError(
            f"{plan}: {changed} is not as geoprint wrote it; `geoprint check {plan}` says what is wrong, and planning "
            "again puts it right."
        )
    files = {path.name: path.read_text("utf-8") for path in folder.iterdir() if path.is_file()}
    samples = read_samples(files, names=chain.names, base=chain.base)
    switched = () if withheld else read_outputs(files, withheld=False)
    types = get_typestore(Stores.ROS2_HUMBLE)
    with staging(bag, overwrite=False) as temporary:
        _write(temporary / _BAG, types, samples, switched, names=chain.names, base=chain.base)
        _compare(temporary / _BAG, types, samples, switched)
    return Path(bag) / _BAG


def _write(
    bag: Path, types: Typestore, samples: Samples, switched: Sequence[Switched], *, names: Sequence[str], base: str
) -> None:
    from rosbags.rosbag2 import Writer

    def duration(seconds: float) -> Any:
        nanos = round(seconds * _NANOSECONDS)
        kind = types.types["builtin_interfaces/msg/Duration"]
        return kind(sec=nanos // _NANOSECONDS, nanosec=nanos % _NANOSECONDS)

    point, nothing = types.types["trajectory_msgs/msg/JointTrajectoryPoint"], np.empty(0)
    points: Any = [
        point(positions=row, velocities=speed, accelerations=nothing, effort=nothing, time_from_start=duration(time))
        for time, row, speed in zip(samples.times.tolist(), samples.joints, samples.speeds, strict=True)
    ]
    stamp = types.types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    header = types.types["std_msgs/msg/Header"](stamp=stamp, frame_id=base)
    message = types.types[_TRAJECTORY](header=header, joint_names=[*names], points=points)
    with Writer(bag, version=_VERSION) as writer:
        topic = writer.add_connection(TOPIC, _TRAJECTORY, typestore=types)
        writer.write(topic, 0, types.serialize_cdr(message, _TRAJECTORY))
        topics = {
            name: writer.add_connection(f"{OUTPUT_TOPIC}{name}", _BOOL, typestore=types)
            for name in sorted({each.signal for each in switched})
        }
        for each in switched:
            message = types.types[_BOOL](data=each.on)
            writer.write(topics[each.signal], round(each.time * _NANOSECONDS), types.serialize_cdr(message, _BOOL))


def _compare(bag: Path, types: Typestore, samples: Samples, switched: Sequence[Switched]) -> None:
    """Compare a bag that was read back with what it shall hold.

    Raises:
        VerificationError: it holds something else.
    """
    from rosbags.rosbag2 import Reader

    events: list[tuple[float, str, bool]] = []
    rows: list[list[float]] = []
    with Reader(bag) as reader:
        for connection, nanos, raw in reader.messages():
            message: Any = types.deserialize_cdr(raw, connection.msgtype)
            if connection.topic == TOPIC:
                for each in message.points:
                    moment = each.time_from_start.sec + each.time_from_start.nanosec / _NANOSECONDS
                    rows.append([moment, *each.positions.tolist(), *each.velocities.tolist()])
            else:
                events.append((nanos / _NANOSECONDS, connection.topic.removeprefix(OUTPUT_TOPIC), message.data))
    wanted = np.column_stack([samples.times, samples.joints, samples.speeds])
    same = len(rows) == len(wanted) and np.allclose(rows, wanted, rtol=0.0, atol=1e-9)
    if not same or sorted(events) != sorted((round(each.time, 9), each.signal, each.on) for each in switched):
        raise VerificationError(f"the bag reads back otherwise than {TABLE} and its outputs; write it again.")
