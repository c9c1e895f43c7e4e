"""A surface through the points of a scan: normals, Poisson reconstruction [Kazhdan2013], cut back to the data."""

from __future__ import annotations

import importlib.util
import math
from io import BytesIO
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import KDTree

from geoprint.errors import InputError
from geoprint.model import FloatArray, IntArray, Surface, reading
from geoprint.surfaces.clipping import clipped, part_of
from geoprint.surfaces.conversion import missing
from geoprint.surfaces.files import cloud_worker
from geoprint.surfaces.files.mesh_file import Check, MeshFile
from geoprint.surfaces.files.native import run_worker
from geoprint.surfaces.files.ply import positions, read_elements, read_header
from geoprint.surfaces.files.point_text import PointCloud, read_point_text, unit_normals
from geoprint.surfaces.points import closest
from geoprint.surfaces.remesh import contracted
from geoprint.surfaces.topology import boundary_half_edges, component_labels, half_edges

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
    points = every
    if importlib.util.find_spec("open3d") is None:
        raise missing("open3d", extra="scan", work="reading point clouds")
    tree = KDTree(points)
    if _narrow(points, tree) < LEAST_NARROW:
        points, normals = _gathered(points, normals, name=name)
        tree = KDTree(points)
    spacing = _spacing(points, tree)
    across = _spread_across(points, tree)
    if across > MOST_ACROSS:
        raise InputError(
            f"`{name}`: about its {len(every)} points others lie in all directions: {across:.2f} of their squared "
            f"distances lie across the plane through them, at most {MOST_ACROSS:.2f} may; {NO_SURFACE}.",
            across=across,
        )
    known = estimated_normals(points, tree) if normals is None else normals
    rough = _poisson(points, known, spacing=spacing, name=name)
    surface = _cut_back(rough, tree, reach=REACH_SPACINGS * spacing)
    _, residuals = closest(surface, every)
    stray = float((residuals > CELL_SPACINGS * spacing).mean())
    if stray > STRAY_SHARE:
        raise InputError(
            f"`{name}`: {stray:.0%} of its {len(every)} points lie farther than {CELL_SPACINGS * spacing:.3g} from "
            f"the surface through them, at most {STRAY_SHARE:.0%} may; {NO_SURFACE}.",
            stray=stray,
        )
    notes = (
        ("reconstructed_from_points", len(every)),
        ("normals", "estimated" if normals is None else "from the file"),
        ("point_spacing", round(spacing, 6)),
        ("residual_mean", round(float(residuals.mean()), 6)),
        ("residual_p95", round(float(np.quantile(residuals, 0.95)), 6)),
        ("residual_max", round(float(residuals.max()), 6)),
    )
    used = {"points": len(every)}
    skipped = {**cloud.skipped, "points at the place of another": len(cloud.points) - len(every)}
    assumed = [*cloud.assumed]
    if len(points) < len(every):
        assumed.append(f"lines of a scanner, gathered to {len(points)} points")
    if normals is None:
        assumed.append("outward is away from the middle of the points")
    return MeshFile(
        surface.vertices,
        surface.faces,
        cloud.unit,
        notes=notes,
        reading=reading(used=used, skipped=skipped, assumed=assumed),
    )


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
            f"`{name}` has {len(points)} points at different places; a surface is laid through {LEAST_POINTS} to "
            f"{MOST_POINTS}, so scan more or thin them out.",
            points=len(points),
        )
    return points, None if cloud.normals is None else cloud.normals[first]


def _narrow(points: FloatArray, tree: KDTree) -> float:
    """Return how much less neighbours spread in one direction of the surface than in the other, in the median."""
    some = points[:: -(-len(points) // ASKED_POINTS)]
    spreads = np.linalg.eigvalsh(_spreads(points[np.asarray(tree.query(some, k=NEAREST)[1])]))
    return float(np.median(np.sqrt(np.maximum(spreads[:, 1], 0.0) / np.maximum(spreads[:, 2], np.finfo(float).tiny))))


def _gathered(points: FloatArray, normals: FloatArray | None, *, name: str) -> tuple[FloatArray, FloatArray | None]:
    """Return the means of the points of a line scanner in cells so large that neighbours lie in all directions."""
    cell = float(np.median(np.asarray(KDTree(points).query(points, k=2)[0])[:, 1]))
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
        if _narrow(means, KDTree(means)) < GATHERED_NARROW:
            continue
        if normals is None:
            return means, None
        sums = np.column_stack([np.bincount(which, normals[:, axis]) for axis in range(3)])
        lengths = np.linalg.norm(sums, axis=1, keepdims=True)
        return means, sums / lengths if lengths.min() > 0.0 else None
    raise InputError(
        f"`{name}`: its {len(points)} points lie along lines, and no neighbouring lines make a surface of them; scan "
        "lines closer to each other, or make the mesh in the scanner's program."
    )


def _spacing(points: FloatArray, tree: KDTree) -> float:
    """Return the side of the square that each point has to itself: a disc about it holds as many as its area."""
    others = 8
    distances = np.asarray(tree.query(points, k=[others + 1])[0])
    return float(np.median(distances)) * float(np.sqrt(np.pi / others))


def _spread_across(points: FloatArray, tree: KDTree) -> float:
    """Return which share of the squared distances of neighbours lies across the plane through them, in the median."""
    some = points[:: -(-len(points) // ASKED_POINTS)]
    spreads = np.linalg.eigvalsh(_spreads(points[np.asarray(tree.query(some, k=NEIGHBOURS)[1])]))
    return float(np.median(spreads[:, 0] / spreads.sum(axis=1)))


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
