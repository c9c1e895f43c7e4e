"""The middle: level curves fitted to where fronts meet, so that no seam stays open there and none is laid twice.

- `strands`: level curves, sampled evenly;
- `neighbours`: what faces a strand across a ridge, and what lies inside of it;
- `ridges`: lines along which strands face each other, from end to end;
- `counting`: how many beads fill the width across a ridge;
- `corners`: tips of sharp corners drawn outwards, into the gap that they leave;
- `fitting`: strands moved to their share of the width, two of them laid as one, one more laid between them;
- `lines`: the strokes that come of it;
- `narrow`: curves that come near to themselves cut there, with one bead between both sides.
"""

from geoprint.patterns.middle.fitting import (
    fitted as fitted,
)
from geoprint.patterns.middle.narrow import parted as parted
