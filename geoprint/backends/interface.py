"""The interface that every planning backend answers to, and that of what builds one."""

from __future__ import annotations

from typing import Protocol

from geoprint.model import Contours, ScalarField, Seed, Surface


class Backend(Protocol):
    """Covers a surface with curves a constant distance apart; built once per surface, asked many times."""

    def distance(self, seed: Seed) -> ScalarField:
        """Return the distance from the seed at the vertices of the surface [mm], zero at the seed, never negative."""
        ...

    def contours(self, seed: Seed, *, spacing: float) -> Contours:
        """Return the level curves at (k + 1/2) * spacing from the seed, k = 0, 1, ... [mm]."""
        ...


class BackendFactory(Protocol):
    """Builds a backend on a surface; says before how finely a part must be cut for it. A backend's class is one."""

    def __call__(self, surface: Surface) -> Backend:
        """Return the backend on a surface, with the options that it has at their defaults."""
        ...

    def edge_length(self, part: Surface, /, *, spacing: float) -> float:
        """Return how long the edges of a part may be for even curves at a spacing [mm]; finer ones do no harm."""
        ...
