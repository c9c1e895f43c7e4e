"""Whole stacks of layers: planned and written as one, and compared over backends."""
