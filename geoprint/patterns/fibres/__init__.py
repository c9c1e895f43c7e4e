"""Fibres: evenly spaced streamlines of a designed field of lines.

- `net`: a surface and the lines on it as plain arrays;
- `nearest`: how near strokes are to a place, over the surface;
- `tracing`: streamlines, straight in each triangle, and where they end;
- `laying`: strokes one beside another, and in the gaps that are left;
- `strokes`: the pattern.
"""

from geoprint.patterns.fibres.laying import (
    LaidStroke as LaidStroke,
    Weave as Weave,
    laid_strokes as laid_strokes,
)
from geoprint.patterns.fibres.strokes import (
    FibrePattern as FibrePattern,
    lines_along_rim as lines_along_rim,
)
