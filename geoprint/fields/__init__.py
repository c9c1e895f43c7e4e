"""Direction fields on a surface: vectors, lines or crosses, with given singularities or with those that suit them.

- `connection`: how a direction passes from face to face, and the curvature of vertices;
- `direction_field`: a field, and what is measured of it;
"""

from geoprint.fields.direction_field import (
    SYMMETRIES as SYMMETRIES,
    DirectionField as DirectionField,
    Singularities as Singularities,
    nearest_field as nearest_field,
)
