"""A surface through the points of a scan: normals, Poisson reconstruction [Kazhdan2013], cut back."""

from __future__ import annotations

import importlib.util
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import KDTree

from geoprint.delimited import Delimited, column_named, encoding_of, is_comment
from geoprint.errors import InputError, how_many, percent
from geoprint.geometry.clipping import clipped, part_of
from geoprint.geometry.files import cloud_worker
from geoprint.geometry.files.mesh_file import Check, MeshFile
from geoprint.geometry.files.ply import positions, read_elements, read_header
from geoprint.geometry.native import missing, run_worker
from geoprint.geometry.points import closest
from geoprint.geometry.remeshing import contracted
from geoprint.geometry.topology import boundary_half_edges, component_labels, half_edges
from geoprint.model import FloatArray, IntArray, Surface, reading

# Reading clouds of points from lines of text: with a header or without, and with any usual separator.


# Normals in a file have length 1 but for rounding in text.
NORMAL_LENGTH = (0.98, 1.02)
# Scanners' programs mark comments so, tables with #.
_COMMENT = "//"
_NORMALS = (("nx", "ny", "nz"), ("normalx", "normaly", "normalz"), ("normal_x", "normal_y", "normal_z"))
_WHAT = "a cloud of points"


@final
@dataclass(frozen=True, slots=True, eq=False)
class PointCloud:
    """Points of a scan.

    Attributes:
        points: (k, 3) positions in the file's unit.
        normals: (k, 3) unit normals, outward; or None where the file has none.
        skipped: what else the file holds, by kind.
        assumed: what the file leaves open, and what it was taken for.
        unit: of the positions where the file says it, else empty.
    """

    points: FloatArray
    normals: FloatArray | None
    skipped: Mapping[str, int] = field(default_factory=dict[str, int])
    assumed: tuple[str, ...] = ()
    unit: str = ""


def read_point_text(data: bytes, *, name: str) -> PointCloud:
    """Read lines of x y z, with a normal behind where these are six numbers and the last three have length 1.

    Numbers are parted as those of tables (`delimited`). A header names the columns; without one the first three are
    the position. Other columns (colours, intensities) are skipped, so are empty lines and comments (# or //). A line of
    one whole number says how many points follow.

    Raises:
        InputError: the lines do not have at least three numbers each, equally many; the header names no position; or
            fewer or more points follow than a line says.
    """
    lines = list(enumerate(data.decode(encoding_of(data), errors="replace").lstrip("\ufeff").splitlines(), start=1))
    # A comment of either kind may be the header.
    lines = [
        (number, f"#{line.lstrip()[2:]}" if line.lstrip().startswith(_COMMENT) else line) for number, line in lines
    ]
    rows, promised = _counts(lines)
    table = Delimited(name, iter(rows), what=_WHAT)
    points, of_normals, unit = _columns(table.header, table.width, name=name)
    kept = [line for number, line in rows if number >= table.header_line and not is_comment(line)]
    values = _values(
        kept if table.header is None or not _names_first(table, rows) else kept[1:], table, rows, name=name
    )
    _check_counts(promised, len(values), name=name)
    normals = unit_normals(values[:, of_normals]) if of_normals else None
    used = {*points, *(of_normals if normals is not None else ())}
    skipped: Counter[str] = Counter(table.unused(used))
    if table.header is None:
        skipped["unused columns"] = table.width - len(used)
    skipped["lines without a point"] = sum(is_comment(line) for _, line in rows)
    decimals = table.separator != "," and any("," in line for line in kept[1:2])
    assumed = ("decimal commas",) if decimals else ()
    return PointCloud(values[:, points], normals, skipped, assumed, unit)


def unit_normals(columns: FloatArray) -> FloatArray | None:
    """Return normals normalised, or None where the columns are something else."""
    lengths = np.linalg.norm(columns, axis=1, keepdims=True)
    shortest, longest = NORMAL_LENGTH
    if not ((lengths >= shortest) & (lengths <= longest)).all():
        return None
    return columns / lengths


def _counts(lines: list[tuple[int, str]]) -> tuple[list[tuple[int, str]], list[tuple[int, int]]]:
    """Return the lines without those that count points, and of these how many points stand before, and the number."""
    kept: list[tuple[int, str]] = []
    promised: list[tuple[int, int]] = []
    points = 0
    for number, line in lines:
        if line.strip().isdecimal():
            promised.append((points, int(line)))
        else:
            kept.append((number, line))
            points += not is_comment(line)
    return kept, promised


def _check_counts(promised: list[tuple[int, int]], rows: int, *, name: str) -> None:
    """Refuse a line that says how many points follow where others do."""
    ends = [*(place for place, _ in promised[1:]), rows]
    for (place, count), end in zip(promised, ends, strict=bool(promised)):
        if end - place != count:
            raise InputError(
                f"`{name}` announces {how_many(count, 'point')}, but holds {end - place}. It is cut off or damaged: "
                "copy or export it again.",
                promised=count,
                found=end - place,
            )


def _names_first(table: Delimited, rows: Sequence[tuple[int, str]]) -> bool:
    """Return whether the header is a line of its own, and not a comment."""
    return any(
        number == table.header_line and table.cells(number, line) == list(table.header or ()) for number, line in rows
    )


def _columns(header: Sequence[str] | None, width: int, *, name: str) -> tuple[tuple[int, ...], tuple[int, ...], str]:
    """Return which columns are the positions, which the normals if any, and the unit that the header says."""
    if header is None:
        if width < 3:
            raise InputError(f"`{name}` has {width} numbers a line; points need x y z, so export them so.")
        return (0, 1, 2), (3, 4, 5) if width == 6 else (), ""
    known = [column_named(each) for each in header]
    names = [each for each, _ in known]
    units = {unit for each, unit in known if each in {"x", "y", "z"}}
    if any(names.count(axis) != 1 for axis in "xyz") or len(units) != 1:
        raise InputError(
            f"`{name}` has the columns {', '.join(header)[:200]}; points need one each of x, y and z in one unit, so "
            "name or export them so."
        )
    normals = next((tuple(map(names.index, each)) for each in _NORMALS if set(each) <= set(names)), ())
    unit = units.pop()
    return tuple(map(names.index, "xyz")), normals, "in" if unit == "inch" else unit


def _values(texts: list[str], table: Delimited, rows: Sequence[tuple[int, str]], *, name: str) -> FloatArray:
    """Return the numbers of the lines, (k, width)."""
    if table.separator != ",":
        texts = [text.replace(",", ".") for text in texts]
    try:
        delimiter = None if table.separator == " " else table.separator
        values = np.loadtxt(texts, dtype=np.float64, ndmin=2, comments=None, delimiter=delimiter)
    except ValueError:
        values = np.empty((0, 0))
    if values.shape == (len(texts), table.width) and texts:
        return values
    # The reader of tables takes empty cells and names the line that it cannot take.
    found = list(_slowly(table, rows))
    if not found:
        raise InputError(f"`{name}` holds no lines of points; export them as x y z.")
    return np.array(found, dtype=np.float64)


def _slowly(table: Delimited, rows: Sequence[tuple[int, str]]) -> Iterator[list[float]]:
    """Yield the numbers of each line of a table."""
    again = Delimited(table.name, iter(rows), what=_WHAT)
    for number, cells, _ in again.rows(range(again.width)):
        yield [again.number(number, str(place + 1), cell, farthest=np.inf, unit="") for place, cell in enumerate(cells)]


# A surface through the points of a scan: normals, Poisson reconstruction [Kazhdan2013], cut back to the data.


# Fewer points are no scan, more take too long [points].
LEAST_POINTS, MOST_POINTS = 200, 3_000_000
# Neighbours from which normals are estimated where the file has none: enough to average noise, few enough to bend.
NEIGHBOURS = 24
# About a point of a surface they spread little across it. Of their squared distances the direction in which they spread
# least has 0.19 to 0.21 where points fill a volume, and 0.13 on a surface whose noise is as large as its spacing.
MOST_ACROSS = 0.15
# That is asked of so many points, for it costs as much as their normals.
ASKED_POINTS = 10_000
# Of these the nearest carry the side from point to point.
LINKS = 8
LEAST_WEIGHT = 1e-9
# The finest cells of the reconstruction in spacings of the points: each then averages about four of them.
CELL_SPACINGS = 2.0
DEPTHS = (4, 10)
# Margin of the reconstruction's cube around the points.
SCALE = 1.1
# The surface reaches this many spacings beyond the points first and is cut back as far, which closes gaps between
# points that are up to twice as wide: scattered points leave circles of 1.8 spacings empty.
REACH_SPACINGS = 2.0
# Where more than this share of the points lies farther from the surface than its cells are wide, they are no surface.
STRAY_SHARE = 0.05
NO_SURFACE = "they are too sparse or no surface, so scan closer or make the mesh in the scanner's program"
# What PLY calls the normal of a point.
_NORMAL = ("nx", "ny", "nz")
# About a point of a line scanner its nearest neighbours lie along the line: of their spread in the surface the narrow
# direction has less than this share of the wide one; about scattered points it has half or more.
NEAREST = 9
LEAST_NARROW = 0.25
# Such points are gathered in cells that grow by this factor until they spread so.
GATHERED_NARROW = 0.45
CELL_GROWTH = 1.2
MOST_GATHERINGS = 40
MOST_CELLS = 1 << 62


def read_cloud(data: bytes, /, *, name: str, check: Check | None = None) -> MeshFile:
    """Return a surface through the points that stand in lines of text.

    Raises:
        InputError: as `read_point_text` and `reconstruct`, and so the others.
        ResourceError: it takes too long or too much memory.
        UsageError: open3d is not installed; as `check`.
    """
    return reconstruct(read_point_text(data, name=name), name=name, check=check)


def read_point_ply(data: bytes, *, name: str) -> PointCloud:
    """Read the vertices of a PLY file without faces, with nx ny nz as normals where it has them.

    Raises:
        InputError: as `ply.read_elements`.
    """
    file = read_elements(read_header(data, name=name), name=name)
    points = positions(file, name=name)
    vertex = file.elements["vertex"]
    others = [key for key in vertex.numbers if key not in {"x", "y", "z", *_NORMAL}] + list(vertex.lists)
    skipped = {element.name: element.count for element in file.elements.values() if element.name != "vertex"}
    skipped[f"properties ({', '.join(others)})"] = len(others)
    normals = positions(file, name=name, axes=_NORMAL) if set(_NORMAL) <= set(vertex.numbers) else None
    return PointCloud(points, None if normals is None else unit_normals(normals), skipped)


def reconstruct(cloud: PointCloud, *, name: str, check: Check | None = None) -> MeshFile:
    """Return a surface through a cloud of points, which ends where the points end.

    Args:
        cloud: as read.
        name: of the file.
        check: is asked whether the points' size and unit can be right, before anything is made of them.

    Returns:
        The largest piece of the surface; its notes tell the points' spacing and the residual: how far they lie from
        it. Points of a line scanner are gathered until they lie as far apart along the lines as across. Without
        normals in the file the outside is the side that faces away from the points' middle.

    Raises:
        InputError: too few or many points, a coordinate that is not finite, or points that are on no surface.
        ResourceError: it takes too long or too much memory.
        UsageError: open3d is not installed.
    """
    if check is not None and np.isfinite(cloud.points).all() and np.ptp(cloud.points, axis=0).any():
        check(cloud.points, cloud.unit, "")
    every, normals = _checked(cloud, name=name)
    if importlib.util.find_spec("open3d") is None:
        raise missing("open3d", extra="scan", work="reading point clouds")
    points, normals, tree = _gathered(every, normals, name=name)
    spacing = _spacing(points, tree)
    _check_flat(points, tree, count=len(every), name=name)
    known = estimated_normals(points, tree) if normals is None else normals
    rough = _poisson(points, known, spacing=spacing, name=name)
    surface = _cut_back(rough, tree, reach=REACH_SPACINGS * spacing)
    residuals = _residuals(surface, every, allowed=CELL_SPACINGS * spacing, name=name)
    notes = (
        ("reconstructed_from_points", len(every)),
        ("normals", "estimated" if normals is None else "from the file"),
        ("point_spacing", round(spacing, 6)),
        ("residual_mean", round(float(residuals.mean()), 6)),
        ("residual_p95", round(float(np.quantile(residuals, 0.95)), 6)),
        ("residual_max", round(float(residuals.max()), 6)),
    )
    skipped = {**cloud.skipped, "points at the place of another": len(cloud.points) - len(every)}
    assumed = [*cloud.assumed]
    if len(points) < len(every):
        assumed.append(f"lines of a scanner, gathered to {how_many(len(points), 'point')}")
    if normals is None:
        assumed.append("outward is away from the middle of the points")
    read = reading(used={"points": len(every)}, skipped=skipped, assumed=assumed)
    return MeshFile(surface.vertices, surface.faces, cloud.unit, notes=notes, reading=read)


def estimated_normals(points: FloatArray, tree: KDTree) -> FloatArray:
    """Return unit normals of the planes through the neighbours of each point, all on one side of the surface.

    The side is carried from point to point along a tree of neighbours whose planes agree best [Hoppe1992]; each piece
    of the cloud then faces away from its middle.

    Args:
        points: (k, 3).
        tree: of these points.

    Returns:
        (k, 3) unit normals.
    """
    near = np.asarray(tree.query(points, k=NEIGHBOURS)[1])
    normals = np.linalg.eigh(_spreads(points[near]))[1][:, :, 0]
    # Before SciPy 1.17 spanning trees take no longer indices than these.
    first = np.repeat(np.arange(len(points), dtype=np.int32), LINKS)
    second = near[:, 1 : LINKS + 1].ravel().astype(np.int32)
    # Weights of a sparse graph must not be 0.
    weights = 1.0 + LEAST_WEIGHT - np.abs(np.einsum("kx,kx->k", normals[first], normals[second]))
    links = coo_array((weights, (first, second)), shape=(len(points), len(points))).tocsr()
    links = minimum_spanning_tree(links.minimum(links.T) + abs(links - links.T))
    _, pieces = connected_components(links, directed=False)
    for piece in range(int(pieces.max()) + 1):
        members = np.flatnonzero(pieces == piece)
        order, before = breadth_first_order(links, members[0], directed=False)
        for point in order[1:].tolist():
            if normals[point] @ normals[before[point]] < 0.0:
                normals[point] *= -1.0
        away = points[members] - points[members].mean(axis=0)
        if np.einsum("kx,kx->", normals[members], away) < 0.0:
            normals[members] *= -1.0
    return normals


def _checked(cloud: PointCloud, *, name: str) -> tuple[FloatArray, FloatArray | None]:
    """Return the points, each place once, with their normals."""
    if not np.isfinite(cloud.points).all():
        raise InputError(f"`{name}` has points with NaN or infinite coordinates; clean it in the scanner's program.")
    points, first = np.unique(cloud.points, axis=0, return_index=True)
    if not LEAST_POINTS <= len(points) <= MOST_POINTS:
        raise InputError(
            f"`{name}` has {how_many(len(points), 'distinct point')}; a surface needs {LEAST_POINTS} to "
            f"{MOST_POINTS}: scan more, or thin them out.",
            points=len(points),
        )
    return points, None if cloud.normals is None else cloud.normals[first]


def _narrow(points: FloatArray, tree: KDTree) -> float:
    """Return how much less neighbours spread in one direction of the surface than in the other, in the median."""
    some = points[:: -(-len(points) // ASKED_POINTS)]
    spreads = np.linalg.eigvalsh(_spreads(points[np.asarray(tree.query(some, k=NEAREST)[1])]))
    return float(np.median(np.sqrt(np.maximum(spreads[:, 1], 0.0) / np.maximum(spreads[:, 2], np.finfo(float).tiny))))


def _gathered(
    points: FloatArray, normals: FloatArray | None, *, name: str
) -> tuple[FloatArray, FloatArray | None, KDTree]:
    """Return points and normals, of a line scanner their means in cells so large that neighbours lie all around."""
    tree = KDTree(points)
    if _narrow(points, tree) >= LEAST_NARROW:
        return points, normals, tree
    cell = float(np.median(np.asarray(tree.query(points, k=2)[0])[:, 1]))
    low = points.min(axis=0)
    for _ in range(MOST_GATHERINGS):
        cell *= CELL_GROWTH
        places: IntArray = np.floor((points - low) / cell).astype(np.int64)
        sides: list[int] = (places.max(axis=0) + 1).tolist()
        if math.prod(sides) > MOST_CELLS:
            continue
        # One number for the three of a cell.
        keys = np.ravel_multi_index(tuple(places.T), sides)
        which, counts = np.unique(keys, return_inverse=True, return_counts=True)[1:]
        if counts.size < LEAST_POINTS:
            break
        means = np.column_stack([np.bincount(which, points[:, axis]) for axis in range(3)]) / counts[:, None]
        tree = KDTree(means)
        if _narrow(means, tree) < GATHERED_NARROW:
            continue
        if normals is None:
            return means, None, tree
        sums = np.column_stack([np.bincount(which, normals[:, axis]) for axis in range(3)])
        lengths = np.linalg.norm(sums, axis=1, keepdims=True)
        return means, sums / lengths if lengths.min() > 0.0 else None, tree
    raise InputError(
        f"`{name}`: its {how_many(len(points), 'point')} lie on lines too far apart to make a surface. Scan closer "
        "lines, or make the mesh in the scanner's program."
    )


def _spacing(points: FloatArray, tree: KDTree) -> float:
    """Return the side of the square that each point has to itself: a disc about it holds as many as its area."""
    others = 8
    distances = np.asarray(tree.query(points, k=[others + 1])[0])
    return float(np.median(distances)) * float(np.sqrt(np.pi / others))


def _check_flat(points: FloatArray, tree: KDTree, *, count: int, name: str) -> None:
    """Refuse points whose neighbours spread across the plane through them as much as within it, in the median.

    Raises:
        InputError: as said, of so many points of the file.
    """
    some = points[:: -(-len(points) // ASKED_POINTS)]
    spreads = np.linalg.eigvalsh(_spreads(points[np.asarray(tree.query(some, k=NEIGHBOURS)[1])]))
    across = float(np.median(spreads[:, 0] / spreads.sum(axis=1)))
    if across > MOST_ACROSS:
        raise InputError(
            f"`{name}`: its {how_many(count, 'point')} fill space instead of a surface. {across:.2f} of their squared "
            f"distances lie across the plane through neighbours, at most {MOST_ACROSS:.2f} may; {NO_SURFACE}.",
            across=across,
        )


def _residuals(surface: Surface, points: FloatArray, *, allowed: float, name: str) -> FloatArray:
    """Return how far points lie from the surface through them.

    Raises:
        InputError: too many are farther than allowed.
    """
    _, residuals = closest(surface, points)
    stray = float((residuals > allowed).mean())
    if stray > STRAY_SHARE:
        raise InputError(
            f"`{name}`: {percent(stray)} of its {how_many(len(points), 'point')} lie more than {allowed:.3g} off the "
            f"surface through them, at most {percent(STRAY_SHARE)} may; {NO_SURFACE}.",
            stray=stray,
        )
    return residuals


def _spreads(around: FloatArray) -> FloatArray:
    """Return (k, 3, 3) sums of the squares of (k, j, 3) places about their middles."""
    offsets = around - around.mean(axis=1, keepdims=True)
    return np.einsum("knx,kny->kxy", offsets, offsets)


def _poisson(points: FloatArray, normals: FloatArray, *, spacing: float, name: str) -> Surface:
    """Return the closed surface of the reconstruction, which runs on where there are no points."""
    centre, size = points.mean(axis=0), float(np.ptp(points, axis=0).max())
    depth = int(np.clip(np.ceil(np.log2(SCALE * size / (CELL_SPACINGS * spacing))), *DEPTHS))
    # About 1 large and about the origin: whatever the unit, the library sees the same numbers.
    unit = (points - centre) / size
    table = BytesIO()
    np.save(table, np.column_stack([unit, normals]), allow_pickle=False)
    content = run_worker(
        Path(cloud_worker.__file__), [str(depth)], data=table.getvalue(), work="turned into a surface", name=name
    )
    with np.load(BytesIO(content), allow_pickle=False) as mesh:
        return Surface(vertices=mesh["vertices"] * size + centre, faces=mesh["faces"].astype(np.int64), name=name)


def _cut_back(rough: Surface, tree: KDTree, *, reach: float) -> Surface:
    """Return the largest piece of a surface near the points: grown beyond them by the reach and shrunk by it again."""
    away = np.asarray(tree.query(rough.vertices)[0])
    grown = contracted(_largest(clipped(rough, (away - reach)[:, None])))
    rim = boundary_half_edges(grown.faces)
    if rim.size == 0:
        return grown
    ends = grown.vertices[half_edges(grown.faces)[rim]]
    inward = np.asarray(KDTree(np.concatenate([ends[:, 0], ends.mean(axis=1)])).query(grown.vertices)[0])
    return contracted(_largest(clipped(grown, (reach - inward)[:, None])))


def _largest(surface: Surface) -> Surface:
    labels = component_labels(surface)
    return part_of(surface, labels == np.argmax(np.bincount(labels)))
