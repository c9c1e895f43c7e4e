"""A mesh worth planning on: reading, preparing, cutting and remeshing it, its topology and operators, points on it.

What lies on it or is made of it is here too: seeds, lines, pieces, and how far two surfaces lie apart.
"""

from typing import TYPE_CHECKING

from geoprint.lazy import attached
from geoprint.surfaces.clipping import (
    clipped as clipped,
    closest_once as closest_once,
    faces_within as faces_within,
    part_of as part_of,
    piece_at as piece_at,
)
from geoprint.surfaces.conversion import Notes as Notes
from geoprint.surfaces.directions import direction_across as direction_across, upright_of as upright_of
from geoprint.surfaces.inscribing import (
    SurfaceLine as SurfaceLine,
    inscribed as inscribed,
    with_vertex as with_vertex,
)
from geoprint.surfaces.landmarks import (
    Landmark as Landmark,
    landmarks as landmarks,
    middle_face as middle_face,
)
from geoprint.surfaces.operators import (
    corner_cotangents as corner_cotangents,
    cotangent_laplacian as cotangent_laplacian,
    diagonal_matrix as diagonal_matrix,
    divergence as divergence,
    edge_lengths as edge_lengths,
    face_areas as face_areas,
    face_normals as face_normals,
    gradient as gradient,
    lumped_mass as lumped_mass,
    mean_normal as mean_normal,
    signed_volume as signed_volume,
    smallest_angles as smallest_angles,
    stiffness as stiffness,
    sum_around_vertices as sum_around_vertices,
    vertex_normals as vertex_normals,
)
from geoprint.surfaces.pieces import (
    Piece as Piece,
    all_curves as all_curves,
    middle_of as middle_of,
    pieces as pieces,
    some_curves as some_curves,
    united as united,
)
from geoprint.surfaces.places import (
    in_words as in_words,
    triple as triple,
)
from geoprint.surfaces.points import (
    closest as closest,
    normals as normals,
    positions as positions,
    vertex_points as vertex_points,
)
from geoprint.surfaces.polylines import (
    PolylineDistance as PolylineDistance,
    arc_lengths as arc_lengths,
    even_points as even_points,
)
from geoprint.surfaces.seeds import (
    boundary_seed as boundary_seed,
    loop_seed as loop_seed,
    nearest_loop as nearest_loop,
    part_seed as part_seed,
    point_seed as point_seed,
)
from geoprint.surfaces.topology import (
    boundary_half_edges as boundary_half_edges,
    boundary_loops as boundary_loops,
    component_labels as component_labels,
    connected_nodes as connected_nodes,
    describe as describe,
    edge_faces as edge_faces,
    edge_keys as edge_keys,
    edges as edges,
    encloses as encloses,
    euler_characteristic as euler_characteristic,
    half_edges as half_edges,
    numbered_edges as numbered_edges,
    turned_over as turned_over,
    twins as twins,
)

if not TYPE_CHECKING:
    __getattr__, __dir__ = attached(__name__, modules="files remesh repair")
