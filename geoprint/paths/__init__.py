"""From contours to the pose stream: order, resampling, attitude and travel."""

from geoprint.paths.arrange import arrange
from geoprint.paths.poses import largest_lean, mean_lean, poses

__all__ = ["arrange", "largest_lean", "mean_lean", "poses"]
