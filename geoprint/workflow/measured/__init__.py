"""Toolpaths of any program, measured on a part, and how the result lands on disk."""
