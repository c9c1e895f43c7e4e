"""A mesh worth planning on: reading, preparing, topology, operators, points on it, seeds and refinement."""

from geoprint.surfaces.io import UNITS, load, ply_bytes, save_ply
from geoprint.surfaces.operators import (
    cotangent_laplacian,
    divergence,
    edge_lengths,
    face_areas,
    face_normals,
    gradient,
    lumped_mass,
    mean_normal,
    vertex_normals,
)
from geoprint.surfaces.points import closest, normals, positions, vertex_points
from geoprint.surfaces.polylines import PolylineDistance, arc_lengths, even_points
from geoprint.surfaces.refine import refine
from geoprint.surfaces.repair import PreparationReport, prepare
from geoprint.surfaces.seeds import boundary_seed, point_seed
from geoprint.surfaces.topology import (
    boundary_half_edges,
    boundary_loops,
    component_labels,
    describe,
    edge_faces,
    edges,
    euler_characteristic,
    half_edges,
    numbered_edges,
    twins,
)

__all__ = [
    "UNITS",
    "PolylineDistance",
    "PreparationReport",
    "arc_lengths",
    "boundary_half_edges",
    "boundary_loops",
    "boundary_seed",
    "closest",
    "component_labels",
    "cotangent_laplacian",
    "describe",
    "divergence",
    "edge_faces",
    "edge_lengths",
    "edges",
    "euler_characteristic",
    "even_points",
    "face_areas",
    "face_normals",
    "gradient",
    "half_edges",
    "load",
    "lumped_mass",
    "mean_normal",
    "normals",
    "numbered_edges",
    "ply_bytes",
    "point_seed",
    "positions",
    "prepare",
    "refine",
    "save_ply",
    "twins",
    "vertex_normals",
    "vertex_points",
]
