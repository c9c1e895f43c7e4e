"""The interface that every pattern answers to, and that of what builds one.

On its class a pattern states its `title`, a few words beside its name, and may state its `summary`, one sentence, and
`beside_line`, whether its rows run beside a line, so that they may have an angle. Its options are the keyword-only
arguments of its constructor; one that is called `field` is what its static method `lines_of` makes of a field file and
of the place of a layer.
"""

from __future__ import annotations

from typing import Protocol

from geoprint.distance import Backend
from geoprint.model import Paths, ScalarField, Source, Surface


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
