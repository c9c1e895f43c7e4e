"""Which label each voxel of a volume has, where its numbers are labels, shares of them or probabilities.

A number within a thousandth of a whole one is that label. Linear resampling of a label map leaves numbers between two
labels, or between one and the background, where the border runs: 0.5 between 0 and 1, but 1.0 between 0 and 2, which
is no label 1. So such a voxel becomes one of the labels that really lie around it, by its share of them. Numbers from
0 to 1 alone are probabilities of one label. Other numbers are an image: nobody can say which of them are the part.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple, cast, final

import numpy as np
from scipy import ndimage

from geoprint.errors import InputError, UsageError, how_many
from geoprint.geometry.files.mesh_file import Choice, Contact, LabelFound
from geoprint.model import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from numpy.typing import NDArray


# A number is a label where it is that near to a whole one.
SAME_LABEL = 1e-3
# The share or probability from which on a voxel belongs to a label.
THRESHOLD = 0.5
# Numbers of a label map are whole for at least this share of its voxels that are not outside; those between are where
# borders run. Of probabilities less may be.
LEAST_WHOLE = 0.3
# Of probabilities from one half on so many are 0.9 or more: a structure is mostly certain. Numbers that are spread
# evenly have a fifth, and intensities scaled to 1 reach it in their brightest voxels only.
CERTAIN, LEAST_CERTAIN = 0.9, 0.22
# Voxels around one between labels in which these are looked for, each way: resampling to half the spacing blurs so far.
REACH = 2
LEAST_SHARP = 0.9
# Splines overshoot by a tenth and more.
OVERSHOOT = 0.25
# Up to so many labels are a label map whatever lies beside what; with more, neighbours in every direction are the same
# label for at least this share, or it is an image.
FEW_LABELS = 20
LEAST_SAME = 0.5
# Labels are counted by a table of all numbers between the lowest and the highest, where these are no more.
MOST_NUMBERS = 1_000_000
# A label that touches another over more than this share of its surface may lie in it.
INSIDE_SHARE = 0.5


class Segment(NamedTuple):
    """A segment of a file that describes them: the layer in which it lies, its value there, and what it is called."""

    layer: int
    value: int
    name: str


@final
@dataclass(frozen=True, slots=True, eq=False)
class GridFile:
    """Numbers on a grid, and where the grid lies.

    Attributes:
        layers: one or several times (i, j, k) numbers as stored; 0 is outside of all labels.
        affine: (4, 4) turns (i, j, k, 1) of a voxel's centre into its position in the file's unit.
        unit: of the positions, or None where the file does not say it.
        usual: the unit that such a file has where it says none, or empty.
        segments: by the numbers to choose them by; empty where the file describes none.
        coordinates: what the three are, in words.
        skipped: what of the header was not used, by kind.
        assumed: what the file leaves open, and what it was taken for.
    """

    layers: tuple[NDArray[np.generic], ...]
    affine: FloatArray
    unit: str | None
    usual: str = ""
    segments: Mapping[int, Segment] = field(default_factory=dict[int, Segment])
    coordinates: str = "right, anterior, superior"
    skipped: Mapping[str, int] = field(default_factory=dict[str, int])
    assumed: tuple[str, ...] = ()


@final
@dataclass(frozen=True, slots=True, eq=False)
class LabelVolume:
    """Labels on a grid, and where the grid lies.

    Attributes:
        labels: (i, j, k) whole numbers, 0 outside of all; where segments overlap, the one that was chosen or the last.
        affine: (4, 4) turns (i, j, k, 1) of a voxel's centre into its position in the file's unit.
        unit: of the positions, or None where the file does not say it.
        names: of labels, where the file has them; nothing in them steers a terminal.
        numbers: of all labels, ascending.
        layers: where segments overlap, the layers in which they lie, else empty.
        segments: of these layers.
        shares: (i, j, k) share of the higher of two labels in each voxel between labels, NaN elsewhere; None where all
            numbers are whole or the threshold is another than THRESHOLD.
        lower: (i, j, k) the lower of these two labels, and
        higher: the other; None where there are no shares.
        usual: the unit that such a file has where it says none, or empty.
        coordinates: what the three are, in words.
        skipped: what of the file was not used, by kind.
        assumed: what it leaves open, and what it was taken for.
    """

    labels: NDArray[np.generic]
    affine: FloatArray
    unit: str | None
    names: Mapping[int, str] = field(default_factory=dict[int, str])
    numbers: tuple[int, ...] = ()
    layers: tuple[NDArray[np.generic], ...] = ()
    segments: Mapping[int, Segment] = field(default_factory=dict[int, Segment])
    shares: NDArray[np.float32] | None = None
    lower: NDArray[np.generic] | None = None
    higher: NDArray[np.generic] | None = None
    usual: str = ""
    coordinates: str = "right, anterior, superior"
    skipped: Mapping[str, int] = field(default_factory=dict[str, int])
    assumed: tuple[str, ...] = ()

    def inside(self, label: int) -> BoolArray:
        """Return (i, j, k) which voxels are of a label."""
        if self.layers and label in self.segments:
            segment = self.segments[label]
            return np.asarray(self.layers[segment.layer] == segment.value)
        return np.asarray(self.labels == label)

    def at(self, places: FloatArray) -> IntArray:
        """Return the (k,) labels of the voxels that hold (k, 3) places [file's unit]; 0 beyond the volume."""
        inverse = np.linalg.inv(self.affine)
        index: IntArray = np.rint(places @ inverse[:3, :3].T + inverse[:3, 3]).astype(np.int64)
        within = ((index >= 0) & (index < np.array(self.labels.shape))).all(axis=1)
        found = np.zeros(len(places), dtype=np.int64)
        found[within] = self.labels[tuple(index[within].T)]
        return found

    def voxels(self, label: int, inside: BoolArray) -> float:
        """Return how many voxels a label fills, with its shares of those between labels; `inside` are its own."""
        if self.shares is None or self.lower is None or self.higher is None:
            return float(inside.sum())
        between = np.isfinite(self.shares)
        whole = float((inside & ~between).sum())
        high, low = between & (self.higher == label), between & (self.lower == label)
        return whole + float(self.shares[high].sum()) + float((1.0 - self.shares[low]).sum())


class _Between(NamedTuple):
    """What the voxels between labels are: flat indices, the two labels of each, and the share of the higher.

    Borders are sharp where nearly all of these voxels have both labels near: then shares are volumes, which linear
    resampling keeps.
    """

    places: IntArray
    lower: IntArray
    higher: IntArray
    share: FloatArray
    sharp: bool


def labelled(grid: GridFile, choice: Choice, *, name: str) -> LabelVolume:
    """Return the labels of a volume.

    Args:
        grid: as read.
        choice: its label wins where segments overlap; its threshold is THRESHOLD where it is None.
        name: of the file.

    Raises:
        InputError: its numbers are an image, or infinite.
        UsageError: the threshold is not between 0 and 1, or given for a volume of whole numbers.
    """
    threshold = choice.threshold
    if threshold is not None and not 0.0 < threshold < 1.0:
        raise UsageError(f"`threshold = {threshold:g}` is not a share: give a number above 0 and below 1.")
    if len(grid.layers) > 1:
        return _of_layers(grid, label=choice.label, threshold=threshold, name=name)
    values, outside = _finite(next(iter(grid.layers)), name=name)
    names = {number: segment.name for number, segment in grid.segments.items() if segment.name}
    if values.dtype.kind == "f":
        near = np.rint(values)
        whole = np.abs(values - near) <= SAME_LABEL
    else:
        near, whole = values, np.ones((), dtype=np.bool_)
    labels, between, assumed = _resolved(values, near, whole, threshold=threshold, name=name)
    numbers = _numbers(labels, name=name)
    shares = lower = higher = None
    if between is not None and between.sharp and threshold in {None, THRESHOLD}:
        shares = np.full(labels.shape, np.nan, dtype=np.float32)
        lower, higher = np.zeros_like(labels), np.zeros_like(labels)
        np.put(shares, between.places, between.share)
        np.put(lower, between.places, between.lower)
        np.put(higher, between.places, between.higher)
    return LabelVolume(
        labels,
        grid.affine,
        grid.unit,
        names,
        numbers,
        shares=shares,
        lower=lower,
        higher=higher,
        usual=grid.usual,
        coordinates=grid.coordinates,
        skipped={**grid.skipped, "voxels without a number (NaN), taken as outside": outside},
        assumed=(*grid.assumed, *assumed),
    )


def found_labels(volume: LabelVolume) -> list[LabelFound]:
    """Return all labels of a volume in mm with their size and place."""
    side = abs(float(np.linalg.det(volume.affine[:3, :3])))
    tabled = not volume.layers and max(volume.numbers, default=0) <= MOST_NUMBERS
    boxes = dict(enumerate(ndimage.find_objects(volume.labels.astype(np.int64)), start=1)) if tabled else {}
    found: list[LabelFound] = []
    for label in volume.numbers:
        box = boxes.get(label)
        inside = volume.inside(label) if box is None else np.asarray(volume.labels[box] == label)
        low, high = box_of(inside, volume.affine, first=None if box is None else [span.start for span in box])
        count = int(inside.sum())
        name = volume.names.get(label, "")
        place = tuple(low.tolist()), tuple(high.tolist())
        filled = count if volume.shares is None else volume.voxels(label, volume.inside(label))
        touches = _touches(volume, label, inside, box)
        found.append(LabelFound(label, name, count, filled * side, *place, touches, inside=None))
    return [replace(one, inside=_around(one, found)) for one in found]


def _around(one: LabelFound, labels: list[LabelFound]) -> int | None:
    """Return the label in which another lies, or None."""
    other = next((each for each in labels if one.touches[:1] and each.label == one.touches[0].label), None)
    if other is None or one.touches[0].share <= INSIDE_SHARE:
        return None
    within = all(low <= its for low, its in zip(other.low, one.low, strict=True)) and all(
        high >= its for high, its in zip(other.high, one.high, strict=True)
    )
    return other.label if within else None


def _touches(volume: LabelVolume, label: int, inside: BoolArray, box: tuple[slice, ...] | None) -> tuple[Contact, ...]:
    """Return which other labels a label's voxels have as neighbours, and their shares of its surface.

    Args:
        volume: that holds it.
        label: its number.
        inside: voxels of the box, or of all of the volume, that are of it.
        box: of the label.
    """
    first = np.array([0, 0, 0] if box is None else [span.start for span in box], dtype=np.int64)
    held = np.pad(inside, 1)
    areas: dict[int, float] = {}
    whole = 0.0
    for axis in range(3):
        others = [other for other in range(3) if other != axis]
        area = float(np.linalg.norm(np.cross(volume.affine[:3, others[0]], volume.affine[:3, others[1]])))
        for step in (1, -1):
            index = np.argwhere(held & ~np.roll(held, -step, axis=axis)) + (first - 1)
            index[:, axis] += step
            whole += area * len(index)
            index = index[((index >= 0) & (index < np.array(volume.labels.shape))).all(axis=1)]
            for number, count in _neighbours(volume, index):
                areas[number] = areas.get(number, 0.0) + area * count
    shares = [Contact(number, area / whole) for number, area in areas.items() if number not in {0, label}]
    return tuple(sorted(shares, key=lambda one: (-one.share, one.label)))


def _neighbours(volume: LabelVolume, index: IntArray) -> list[tuple[int, int]]:
    """Return labels and how many of some voxels are of each; of segments that overlap every one counts."""
    if not volume.layers:
        numbers, counts = np.unique(volume.labels[tuple(index.T)], return_counts=True)
        return list(zip(numbers.astype(np.int64).tolist(), counts.tolist(), strict=True))
    values = [layer[tuple(index.T)] for layer in volume.layers]
    return [(number, int((values[one.layer] == one.value).sum())) for number, one in volume.segments.items()]


def box_of(inside: BoolArray, affine: FloatArray, *, first: list[int] | None = None) -> tuple[FloatArray, FloatArray]:
    """Return (3,) lowest and (3,) highest coordinates of voxels, at least one, whose first has an index."""
    # Along a column of voxels the first and the last lie farthest out.
    columns = np.argwhere(inside.any(axis=2))
    lines = inside[columns[:, 0], columns[:, 1]]
    ends = (lines.argmax(axis=1), inside.shape[2] - 1 - lines[:, ::-1].argmax(axis=1))
    index = np.concatenate([np.column_stack([columns, end]) for end in ends]).astype(np.float64)
    places = (index + np.array(first or [0, 0, 0])) @ affine[:3, :3].T + affine[:3, 3]
    half = 0.5 * np.abs(affine[:3, :3]).sum(axis=1)
    return places.min(axis=0) - half, places.max(axis=0) + half


def _of_layers(grid: GridFile, *, label: int | None, threshold: float | None, name: str) -> LabelVolume:
    """Return the labels of segments that may overlap: the last, or the one that is meant, wins."""
    kinds = {layer.dtype.kind for layer in grid.layers}
    if not kinds <= set("iu") or threshold is not None:
        raise InputError(
            f"`{name}` has {how_many(len(grid.layers), 'layer')} of thresholds or shares; layered segments need whole "
            "numbers: export them so, and omit `threshold`."
        )
    labels = np.zeros(grid.layers[0].shape, dtype=np.int64)
    for number in sorted(grid.segments, key=lambda one: (one == label, one)):
        segment = grid.segments[number]
        labels[grid.layers[segment.layer] == segment.value] = number
    unknown = sum(
        int((~np.isin(layer, [0, *(one.value for one in grid.segments.values() if one.layer == place)])).sum())
        for place, layer in enumerate(grid.layers)
    )
    held = [number for number, one in grid.segments.items() if (grid.layers[one.layer] == one.value).any()]
    empty = len(grid.segments) - len(held)
    return LabelVolume(
        labels,
        grid.affine,
        grid.unit,
        {number: segment.name for number, segment in grid.segments.items() if segment.name},
        tuple(sorted(held)),
        layers=grid.layers,
        segments=grid.segments,
        usual=grid.usual,
        coordinates=grid.coordinates,
        skipped={**grid.skipped, "voxels of no segment": unknown, "segments without voxels": empty},
        assumed=(*grid.assumed, f"segments of {len(grid.layers)} layers, numbered as their header says"),
    )


def _finite(values: NDArray[np.generic], *, name: str) -> tuple[NDArray[np.generic], int]:
    """Return numbers in which NaN is 0, and how often it was."""
    if values.dtype.kind != "f":
        return values, 0
    found = values.astype(np.float32 if values.dtype.itemsize <= 4 else np.float64)
    none = np.isnan(found)
    if np.isinf(found).any():
        raise InputError(f"`{name}` has {int(np.isinf(found).sum())} infinite voxels; export the labels again.")
    found[none] = 0.0
    return found, int(none.sum())


def _numbers(labels: NDArray[np.generic], *, name: str) -> tuple[int, ...]:
    """Return the labels of a grid, if they are no image."""
    values, counts = _counted(labels)
    numbers = tuple(value for value in values.tolist() if value != 0)
    if len(numbers) > FEW_LABELS:
        # An image has another number in nearly every voxel along one direction at least.
        usual = values[np.argmax(counts)]
        shares: list[float] = []
        for axis in range(3):
            turned = np.moveaxis(labels, axis, 0)
            one, other = turned[:-1], turned[1:]
            both = (one != 0) & (other != 0) & (one != usual) & (other != usual)
            shares.append(float((one == other)[both].mean()) if both.any() else 1.0)
        if min(shares) < LEAST_SAME:
            raise _image(labels, count=len(numbers), name=name)
    return numbers


def _counted(labels: NDArray[np.generic]) -> tuple[IntArray, IntArray]:
    """Return the whole numbers of a grid, ascending, and how often each is there."""
    low, high = int(labels.min()), int(labels.max())
    if high - low > MOST_NUMBERS:
        values, counts = np.unique(labels, return_counts=True)
        return values.astype(np.int64), counts
    counts = np.bincount((labels.astype(np.int64) - low).ravel(order="K"))
    values = np.flatnonzero(counts)
    return values + low, counts[values]


def _different(values: NDArray[np.generic]) -> int:
    return int(np.unique(values).size)


def _image(values: NDArray[np.generic], *, count: int, name: str) -> InputError:
    return InputError(
        f"`{name}` is an image of intensities from {float(values.min()):g} to {float(values.max()):g} "
        f"({how_many(count, 'different value')}), not a volume of labels. Segment it, and export the segmentation."
    )


def _resolved(
    values: NDArray[np.generic], near: NDArray[np.generic], whole: BoolArray, *, threshold: float | None, name: str
) -> tuple[NDArray[np.generic], _Between | None, tuple[str, ...]]:
    """Return the label of each voxel, those between labels if there are any, and what is assumed."""
    if whole.all():
        if threshold is not None:
            raise UsageError(f"`{name}` holds whole numbers, no shares or probabilities; leave `threshold` out.")
        if values.dtype.kind == "f" and float(np.abs(near).max(initial=0.0)) > np.iinfo(np.int32).max:
            raise _image(values, count=_different(values), name=name)
        return (near.astype(np.int32) if values.dtype.kind == "f" else values), None, ()
    limit = THRESHOLD if threshold is None else threshold
    least, most = float(values.min()), float(values.max())
    body = np.abs(values) > SAME_LABEL
    if most <= MOST_NUMBERS and least >= -OVERSHOOT and whole[body].mean() >= LEAST_WHOLE:
        between = _between(values, near, whole)
        # Wide borders of one label are probabilities.
        if between is not None and (between.sharp or most > 1.0 + OVERSHOOT):
            labels = np.where(whole, near, 0.0).astype(np.int32)
            np.put(labels, between.places, np.where(between.share >= limit, between.higher, between.lower))
            said = f"resampled labels: a voxel between two has the one of which it holds {limit:g} or more"
            return labels, between, (said,)
    if least >= -SAME_LABEL and most <= 1.0 + SAME_LABEL:
        numbers = values.astype(np.float64, copy=False)
        certain, likely = np.count_nonzero(numbers >= CERTAIN), np.count_nonzero(numbers >= THRESHOLD)
        if threshold is None and certain <= LEAST_CERTAIN * likely:
            raise InputError(
                f"`{name}` has numbers from {least:g} to {most:g} . If they are probabilities of a label, give the "
                f"limit with `threshold = {THRESHOLD:g}`; if they are intensities, segment the image first."
            )
        said = f"probabilities of one label, 1, from {limit:g} on"
        return (numbers >= limit).astype(np.int32), None, (said,)
    raise _image(values, count=_different(values), name=name)


def _between(values: NDArray[np.generic], near: NDArray[np.generic], whole: BoolArray) -> _Between | None:
    """Return between which labels the voxels lie that are none, or None where labels do not explain them."""
    # A label lies where a block of voxels has it; single ones on the way from 0 to 2 are no label 1.
    marked = np.where(whole, near, -1.0).astype(np.int64) + 1
    block = (slice(0, -1), slice(1, None))
    same = np.ones(tuple(extent - 1 for extent in marked.shape), dtype=np.bool_)
    first = marked[:-1, :-1, :-1]
    for i in block:
        for j in block:
            for k in block:
                same &= marked[i, j, k] == first
    same &= first > 0
    core = np.zeros(marked.shape, dtype=np.bool_)
    for i in block:
        for j in block:
            for k in block:
                core[i, j, k] |= same
    if not core.any():
        return None
    # Whole numbers outside of such blocks count as labels where the label has blocks elsewhere.
    known = np.unique(marked[core])
    places = np.flatnonzero(~(whole & np.isin(marked, known)))
    size = 2 * REACH + 1
    largest = MOST_NUMBERS + 1
    low = ndimage.minimum_filter(np.where(core, marked, largest), size).ravel()[places]
    high = ndimage.maximum_filter(np.where(core, marked, 0), size).ravel()[places]
    numbers = values.ravel()[places].astype(np.float64)
    explained = (high > 0) & (numbers >= low - 1 - OVERSHOOT) & (numbers <= high - 1 + OVERSHOOT)
    if explained.mean() < 1.0 - OVERSHOOT:
        return None
    sharp = bool(((high > 0) & (low < high)).mean() >= LEAST_SHARP)
    low, high = low - 1, high - 1
    # Without a label near, or with but one that it is far from, the nearest whole number is all there is.
    alone = (high < 0) | ((low == high) & (np.abs(numbers - high) > 0.5))
    low, high = (np.where(alone, np.rint(numbers), one).astype(np.int64) for one in (low, high))
    for label, rows in _near_voxels(marked, core, places, between=low < high):
        # Of the labels near a voxel the next below and above its number are the two.
        below, above = rows[numbers[rows] >= label], rows[numbers[rows] < label]
        low[below], high[above] = np.maximum(low[below], label), np.minimum(high[above], label)
    lower, higher = low, np.maximum(high, low)
    span = np.maximum(higher - lower, 1)
    return _Between(places, lower, higher, np.clip((numbers - lower) / span, 0.0, 1.0), sharp)


def _near_voxels(
    marked: IntArray, core: BoolArray, places: IntArray, *, between: BoolArray
) -> Iterator[tuple[int, IntArray]]:
    """Yield each label and the rows of places near it, where these lie between two labels."""
    row = np.full(marked.size, -1, dtype=np.int64)
    row[places[between]] = np.flatnonzero(between)
    row = row.reshape(marked.shape)
    labels = np.unique(marked[core])
    boxes = ndimage.find_objects(marked)
    for number in labels.tolist():
        spans = cast("tuple[slice[int, int, None], ...]", boxes[number - 1])
        box = tuple(slice(max(span.start - REACH, 0), span.stop + REACH) for span in spans)
        near = ndimage.maximum_filter((core[box] & (marked[box] == number)).astype(np.uint8), 2 * REACH + 1) > 0
        rows = row[box][near]
        yield number - 1, rows[rows >= 0]
