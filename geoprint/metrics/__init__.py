"""How even a toolpath is, measured on the path itself and not on any backend's field.

The exact distance over the triangles that this takes gives the shortest line between two places too (`shortest_way`).
What a program deposits as it was executed is in `executed_flow`.
"""

from geoprint.metrics.agreement import (
    EVEN_ENOUGH as EVEN_ENOUGH,
    MOST_MISSED as MOST_MISSED,
    Agreement as Agreement,
    Covering as Covering,
    agreement as agreement,
    equally_good as equally_good,
    ranked as ranked,
)
from geoprint.metrics.evenness import (
    MeasuredSurface as MeasuredSurface,
    Uniformity as Uniformity,
    measure_paths as measure_paths,
    uniformity as uniformity,
)
from geoprint.metrics.fibers import (
    FibreAngles as FibreAngles,
    Overhang as Overhang,
    fibre_angles as fibre_angles,
    overhang as overhang,
)
from geoprint.metrics.levels import (
    DistanceErrors as DistanceErrors,
    LevelSpacing as LevelSpacing,
    LevelSpacings as LevelSpacings,
    WorstPlace as WorstPlace,
    distance_errors as distance_errors,
)
from geoprint.metrics.printed import (
    Interval as Interval,
    Printed as Printed,
    alike as alike,
    difference as difference,
    printed as printed,
    standoff_within as standoff_within,
    thickness_within as thickness_within,
)
from geoprint.metrics.rigid_fit import RigidFit as RigidFit, moved as moved, rigid_fit as rigid_fit
from geoprint.metrics.sides import SideSpacing as SideSpacing
from geoprint.metrics.spacing import (
    SOURCES as SOURCES,
    SpacingAt as SpacingAt,
    SpacingFigures as SpacingFigures,
    Spans as Spans,
    joined_spans as joined_spans,
)
from geoprint.metrics.thickness import (
    LevelledLayer as LevelledLayer,
    Levelling as Levelling,
    Thickness as Thickness,
    stretches_of_poses as stretches_of_poses,
)
