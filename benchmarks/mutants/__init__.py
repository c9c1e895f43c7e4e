"""Tries whether the tests notice small changes of the code: `python -m benchmarks.mutants`."""
