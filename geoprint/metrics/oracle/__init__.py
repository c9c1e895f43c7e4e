"""Exact shortest ways over triangles, which no backend uses."""

from geoprint.metrics.oracle.aside import (
    FOUND as FOUND,
    NONE as NONE,
    OBLIQUE as OBLIQUE,
    UNKNOWN as UNKNOWN,
    Neighbours as Neighbours,
    Stretches as Stretches,
    neighbours as neighbours,
)
from geoprint.metrics.oracle.geodesic import (
    WINDOWS_IN_ALL as WINDOWS_IN_ALL,
    Ask as Ask,
    GeodesicDistance as GeodesicDistance,
    shortest_way as shortest_way,
)
from geoprint.metrics.oracle.tracing import SurfacePath as SurfacePath, trace as trace
from geoprint.metrics.oracle.unfolding import (
    ANY as ANY,
    ComplexArray as ComplexArray,
    FlatMesh as FlatMesh,
    Places as Places,
    SmallTriangles as SmallTriangles,
    flat_mesh as flat_mesh,
    flat_places as flat_places,
    positive_shares as positive_shares,
    small_triangles as small_triangles,
    spatial as spatial,
)
