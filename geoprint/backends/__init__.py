"""Planning backends: each covers a surface with curves a constant distance apart, behind one interface.

A new backend is one file beside these and one line in `BACKENDS`.
"""

from collections.abc import Mapping
from types import MappingProxyType

from geoprint.backends.diagnostics import Diagnostics, diagnostics
from geoprint.backends.distortion import Distortion, distortion, predicted_spacing
from geoprint.backends.fast_marching import FastMarching
from geoprint.backends.heat import Heat
from geoprint.backends.interface import Backend, BackendFactory
from geoprint.backends.lscm import Flattening, Lscm
from geoprint.backends.piecewise import Piecewise

BACKENDS: Mapping[str, BackendFactory] = MappingProxyType({"heat": Heat, "fast-marching": FastMarching, "lscm": Lscm})

__all__ = [
    "BACKENDS",
    "Backend",
    "BackendFactory",
    "Diagnostics",
    "Distortion",
    "FastMarching",
    "Flattening",
    "Heat",
    "Lscm",
    "Piecewise",
    "diagnostics",
    "distortion",
    "predicted_spacing",
]
