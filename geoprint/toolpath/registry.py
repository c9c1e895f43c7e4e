"""Every pattern that there is, built in, registered or from a package, and the interface that it answers to.

On its class a pattern states its `title`, a few words beside its name, and may state its `summary`, one sentence, and
`beside_line`, whether its rows run beside a line, so that they may have an angle. Its options are the keyword-only
arguments of its constructor; one that is called `field` is what its static method `lines_of` makes of a field file and
of the place of a layer.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Protocol

from geoprint import features
from geoprint.distance import Backend
from geoprint.model import Paths, ScalarField, Source, Surface
from geoprint.registry import Entry, Factory, Registry
from geoprint.toolpath.contours import ContourPattern
from geoprint.toolpath.guided import GuidedPattern
from geoprint.toolpath.spiral import SpiralPattern


class Pattern(Protocol):
    """Covers a surface with paths."""

    def paths(self, surface: Surface, source: Source, *, backend: Backend, spacing: float | ScalarField) -> Paths:
        """Return the paths; they know nothing of the order in which they are printed.

        Args:
            surface: to cover, in one piece or several; no stroke lies on two of them.
            source: where rows are counted from.
            backend: measures distances on that surface.
            spacing: wanted distance of neighbouring rows [mm], the same everywhere or one at each vertex.

        Raises:
            UsageError: the pattern cannot follow such a spacing.
            FieldError: not one stroke lies on the surface, or on a piece of it.
        """
        ...


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
