"""The spiral: one stroke from the rim to the middle, whose distance from the seed rises by one spacing a turn.

- `slits`: a surface slit open along a line of edges, so that what rises by one round it has one value a vertex;
- `turning`: the share of a turn at every vertex, as even as it can be from turn to turn;
- `strokes`: the level curve of distance less turns, joined across the slit.
"""

from geoprint.patterns.spiral.strokes import (
    SpiralPattern as SpiralPattern,
)
