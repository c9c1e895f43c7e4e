"""Tries what programs promise on a controller of our own: `python -m benchmarks.destruction`."""
