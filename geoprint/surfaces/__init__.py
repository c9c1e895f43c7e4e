"""A mesh worth planning on: reading, preparing, cutting and remeshing it, its topology and operators, points on it.

What lies on it or is made of it is here too: seeds, lines, pieces, and how far two surfaces lie apart.
"""

from geoprint.surfaces.clipping import clipped, faces_within, part_of, piece_at
from geoprint.surfaces.contraction import contracted, trimmed
from geoprint.surfaces.conversion import Notes
from geoprint.surfaces.decimation import decimate
from geoprint.surfaces.deviation import Deviation, Distances, deviation
from geoprint.surfaces.inscribing import SurfaceLine, inscribed, with_vertex
from geoprint.surfaces.inspection import Finding, Inspection, inspect
from geoprint.surfaces.io import (
    UNITS,
    Loaded,
    likely_unit,
    load,
    load_file,
    ply_bytes,
    save_ply,
    suggested_unit,
    unit_hint,
)
from geoprint.surfaces.operators import (
    cotangent_laplacian,
    divergence,
    edge_lengths,
    face_areas,
    face_normals,
    gradient,
    lumped_mass,
    mean_normal,
    smallest_angles,
    sum_around_vertices,
    vertex_normals,
)
from geoprint.surfaces.pieces import Piece, all_curves, middle_of, pieces, some_curves, united
from geoprint.surfaces.places import in_words, triple
from geoprint.surfaces.points import closest, normals, positions, vertex_points
from geoprint.surfaces.polylines import PolylineDistance, arc_lengths, even_points
from geoprint.surfaces.refine import refine
from geoprint.surfaces.regions import region_faces
from geoprint.surfaces.remeshing import remesh
from geoprint.surfaces.repair import Joined, PreparationReport, join, prepare, signed_volume
from geoprint.surfaces.seeds import boundary_seed, point_seed
from geoprint.surfaces.smoothing import smooth
from geoprint.surfaces.topology import (
    boundary_half_edges,
    boundary_loops,
    component_labels,
    connected_nodes,
    describe,
    edge_faces,
    edge_keys,
    edges,
    euler_characteristic,
    half_edges,
    numbered_edges,
    turned_over,
    twins,
)

__all__ = [
    "UNITS",
    "Deviation",
    "Distances",
    "Finding",
    "Inspection",
    "Joined",
    "Loaded",
    "Notes",
    "Piece",
    "PolylineDistance",
    "PreparationReport",
    "SurfaceLine",
    "all_curves",
    "arc_lengths",
    "boundary_half_edges",
    "boundary_loops",
    "boundary_seed",
    "clipped",
    "closest",
    "component_labels",
    "connected_nodes",
    "contracted",
    "cotangent_laplacian",
    "decimate",
    "describe",
    "deviation",
    "divergence",
    "edge_faces",
    "edge_keys",
    "edge_lengths",
    "edges",
    "euler_characteristic",
    "even_points",
    "face_areas",
    "face_normals",
    "faces_within",
    "gradient",
    "half_edges",
    "in_words",
    "inscribed",
    "inspect",
    "join",
    "likely_unit",
    "load",
    "load_file",
    "lumped_mass",
    "mean_normal",
    "middle_of",
    "normals",
    "numbered_edges",
    "part_of",
    "piece_at",
    "pieces",
    "ply_bytes",
    "point_seed",
    "positions",
    "prepare",
    "refine",
    "region_faces",
    "remesh",
    "save_ply",
    "signed_volume",
    "smallest_angles",
    "smooth",
    "some_curves",
    "suggested_unit",
    "sum_around_vertices",
    "trimmed",
    "triple",
    "turned_over",
    "twins",
    "unit_hint",
    "united",
    "vertex_normals",
    "vertex_points",
    "with_vertex",
]
