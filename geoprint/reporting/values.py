"""What the report page shows of a part, as plain frozen values; no stage is known here."""

from __future__ import annotations

from typing import Literal, final

import numpy as np

from geoprint.errors import InputError, how_many
from geoprint.model import FloatArray, IntArray, Surface, comparable, freeze_arrays, frozen

# A replay is looked at, not measured: so many frames move smoothly and keep the page small.
MOST_FRAMES = 600
# Values of `BackendView.coverage`.
COVERED, GAP, OVERLAP = 0, 1, 2


@final
@comparable
class Picture:
    """A still picture.

    Attributes:
        caption: what it shows; also read out in its place.
        kind: of its bytes.
        content: the file's bytes.
    """

    caption: str
    kind: Literal["png", "svg"]
    content: bytes


@final
@frozen
class Body:
    """A solid of the cell, where it is when all joints are at zero.

    Attributes:
        kind: the arm, what it carries, what stands in the cell, a table that tilts, or what the part lies on.
        joint: the joint that moves it, from 1; 0 for what stands still. Of a table its solids are counted, from 1.
        surface: its outside, in the part's own (work) frame.
    """

    kind: Literal["arm", "tool", "cell", "table", "body"]
    joint: int
    surface: Surface


@final
@frozen
class Machine:
    """What moves around the part: a point x of joint j's link goes to turn_1 ( ... turn_j (x)).

    Attributes:
        points: (j, 3) a point on the axis of each joint, all of them at zero, in the work frame [mm].
        directions: (j, 3) unit vectors about which joints turn positively.
        bodies: what is drawn.
        note: what is drawn otherwise than wanted, or nothing.
    """

    points: FloatArray
    directions: FloatArray
    bodies: tuple[Body, ...]
    note: str = ""

    def __post_init__(self) -> None:
        freeze_arrays(self, points="float: j 3", directions="float: j 3")


@final
@frozen
class TableReplay:
    """How a table holds the part at each moment of a replay: as it rests, and on its course to each attitude.

    Attributes:
        turning: (a, 2) when the table moves to each attitude [s], rising.
        times: (n,) moments of the frames [s], rising: the first and the last of each motion, and enough within it that
            what is between two of them goes straight.
        part: (n, 3, 4) motion of the part from where it rests, in the work frame.
        solids: (n, s, 3, 4) the same of each solid of the table; one that grows longer is stretched.
    """

    turning: FloatArray
    times: FloatArray
    part: FloatArray
    solids: FloatArray

    def __post_init__(self) -> None:
        sizes = freeze_arrays(
            self, turning="float: a 2", times="float: n", part="float: n 3 4", solids="float: n s 3 4",
        )  # fmt: skip
        moves, frames = self.turning.ravel(), self.times
        if np.diff(moves).min(initial=0.0) < 0.0 or np.diff(frames).min(initial=0.0) < 0.0:
            raise InputError("the table's motions in a replay, or their frames, go back in time: give them in order.")
        if not np.isin(moves, frames).all() or not {frames[0], frames[-1]} <= set(moves):
            raise InputError(
                f"a table moves {sizes['a']} times, and its {sizes['n']} frames do not match: give a frame at both "
                "ends of each motion, and only within motions."
            )


@final
@frozen
class Replay:
    """The robot's motion along the path of one backend.

    The frames show the arm; the bead carries its own, finer times, so that curves stay curves.

    Attributes:
        times: (f,) rising, of each frame, at most 600 [s].
        joints: (f, j) angles of the machine's joints [rad].
        speeds: (f,) of the tip [mm/s].
        valve: (d, 2) when the valve is open [s].
        lamp: (l, 2) when the lamp is on [s].
        bead: (k, 3) deposited path in the order of printing, in the work frame [mm].
        bead_offsets: (r + 1,) stretch i is `bead[bead_offsets[i]:bead_offsets[i + 1]]`.
        bead_times: (k,) when each point is deposited [s], not falling.
        table: how a table holds the part meanwhile; None where the part stands still.
    """

    times: FloatArray
    joints: FloatArray
    speeds: FloatArray
    valve: FloatArray
    lamp: FloatArray
    bead: FloatArray
    bead_offsets: IntArray
    bead_times: FloatArray
    table: TableReplay | None = None

    def __post_init__(self) -> None:
        sizes = freeze_arrays(
            self, times="float: f", joints="float: f j", speeds="float: f", valve="float: d 2", lamp="float: l 2",
            bead="float: k 3", bead_offsets="int: o", bead_times="float: k",
        )  # fmt: skip
        if not 2 <= sizes["f"] <= MOST_FRAMES:
            raise InputError(
                f"a replay has {sizes['f']} frames, 2 to {MOST_FRAMES} are allowed: take every n-th row of the motion."
            )
        if np.diff(self.times).min() <= 0.0 or np.diff(self.bead_times).min(initial=0.0) < 0.0:
            raise InputError("Replay.times must rise and Replay.bead_times must not fall.")
        _check_stretches(self.bead_offsets, points=sizes["k"], name="Replay.bead_offsets")


@final
@frozen
class MotionShades:
    """What the motion does about each of the n vertices of the view surface: on the path that lies nearest.

    Attributes:
        lean: (n,) of the nozzle from the surface normal [degrees].
        speed: (n,) of the tip over the set one.
    """

    lean: FloatArray
    speed: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, lean="float: n", speed="float: n")


@final
@frozen
class BackendView:
    """What one backend planned, to be drawn on the view surface of its part (n vertices).

    Attributes:
        name: short, as the command line spells it.
        title: what it is, in a few words.
        distance: (n,) its distance from the source [mm].
        spacing_ratios: (n,) ratio of the nearest sample, on the worse side; NaN for no neighbour.
        coverage: (n,) 0 covered, 1 gap (too far from every path), 2 overlap (near two stretches of path).
        places: (k, 3) samples of the paths, stretch after stretch [mm].
        offsets: (r + 1,) stretch i is `places[offsets[i]:offsets[i + 1]]`.
        ratios: (k,) distance to the neighbouring path over the wanted spacing; NaN for no neighbour.
        widths: (k,) of the bead [mm], or None where nobody knows.
        still: its paths, coloured by local spacing; stands in where no 3D is drawn, and in print.
        replay: the robot's motion, or None where there is none to show.
        shades: lean and speed of that motion, or None.
    """

    name: str
    title: str
    distance: FloatArray
    spacing_ratios: FloatArray
    coverage: IntArray
    places: FloatArray
    offsets: IntArray
    ratios: FloatArray
    widths: FloatArray | None
    still: Picture
    replay: Replay | None
    shades: MotionShades | None

    def __post_init__(self) -> None:
        sizes = freeze_arrays(
            self, distance="float: n", coverage="int: n", places="float: k 3", offsets="int: o",
        )  # fmt: skip
        if self.widths is not None:
            freeze_arrays(self, places="float: k 3", widths="float: k")
        _freeze_measured(self, "spacing_ratios", size=sizes["n"])
        _freeze_measured(self, "ratios", size=sizes["k"])
        _check_stretches(self.offsets, points=sizes["k"], name="BackendView.offsets")
        if not np.isin(self.coverage, (COVERED, GAP, OVERLAP)).all():
            raise InputError("the coverage must be 0 (covered), 1 (gap) or 2 (overlap).")


@final
@comparable
class Row:
    """A line of the table: one quantity, a value for each backend.

    Attributes:
        group: heading it stands under; neighbouring rows with the same one share it.
        quantity: what it is, with its unit.
        meaning: a few words for a reader who does not know the quantity; may be empty.
        values: one text a backend.
        best: columns of `values` that are set off as the best ones.
        decides: whether it stands in the short table at the top, too.
    """

    group: str
    quantity: str
    meaning: str
    values: tuple[str, ...]
    best: tuple[int, ...] = ()
    decides: bool = False


@final
@comparable
class Section:
    """A section of the page that a feature writes.

    Attributes:
        heading: stands above it.
        sentences: a paragraph each.
        pictures: below them.
    """

    heading: str
    sentences: tuple[str, ...]
    pictures: tuple[Picture, ...] = ()


@final
@frozen
class PathDistances:
    """How far sets of lines lie apart: the paths of backends [mm], or the lines of photographs [pixels].

    Attributes:
        names: of b sets.
        hausdorff: (b, b) largest distance from a point of one set to the other, in either direction.
        mean: (b, b) the mean of these distances.
    """

    names: tuple[str, ...]
    hausdorff: FloatArray
    mean: FloatArray

    def __post_init__(self) -> None:
        sizes = freeze_arrays(self, hausdorff="float: b b", mean="float: b b")
        if sizes["b"] != len(self.names):
            raise InputError(
                f"the distances between paths have {how_many(len(self.names), 'name')} for {sizes['b']} paths."
            )


@final
@frozen
class PartReport:
    """Everything the page says of one part.

    Attributes:
        name: of the part, usually its file's.
        verdict: sentences in plain words; the first one decides and is set large.
        cautions: what nobody may overlook: what was not checked, a placement that is not calibrated.
        overview: its cells in the table over all parts, as (heading, value).
        surface: to draw on, with no more faces than a page bears (`view_surface`).
        R_view_work: (3, 3) rotation to the view: z up, as the part stands in the cell or along its mean normal.
        spacing: wanted spacing [mm].
        machine: the robot around it, or None where none was planned.
        winner: which of the backends covers it best; what is shown where one is shown.
        backends: what was planned, in the order of the table.
        refused: (backend, reason) of those that planned nothing.
        table: one row a quantity, one column a backend that planned.
        path_distances: how far the paths lie apart, or None with one backend only.
        pictures: others, for instance the flattened chart.
        settings: (name, value), as asked for.
        inputs: (file, SHA-256).
        critical_deg: angle of the surface's normal from upright beyond which beads overhang [degrees]; None where
            nobody asks for it.
        sections: that features write.
    """

    name: str
    verdict: tuple[str, ...]
    cautions: tuple[str, ...]
    overview: tuple[tuple[str, str], ...]
    surface: Surface
    R_view_work: FloatArray
    spacing: float
    machine: Machine | None
    winner: int
    backends: tuple[BackendView, ...]
    refused: tuple[tuple[str, str], ...]
    table: tuple[Row, ...]
    path_distances: PathDistances | None
    pictures: tuple[Picture, ...]
    settings: tuple[tuple[str, str], ...]
    inputs: tuple[tuple[str, str], ...]
    critical_deg: float | None = None
    sections: tuple[Section, ...] = ()

    def __post_init__(self) -> None:
        freeze_arrays(self, R_view_work="float: 3 3")
        if not self.verdict or not 0 <= self.winner < len(self.backends):
            raise InputError(
                f"the report on {self.name} needs a verdict, at least one backend that planned, and which is best."
            )
        for backend in self.backends:
            if len(backend.distance) != len(self.surface.vertices):
                raise InputError(
                    f"the report on {self.name}: {backend.name} has {how_many(len(backend.distance), 'value')} for "
                    f"{how_many(len(self.surface.vertices), 'vertex', 'vertices')} of the view surface; take "
                    "values[view.vertices]."
                )
        for row in self.table:
            if len(row.values) != len(self.backends):
                raise InputError(
                    f"the report on {self.name}: the row '{row.quantity}' has {how_many(len(row.values), 'value')} "
                    f"for {how_many(len(self.backends), 'backend')}."
                )


def _freeze_measured(view: BackendView, name: str, *, size: int) -> None:
    """Check an array that may hold NaN, where nothing was measured, and make it read-only."""
    values: FloatArray = np.array(getattr(view, name), dtype=np.float64)
    if values.shape != (size,) or np.isinf(values).any():
        raise InputError(f"{name} must be {size} finite numbers or NaN, found shape {values.shape}.")
    values.setflags(write=False)
    object.__setattr__(view, name, values)


def _check_stretches(offsets: IntArray, *, points: int, name: str) -> None:
    if offsets.size < 2 or offsets[0] != 0 or offsets[-1] != points or np.diff(offsets).min() < 1:
        raise InputError(f"{name} must rise from 0 to the number of points, {points}.")
