"""Paths of a bundle that geoprint wrote: its poses.csv, on the surface."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from geoprint.toolpaths.path_file import PathFile
from geoprint.toolpaths.tables import read_table

TITLE = "bundle"
POSES = "poses.csv"


def read_bundle(path: Path, *, deposit: str | None) -> PathFile:
    """Read the deposited runs of a bundle.

    Args:
        path: of its folder.
        deposit: not used: the bundle says itself what deposits.

    Raises:
        InputError: its poses.csv cannot be read; names the line.
    """
    del deposit
    return replace(read_table(path / POSES, deposit=None), name=path.name, format=TITLE)
