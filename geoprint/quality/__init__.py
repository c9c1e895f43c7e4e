"""How even a toolpath is, measured on the path itself and not on any backend's field."""

from geoprint.quality.uniformity import Uniformity, uniformity

__all__ = ["Uniformity", "uniformity"]
