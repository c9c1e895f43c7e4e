"""The paper's 2D backend: conformal chart, distance transform, marching squares, barycentric lift."""

from geoprint.backends.lscm.backend import (
    Flattening as Flattening,
    Lscm as Lscm,
    chart_images as chart_images,
)
from geoprint.backends.lscm.chart_lookup import locate as locate
from geoprint.backends.lscm.distortion import distortion as distortion, predicted_spacing as predicted_spacing
