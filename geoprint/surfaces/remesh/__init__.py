"""Triangles of another size or shape over the same surface, within a deviation."""

from geoprint.surfaces.remesh.contraction import (
    contracted as contracted,
    trimmed as trimmed,
)
from geoprint.surfaces.remesh.decimation import decimate as decimate
from geoprint.surfaces.remesh.deviation import (
    Deviation as Deviation,
    Distances as Distances,
    deviation as deviation,
)
from geoprint.surfaces.remesh.refine import (
    halved as halved,
    refine as refine,
)
from geoprint.surfaces.remesh.remeshing import remesh as remesh
from geoprint.surfaces.remesh.smoothing import (
    TERRACE_SHARE as TERRACE_SHARE,
    TERRACE_WAVELENGTH as TERRACE_WAVELENGTH,
    smooth as smooth,
)
