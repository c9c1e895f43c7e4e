"""Exact shortest ways over triangles, which no backend uses."""

from geoprint.quality.oracle.aside import (
    FOUND as FOUND,
    NONE as NONE,
    OBLIQUE as OBLIQUE,
    UNKNOWN as UNKNOWN,
    Neighbours as Neighbours,
    Stretches as Stretches,
    neighbours as neighbours,
)
from geoprint.quality.oracle.geodesic import (
    WINDOWS_IN_ALL as WINDOWS_IN_ALL,
    Ask as Ask,
    GeodesicDistance as GeodesicDistance,
)
from geoprint.quality.oracle.horizon import ANY as ANY
from geoprint.quality.oracle.shortest_way import shortest_way as shortest_way
from geoprint.quality.oracle.tracing import (
    SurfacePath as SurfacePath,
    trace as trace,
)
from geoprint.quality.oracle.triangles import (
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
