"""Direction fields on a surface: vectors, lines or crosses, with given singularities or with those that suit them.

- `fields`: a field, how a direction passes from face to face, and a field on a surface that lies over its own;
- `preferences`: strokes, a direction, the rim and principal curvature, that a field leans to;
- `prescribed`: the field with given singularities and no others, and the one of least gradient;
- `wall`: the fibres of a ventricle's wall by rule, on surfaces within labelled voxels;
- `pattern`: the lines that a field file says, and paths along them as `stripes` or as `streamlines`.
"""

from geoprint.fibers.fields import (
    SYMMETRIES as SYMMETRIES,
    DirectionField as DirectionField,
    Singularities as Singularities,
    carried_field as carried_field,
    nearest_field as nearest_field,
)
from geoprint.fibers.preferences import (
    AlongCurvature as AlongCurvature,
    AlongDirection as AlongDirection,
    AlongRim as AlongRim,
    AlongStroke as AlongStroke,
    Preference as Preference,
    Wishes as Wishes,
)
from geoprint.fibers.prescribed import (
    prescribed_field as prescribed_field,
    singularities_near as singularities_near,
    smoothest_field as smoothest_field,
)
from geoprint.fibers.wall import (
    HelixRule as HelixRule,
    WallCoordinates as WallCoordinates,
    WallVoxels as WallVoxels,
    apex_to_base as apex_to_base,
)
