"""The running stage, named for whoever watches, and how long each took."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from typing import final


@final
class Stages:
    """Names the stage that runs, for whoever watches, and times each.

    Args:
        observe: called with the name of each stage as it starts.
        timings: name and seconds of the stages that went before.
    """

    def __init__(self, observe: Callable[[str], None], *, timings: Sequence[tuple[str, float]] = ()) -> None:
        self.observe = observe
        self._begun: list[str] = []
        self.timings = [*timings]

    def begun(self, name: str) -> int:
        """Return how often a stage was begun."""
        return self._begun.count(name)

    @contextmanager
    def __call__(self, name: str) -> Generator[None]:
        """Run the body as a stage."""
        self.observe(name)
        self._begun.append(name)
        start = time.perf_counter()
        yield
        self.timings.append((name, time.perf_counter() - start))
        _give_back()


def _give_back() -> None:
    """Give the system what a stage took and freed: glibc keeps it where anything above it is still held.

    Other allocators have no such call, and Windows no library of that kind.
    """
    with suppress(AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
