"""What people look at: figures of plans and comparisons. Takes plain values, knows no stage."""

from geoprint.report.figures import Coverage, coverage_figure

__all__ = ["Coverage", "coverage_figure"]
