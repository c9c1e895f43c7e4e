"""The heat method on the intrinsic Delaunay triangulation."""

from geoprint.backends.heat.backend import Heat as Heat
