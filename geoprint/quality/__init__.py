"""How even a toolpath is, measured on the path itself and not on any backend's field.

The exact distance over the triangles that this takes gives the shortest line between two places too (`shortest_way`).
How thick a stack of layers becomes is measured in `stacked`.
"""

from geoprint.quality.agreement import (
    Agreement as Agreement,
    agreement as agreement,
)
from geoprint.quality.distance import DistanceErrors as DistanceErrors, distance_errors as distance_errors
from geoprint.quality.evenness import (
    OFF_SURFACE_SHARE as OFF_SURFACE_SHARE,
    Uniformity as Uniformity,
    measure_paths as measure_paths,
    uniformity as uniformity,
)
from geoprint.quality.fibres import FibreAngles as FibreAngles, fibre_angles as fibre_angles
from geoprint.quality.levels import LevelSpacings as LevelSpacings
from geoprint.quality.overhang import Overhang as Overhang, overhang as overhang
from geoprint.quality.printed import (
    Interval as Interval,
    Printed as Printed,
    alike as alike,
    difference as difference,
    printed as printed,
    standoff_within as standoff_within,
    thickness_within as thickness_within,
)
from geoprint.quality.ranking import (
    EVEN_ENOUGH as EVEN_ENOUGH,
    MOST_MISSED as MOST_MISSED,
    MOST_TWICE as MOST_TWICE,
    SAME_COVERAGE as SAME_COVERAGE,
    Covering as Covering,
    equally_good as equally_good,
    ranked as ranked,
)
from geoprint.quality.rigid_fit import RigidFit as RigidFit, moved as moved, rigid_fit as rigid_fit
from geoprint.quality.sides import SideSpacing as SideSpacing
from geoprint.quality.spacing import SpacingAt as SpacingAt, SpacingFigures as SpacingFigures
from geoprint.quality.spans import Spans as Spans, joined_spans as joined_spans
from geoprint.quality.straying import SOURCES as SOURCES
from geoprint.quality.thickness import (
    LevelledLayer as LevelledLayer,
    Thickness as Thickness,
    stretches_of_poses as stretches_of_poses,
)
