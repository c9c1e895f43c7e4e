"""Paths of a bundle that geoprint wrote: its poses.csv, on the surface."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from geoprint.errors import UsageError
from geoprint.toolpaths.path_file import PathFile
from geoprint.toolpaths.tables import read_table

TITLE = "bundle"
POSES = "poses.csv"


def read_bundle(path: Path, *, deposit: str | None) -> PathFile:
    """Read the deposited runs of a bundle.

    Args:
        path: of its folder.
        deposit: must be None: the bundle says itself what deposits.

    Raises:
        UsageError: what deposits is named.
        InputError: its poses.csv cannot be read; names the line.
    """
    if deposit is not None:
        raise UsageError("`--deposit` is for G-code and RAPID: a bundle says itself what deposits.")
    return replace(read_table(path / POSES, deposit=None), name=path.name, format=TITLE)
