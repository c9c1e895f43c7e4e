"""Patterns: how strokes cover a surface, with whatever distance a backend measures on it.

A new pattern is one file beside these and one line in `PATTERNS`, or a package of its own that names its class in the
entry-point group `geoprint.patterns`; a script makes one known with `register`.
"""

from geoprint.patterns.interface import (
    Pattern as Pattern,
    PatternFactory as PatternFactory,
)
from geoprint.patterns.known import (
    PATTERNS as PATTERNS,
    pattern as pattern,
    pattern_names as pattern_names,
    register as register,
    runs_beside_line as runs_beside_line,
)
