"""Planning backends: each covers a surface with curves a constant distance apart, behind one interface.

A new backend is one file beside these and one line in `BACKENDS`.
"""

from collections.abc import Mapping
from types import MappingProxyType

from geoprint.backends.diagnostics import (
    Diagnostics as Diagnostics,
    diagnostics as diagnostics,
)
from geoprint.backends.heat import Heat
from geoprint.backends.interface import (
    Backend as Backend,
    BackendFactory as BackendFactory,
)
from geoprint.backends.lscm import Lscm
from geoprint.backends.marching import FastMarching
from geoprint.backends.piecewise import Piecewise as Piecewise

BACKENDS: Mapping[str, BackendFactory] = MappingProxyType({"heat": Heat, "fast-marching": FastMarching, "lscm": Lscm})
