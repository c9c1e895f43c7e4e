"""Job and cell: TOML and command-line values in, validated model values out. Degrees end here.

Unknown keys, wrong types, NaN and infinity are refused with the key's name, so that a typing error never becomes a
default.
"""

from geoprint.config.cells import PACKAGED_CELLS, load_cell, packaged_cell_text
from geoprint.config.job import Job, PatchRegion, job_of

__all__ = ["PACKAGED_CELLS", "Job", "PatchRegion", "job_of", "load_cell", "packaged_cell_text"]
