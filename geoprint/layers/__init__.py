"""Layers: expanded surfaces over a part, each at one distance from it, and how a thickness falls into them.

- `feet`: where on the part a place stands, on which side, and how far beyond its rim;
- `rims`: normals at the rim, right to second order;
- `creases`: where edges of a level pass one;
- `folds`: faces that lean from it, and crumbs at its rim;
- `nets`: triangles about a level of the distance, from cells of a grid;
- `level_surfaces`: the level surface of the distance, cut along the normals of the rim;
- `refining`: the same made finer where it must be;
- `targets`: what layers fill: a closed shape, or a thickness that varies over the part;
- `cutting`: a level cut by it, and what holds it from below;
- `slices`: what a plane cuts of layers, and of the paths on them;
- `stacks`: how many layers of which height make a thickness, and the levels between them.
"""

from geoprint.layers.level_surfaces import level_surface as level_surface
from geoprint.layers.slices import (
    CutPlane as CutPlane,
    Slice as Slice,
    layer_level as layer_level,
    middle_planes as middle_planes,
    sliced as sliced,
    sliced_layer as sliced_layer,
    whole_layers as whole_layers,
)
from geoprint.layers.targets import (
    Columns as Columns,
    LayerTarget as LayerTarget,
    TargetShape as TargetShape,
    TargetThickness as TargetThickness,
    area_standing_out as area_standing_out,
    cut as cut,
    with_sides as with_sides,
    without_crumbs as without_crumbs,
)
