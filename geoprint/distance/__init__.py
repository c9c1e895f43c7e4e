"""Planning backends: each covers a surface with curves a constant distance apart, behind one interface.

A new backend is one file beside these and one line in `BACKENDS`, or a package of its own that names its class in the
entry-point group `geoprint.backends`; a script makes one known with `register`.
"""

from geoprint.distance.distortion import (
    distortion as distortion,
    locate as locate,
    predicted_spacing as predicted_spacing,
)
from geoprint.distance.interface import (
    Accuracy as Accuracy,
    Backend as Backend,
    BackendFactory as BackendFactory,
    ChartImage as ChartImage,
    Diagnostics as Diagnostics,
    Shown as Shown,
    diagnostics as diagnostics,
    level_distances as level_distances,
    linear_edge_length as linear_edge_length,
)
from geoprint.distance.isolines import isolines as isolines
from geoprint.distance.registry import (
    BACKENDS as BACKENDS,
    Piecewise as Piecewise,
    accuracy as accuracy,
    backend as backend,
    backend_names as backend_names,
    compared_backends as compared_backends,
    most_accurate_backend as most_accurate_backend,
    register as register,
)
