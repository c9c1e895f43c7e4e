"""A surface through the points of a scan: normals, Poisson reconstruction [Kazhdan2013], cut back to the data."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import KDTree

from geoprint.errors import InputError
from geoprint.model import FloatArray, Surface
from geoprint.surfaces.clipping import clipped, part_of
from geoprint.surfaces.conversion import missing
from geoprint.surfaces.files import cloud_worker
from geoprint.surfaces.files.mesh_file import MeshFile
from geoprint.surfaces.files.native import run_worker
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
# Normals in a file have length 1 but for rounding in text.
NORMAL_LENGTH = (0.98, 1.02)


PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip


@final
@dataclass(frozen=True, slots=True, eq=False)
class PointCloud:
    """Points of a scan.

    Attributes:
        points: (k, 3) positions in the file's unit.
        normals: (k, 3) unit normals, outward; or None where the file has none.
    """

    points: FloatArray
    normals: FloatArray | None


def read_cloud(data: bytes, /, *, name: str) -> MeshFile:
    """Return a surface through the points that stand in lines of text.

    Raises:
        InputError: as `read_point_text` and `reconstruct`, and so the others.
        ResourceError: it takes too long or too much memory.
        UsageError: open3d is not installed.
    """
    return reconstruct(read_point_text(data, name=name), name=name)


def read_point_text(data: bytes, *, name: str) -> PointCloud:
    """Read lines of x y z, with a normal behind where these are six numbers and the last three have length 1.

    Other numbers behind (colours, intensities) are left out; so are a first line with the count and lines with #.

    Raises:
        InputError: the lines do not have at least three numbers each, equally many.
    """
    lines = data.decode("ascii", errors="replace").splitlines()
    first = lines[0].split() if lines else []
    counted = len(first) == 1 and first[0].isdigit()
    table = np.loadtxt(lines[counted:], dtype=np.float64, ndmin=2)
    if table.shape[1] < 3:
        raise InputError(f"`{name}` has {table.shape[1]} numbers a line; points need x y z, so export them so.")
    return PointCloud(table[:, :3], _unit_normals(table[:, 3:6]) if table.shape[1] == 6 else None)


def read_point_ply(data: bytes, *, name: str) -> PointCloud:
    """Read the vertices of a PLY file without faces, with nx ny nz as normals where it has them.

    Raises:
        InputError: the header does not describe vertices of plain numbers, or the file is shorter than it says.
    """
    header, _, body = data.partition(b"end_header")
    body = body[2:] if body[:2] == b"\r\n" else body[1:]
    lines = [line.split() for line in header.decode("ascii", errors="replace").splitlines()]
    start = next((number for number, words in enumerate(lines) if words[:1] == ["element"]), len(lines))
    if start == len(lines) or lines[start][1:2] != ["vertex"]:
        raise InputError(f"`{name}` does not begin with its vertices; export the points alone, as x y z lines.")
    following = (number for number in range(start + 1, len(lines)) if lines[number][:1] == ["element"])
    properties = [words for words in lines[start + 1 : next(following, len(lines))] if words[:1] == ["property"]]
    if not {"x", "y", "z"} <= {words[-1] for words in properties} or any(words[1] == "list" for words in properties):
        raise InputError(f"`{name}` has vertices without x y z or with lists; export the points as x y z lines.")
    count, names = int(lines[start][2]), [words[-1] for words in properties]
    if ["format", "ascii", "1.0"] in lines:
        table = np.loadtxt(body.decode("ascii").split("\n"), dtype=np.float64, ndmin=2, max_rows=count)
        columns = dict(zip(names, table.T, strict=True))
    else:
        order = ">" if ["format", "binary_big_endian", "1.0"] in lines else "<"
        kinds = [(words[-1], order + PLY_TYPES[words[1]]) for words in properties]
        vertices = np.frombuffer(body, dtype=np.dtype(kinds), count=count)
        columns = {key: vertices[key].astype(np.float64) for key in names}
    points = np.column_stack([columns[axis] for axis in "xyz"])
    if not {"nx", "ny", "nz"} <= set(names):
        return PointCloud(points, None)
    return PointCloud(points, _unit_normals(np.column_stack([columns[axis] for axis in ("nx", "ny", "nz")])))


def reconstruct(cloud: PointCloud, *, name: str) -> MeshFile:
    """Return a surface through a cloud of points, which ends where the points end.

    Args:
        cloud: as read.
        name: of the file.

    Returns:
        The largest piece of the surface; its notes tell the points' spacing and the residual: how far they lie from
        it. Without normals in the file the outside is the side that faces away from the points' middle.

    Raises:
        InputError: too few or many points, a coordinate that is not finite, or points that are on no surface.
        ResourceError: it takes too long or too much memory.
        UsageError: open3d is not installed.
    """
    points, normals = _checked(cloud, name=name)
    if importlib.util.find_spec("open3d") is None:
        raise missing("open3d", extra="scan", work="reading point clouds")
    tree = KDTree(points)
    spacing = _spacing(points, tree)
    across = _spread_across(points, tree)
    if across > MOST_ACROSS:
        raise InputError(
            f"`{name}`: about its {len(points)} points others lie in all directions: {across:.2f} of their squared "
            f"distances lie across the plane through them, at most {MOST_ACROSS:.2f} may; {NO_SURFACE}.",
            across=across,
        )
    known = estimated_normals(points, tree) if normals is None else normals
    rough = _poisson(points, known, spacing=spacing, name=name)
    surface = _cut_back(rough, tree, reach=REACH_SPACINGS * spacing)
    _, residuals = closest(surface, points)
    stray = float((residuals > CELL_SPACINGS * spacing).mean())
    if stray > STRAY_SHARE:
        raise InputError(
            f"`{name}`: {stray:.0%} of its {len(points)} points lie farther than {CELL_SPACINGS * spacing:.3g} from "
            f"the surface through them, at most {STRAY_SHARE:.0%} may; {NO_SURFACE}.",
            stray=stray,
        )
    notes = (
        ("reconstructed_from_points", len(points)),
        ("normals", "estimated" if normals is None else "from the file"),
        ("point_spacing", round(spacing, 6)),
        ("residual_mean", round(float(residuals.mean()), 6)),
        ("residual_p95", round(float(np.quantile(residuals, 0.95)), 6)),
        ("residual_max", round(float(residuals.max()), 6)),
    )
    return MeshFile(surface.vertices, surface.faces, notes=notes)


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


def _unit_normals(columns: FloatArray) -> FloatArray | None:
    """Return normals normalised, or None where the columns are something else."""
    lengths = np.linalg.norm(columns, axis=1, keepdims=True)
    shortest, longest = NORMAL_LENGTH
    if not ((lengths >= shortest) & (lengths <= longest)).all():
        return None
    return columns / lengths


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
