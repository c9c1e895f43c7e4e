"""What a file of toolpaths becomes, how its lines are read within bounds, and how runs are put together."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import TypeAlias, final

import numpy as np

from geoprint.delimited import refuse as refuse, text_lines
from geoprint.errors import InputError
from geoprint.model import FloatArray, Polylines, Reading, frozen, reading as record

# Points of one file, on deposit and on travel: about 200 MB.
MOST_POINTS = 5_000_000
# Bytes of one line; slicers write whole settings into one.
MOST_LINE = 1_000_000
# Bytes of a file: more is no toolpath of one part.
MOST_BYTES = 2_000_000_000
# A larger coordinate [mm] is a typing error or another unit.
FARTHEST = 1_000_000.0

Point: TypeAlias = tuple[float, float, float]


@final
@frozen
class PathFile:
    """The toolpaths of a file.

    Attributes:
        name: of the file, without its folder.
        format: what it is, in words.
        curves: the deposited runs.
        deposit: how deposit was distinguished from travel, in words.
        points: points that were read, those of travel too.
        dropped: runs of a single point, left out.
        reading: what was used, skipped and assumed.
    """

    name: str
    format: str
    curves: Polylines
    deposit: str
    points: int
    dropped: int
    reading: Reading


def lines_of(path: Path) -> Iterator[tuple[int, str]]:
    """Yield number and text of each line of a file, one at a time, whatever ends its lines.

    Raises:
        InputError: it cannot be read, is larger than allowed, or holds something else than text.
    """
    return text_lines(path, most_bytes=MOST_BYTES, most_line=MOST_LINE, what="a file of toolpaths")


def number_of(name: str, line: int, what: str, text: str, *, scale: float = 1.0) -> float:
    """Return a coordinate [mm].

    Raises:
        InputError: it is no finite number of a sensible size.
    """
    try:
        value = float(text) * scale
    except ValueError:
        value = math.nan
    # Python reads 1_0, which nobody means.
    if "_" in text or not abs(value) <= FARTHEST:
        refuse(name, line, f"{what} is {text[:40]!r}, needed is a number of mm between -{FARTHEST:g} and {FARTHEST:g}")
    return value


@final
class Recorder:
    """Puts runs together, point by point, within bounds; lives while a file is read.

    Args:
        name: of the file.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._points = array("d")
        self._firsts = array("q")
        self._last: Point | None = None
        self.read = 0

    def line(self, number: int, start: Point, end: Point) -> None:
        """Deposit along a line of the file from a place to another; it goes on where the last one ended."""
        if self._last != start:
            self.begin(number, start)
        self.point(number, end)

    def path(self, number: int, points: FloatArray) -> None:
        """Deposit along (k, 3) points of a line of the file; it goes on where the last one ended."""
        moved = np.flatnonzero((points[1:] != points[:-1]).any(axis=1)) + 1
        if not moved.size:
            return
        (x, y, z), (u, v, w) = points[0].tolist(), points[-1].tolist()
        if self._last != (x, y, z):
            self.begin(number, (x, y, z))
        self.count(number, moved.size)
        self._points.frombytes(points[moved].tobytes())
        self._last = (u, v, w)

    def lines(self, starts: FloatArray, ends: FloatArray) -> None:
        """Deposit along lines that are counted already, from (k, 3) places to (k, 3) places; see `line`."""
        begins = np.ones(len(starts), dtype=bool)
        begins[1:] = (starts[1:] != ends[:-1]).any(axis=1)
        places = np.insert(ends, np.flatnonzero(begins), starts[begins], axis=0)
        firsts = np.flatnonzero(begins) + np.arange(int(begins.sum())) + len(self._points) // 3
        self._points.frombytes(np.ascontiguousarray(places).tobytes())
        self._firsts.frombytes(firsts.astype(np.int64).tobytes())

    def begin(self, number: int, start: Point) -> None:
        """Begin a run."""
        self._firsts.append(len(self._points) // 3)
        self.point(number, start)

    def point(self, number: int, place: Point) -> None:
        """Add a point to the run.

        Raises:
            InputError: there are too many.
        """
        self.count(number)
        self._points.extend(place)
        self._last = place

    def count(self, number: int, points: int = 1) -> None:
        """Count points that a line of the file makes.

        Raises:
            InputError: there are too many.
        """
        self.read += points
        if self.read > MOST_POINTS:
            refuse(self._name, number, f"the file has more than {MOST_POINTS} points; give the paths of one part")

    def lift(self) -> None:
        """End the run."""
        self._last = None

    def file(self, *, title: str, deposit: str, reading: Reading | None = None) -> PathFile:
        """Return what was read.

        Args:
            title: of the format.
            deposit: how deposit was distinguished from travel.
            reading: what the reader used, skipped and assumed; the points alone if not given.

        Raises:
            InputError: nothing is deposited along a line.
        """
        points = np.frombuffer(self._points, dtype=np.float64).reshape(-1, 3)
        counts = np.diff(np.append(np.frombuffer(self._firsts, dtype=np.int64), len(points)))
        kept = counts > 1
        if not kept.any():
            raise InputError(
                f"{self._name} holds no path that deposits: {self.read} points were read as {title}, deposit by "
                f"{deposit}; give what deposits with `--deposit`, or export the paths."
            )
        curves = Polylines(
            points[np.repeat(kept, counts)], np.concatenate([[0], np.cumsum(counts[kept])]).astype(np.int64)
        )
        dropped = int((~kept).sum())
        said = reading or record(used={"points": self.read}, skipped={"runs of one point": dropped})
        return PathFile(self._name, title, curves, deposit, self.read, dropped, said)
