"""Every backend that there is: built in, made known by a script, or from an installed package."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from geoprint.backends.heat import Heat
from geoprint.backends.interface import Accuracy, BackendFactory
from geoprint.backends.lscm import Lscm
from geoprint.backends.marching import FastMarching
from geoprint.registry import Entry, Registry

BACKENDS: Mapping[str, BackendFactory] = MappingProxyType({"heat": Heat, "fast-marching": FastMarching, "lscm": Lscm})

_KNOWN = Registry(
    "backend",
    group="geoprint.backends",
    built_in=BACKENDS,
    members=("title", "edge_length", "distance", "contours"),
)


def register(name: str, factory: BackendFactory) -> None:
    """Make a backend known by a name for as long as the program runs; a package names it as an entry point instead.

    Raises:
        UsageError: the name is taken or no name, or the class lacks what a backend has.

    Examples:
        >>> class Straight:
        ...     title = "straight distance to the seed"
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


def with_option(name: str) -> tuple[str, ...]:
    """Return the names of the backends that have an option; packages of others do not count."""
    return tuple(entry.name for entry in _KNOWN.own if name in entry.options)


def accuracy(entry: Entry[BackendFactory]) -> Accuracy:
    """Return what a backend states of its distances."""
    return entry.fact("accuracy", Accuracy.UNSTATED)
