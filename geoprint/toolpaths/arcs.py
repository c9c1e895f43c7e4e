"""Arcs of RAPID (MoveC): the place that each leads through, and points along it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass
from typing import cast

import numpy as np

from geoprint.export.rapid.language.syntax import Call, Literal, Module, Name, Series
from geoprint.export.rapid.machine import Execution
from geoprint.model import FloatArray
from geoprint.toolpaths.path_file import refuse

# Angle between points of an arc [rad]: on a radius of 20 mm its chords are within a micrometre.
STEP = np.radians(1.0)


def through_places(name: str, ran: Execution, modules: Sequence[Module], rows: Sequence[int]) -> dict[int, FloatArray]:
    """Return the place that each of some moves leads through, in the coordinates of its target [mm].

    Args:
        name: of the file.
        ran: the execution.
        modules: of the program.
        rows: of moves along arcs.

    Raises:
        InputError: the place is neither written out nor a datum.
    """
    if not rows:
        return {}
    calls = {
        (module.file, call.line): call
        for module in modules
        for call in _calls(module.routines)
        if call.name.lower() in {"movec", "triggc"}
    }
    found: dict[int, FloatArray] = {}
    for row in rows:
        file, line = ran.files[int(ran.moves.files[row])], int(ran.moves.lines[row])
        call = calls.get((file, line))
        first = None if call is None else call.arguments[0].value
        value: object = first.value if isinstance(first, Literal) else None
        if isinstance(first, Name):
            value = ran.data.get(first.name.lower())
        if not isinstance(value, tuple):
            refuse(name, line, "the circle's middle place is neither written out nor a datum of a module")
        found[row] = np.array(cast("tuple[tuple[float, float, float]]", value)[0], dtype=np.float64)
    return found


def _calls(node: object) -> Iterator[Call]:
    """Yield the calls within statements, however deep."""
    if isinstance(node, Call):
        yield node
    elif isinstance(node, tuple):
        for part in cast("tuple[object, ...]", node):
            yield from _calls(part)
    elif is_dataclass(node) and not isinstance(node, Series):
        for field in fields(node):
            yield from _calls(getattr(node, field.name))


def along_arc(start: FloatArray, through: FloatArray | None, end: FloatArray) -> FloatArray:
    """Return (k, 3) points of a straight line, or of the arc through another place [mm]."""
    if through is None:
        return np.stack([start, end])
    first, second = through - start, end - start
    normal = np.cross(first, second)
    square = float(normal @ normal)
    if square == 0.0:
        return np.stack([start, through, end])
    towards = np.cross((first @ first) * second - (second @ second) * first, normal)
    centre = start + towards / (2.0 * square)
    x = start - centre
    y = np.cross(normal / np.sqrt(square), x)
    angle = float(np.mod(np.arctan2((end - centre) @ y, (end - centre) @ x), 2.0 * np.pi))
    turns = np.linspace(0.0, angle, max(int(np.ceil(angle / STEP)), 1) + 1)[:, None]
    return centre + np.cos(turns) * x + np.sin(turns) * y
