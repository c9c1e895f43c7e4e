"""Refusals with their proof, and with a change that was tried."""

from geoprint.pipeline.refusals.changes import changes as changes
from geoprint.pipeline.refusals.proving import printed as printed, proven as proven
