"""Where the tool of a G-code program is: coordinate systems, offsets, homes, and the frame that each place is known in.

A coordinate system that nothing in the file sets lies where the controller's memory has it: its zero is a frame of its
own. So is a place that the tool had before anything says where, once G92 or G10 L20 gives it a name. Machine
coordinates are frame 0. Two places are compared only within one frame; each axis has its own.
"""

from __future__ import annotations

import math
from typing import final

_MACHINE = 0
_SYSTEMS = 9
_NAN = math.nan


@final
class Places:
    """Place of the tool and offsets of the coordinates, axis by axis [mm]; lives while a file is read.

    Attributes:
        here: of the tool; not a number where it is not known.
        frames: in which `here` is known.
        why: what made an axis unknown; empty where nothing before has said it.
        shift: what is added to a coordinate of the program.
        shift_frames: in which that is known.
    """

    def __init__(self) -> None:
        self.here = [_NAN] * 3
        self.frames = [_MACHINE] * 3
        self.why = [""] * 3
        self._system = 1
        # Offset of each system and axis, with its frame; what G92 or G52 adds, with a frame where it alone counts.
        self._offsets = {s: [(0.0, s)] * 3 for s in range(1, _SYSTEMS + 1)}
        self._added: list[tuple[float, int | None]] = [(0.0, None)] * 3
        self._stored = list(self._added)
        self._homes: dict[str, tuple[list[float], list[int]]] = {}
        self._frame_count = _SYSTEMS
        self._triples: dict[tuple[int, ...], int] = {}
        # Of the frames in use, where they have been looked up since they changed.
        self._triple = -1
        self.shift = [0.0] * 3
        self.shift_frames = [1] * 3

    def frame(self) -> int:
        """Return a number for the frames that the three axes are known in."""
        if self._triple < 0:
            self._triple = self._triples.setdefault(tuple(self.frames), len(self._triples))
        return self._triple

    def select(self, system: int) -> None:
        """Use another coordinate system, 1 for G54 to 9 for G59.3."""
        if system != self._system:
            self._system = system
            self._lose_renamed(range(3))

    def put_system(self, system: int, axis: int, value: float) -> None:
        """Put the zero of a coordinate system to a machine coordinate (G10 L2); 0 for the one in use."""
        system = system or self._system
        self._offsets[system][axis] = (value, _MACHINE)
        if system == self._system:
            self._lose_renamed([axis])

    def move_system(self, system: int, axis: int, value: float) -> None:
        """Move the zero of a coordinate system by a distance."""
        system = system or self._system
        old, frame = self._offsets[system][axis]
        self._offsets[system][axis] = (old + value, frame)
        self._add_up()

    def name_in_system(self, system: int, axis: int, value: float) -> None:
        """Put the zero of a coordinate system so that the tool is at a coordinate of it (G10 L20)."""
        system = system or self._system
        added, renamed = self._added[axis]
        if renamed is not None:
            self._added[axis], added = (0.0, None), 0.0
        self._begin_frame(axis, value + added)
        self._offsets[system][axis] = (self.here[axis] - value - added, self.frames[axis])
        self._add_up()

    def name_here(self, axis: int, value: float) -> None:
        """Give the tool's place a coordinate (G92)."""
        self._begin_frame(axis, value)
        offset, frame = self._offsets[self._system][axis]
        away = self.here[axis] - value
        same = frame == self.frames[axis]
        self._added[axis] = (away - offset, None) if same else (away, self.frames[axis])
        self._stored[axis] = self._added[axis]
        self._add_up()

    def add(self, axis: int, value: float) -> None:
        """Add a distance to the coordinates of an axis (G52), in place of what G92 added."""
        self._added[axis] = self._stored[axis] = (value, None)
        self._add_up()

    def is_renamed(self, axis: int) -> bool:
        """Return whether G92 or G52 has given an axis other coordinates."""
        return self._added[axis] != (0.0, None)

    def cancel(self, *, forget: bool) -> None:
        """Take back what G92 and G52 added (G92.1, and G92.2 which does not forget it)."""
        self._added = [(0.0, None)] * 3
        if forget:
            self._stored = list(self._added)
        self._add_up()

    def restore(self) -> None:
        """Add again what was taken back (G92.3)."""
        self._added = list(self._stored)
        self._add_up()

    def home(self, axis: int) -> None:
        """Move an axis to its home and take it for the zero of the program, as printers are sliced for."""
        self._added[axis] = self._stored[axis] = (0.0, None)
        self._add_up()
        self.here[axis] = self.shift[axis]
        self._know(axis, self.shift_frames[axis])

    def keep(self, code: str) -> None:
        """Store the tool's place (G28.1, G30.1)."""
        self._homes[code] = (list(self.here), list(self.frames))

    def recall(self, code: str, axis: int, why: str) -> None:
        """Move an axis to where a code leads (G28, G30); nobody knows where, unless it was stored."""
        if code not in self._homes:
            self.lose(axis, why)
            return
        places, frames = self._homes[code]
        self.here[axis], self.why[axis] = places[axis], why
        self._know(axis, frames[axis])

    def lose(self, axis: int, why: str) -> None:
        """Forget where an axis is."""
        self.here[axis], self.why[axis] = _NAN, why
        self._know(axis, _MACHINE)

    def put(self, axis: int, value: float, *, machine: bool) -> None:
        """Move an axis to a coordinate of the program, or of the machine (G53)."""
        frame = _MACHINE if machine else self.shift_frames[axis]
        self.here[axis] = value if machine else value + self.shift[axis]
        if frame != self.frames[axis]:
            self._know(axis, frame)

    def _know(self, axis: int, frame: int) -> None:
        """Note the frame that the place of an axis is known in."""
        self.frames[axis] = frame
        self._triple = -1

    def _begin_frame(self, axis: int, value: float) -> None:
        """Where nobody knows the place of an axis, let its coordinate begin a frame."""
        if math.isnan(self.here[axis]):
            self._frame_count += 1
            self.here[axis] = value
            self._know(axis, self._frame_count)

    def _lose_renamed(self, axes: range | list[int]) -> None:
        """Add up offsets behind a change of system; what G92 named in a frame of its own is known no more."""
        for axis in axes:
            if self._added[axis][1] is not None:
                self._frame_count += 1
                self._added[axis] = (self._added[axis][0], self._frame_count)
        self._add_up()

    def _add_up(self) -> None:
        for axis, ((offset, frame), (added, renamed)) in enumerate(
            zip(self._offsets[self._system], self._added, strict=True)
        ):
            self.shift[axis] = added + (offset if renamed is None else 0.0)
            self.shift_frames[axis] = frame if renamed is None else renamed
