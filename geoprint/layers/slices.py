"""A thickness in whole layers: their number and height, and the stack sliced open."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.distance import isolines
from geoprint.errors import InputError
from geoprint.layers.level_surfaces import level_surface
from geoprint.model import FloatArray, IntArray, PoseStream, ScalarField, Surface, freeze_arrays, frozen

# Layers sliced open: the line in which a plane cuts a surface, and the beads of the paths that cross it.


# A path whose bead a plane would cut so many times as wide runs along the plane: it is cut lengthwise.
MOST_OBLIQUE = 3.0
# A plane passes the vertices of a surface by this share of its size: one that goes through them cuts in branches.
ASIDE_SHARE = 1e-6


@final
@frozen
class CutPlane:
    """A plane that slices a part open.

    Attributes:
        origin: (3,) a place on it [mm].
        R_plane_work: (3, 3) rotation: x to the right, y up, both in the plane, and z out of it to the reader.
    """

    origin: FloatArray
    R_plane_work: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, origin="float: 3", R_plane_work="float: 3 3")

    def seen(self, places: FloatArray) -> FloatArray:
        """Return (k, 3) places as seen: right, up, and towards the reader from the plane [mm]."""
        return (places - self.origin) @ self.R_plane_work.T


@final
@frozen
class Slice:
    """What a plane cuts of a layer, or of the part: c lines, and b beads.

    Attributes:
        line: (q, 2) of the surface, line after line [mm].
        offsets: (c + 1,) where each line starts.
        beads: (b, 2) middles of the beads [mm].
        along: (b, 2) unit vectors along the layer.
        widths: (b,) of the beads, as the plane cuts them [mm].
    """

    line: FloatArray
    offsets: IntArray
    beads: FloatArray
    along: FloatArray
    widths: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, line="float: q 2", offsets="int: o", beads="float: b 2", along="float: b 2", widths="float: b"
        )


def middle_planes(part: Surface, upright: FloatArray) -> tuple[CutPlane, CutPlane]:
    """Return the planes through the middle of a part, upright: across where it is longest, and along that.

    Args:
        part: n vertices.
        upright: (3, 3) rotation in which it stands upright.
    """
    seen = part.vertices @ upright.T
    middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    _, _, axes = np.linalg.svd(seen[:, :2] - seen[:, :2].mean(axis=0), full_matrices=False)
    longest = axes[0] * (1.0 if axes[0].sum() >= 0.0 else -1.0)
    long, short, up = np.append(longest, 0.0), np.array([-longest[1], longest[0], 0.0]), np.array([0.0, 0.0, 1.0])
    aside = ASIDE_SHARE * float(np.linalg.norm(np.ptp(seen, axis=0)))
    across, along = np.stack([short, up, long]), np.stack([long, up, -short])
    first, second = (
        CutPlane((middle + aside * R[2]) @ upright, R @ upright) for R in (across, along)
    )  # fmt: skip
    return first, second


def sliced(surface: Surface, plane: CutPlane) -> tuple[FloatArray, IntArray]:
    """Return the (q, 2) places where a plane cuts a surface [mm], line after line, and the (c + 1,) starts of these."""
    curves, _ = isolines(surface, ScalarField(plane.seen(surface.vertices)[:, 2]), levels=np.zeros(1))
    return plane.seen(curves.points.xyz(surface))[:, :2], curves.offsets


def sliced_layer(surface: Surface, poses: PoseStream, plane: CutPlane, *, height: float) -> Slice:
    """Return what a plane cuts of a layer: the line of its middle, and the beads of its paths.

    Args:
        surface: the middle of the layer.
        poses: its paths, with the flow that they deposit.
        plane: that cuts.
        height: of the layer [mm]; the flow over it is the width of a bead.
    """
    line, offsets = sliced(surface, plane)
    places, rows, widths = _beads(plane.seen(poses.surface_points), poses, height=height)
    upright = poses.normals[rows] @ plane.R_plane_work.T[:, :2]
    lengths = np.linalg.norm(upright, axis=1, keepdims=True)
    upright = np.where(lengths > 0.0, upright / np.where(lengths > 0.0, lengths, 1.0), [0.0, 1.0])
    along = np.column_stack([upright[:, 1], -upright[:, 0]])
    return Slice(line=line, offsets=offsets, beads=places, along=along, widths=widths)


def _beads(seen: FloatArray, poses: PoseStream, *, height: float) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return the (b, 2) middles of the beads that a plane cuts, the pose before each, and how wide they are there [mm].

    Args:
        seen: (p, 3) places of the poses as the plane sees them.
        poses: p of them.
        height: of the layer [mm].
    """
    steps = np.diff(seen, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    wide = 0.5 * (poses.flow[:-1] + poses.flow[1:]) / height
    straight = np.abs(steps[:, 2]) / np.where(lengths > 0.0, lengths, 1.0)
    oblique = straight * MOST_OBLIQUE < 1.0
    over = seen[:, 2] >= 0.0
    (across,) = np.nonzero(poses.deposited & ~oblique & (over[1:] != over[:-1]))
    share = seen[across, 2] / -steps[across, 2]
    # A bead along the plane is cut where the plane lies within it, and drawn in pieces that bend with the layer.
    middles = np.abs(seen[:-1, 2] + 0.5 * steps[:, 2])
    (lengthwise,) = np.nonzero(poses.deposited & oblique & (lengths > 0.0) & (middles <= 0.5 * wide))
    starts, ends = _pieces(lengthwise, lengths, wide)
    places = np.concatenate([
        (seen[across] + share[:, None] * steps[across])[:, :2], 0.5 * (seen[starts] + seen[ends + 1])[:, :2],
    ])  # fmt: skip
    widths = np.concatenate([
        wide[across] / straight[across], np.linalg.norm((seen[ends + 1] - seen[starts])[:, :2], axis=1),
    ])  # fmt: skip
    return places, np.concatenate([across, starts]), widths


def _pieces(rows: IntArray, lengths: FloatArray, wide: FloatArray) -> tuple[IntArray, IntArray]:
    """Return the first and the last row of pieces of rows in a row, each about as many times as long as it is wide."""
    if not rows.size:
        return rows, rows
    chain = np.cumsum(np.diff(rows, prepend=rows[0]) != 1)
    arcs = np.cumsum(lengths[rows])
    first = np.searchsorted(chain, chain)
    arcs -= arcs[first]
    piece = np.floor(arcs / (MOST_OBLIQUE * wide[rows])).astype(np.int64)
    begins = np.flatnonzero((np.diff(chain, prepend=chain[0] - 1) != 0) | (np.diff(piece, prepend=-1) != 0))
    return rows[begins], rows[np.append(begins[1:], rows.size) - 1]


# A thickness in whole layers: their number and height, and the levels between which they lie.


# A surface may lie off its level by this share of a layer's height, so that layers are as high as they shall be to 2 %.
TOLERANCE_SHARE = 0.01
# Its edges are as long as a layer is high, within these bounds [mm]: longer ones round off the corners of its rim.
SHORTEST_EDGE, LONGEST_EDGE = 0.3, 1.0
# More layers than this are a typing error: a print of a day.
MOST_LAYERS = 500


def whole_layers(thickness: float, *, height: float) -> tuple[int, float]:
    """Return how many layers of about a height make a thickness, and the height that they then have [mm].

    Raises:
        InputError: a length is no positive number, or there are too many layers.

    Examples:
        >>> whole_layers(3.0, height=0.4)
        (8, 0.375)
    """
    for name, value in (("the thickness", thickness), ("the height of a layer", height)):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name} must be a positive number of mm, found {value}.")
    count = max(round(thickness / height), 1)
    if count > MOST_LAYERS:
        raise InputError(
            f"{thickness:g} mm in layers of {height:g} mm need {count:,} of them, but {MOST_LAYERS} is the limit: "
            "check thickness and height, both in mm."
        )
    return count, thickness / count


def layer_level(part: Surface, over: float, *, height: float) -> Surface:
    """Return the surface at a height over a part, as true as layers need it.

    Args:
        part: manifold, consistently wound; layers lie on its outer side.
        over: the height, along the distance from the part [mm].
        height: of a layer [mm].

    Raises:
        InputError: a length is no positive number.
        FieldError: nothing of the outer side is that far from the part.
        MeshError: sheets of the level lie too close together.
    """
    edge = min(max(height, SHORTEST_EDGE), LONGEST_EDGE)
    return level_surface(part, height=over, edge_length=edge, tolerance=TOLERANCE_SHARE * height)
