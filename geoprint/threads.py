"""Work that threads of this process share, where most of it runs outside of the interpreter's lock.

That is what numpy and scipy do on large arrays, the compiled loops of `kernels`, and solvers in other languages. What
is found does not depend on how many threads there are, nor on which of them is first.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from functools import cache
from typing import TypeVar

from threadpoolctl import ThreadpoolController

# Variable of the environment that limits the threads of a process, as OMP_NUM_THREADS does those of BLAS.
THREADS = "GEOPRINT_NUM_THREADS"

_Asked = TypeVar("_Asked")
_Found = TypeVar("_Found")
_First = TypeVar("_First")
_Second = TypeVar("_Second")


def _threads() -> int:
    """Return how many threads share work: as many as there are processors, unless the environment names fewer."""
    asked = os.environ.get(THREADS, "")
    return max(1, min(int(asked), processors())) if asked.isdecimal() else processors()


def processors() -> int:
    """Return how many processors this process may use: a scheduler of jobs allots fewer than a machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def each_of(work: Callable[[_Asked], _Found], asked: Sequence[_Asked]) -> list[_Found]:
    """Return what work finds of everything that is asked, in that order.

    Args:
        work: keeps nothing between two calls.
        asked: any number.

    Raises:
        GeoprintError: as the work; of several the first in the order of what is asked.
    """
    count = min(len(asked), _threads())
    if count < 2:
        return [work(each) for each in asked]
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(work, asked))


def both(first: Callable[[], _First], second: Callable[[], _Second]) -> tuple[_First, _Second]:
    """Return what two works find that have nothing to do with one another.

    Raises:
        GeoprintError: as the works; of both the first one's.
    """
    if _threads() < 2:
        found = first()
        return found, second()
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(second)
        return first(), waiting.result()


def single_threaded_blas() -> AbstractContextManager[object]:
    """Return a context in which BLAS uses one thread; who factorises in several threads enters it around all of them.

    SuperLU calls BLAS on many tiny blocks: waking its threads for each costs up to 80 times the work itself where
    another process holds a core.
    """
    limited: AbstractContextManager[object] = _blas().limit(limits=1, user_api="blas")  # pyright: ignore[reportUnknownMemberType]
    return limited


@cache
def _blas() -> ThreadpoolController:
    """Return the libraries of this process; to look for them takes longer than to factorise 1,000 unknowns."""
    return ThreadpoolController()
