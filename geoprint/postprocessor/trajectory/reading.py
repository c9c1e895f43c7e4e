"""Reads a joint trajectory and its outputs, and plays them: by cubic segments between the samples."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import final

import numpy as np

from geoprint.errors import how_many
from geoprint.model import FloatArray, freeze_arrays, frozen
from geoprint.postprocessor.execution import Switched, refusal

TABLE, MESSAGE = "joint_trajectory.csv", "joint_trajectory.yaml"
OUTPUTS, WITHHELD = "outputs.csv", "outputs_withheld.csv"
_COLUMNS = "t,q1,q2,q3,q4,q5,q6,v1,v2,v3,v4,v5,v6"
_NUMBER = r"-?\d+\.\d+"
_ROW = re.compile(rf"{_NUMBER}(?:,{_NUMBER}){{12}}")
_EVENT = re.compile(r"(\d+\.\d+),([A-Za-z][A-Za-z0-9_]*),([01])")
_SIX = rf"\[({_NUMBER}(?:, {_NUMBER}){{5}})\]"
_POSITIONS, _VELOCITIES = re.compile(rf"- positions: {_SIX}"), re.compile(rf"  velocities: {_SIX}")
_TIME = re.compile(r"  time_from_start: \{sec: (\d+), nanosec: (\d+)\}")
# Both files hold the same decimals [s, rad, rad/s].
_SAME = 1e-9


@final
@frozen
class Samples:
    """A joint trajectory: k samples.

    Attributes:
        times: (k,) rising from 0 [s].
        joints: (k, 6) [rad].
        speeds: (k, 6) [rad/s].
    """

    times: FloatArray
    joints: FloatArray
    speeds: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, times="float: k", joints="float: k 6", speeds="float: k 6")

    def played(self, moments: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (m, 6) joints and their speeds at (m,) moments, on the cubic segments between samples."""
        later = np.clip(np.searchsorted(self.times, moments, side="right"), 1, self.times.size - 1)
        h = (self.times[later] - self.times[later - 1])[:, None]
        u = (moments - self.times[later - 1])[:, None] / h
        q0, q1, v0, v1 = self.joints[later - 1], self.joints[later], self.speeds[later - 1] * h, self.speeds[later] * h
        # q0 + v0 u + (3 d - 2 v0 - v1) u^2 + (v0 + v1 - 2 d) u^3 with d = q1 - q0.
        rise = q1 - q0
        square, cube = 3.0 * rise - 2.0 * v0 - v1, v0 + v1 - 2.0 * rise
        return q0 + u * (v0 + u * (square + u * cube)), (v0 + u * (2.0 * square + 3.0 * u * cube)) / h


def read_samples(files: Mapping[str, str], *, names: Sequence[str], base: str) -> Samples:
    """Return the samples of a joint trajectory, which its table and its message must both hold.

    Args:
        files: text of each file.
        names: of the joints, from the base on.
        base: link that the message must refer to.

    Raises:
        VerificationError: a file is missing or holds something else; file and line are named.
    """
    lines = _lines(files, TABLE)
    if lines[0] != _COLUMNS:
        raise refusal(TABLE, 1, f"the columns must be {_COLUMNS}")
    rows = [_numbers(line, number) for number, line in enumerate(lines[1:], start=2)]
    if len(rows) < 2:
        raise refusal(TABLE, 2, "it must have 2 rows at least")
    data = np.array(rows)
    steps = np.diff(data[:, 0])
    if data[0, 0] != 0.0 or (steps <= 0.0).any():
        line = 2 if data[0, 0] != 0.0 else int(np.argmax(steps <= 0.0)) + 3
        raise refusal(TABLE, line, "times must rise from 0")
    samples = Samples(data[:, 0], data[:, 1:7], data[:, 7:])
    _compare_message(_lines(files, MESSAGE), samples, names=names, base=base)
    return samples


def read_outputs(files: Mapping[str, str], *, withheld: bool) -> tuple[Switched, ...]:
    """Return what switches when, by the clock of the samples.

    Args:
        files: text of each file.
        withheld: whether nobody may drive them, so that they lie in a file of another name.

    Raises:
        VerificationError: the file is missing, a line says something else, or the other file lies there.
    """
    name, other = (WITHHELD, OUTPUTS) if withheld else (OUTPUTS, WITHHELD)
    if other in files:
        raise refusal(other, 1, f"there must be {name} alone")
    lines = _lines(files, name)
    if lines[0] != "t,output,value":
        raise refusal(name, 1, "the columns must be t,output,value")
    found: list[Switched] = []
    for number, line in enumerate(lines[1:], start=2):
        match = _EVENT.fullmatch(line)
        if match is None:
            raise refusal(name, number, f"a time, an output and 0 or 1 must stand here, found {line[:60]!r}")
        found.append(Switched(float(match[1]), match[2].lower(), match[3] == "1", name, number))
        if number > 2 and found[-1].time < found[-2].time:
            raise refusal(name, number, "times must not fall")
    return tuple(found)


def comments(files: Mapping[str, str]) -> list[str]:
    """Return the comments at the head of the message."""
    return [line[2:] for line in files.get(MESSAGE, "").split("\n") if line.startswith("# ")]


def _lines(files: Mapping[str, str], name: str) -> list[str]:
    """Return the lines of a file that ends with a line."""
    if name not in files:
        raise refusal(name, 1, "the file is missing")
    if not files[name].endswith("\n"):
        raise refusal(name, files[name].count("\n") + 1, "the last line is cut off")
    return files[name].split("\n")[:-1]


def _numbers(line: str, number: int) -> list[float]:
    if _ROW.fullmatch(line) is None:
        raise refusal(TABLE, number, f"13 numbers with decimals must stand here, found {line[:60]!r}")
    return [float(each) for each in line.split(",")]


def _compare_message(lines: Sequence[str], samples: Samples, *, names: Sequence[str], base: str) -> None:
    """Check that a message has a head of comments and names, and the samples of the table.

    Raises:
        VerificationError: a line says something else.
    """
    said = sum(line.startswith("# ") for line in lines)
    head = ["header:", "  stamp: {sec: 0, nanosec: 0}", f"  frame_id: {base}", "joint_names:"]
    head += [*(f"- {name}" for name in names), "points:"]
    for number, wanted in enumerate(head, start=said + 1):
        if number > len(lines) or lines[number - 1] != wanted:
            raise refusal(MESSAGE, number, f"{wanted!r} must stand here")
    first = said + len(head)
    if len(lines) - first != 3 * samples.times.size:
        raise refusal(MESSAGE, len(lines), f"{how_many(samples.times.size, 'point')} must follow, as in {TABLE}")
    for k in range(samples.times.size):
        number = first + 3 * k
        for offset, (form, wanted) in enumerate(
            ((_POSITIONS, samples.joints[k]), (_VELOCITIES, samples.speeds[k]), (_TIME, samples.times[k : k + 1]))
        ):
            match = form.fullmatch(lines[number + offset])
            if match is None:
                raise refusal(MESSAGE, number + offset + 1, "a point has another form here")
            found = (
                np.array([int(match[1]) + 1e-9 * int(match[2])])
                if form is _TIME
                else np.array([float(each) for each in match[1].split(", ")])
            )
            if np.abs(found - wanted).max() > _SAME:
                raise refusal(MESSAGE, number + offset + 1, f"{TABLE} has another value in row {k + 1}")
