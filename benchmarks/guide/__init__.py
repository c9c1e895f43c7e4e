"""The pictures of the guide, and the guide as one page: `python -m benchmarks.guide`."""
