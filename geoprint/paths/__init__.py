"""From strokes to the pose stream: order, resampling, attitude and travel."""

from geoprint.paths.arrange import arrange as arrange
from geoprint.paths.lifting import CrossedCreases as CrossedCreases, creases as creases
from geoprint.paths.poses import (
    PosedSurface as PosedSurface,
    largest_lean as largest_lean,
    mean_lean as mean_lean,
    posed_surface as posed_surface,
    poses as poses,
)
from geoprint.paths.seams import Seams as Seams, seams_of as seams_of
from geoprint.paths.summing import check_sum as check_sum
