"""The one interface that every planning backend answers to."""

from __future__ import annotations

from typing import Protocol

from geoprint.model import Contours, ScalarField, Seed


class Backend(Protocol):
    """Covers a surface with curves a constant distance apart; built once per surface, asked many times."""

    def distance(self, seed: Seed) -> ScalarField:
        """Return the distance from the seed at the vertices of the surface [mm], zero at the seed, never negative."""
        ...

    def contours(self, seed: Seed, *, spacing: float) -> Contours:
        """Return the level curves at (k + 1/2) * spacing from the seed, k = 0, 1, ... [mm]."""
        ...
