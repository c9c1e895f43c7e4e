"""Fibres: strokes along a designed field of lines, level curves of a phase or streamlines.

- `net`: a surface and the lines on it as plain arrays;
- `nearest`: how near strokes are to a place, over the surface;
- `tracing`: streamlines, straight in each triangle, and where they end;
- `laying`: strokes one beside another, and in the gaps that are left;
- `senses`: which of its two senses the line of a face has at each vertex;
- `evened`: how fast rows shall follow one another, so that few of them have to end;
- `phase`: a complex number a vertex whose argument rises by one turn from row to row;
- `levels`: its level curves;
- `rows`: which row each of them is;
- `stripes`: level curves as strokes;
- `strokes`: the pattern.
"""

from geoprint.patterns.fibres.laying import (
    LaidStroke as LaidStroke,
    Weave as Weave,
    laid_strokes as laid_strokes,
)
from geoprint.patterns.fibres.strokes import (
    LAYINGS as LAYINGS,
    FibrePattern as FibrePattern,
    lines_along_rim as lines_along_rim,
)
