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
from typing import TYPE_CHECKING, TypeAlias, final

import numpy as np
from scipy import ndimage

from geoprint.errors import InputError, UsageError
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.surfaces.conversion import missing
from geoprint.surfaces.files.dicom_segmentation import read_dicom
from geoprint.surfaces.files.mesh_file import UNITS, MeshFile
from geoprint.surfaces.files.volume_formats import LabelVolume, read_nifti, read_nrrd
from geoprint.surfaces.operators import signed_volume
from geoprint.surfaces.remesh import TERRACE_SHARE, TERRACE_WAVELENGTH
from geoprint.surfaces.topology import turned_over

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


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Field:
    """Signed distance from a label's border on a grid finer than the volume's where its slices are thick.

    Attributes:
        values: (i, j, k) [file's unit], positive inside.
        finer: (3,) points of the grid for each voxel.
        first: (3,) voxel index of the grid's first point.
    """

    values: Distances
    finer: IntArray
    first: IntArray


def read_nifti_label(data: bytes, /, *, name: str, label: int | None, thin: bool) -> MeshFile:
    """Return the surface of one label of a NIfTI file, as `volume_mesh`; raises also as `read_nifti`."""
    return volume_mesh(read_nifti(data, name=name), label=label, name=name, thin=thin)


def read_nrrd_label(data: bytes, /, *, name: str, label: int | None, thin: bool) -> MeshFile:
    """Return the surface of one label of a NRRD file, as `volume_mesh`; raises also as `read_nrrd`."""
    return volume_mesh(read_nrrd(data, name=name), label=label, name=name, thin=thin)


def read_dicom_label(data: bytes, /, *, name: str, label: int | None, thin: bool) -> MeshFile:
    """Return the surface of one segment of a DICOM file, as `volume_mesh`; raises also as `read_dicom`."""
    return volume_mesh(read_dicom(data, label=label, name=name), label=label, name=name, thin=thin)


def read_volume(data: bytes, /, *, name: str) -> LabelVolume:
    """Return the labels of a file and where they lie; its unit is mm where it says none.

    Raises:
        UsageError: its suffix is that of no volume; as the readers.
        InputError: as `read_nifti`, `read_nrrd` and `read_dicom`.
    """
    lower = name.lower()
    if lower.endswith((".nii", ".nii.gz")):
        volume = read_nifti(data, name=name)
    elif lower.endswith(".nrrd"):
        volume = read_nrrd(data, name=name)
    elif lower.endswith(".dcm"):
        volume = read_dicom(data, label=None, name=name)
    else:
        raise UsageError(f"`{name}` is no label volume: its name must end in .nii, .nii.gz, .nrrd or .dcm.")
    affine = volume.affine.copy()
    affine[:3] *= UNITS[volume.unit or "mm"]
    return replace(volume, affine=affine, unit="mm")


def volume_mesh(volume: LabelVolume, *, label: int | None, name: str, thin: bool = False) -> MeshFile:
    """Return the surface of one label of a volume.

    Args:
        volume: as read.
        label: which one; None where there is but one.
        name: of the file.
        thin: whether a label as thin as its voxels is taken with their terraces.

    Raises:
        UsageError: there is no such label, or no choice among several; a package is missing.
        InputError: as `label_surface`.
    """
    chosen = _chosen_label(volume, label, name=name)
    side = UNITS[volume.unit or "mm"] * float(np.linalg.norm(volume.affine[:3, :3], axis=0).max())
    advice = (
        f"take it with the terraces of its voxels, and these off it, by `geoprint remesh {name} --label {chosen} "
        f"--thin --smooth {TERRACE_WAVELENGTH * side:.3g} --max-deviation {TERRACE_SHARE * side:.2g} --out part.ply`, "
        "and plan that; or use a finer volume"
    )
    vertices, faces, smoothing, volume_error = label_surface(
        volume.labels == chosen, volume.affine, name=name, advice=advice, thin=thin
    )
    notes = (
        ("label", chosen),
        ("smoothing_voxels", smoothing),
        ("volume_error", round(volume_error, 6)),
        ("coordinates", "right, anterior, superior"),
    )
    return MeshFile(vertices, faces, volume.unit or "", notes)


def label_surface(
    inside: BoolArray, affine: FloatArray, *, name: str, advice: str, thin: bool
) -> tuple[FloatArray, IntArray, float, float]:
    """Return a smooth closed surface around some voxels.

    Args:
        inside: (i, j, k) which voxels, at least one.
        affine: (4, 4) position of the voxels' centres; a left-handed or oblique one is as good as any.
        name: of the file.
        advice: what helps where the label is too thin, but not too thin for its terraces.
        thin: whether these are taken.

    Returns:
        (n, 3) vertices and (m, 3) faces, counter-clockwise from outside; the smoothing that was used [finest side of a
        voxel]; and by which share the enclosed volume differs from that of the voxels.

    Raises:
        InputError: the label is too thin for its voxels, or takes too many of them.
    """
    sides: FloatArray = np.linalg.norm(affine[:3, :3], axis=0)
    block, first = _block(inside)
    wanted = float(block.sum() * abs(np.linalg.det(affine[:3, :3])))
    rough = _distances(block, first, sides=sides, name=name)
    smooth, smoothing, loss = _smoothed(rough, affine, THIN_SMOOTHINGS if thin else SMOOTHINGS, wanted=wanted)
    if abs(loss) > UNBELIEVABLE_LOSS:
        least = _smoothed(rough, affine, THIN_SMOOTHINGS[-1:], wanted=wanted)[2]
        raise InputError(
            f"`{name}`: the label is about as thin as its voxels of {' x '.join(f'{side:.3g}' for side in sides)}: "
            f"even the least smoothing changes its volume by {-loss:+.0%}, at most {UNBELIEVABLE_LOSS:.0%} is allowed; "
            f"{advice if abs(least) <= UNBELIEVABLE_LOSS else 'use a volume with thinner slices'}.",
            loss=loss,
        )
    surface, volume = _with_volume(smooth, affine, wanted=wanted, name=name)
    return surface.vertices, surface.faces, smoothing, volume / wanted - 1.0


def _chosen_label(volume: LabelVolume, label: int | None, *, name: str) -> int:
    """Return the label that is meant, if it is there."""
    values, counts = np.unique(volume.labels, return_counts=True)
    finite = np.isfinite(values) & (values != 0)
    found = dict(zip(values[finite].tolist(), counts[finite].tolist(), strict=True))
    names = {value: f"{volume.names[value]}, " if volume.names.get(value) else "" for value in found}
    shown = ", ".join(f"{value:g} ({names[value]}{count} voxels)" for value, count in [*found.items()][:20])
    if not found:
        raise InputError(f"`{name}` holds no label: all of its voxels are 0.")
    if label is None and len(found) == 1:
        label = round(next(iter(found)))
    if label is None:
        raise UsageError(f"`{name}` holds the labels {shown}; choose one with `--label N`.")
    if label not in found:
        raise UsageError(f"`{name}` has no label {label}; it holds {shown}: choose one with `--label N`.")
    return label


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
    return _Field(values, finer, first)


def _smoothed(
    rough: _Field, affine: FloatArray, smoothings: Sequence[float], *, wanted: float
) -> tuple[_Field, float, float]:
    """Return the field smoothed as far as the part bears it, the smoothing, and the share of volume it takes away."""
    sides: FloatArray = np.linalg.norm(affine[:3, :3], axis=0)
    smooth, smoothing, loss = rough, 0.0, 0.0
    for smoothing in smoothings:
        widths = smoothing * np.maximum(sides.min() / sides, SLICE_SHARE) * rough.finer
        values = np.asarray(ndimage.gaussian_filter(rough.values, widths), dtype=np.float32)
        smooth = _Field(values, rough.finer, rough.first)
        loss = 1.0 if values.max() <= 0.0 else 1.0 - _enclosed(smooth, affine, level=0.0)[1] / wanted
        if abs(loss) <= LARGEST_LOSS:
            break
    return smooth, smoothing, loss


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
        f"{VOLUME_TOLERANCE:.1%}; the label is too thin or ragged, so clean it or use a finer volume."
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
