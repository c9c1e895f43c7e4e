"""Optional features: each a folder of this package, or an installed package, that adds itself under entry points.

A folder has a `feature.toml`: a table a group of entry points, as a package of its own would name them in its
pyproject.toml, and `[commands]` with the line that help shows of each; their functions stand in `commands.py` there.
What a folder adds is found by that file alone, so nothing else names it.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from pathlib import Path
from typing import Any, cast, final

from geoprint.errors import UsageError

# The groups under which things are named; a command is a function whose parameters are its options, readers of meshes
# and of label volumes have the suffixes of their files as names.
BACKENDS, PATTERNS, COMMANDS, REPORTS, DIVISIONS, POST_PROCESSORS, READERS, VOLUMES = (
    "geoprint.backends", "geoprint.patterns", "geoprint.commands", "geoprint.reports", "geoprint.divisions",
    "geoprint.post_processors", "geoprint.readers", "geoprint.volumes",
)  # fmt: skip
MANIFEST = "feature.toml"
PAGE = "guide.md"


@final
@dataclass(frozen=True, slots=True)
class Feature:
    """One folder that adds something.

    Attributes:
        folder: where it stands.
        commands: the line of help of each of its commands, by name.
        points: all that it names, commands too.
    """

    folder: Path
    commands: Mapping[str, str]
    points: tuple[EntryPoint, ...]


@cache
def features() -> tuple[Feature, ...]:
    """Return the features that stand beside this module, by the names of their folders."""
    return tuple(_feature(path.parent) for path in sorted(Path(__file__).parent.glob(f"*/{MANIFEST}")))


def named_points(group: str) -> EntryPoints:
    """Return what features and installed packages name in a group."""
    return _installed(tuple(sys.path), group)


def own_points(group: str) -> EntryPoints:
    """Return what the features of this package name in a group, without a look at installed packages."""
    return EntryPoints(point for feature in features() for point in feature.points if point.group == group)


def origin_of(point: EntryPoint) -> str:
    """Return which package names something, in words."""
    package = "a feature" if point.dist is None else f"the package {point.dist.name} {point.dist.version}"
    return f"{package} (entry point {point.name} = {point.value})"


def loaded(point: EntryPoint, noun: str) -> Any:
    """Return what an entry point names.

    Raises:
        UsageError: it cannot be loaded; the sentence names package and entry point.
    """
    try:
        return point.load()
    except Exception as error:  # whatever another's package raises when it is imported
        raise UsageError(
            f"the {noun} '{point.name}' from {origin_of(point)} cannot be loaded ({error}): "
            "fix or uninstall that package."
        ) from error


# The files of all installed packages are read for them: a fifth of what planning a small part takes without a robot.
@lru_cache(maxsize=32)
def _installed(_path: tuple[str, ...], group: str) -> EntryPoints:
    return EntryPoints([*own_points(group), *entry_points(group=group)])


def _feature(folder: Path) -> Feature:
    tables = cast("dict[str, dict[str, str]]", tomllib.loads((folder / MANIFEST).read_text(encoding="utf-8")))
    package = f"{__package__}.{folder.name}"
    commands = tables.pop("commands", {})
    calls = {name: f"{package}.commands:{name.replace('-', '_')}" for name in commands}
    named = {**tables, COMMANDS: calls}
    points = [EntryPoint(name, value, group) for group, each in named.items() for name, value in each.items()]
    return Feature(folder, commands, tuple(points))
