"""How even a toolpath is, measured on the path itself and not on any backend's field.

The exact distance over the triangles that this takes gives the shortest line between two places too (`shortest_way`).
How thick a stack of layers becomes is measured in `stacked`.
"""

from geoprint.quality.agreement import (
    Agreement as Agreement,
    agreement as agreement,
)
from geoprint.quality.measuring import (
    OFF_SURFACE_SHARE as OFF_SURFACE_SHARE,
    PathMeasure as PathMeasure,
    measure_paths as measure_paths,
)
from geoprint.quality.overhang import Overhang as Overhang, overhang as overhang
from geoprint.quality.printed import (
    Interval as Interval,
    Printed as Printed,
    alike as alike,
    difference as difference,
    printed as printed,
    thickness_cv as thickness_cv,
    thickness_within as thickness_within,
)
from geoprint.quality.ranking import (
    EVEN_ENOUGH as EVEN_ENOUGH,
    MOST_MISSED as MOST_MISSED,
    MOST_TWICE as MOST_TWICE,
    SAME_COVERAGE as SAME_COVERAGE,
    SAME_SPACING as SAME_SPACING,
    Covering as Covering,
    ranked as ranked,
)
from geoprint.quality.rigid_fit import RigidFit as RigidFit, moved as moved, rigid_fit as rigid_fit
from geoprint.quality.sides import (
    SideFigures as SideFigures,
    SideSpacing as SideSpacing,
)
from geoprint.quality.spans import Spans as Spans, joined_spans as joined_spans
from geoprint.quality.straying import SOURCES as SOURCES
from geoprint.quality.thickness import (
    LevelledLayer as LevelledLayer,
    Thickness as Thickness,
)
from geoprint.quality.uniformity import (
    Uniformity as Uniformity,
    uniformity as uniformity,
)
