"""A package as pip leaves it: its name, version and entry points beside the modules, without building anything."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path


def installed(site: Path, *, name: str, version: str, groups: Mapping[str, Mapping[str, str]]) -> Path:
    """Write the metadata of a package into a folder of modules and return that folder."""
    info = site / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    lines = [
        line
        for group, points in groups.items()
        for line in (f"[{group}]", *(f"{point} = {value}" for point, value in points.items()))
    ]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    return site
