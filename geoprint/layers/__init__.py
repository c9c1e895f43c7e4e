"""Layers: a feature that prints a thickness, or what a target shape holds, layer upon layer over a part.

Geometry: `feet` (where on the part a place stands, on which side, how far beyond its rim), `level_surfaces` (one
distance from the part, cut along the normals of the rim), `refining` (the same made finer where it must be), `targets`
(what layers fill, and a level cut by it), `slices` (what a plane cuts of layers, and of the paths on them).

Planning: `division` is what the core finds; `layering` says in which layers a job falls, `stacking` plans and compares
them, `stack_thickness` simulates their sum, `check_stack` holds a folder against its bundles; `records`, `stack_text`,
`stack_comparison`, `stack_page` and `slice_figure` say what came out.
"""

from geoprint.layers.level_surfaces import level_surface as level_surface
from geoprint.layers.records import StackComparisonRecord as StackComparisonRecord, StackRecord as StackRecord
from geoprint.layers.slices import (
    layer_level as layer_level,
    middle_planes as middle_planes,
    sliced as sliced,
    sliced_layer as sliced_layer,
    whole_layers as whole_layers,
)
from geoprint.layers.stack_thickness import FinishedStack as FinishedStack, StackedLayer as StackedLayer
from geoprint.layers.stacking import (
    compare_stacks as compare_stacks,
    plan_layers as plan_layers,
    plan_stack as plan_stack,
)
from geoprint.layers.targets import (
    Columns as Columns,
    TargetShape as TargetShape,
    TargetThickness as TargetThickness,
    area_standing_out as area_standing_out,
    cut as cut,
    with_sides as with_sides,
    without_crumbs as without_crumbs,
)
