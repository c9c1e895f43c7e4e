"""Planning backends: each covers a surface with curves a constant distance apart, behind one interface.

A new backend is one file beside these and one line in `BACKENDS`, or a package of its own that names its class in the
entry-point group `geoprint.backends`; a script makes one known with `register`.
"""

from geoprint.backends.chart_lookup import locate as locate
from geoprint.backends.diagnostics import (
    Diagnostics as Diagnostics,
    diagnostics as diagnostics,
)
from geoprint.backends.distortion import distortion as distortion, predicted_spacing as predicted_spacing
from geoprint.backends.interface import (
    Accuracy as Accuracy,
    Backend as Backend,
    BackendFactory as BackendFactory,
    ChartImage as ChartImage,
    Shown as Shown,
)
from geoprint.backends.isolines import isolines as isolines
from geoprint.backends.known import (
    BACKENDS as BACKENDS,
    accuracy as accuracy,
    backend as backend,
    backend_names as backend_names,
    compared_backends as compared_backends,
    most_accurate_backend as most_accurate_backend,
    register as register,
    with_option as with_option,
)
from geoprint.backends.levels import (
    level_distances as level_distances,
    linear_edge_length as linear_edge_length,
)
from geoprint.backends.piecewise import Piecewise as Piecewise
