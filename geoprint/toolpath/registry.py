"""Every pattern that there is: built in, made known by a script, or from an installed package."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from geoprint import features
from geoprint.registry import Entry, Factory, Registry
from geoprint.toolpath.contours import ContourPattern
from geoprint.toolpath.guided import GuidedPattern
from geoprint.toolpath.pattern import Pattern
from geoprint.toolpath.spiral import SpiralPattern

PATTERNS: Mapping[str, Factory[Pattern]] = MappingProxyType(
    {"contours": ContourPattern, "spiral": SpiralPattern, "guided": GuidedPattern}
)

_KNOWN = Registry("pattern", group=features.PATTERNS, built_in=PATTERNS, members=("title", "paths"))


def register(name: str, factory: Factory[Pattern]) -> None:
    """Register a pattern under a name until the program ends; a package declares an entry point instead.

    Raises:
        UsageError: the name is invalid or in use, or the class lacks what a pattern needs.

    Examples:
        >>> class Rows:
        ...     title = "straight rows"
        >>> register("rows", Rows)
        Traceback (most recent call last):
        geoprint.errors.UsageError: the pattern 'rows' that was registered cannot be used: its class lacks paths; a
        pattern is a class with title, paths.
    """
    _KNOWN.register(name, factory)


def pattern(name: str) -> Entry[Factory[Pattern]]:
    """Return a pattern by its name.

    Raises:
        UsageError: there is none of that name or more than one, or a package's cannot be loaded.
    """
    return _KNOWN.find(name)


def pattern_names() -> tuple[str, ...]:
    """Return the names of all patterns; those of packages are not loaded for it."""
    return _KNOWN.names


def runs_beside_line(entry: Entry[Factory[Pattern]]) -> bool:
    """Return whether the rows of a pattern run beside a line, as it states; most have none."""
    return entry.fact("beside_line", default=False)
