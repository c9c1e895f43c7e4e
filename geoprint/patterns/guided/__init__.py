"""Guided rows: side by side with a drawn curve, in strokes that turn where rows end.

- `within`: curves cut where they leave what a field holds above a value;
- `turns`: rows joined to strokes along the line at which they end;
- `rows`: the pattern, with contours around the rows where they are asked for.
"""

from geoprint.patterns.guided.rows import (
    GuidedPattern as GuidedPattern,
)
