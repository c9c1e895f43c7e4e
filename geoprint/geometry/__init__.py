"""A mesh worth planning on: read, examined, repaired, cut, remeshed, with points, operators and sources."""

from typing import TYPE_CHECKING

from geoprint.geometry.clipping import (
    Landmark as Landmark,
    SurfaceLine as SurfaceLine,
    clipped as clipped,
    closest_once as closest_once,
    faces_within as faces_within,
    inscribed as inscribed,
    landmarks as landmarks,
    middle_face as middle_face,
    part_of as part_of,
    piece_at as piece_at,
    with_vertex as with_vertex,
)
from geoprint.geometry.creases import (
    SHARP as SHARP,
    creases as creases,
    edges_alone as edges_alone,
    juts_out as juts_out,
)
from geoprint.geometry.deviation import Deviation as Deviation, Distances as Distances, deviation as deviation
from geoprint.geometry.facets import SmoothNormals as SmoothNormals, smooth_normals as smooth_normals
from geoprint.geometry.files.mesh_file import Notes as Notes
from geoprint.geometry.operators import (
    corner_cotangents as corner_cotangents,
    cotangent_laplacian as cotangent_laplacian,
    diagonal_matrix as diagonal_matrix,
    edge_lengths as edge_lengths,
    face_areas as face_areas,
    face_normals as face_normals,
    gradient as gradient,
    lumped_mass as lumped_mass,
    mean_normal as mean_normal,
    shortest_edge_path as shortest_edge_path,
    signed_volume as signed_volume,
    smallest_angles as smallest_angles,
    stiffness as stiffness,
    sum_around_vertices as sum_around_vertices,
    vertex_normals as vertex_normals,
)
from geoprint.geometry.pieces import (
    Piece as Piece,
    PolylineDistance as PolylineDistance,
    all_curves as all_curves,
    arc_lengths as arc_lengths,
    even_points as even_points,
    middle_of as middle_of,
    pieces as pieces,
    some_curves as some_curves,
    united as united,
    whole_steps as whole_steps,
)
from geoprint.geometry.points import (
    PLACE_TOLERANCE as PLACE_TOLERANCE,
    closest as closest,
    direction_across as direction_across,
    in_words as in_words,
    normals as normals,
    on_surface as on_surface,
    positions as positions,
    triple as triple,
    upright_of as upright_of,
    vertex_points as vertex_points,
)
from geoprint.geometry.refine import halved as halved, refine as refine
from geoprint.geometry.source import (
    boundary_source as boundary_source,
    loop_source as loop_source,
    nearest_loop as nearest_loop,
    part_source as part_source,
    point_source as point_source,
)
from geoprint.geometry.topology import (
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
    turned_over as turned_over,
    twins as twins,
)
from geoprint.lazy import attached

if TYPE_CHECKING:
    from geoprint.geometry.mesh_inspection import (
        Defect as Defect,
        Inspection as Inspection,
        Rim as Rim,
        inspect as inspect,
        terrace_height as terrace_height,
    )
    from geoprint.geometry.remeshing import (
        TERRACE_SHARE as TERRACE_SHARE,
        TERRACE_WAVELENGTH as TERRACE_WAVELENGTH,
        contracted as contracted,
        decimate as decimate,
        remesh as remesh,
        smooth as smooth,
        trimmed as trimmed,
    )
    from geoprint.geometry.repair import (
        Joined as Joined,
        PreparationReport as PreparationReport,
        Repairs as Repairs,
        described as described,
        join as join,
        prepare as prepare,
        stays_open as stays_open,
    )

# Compiled loops come with these.
_LATER = {
    "mesh_inspection": "Defect Inspection Rim inspect terrace_height",
    "remeshing": "TERRACE_SHARE TERRACE_WAVELENGTH contracted decimate remesh smooth trimmed",
    "repair": "Joined PreparationReport Repairs described join prepare stays_open",
}

if not TYPE_CHECKING:
    __getattr__, __dir__ = attached(__name__, modules="files", names=_LATER)
