"""Paths on a surface: patterns, order, corners, resampling and the stream of tool poses."""

from geoprint.toolpath.lifting import CrossedCreases as CrossedCreases, creases as creases
from geoprint.toolpath.ordering import Seams as Seams, arrange as arrange, check_sum as check_sum, seams_of as seams_of
from geoprint.toolpath.poses import (
    Leads as Leads,
    PosedSurface as PosedSurface,
    largest_lean as largest_lean,
    mean_lean as mean_lean,
    posed_surface as posed_surface,
    poses as poses,
)
from geoprint.toolpath.registry import (
    PATTERNS as PATTERNS,
    Pattern as Pattern,
    pattern as pattern,
    pattern_names as pattern_names,
    register as register,
    runs_beside_line as runs_beside_line,
)
