"""A smooth surface around one label of a volume.

A segmentation is a heap of boxes; the surface that was meant is smooth. The signed distance from the heap's border is
smoothed by little more than a voxel, which takes away the terraces, and of its level surfaces the one is taken that
encloses exactly the volume of the voxels, since smoothing by itself shrinks what bulges. Between thick slices the
distance is interpolated first: shape-based interpolation [Raya1990].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple, TypeAlias, final

import numpy as np
from scipy import ndimage

from geoprint.errors import InputError, UsageError, percent
from geoprint.geometry.files.labelling import LabelVolume, box_of
from geoprint.geometry.files.mesh_file import UNITS, Choice, MeshFile
from geoprint.geometry.native import missing
from geoprint.geometry.operators import signed_volume
from geoprint.geometry.remeshing import TERRACE_SHARE, TERRACE_WAVELENGTH
from geoprint.geometry.topology import turned_over
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, reading

if TYPE_CHECKING:
    from numpy.typing import NDArray


Distances: TypeAlias = "NDArray[np.float32]"

# Standard deviation of the smoothing, in the finest side of a voxel, from the smoothest on; the first that keeps the
# part is taken. On a heart of 1 mm voxels the first halves the distance to the true surface and leaves 3 degrees of
# the 20 by which voxel faces miss its normal.
SMOOTHINGS = (1.0, 0.7, 0.5)
# Who takes a label as thin as its voxels gets their terraces with it, where less smoothing than that keeps it.
THIN_SMOOTHINGS = (*SMOOTHINGS, 0.25, 0.0)
# Along an axis with longer voxels at least this share of their side.
SLICE_SHARE = 0.35
# Where smoothing alone takes more than this share of the volume the part is too thin for it, and less is tried ...
LARGEST_LOSS = 0.04
# ... up to this, beyond which nobody can say where the surface lies.
UNBELIEVABLE_LOSS = 0.12
# The volume of the surface is that of the voxels but for this share.
VOLUME_TOLERANCE = 1e-3
# A grid point nearer to the surface than this share of the finest side of a voxel counts as that far: so triangles keep
# a size, and the surface moves by less than the noise of any scanner.
CRUMB_SHARE = 0.05
# Steps to that volume; each takes a surface. Two or three are enough.
MOST_STEPS = 8
# Voxels of empty margin, so that the surface is closed where the label touches the end of the volume.
MARGIN = 4
# Largest block of voxels around a label, finer ones between thick slices included: 1.2 GB of arrays.
MOST_VOXELS = 100_000_000
# Labels that a message lists.
MOST_LISTED = 100


@final
@dataclass(frozen=True, slots=True)
class _Small:
    """Islands or pinholes of a label: how many there are, and how many voxels they have together."""

    count: int
    voxels: int


class LabelSurface(NamedTuple):
    """A surface around a label.

    Attributes:
        vertices: (n, 3) [file's unit].
        faces: (m, 3), counter-clockwise from outside.
        smoothing: that was used [finest side of a voxel].
        volume_error: by which share the enclosed volume differs from that of the label.
        islands: that smoothing took away.
        pinholes: that it closed.
    """

    vertices: FloatArray
    faces: IntArray
    smoothing: float
    volume_error: float
    islands: _Small
    pinholes: _Small


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Field:
    """Signed distance from a label's border on a grid finer than the volume's where its slices are thick.

    Attributes:
        values: (i, j, k) [file's unit], positive inside.
        finer: (3,) points of the grid for each voxel.
        first: (3,) voxel index of the grid's first point.
        widths: (3,) finest side of a voxel as a share of each, or SLICE_SHARE where that is more.
    """

    values: Distances
    finer: IntArray
    first: IntArray
    widths: FloatArray


def volume_mesh(volume: LabelVolume, choice: Choice, *, name: str) -> MeshFile:
    """Return the surface of one label of a volume.

    Args:
        volume: as read.
        choice: which label, and how; no label where there is but one.
        name: of the file.

    Raises:
        UsageError: there is no such label, or no choice among several; a package is missing; as `choice.check`.
        InputError: as `label_surface`.
    """
    chosen = _chosen_label(volume, choice.label, name=name)
    inside = volume.inside(chosen)
    millimetres = UNITS[volume.unit or "mm"]
    if choice.check is not None:
        low, high = box_of(inside, volume.affine)
        choice.check(np.stack([low, high]), volume.unit or "", volume.usual)
    side = millimetres * float(np.linalg.norm(volume.affine[:3, :3], axis=0).max())
    advice = (
        f"smooth its voxel terraces with `geoprint remesh {name} --label {chosen} --thin --smooth "
        f"{TERRACE_WAVELENGTH * side:.3g} --max-deviation {TERRACE_SHARE * side:.2g} --out part.ply` and plan that; "
        "or use a finer volume"
    )
    made = label_surface(
        inside, volume.affine, voxels=volume.voxels(chosen, inside), name=name, advice=advice, thin=choice.thin
    )
    notes = (
        ("label", chosen),
        ("smoothing_voxels", made.smoothing),
        ("volume_error", round(made.volume_error, 6)),
        ("coordinates", volume.coordinates),
    )
    cubes = abs(float(np.linalg.det(volume.affine[:3, :3]))) * millimetres**3
    skipped = dict(volume.skipped) | {"other labels": len(volume.numbers) - 1}
    for kind, small in (("islands too small for a surface", made.islands), ("pinholes closed", made.pinholes)):
        skipped[f"{kind} ({small.voxels} voxels, {small.voxels * cubes:.3g} mm3)"] = small.count
    named = f" '{volume.names[chosen]}'" if volume.names.get(chosen) else ""
    record = reading(
        used={f"voxels of label {chosen}{named}": int(inside.sum()) - made.islands.voxels},
        skipped=skipped,
        assumed=volume.assumed,
    )
    return MeshFile(made.vertices, made.faces, volume.unit or "", notes, reading=record, usual=volume.usual)


def label_surface(
    inside: BoolArray, affine: FloatArray, *, voxels: float, name: str, advice: str, thin: bool
) -> LabelSurface:
    """Return a smooth closed surface around some voxels.

    Args:
        inside: (i, j, k) which voxels, at least one.
        affine: (4, 4) position of the voxels' centres; a left-handed or oblique one is as good as any.
        voxels: how many they fill, by their shares where they have them.
        name: of the file.
        advice: what helps where the label is too thin, but not too thin for its terraces.
        thin: whether these are taken.

    Returns:
        The surface. Islands and pinholes that smoothing takes away are left out of it and of its volume.

    Raises:
        InputError: the label is too thin for its voxels, or takes too many of them.
    """
    sides: FloatArray = np.linalg.norm(affine[:3, :3], axis=0)
    block, first = _block(inside)
    cube = float(abs(np.linalg.det(affine[:3, :3])))
    smoothings = THIN_SMOOTHINGS if thin else SMOOTHINGS
    rough = _distances(block, first, sides=sides, name=name)
    cleaned, islands, pinholes = _cleaned(block, rough, smoothings[0])
    if islands.count or pinholes.count:
        rough = _distances(cleaned, first, sides=sides, name=name)
    wanted = cube * (voxels - islands.voxels + pinholes.voxels)
    smooth, smoothing, loss = _smoothed(rough, affine, smoothings, wanted=wanted)
    if abs(loss) > UNBELIEVABLE_LOSS:
        least = _smoothed(rough, affine, THIN_SMOOTHINGS[-1:], wanted=wanted)[2]
        raise InputError(
            f"`{name}`: the label is about as thin as its voxels of {' x '.join(f'{side:.3g}' for side in sides)}. "
            f"The least smoothing changes its volume by {percent(-loss, signed=True)}, at most "
            f"{percent(UNBELIEVABLE_LOSS)} is allowed: "
            f"{advice if abs(least) <= UNBELIEVABLE_LOSS else 'use a volume with thinner slices'}.",
            loss=loss,
        )
    surface, volume = _with_volume(smooth, affine, wanted=wanted, name=name)
    return LabelSurface(surface.vertices, surface.faces, smoothing, volume / wanted - 1.0, islands, pinholes)


def _cleaned(block: BoolArray, rough: _Field, smoothing: float) -> tuple[BoolArray, _Small, _Small]:
    """Return voxels without the islands and pinholes that smoothing takes away, and what these were.

    The largest island stays, and so does what is outside.
    """
    smooth = _widened(rough, smoothing)[tuple(slice(None, None, int(step)) for step in rough.finer)]
    cleaned = block.copy()
    found: list[_Small] = []
    for value in (True, False):
        parts = np.asarray(ndimage.label(block == value)[0])
        sizes = np.bincount(parts.ravel())
        numbers = np.arange(1, sizes.size)
        strongest = np.asarray(ndimage.maximum(smooth if value else -smooth, parts, numbers)).reshape(-1)
        gone = numbers[strongest <= 0.0]
        gone = gone[gone != 1 + int(np.argmax(sizes[1:]))]
        if gone.size:
            cleaned[np.isin(parts, gone)] = not value
        found.append(_Small(int(gone.size), int(sizes[gone].sum())))
    return cleaned, found[0], found[1]


def _chosen_label(volume: LabelVolume, label: int | None, *, name: str) -> int:
    """Return the label that is meant, if it is there."""
    if not volume.numbers:
        raise InputError(f"`{name}` holds no label: all of its voxels are 0.")
    if label is None and len(volume.numbers) == 1:
        return volume.numbers[0]
    if label in volume.numbers:
        return label
    names = {number: f"{volume.names[number]}, " if volume.names.get(number) else "" for number in volume.numbers}
    counts = ((number, int(volume.inside(number).sum())) for number in volume.numbers[:MOST_LISTED])
    shown = ", ".join(f"{number} ({names[number]}{count} voxels)" for number, count in counts)
    if len(volume.numbers) > MOST_LISTED:
        shown += f" and {len(volume.numbers) - MOST_LISTED} more, which `geoprint inspect {name}` lists"
    if label is None:
        raise UsageError(f"`{name}` holds the labels {shown}; choose one with `--label N`.")
    raise UsageError(f"`{name}` has no label {label}; it holds {shown}: choose one with `--label N`.")


def _block(inside: BoolArray) -> tuple[BoolArray, IntArray]:
    """Return the voxels with a margin of empty ones, and the index of the first voxel of this block."""
    spans = [np.flatnonzero(inside.any(axis=(1, 2))), np.flatnonzero(inside.any(axis=(0, 2))),
             np.flatnonzero(inside.any(axis=(0, 1)))]  # fmt: skip
    part = inside[tuple(slice(int(span[0]), int(span[-1]) + 1) for span in spans)]
    return np.pad(part, MARGIN), np.array([int(span[0]) - MARGIN for span in spans])


def _distances(block: BoolArray, first: IntArray, *, sides: FloatArray, name: str) -> _Field:
    """Return the signed distance from the border of a block's voxels, on finer slices where they are thick."""
    finer = np.maximum(np.rint(sides / sides.min()), 1).astype(np.int64)
    count = math.prod(int(extent) for extent in block.shape) * math.prod(finer.tolist())
    if count > MOST_VOXELS:
        raise InputError(
            f"`{name}`: the label spans {' x '.join(map(str, block.shape))} voxels, {count} with even sides, and at "
            f"most {MOST_VOXELS} are worked on; resample it coarser or crop it.",
            voxels=count,
        )
    values = np.asarray(ndimage.distance_transform_edt(block, sampling=sides), dtype=np.float32)
    values -= np.asarray(ndimage.distance_transform_edt(~block, sampling=sides), dtype=np.float32)
    for axis in range(3):
        if finer[axis] > 1:
            values = _interpolated(values, axis, times=int(finer[axis]))
    return _Field(values, finer, first, np.maximum(sides.min() / sides, SLICE_SHARE))


def _smoothed(
    rough: _Field, affine: FloatArray, smoothings: Sequence[float], *, wanted: float
) -> tuple[_Field, float, float]:
    """Return the field smoothed as far as the part bears it, the smoothing, and the share of volume it takes away."""
    smooth, smoothing, loss = rough, 0.0, 0.0
    for smoothing in smoothings:
        values = _widened(rough, smoothing)
        smooth = replace(rough, values=values)
        loss = 1.0 if values.max() <= 0.0 else 1.0 - _enclosed(smooth, affine, level=0.0)[1] / wanted
        if abs(loss) <= LARGEST_LOSS:
            break
    return smooth, smoothing, loss


def _widened(rough: _Field, smoothing: float) -> Distances:
    """Return the field smoothed by so many finest sides of a voxel, less along thick slices."""
    return np.asarray(ndimage.gaussian_filter(rough.values, smoothing * rough.widths * rough.finer), dtype=np.float32)


def _interpolated(values: Distances, axis: int, *, times: int) -> Distances:
    """Return values with so many points for each along an axis, linear between them."""
    places: FloatArray = np.arange((values.shape[axis] - 1) * times + 1, dtype=np.float64) / times
    before = np.minimum(places.astype(np.int64), values.shape[axis] - 2)
    shape = [-1 if other == axis else 1 for other in range(3)]
    share = (places - before).astype(np.float32).reshape(shape)
    low, high = np.take(values, before, axis=axis), np.take(values, before + 1, axis=axis)
    return np.asarray(low * (1 - share) + high * share, dtype=np.float32)


def _with_volume(smooth: _Field, affine: FloatArray, *, wanted: float, name: str) -> tuple[Surface, float]:
    """Return the level surface that encloses a volume, and what it encloses, found by secants."""
    level, step = 0.0, 0.05 * float(np.linalg.norm(affine[:3, :3], axis=0).min())
    surface, volume = _enclosed(smooth, affine, level=level)
    other = _enclosed(smooth, affine, level=level - step)[1]
    slope = (other - volume) / -step
    for _ in range(MOST_STEPS):
        if abs(volume / wanted - 1.0) <= VOLUME_TOLERANCE:
            return surface, volume
        before, last = level, volume
        # Beyond the values of the field there is no surface at all.
        level = float(np.clip(level + (wanted - volume) / slope, 0.9 * smooth.values.min(), 0.9 * smooth.values.max()))
        if level == before:
            break
        surface, volume = _enclosed(smooth, affine, level=level)
        slope = (volume - last) / (level - before)
    raise InputError(
        f"`{name}`: no smooth surface around the label encloses the volume of its voxels within "
        f"{percent(VOLUME_TOLERANCE, 1)}. The label is too thin or ragged: clean it, or use a finer volume."
    )


def _enclosed(smooth: _Field, affine: FloatArray, *, level: float) -> tuple[Surface, float]:
    """Return the surface at a level in the file's coordinates, and the volume inside."""
    try:
        from skimage.measure import marching_cubes
    except ImportError as error:
        raise missing("scikit-image", extra="medical", work="reading label volumes") from error
    found, faces, _, _ = marching_cubes(_kept_off(smooth, affine, level=level), level, allow_degenerate=False)
    voxels = found / smooth.finer + smooth.first
    vertices = voxels @ affine[:3, :3].T + affine[:3, 3]
    surface = Surface(vertices=vertices.astype(np.float64), faces=faces.astype(np.int64))
    volume = signed_volume(surface)
    if volume < 0:
        return turned_over(surface), -volume
    return surface, volume


def _kept_off(smooth: _Field, affine: FloatArray, *, level: float) -> Distances:
    """Return the field with values that nearly are the level moved a little off it: without crumbs of triangles."""
    least = np.float32(CRUMB_SHARE * np.linalg.norm(affine[:3, :3], axis=0).min())
    off = smooth.values - np.float32(level)
    return np.where(np.abs(off) < least, np.float32(level) + np.where(off < 0, -least, least), smooth.values)
