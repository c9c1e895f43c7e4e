"""Every distance backend by its name: built in, registered or from a package; several components."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import final

import numpy as np

from geoprint import features
from geoprint.distance.fast_marching import FastMarching
from geoprint.distance.heat import Heat
from geoprint.distance.interface import Accuracy, Backend, BackendFactory, Showing, Shown
from geoprint.distance.lscm import Lscm
from geoprint.errors import naming
from geoprint.geometry import all_curves, in_words, middle_of, pieces, some_curves
from geoprint.model import Contours, FloatArray, ScalarField, Source, Surface
from geoprint.registry import Entry, Registry

# Every backend that there is: built in, made known by a script, or from an installed package.


BACKENDS: Mapping[str, BackendFactory] = MappingProxyType({"heat": Heat, "fast-marching": FastMarching, "lscm": Lscm})

_KNOWN = Registry(
    "backend",
    group=features.BACKENDS,
    built_in=BACKENDS,
    members=("title", "edge_length", "distance", "contours"),
)


def register(name: str, factory: BackendFactory) -> None:
    """Register a backend under a name until the program ends; a package declares an entry point instead.

    Raises:
        UsageError: the name is invalid or in use, or the class lacks what a backend needs.

    Examples:
        >>> class Straight:
        ...     title = "straight distance to the source"
        ...
        ...     def __init__(self, surface, *, stretch=1.0):
        ...         self.surface, self.stretch = surface, stretch
        >>> register("straight", Straight)
        Traceback (most recent call last):
        geoprint.errors.UsageError: the backend 'straight' that was registered cannot be used: its class lacks
        edge_length, distance, contours; a backend is a class with title, edge_length, distance, contours.
    """
    _KNOWN.register(name, factory)


def backend(name: str) -> Entry[BackendFactory]:
    """Return a backend by its name.

    Raises:
        UsageError: there is none of that name or more than one, or a package's cannot be loaded.
    """
    return _KNOWN.find(name)


def backend_names() -> tuple[str, ...]:
    """Return the names of all backends; those of packages are not loaded for it."""
    return _KNOWN.names


def compared_backends() -> tuple[str, ...]:
    """Return the names of those that are compared unless somebody says otherwise, the least accurate first.

    A package of others is not loaded for it.
    """
    compared = (entry for entry in _KNOWN.own if entry.fact("compared", default=False))
    return tuple(entry.name for entry in sorted(compared, key=accuracy))


def most_accurate_backend() -> Entry[BackendFactory]:
    """Return the backend whose distances come nearest to those over the surface; packages of others do not count."""
    return max(_KNOWN.own, key=accuracy)


def accuracy(entry: Entry[BackendFactory]) -> Accuracy:
    """Return what a backend states of its distances."""
    return entry.fact("accuracy", Accuracy.UNSTATED)


# A surface in several pieces, such as patches that one job prints: each piece is planned by itself.


@final
class Piecewise:
    """A backend on each piece of a surface, answering as one: what lies on one piece never counts on another.

    Args:
        surface: in one piece or several.
        build: returns the backend of a piece.

    Raises:
        GeoprintError: as `build`; where there are several pieces the sentence names the one, and so below.
    """

    def __init__(self, surface: Surface, build: Callable[[Surface], Backend]) -> None:
        self._vertices = len(surface.vertices)
        self._pieces = pieces(surface)
        several = len(self._pieces) > 1
        self._names = [
            f"patch {number} of {surface.name}, about {in_words(middle_of(piece.surface))}" if several else ""
            for number, piece in enumerate(self._pieces, start=1)
        ]
        found: list[Backend] = []
        for name, piece in zip(self._names, self._pieces, strict=True):
            with naming(name):
                found.append(build(piece.surface))
        self._backends = tuple(found)
        self._latest: tuple[Source, ScalarField] | None = None
        self._drawn: tuple[Source, Contours] | None = None

    def distance(self, source: Source) -> ScalarField:
        """Return the distance from that part of the source which lies on the same piece, at the vertices [mm].

        It is kept until something is asked of another source.

        Raises:
            InputError: a piece has no part of the source.
        """
        if self._latest is not None and self._latest[0] is source:
            return self._latest[1]
        values = np.zeros(self._vertices)
        for name, piece, backend in zip(self._names, self._pieces, self._backends, strict=True):
            with naming(name):
                values[piece.vertices] = backend.distance(Source(piece.own(source.curves))).values
        return self._kept(source, values)

    def contours(self, source: Source, *, spacing: float) -> Contours:
        """Return the level curves of all pieces at one spacing [mm]; those of a level in the order of the pieces.

        They are kept until others are asked for: those of each treatment of the medial axis are made of the same.

        Raises:
            InputError: a piece has no part of the source.
            FieldError: not even the first level lies on a piece.
        """
        if self._drawn is not None and self._drawn[0] is source and self._drawn[1].spacing == spacing:
            return self._drawn[1]
        found: list[Contours] = []
        values = np.zeros(self._vertices)
        for name, piece, backend in zip(self._names, self._pieces, self._backends, strict=True):
            with naming(name):
                found.append(backend.contours(Source(piece.own(source.curves)), spacing=spacing))
            values[piece.vertices] = found[-1].distance.values
        levels = np.concatenate([contours.levels for contours in found])
        order = np.argsort(levels, kind="stable")
        whole = [piece.on_whole(contours.curves) for piece, contours in zip(self._pieces, found, strict=True)]
        drawn = Contours(some_curves(all_curves(whole), order), levels[order], spacing, self._kept(source, values))
        self._drawn = (source, drawn)
        return drawn

    def shown(self, *, spacing: float) -> tuple[Shown, ...]:
        """Return what the backend can show of itself on each piece for a spacing [mm]; nothing of most."""
        return tuple(one.shown(spacing=spacing) for one in self._backends if isinstance(one, Showing))

    def _kept(self, source: Source, values: FloatArray) -> ScalarField:
        self._latest = (source, ScalarField(values))
        return self._latest[1]
