"""Layers: expanded surfaces over a part, each at one distance from it, and how a thickness falls into them.

- `feet`: where on the part a place stands, on which side, and how far beyond its rim;
- `nets`: triangles about a level of the distance, from cells of a grid;
- `level_surfaces`: the level surface of the distance, cut along the normals of the rim;
- `stacks`: how many layers of which height make a thickness, and the levels between them.
"""

from geoprint.layers.level_surfaces import level_surface as level_surface
from geoprint.layers.stacks import (
    layer_level as layer_level,
    whole_layers as whole_layers,
)
