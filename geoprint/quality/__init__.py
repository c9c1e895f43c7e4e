"""How even a toolpath is, measured on the path itself and not on any backend's field.

The exact distance over the triangles that this takes gives the shortest line between two places too (`shortest_way`).
"""

from geoprint.quality.agreement import Agreement, agreement
from geoprint.quality.thickness import LevelledLayer, Thickness
from geoprint.quality.uniformity import Uniformity, uniformity, widths_at_poses

__all__ = ["Agreement", "LevelledLayer", "Thickness", "Uniformity", "agreement", "uniformity", "widths_at_poses"]
