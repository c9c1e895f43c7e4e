"""The paper's 2D backend: conformal chart, distance transform, marching squares, barycentric lift."""

from geoprint.backends.lscm.backend import Lscm as Lscm
