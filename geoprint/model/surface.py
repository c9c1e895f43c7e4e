"""The surface and what lies on it: points, curves, sources, distance fields, polylines, and how a file was read."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias, final

import numpy as np

from geoprint.errors import InputError, how_many
from geoprint.model.values import BoolArray, Count, FloatArray, IntArray, freeze_arrays, frozen, recorded

# The surface and what lies on it: points, curves, sources, distance fields and contours.


# Barycentric weights may miss the simplex by rounding only.
WEIGHT_TOLERANCE = 1e-9


@final
@frozen
class Surface:
    """A triangle mesh with consistent winding; counter-clockwise seen from outside.

    Attributes:
        vertices: (n, 3) positions [mm] in the part's own (work) frame.
        faces: (m, 3) vertex indices.
        name: what messages call it, usually the file's name.
    """

    vertices: FloatArray
    faces: IntArray
    name: str = "surface"

    def __post_init__(self) -> None:
        sizes = freeze_arrays(self, vertices="float: n 3", faces="int: m 3")
        if sizes["m"] == 0:
            raise InputError(f"{self.name} has no faces; a surface needs at least one triangle.")
        if self.faces.min() < 0 or self.faces.max() >= sizes["n"]:
            raise InputError(
                f"{self.name}: a face refers to vertex {self.faces.max()}, "
                f"but there are {sizes['n']} vertices, numbered from 0."
            )


@final
@frozen
class SurfacePoints:
    """Points on a surface: the hinge of the data flow. Positions and normals are derived in `geometry.points`.

    Attributes:
        faces: (k,) index of the triangle each point lies in.
        weights: (k, 3) barycentric weights, each in [0, 1], summing to 1.
    """

    faces: IntArray
    weights: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, faces="int: k", weights="float: k 3")
        if self.faces.size and self.faces.min() < 0:
            raise InputError("the faces of points must not be negative.")
        if self.faces.size and (
            self.weights.min() < -WEIGHT_TOLERANCE or np.abs(self.weights.sum(axis=1) - 1.0).max() > WEIGHT_TOLERANCE
        ):
            raise InputError("the weights of points must lie in [0, 1] and sum to 1.")

    def __getitem__(self, rows: IntArray | BoolArray | list[int] | slice) -> SurfacePoints:
        """Return some of the points."""
        return SurfacePoints(self.faces[rows], self.weights[rows])

    @classmethod
    def chained(cls, parts: Sequence[SurfacePoints]) -> SurfacePoints:
        """Return the points of several on one surface, one after the other."""
        return cls(np.concatenate([part.faces for part in parts]), np.concatenate([part.weights for part in parts]))

    def corners(self, surface: Surface) -> IntArray:
        """Return the (k, 3) vertices of the triangles that the points lie in.

        Raises:
            InputError: a point names a face that the surface does not have.
        """
        if self.faces.max(initial=-1) >= len(surface.faces):
            raise InputError(
                f"{surface.name} has faces 0 to {len(surface.faces) - 1}, but a point lies in face {self.faces.max()}; "
                "points belong to the surface they were made on."
            )
        return surface.faces[self.faces]

    def values(self, surface: Surface, at_vertices: FloatArray) -> FloatArray:
        """Return the (k,) values of what is linear in each triangle, given the (n,) values at the vertices.

        Raises:
            InputError: a point names a face that the surface does not have.
        """
        return np.einsum("kc,kc->k", self.weights, at_vertices[self.corners(surface)])

    def xyz(self, surface: Surface) -> FloatArray:
        """Return the (k, 3) positions [mm] on the surface that the points were made on.

        Raises:
            InputError: a point names a face that the surface does not have.
        """
        return np.einsum("kc,kcx->kx", self.weights, surface.vertices[self.corners(surface)])


@final
@frozen
class SurfaceCurves:
    """Polylines on a surface, stored end to end; a point source is a curve of one point.

    Consecutive points of a curve lie in one common triangle or are so close that the chord stands for the surface.

    Attributes:
        points: the k points of all curves.
        offsets: (c + 1,) curve i is `points[offsets[i]:offsets[i + 1]]`; starts at 0, ends at k, no empty curve.
        closed: (c,) whether the curve is closed; a closed one repeats its first point at its end.
    """

    points: SurfacePoints
    offsets: IntArray
    closed: BoolArray

    def __post_init__(self) -> None:
        freeze_arrays(self, offsets="int: o", closed="bool: c")
        check_offsets(self.offsets, curves=self.closed.size, points=self.points.faces.size)

    @property
    def count(self) -> int:
        """Number of curves c."""
        return int(self.closed.size)

    def xyz(self, surface: Surface, curve: int) -> FloatArray:
        """Return the (j, 3) positions [mm] of one curve's points, in its order.

        Args:
            surface: that the curves were made on.
            curve: its number, from 0.

        Raises:
            InputError: there is no such curve, or a point names a face that the surface does not have.
        """
        if not 0 <= curve < self.count:
            raise InputError(f"there are {how_many(self.count, 'curve')}, numbered from 0; found {curve}.")
        held = slice(*self.offsets[curve : curve + 2])
        return self.points[held].xyz(surface)


@final
@frozen
class Source:
    """Where distance is zero.

    Attributes:
        curves: boundary loops, curves or points on the surface; at least one.
    """

    curves: SurfaceCurves

    def __post_init__(self) -> None:
        if self.curves.count == 0:
            raise InputError("a source needs at least one curve or point on the surface; this one is empty.")


@final
@frozen
class ScalarField:
    """A number at each vertex, linear in each triangle.

    Attributes:
        values: (n,) distances [mm] from the source, not negative.
    """

    values: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, values="float: n")

    @property
    def maximum(self) -> float:
        """Largest distance [mm]."""
        return float(self.values.max())


@final
@frozen
class Contours:
    """Level curves of a distance: level k lies at (k + 1/2) * spacing from the source.

    Attributes:
        curves: c curves; the region of larger distance is on the left, seen from outside.
        levels: (c,) level k of each curve, ascending.
        spacing: distance between neighbouring levels [mm].
        distance: the field they were traced on, at the vertices of the surface.
    """

    curves: SurfaceCurves
    levels: IntArray
    spacing: float
    distance: ScalarField

    def __post_init__(self) -> None:
        freeze_arrays(self, levels="int: c")
        if self.levels.size != self.curves.count:
            raise InputError(
                f"contours need one level a curve: {how_many(self.levels.size, 'level')}, "
                f"{how_many(self.curves.count, 'curve')}."
            )

    @property
    def point_levels(self) -> IntArray:
        """(k,) level of each of the k points of all curves."""
        return np.repeat(self.levels, np.diff(self.curves.offsets))


@final
@frozen
class FollowedLines:
    """Lines on a surface that paths follow, and where they turn about a place.

    Attributes:
        directions: (m, 3) unit vector along the line of each face; its opposite says the same.
        places: (s, 3) about which lines turn [mm].
        indices: (s,) how often, counter-clockwise: 1 where they circle, -1/2 where three folds meet.
        axes: (m, 2, 3) unit vectors around and up an axis, between which helix angles count; zero where nothing tells
            them. None where the lines have no axis.
    """

    directions: FloatArray
    places: FloatArray
    indices: FloatArray
    axes: FloatArray | None = None

    def __post_init__(self) -> None:
        axes = {} if self.axes is None else {"axes": "float: m 2 3"}
        freeze_arrays(self, directions="float: m 3", places="float: s 3", indices="float: s", **axes)


@final
@frozen
class Paths:
    """Curves that cover a surface, before anybody orders them: what a pattern draws and a path is made of.

    Attributes:
        curves: c curves with k points in all, each open or closed and on one piece of the surface.
        row: (k,) row that each point lies on, counted from the source: k along a contour, rising by one a turn along a
            spiral and by one along a fibre, the number of the row for guided ones.
        spacing: (k,) distance wanted at each point to the neighbouring row [mm].
        width: (k,) of the strip of surface that each point is to fill, over the spacing.
        dropped: lengths of those that the pattern left out because they were not worth a start [mm].
        followed: lines of the surface's faces that they follow; None where it is no field that they follow.
        promised: (k,) distance from the source at which each point promises to lie [mm]; None where they promise none.
    """

    curves: SurfaceCurves
    row: FloatArray
    spacing: FloatArray
    width: FloatArray
    dropped: tuple[float, ...] = ()
    followed: FollowedLines | None = None
    promised: FloatArray | None = None

    def __post_init__(self) -> None:
        promised = {} if self.promised is None else {"promised": "float: k"}
        count = freeze_arrays(self, row="float: k", spacing="float: k", width="float: k", **promised)["k"]
        if count != self.curves.points.faces.size:
            raise InputError(
                f"paths need one row a point: {how_many(count, 'row')}, "
                f"{how_many(self.curves.points.faces.size, 'point')}."
            )
        if self.spacing.min(initial=1.0) <= 0.0 or self.width.min(initial=1.0) <= 0.0:
            raise InputError("spacing and width of paths must be positive.")

    @property
    def levels(self) -> IntArray:
        """(c,) whole part of the row at which each curve starts."""
        return np.floor(self.row[self.curves.offsets[:-1]]).astype(np.int64)


def check_offsets(offsets: IntArray, *, curves: int, points: int) -> None:
    """Check that offsets cut `points` items into `curves` pieces, none of them empty.

    Raises:
        InputError: they do not.
    """
    whole = offsets.size == curves + 1 and offsets[0] == 0 and offsets[-1] == points
    if not whole or (curves and np.diff(offsets).min() < 1):
        raise InputError(f"offsets must rise strictly from 0 to {points} in {curves} steps.")


# Polylines in space, such as the paths of any planner before anything is known of the surface that they cover.


@final
@frozen
class Polylines:
    """Runs of straight lines from point to point, stored end to end.

    Attributes:
        points: (k, 3) corners, run after run [mm].
        offsets: (r + 1,) run i is `points[offsets[i]:offsets[i + 1]]`; each has two points or more.
    """

    points: FloatArray
    offsets: IntArray

    def __post_init__(self) -> None:
        sizes = freeze_arrays(self, points="float: k 3", offsets="int: o")
        check_offsets(self.offsets, curves=self.count, points=sizes["k"])
        if np.diff(self.offsets).min(initial=2) < 2:
            raise InputError("every run of Polylines needs two points or more.")

    @property
    def count(self) -> int:
        """Number of runs r."""
        return int(self.offsets.size) - 1

    @classmethod
    def of(cls, runs: Sequence[FloatArray]) -> Polylines:
        """Return runs that are given as arrays of (k, 3) points each [mm], in their order.

        Raises:
            InputError: there is none, or one has less than two points or is no such array.
        """
        if len(runs) == 0:
            raise InputError("Polylines need one run or more, each an array of (k, 3) points.")
        each = [np.asarray(run) for run in runs]
        if any(run.ndim != 2 or run.shape[1] != 3 for run in each):
            raise InputError(f"every run of Polylines must have shape (k, 3), found {[run.shape for run in each][:5]}.")
        return cls(np.concatenate(each), np.cumsum([0, *(len(run) for run in each)]))

    @property
    def runs(self) -> IntArray:
        """(k,) run of each point, from 0."""
        return np.repeat(np.arange(self.count), np.diff(self.offsets))


# What a reader of files says beside its data: what it used, what it skipped and what it assumed.


Counted: TypeAlias = dict[str, Count]

# As many kinds, and letters of one, as a sentence shows; a foreign file may hold any number.
SHOWN_KINDS = 12
SHOWN_LETTERS = 60
_PLURAL = re.compile(r"(?<![`\w])[a-z]+s\b(?!`)")
_IRREGULAR = {"vertices": "vertex", "properties": "property"}


@final
@recorded("ReadingRecord")
class Reading:
    """What a reader used of a file, what it skipped and what it assumed; `reading` makes one.

    What can change geometry or meaning is used or the file is refused: only what cannot is skipped.

    Attributes:
        used: kinds of content that were used, with their counts, such as {"moves": 412}.
        skipped: kinds of content that were skipped, with their counts, such as {"M104": 31}; the most frequent first.
        assumed: assumptions where the file leaves something open, such as "E relative, from the first moves".
    """

    used: Counted
    skipped: Counted
    assumed: tuple[str, ...]

    @property
    def text(self) -> str:
        """Return it in one line, as "read: 412 moves; skipped: 31 M104; assumed: E relative"."""
        parts = {"read": _listed(self.used), "skipped": _listed(self.skipped), "assumed": ", ".join(self.assumed)}
        return "; ".join(f"{name}: {said}" for name, said in parts.items() if said)


def reading(
    *, used: Mapping[str, int], skipped: Mapping[str, int] | None = None, assumed: Iterable[str] = ()
) -> Reading:
    """Return the record of a reader; kinds that were met no time are left out.

    Args:
        used: how often each kind was used, in the order in which they shall be said.
        skipped: how often each kind was skipped.
        assumed: phrases, each once.

    Examples:
        >>> reading(used={"moves": 412}, skipped={"G4": 2, "M104": 31}, assumed=["E relative"]).text
        'read: 412 moves; skipped: 31 M104, 2 G4; assumed: E relative'
    """
    often = sorted((skipped or {}).items(), key=lambda each: (-each[1], each[0]))
    return Reading(
        {kind[:SHOWN_LETTERS]: count for kind, count in used.items() if count},
        {kind[:SHOWN_LETTERS]: count for kind, count in often if count},
        tuple(dict.fromkeys(assumed)),
    )


def _listed(counted: Counted) -> str:
    shown = [f"{count} {_singular(kind) if count == 1 else kind}" for kind, count in counted.items()][:SHOWN_KINDS]
    rest = [*counted.values()][SHOWN_KINDS:]
    return ", ".join([*shown, *([f"{sum(rest)} of {len(rest)} other kinds"] if rest else [])])


def _singular(kind: str) -> str:
    """Return the words for one of a kind; names, as `vn` and M104, stay."""
    return _PLURAL.sub(lambda found: _IRREGULAR.get(found[0], found[0][:-1]), kind, count=1)
