"""What a program made in one scenario: its moves, how long they are and last, and where the tip is when."""

from __future__ import annotations

import math
from typing import final

import numpy as np

from geoprint.model import FloatArray, comparable
from geoprint.postprocessor.urscript.log import Log, Move
from geoprint.postprocessor.urscript.motion import Arc, Line, Piece, Rest
from geoprint.postprocessor.urscript.poses import position


@final
@comparable
class Made:
    """A program that was executed in one scenario.

    Attributes:
        name: of the scenario, in words.
        log: what happened.
        path: the moves to the targets but the first.
        start: the move to the first.
    """

    name: str
    log: Log
    path: tuple[Move, ...]
    start: Move


def lengths(made: Made) -> tuple[FloatArray, FloatArray]:
    """Return (t - 1,) lengths of the blend that leads to each move, and of its line [mm]."""
    ways = _middles(made)
    arcs = [0.0 if arc is None else arc.way.length for arc, _ in ways]
    lines = [0.0 if line is None else line.way.length for _, line in ways]
    return 1e3 * np.array(arcs), 1e3 * np.array(lines)


def durations(made: Made) -> FloatArray:
    """Return (t - 1,) how long each move takes, from the middle of one blend to that of the next [s]."""
    ways = _middles(made)
    begins = [
        move.begins if arc is None else arc.passed(0.5 * arc.way.length)
        for move, (arc, _) in zip(made.path, ways, strict=True)
    ]
    ends = [
        move.ends if move.blend == 0.0 else following
        for move, following in zip(made.path, [*begins[1:], math.inf], strict=True)
    ]
    return np.array(ends) - np.array(begins)


def tip_at(made: Made, time: float) -> FloatArray:
    """Return where the tip is [mm]."""
    for piece in reversed(made.log.pieces):
        if piece.begins <= time:
            way = piece.way
            if isinstance(way, (Line, Arc, Rest)):
                return 1e3 * np.array(way.place(piece.gone(time)))
            break
    return 1e3 * np.array(position(made.start.target))


def pieces_by_move(log: Log) -> dict[int, list[Piece]]:
    """Return the ways of each move by its number."""
    found: dict[int, list[Piece]] = {}
    for piece in log.pieces:
        found.setdefault(piece.move, []).append(piece)
    return found


def _middles(made: Made) -> list[tuple[Piece | None, Piece | None]]:
    """Return of each move the blend that leads to it, if any, and its line."""
    pieces = pieces_by_move(made.log)
    first = next(k for k, move in enumerate(made.log.moves) if move is made.path[0])
    found: list[tuple[Piece | None, Piece | None]] = []
    for k in range(len(made.path)):
        own = pieces[first + k]
        found.append((own[0] if isinstance(own[0].way, Arc) else None, own[-1]))
    return found
