"""Work that threads of this process share, where most of it runs outside of the interpreter's lock.

That is what numpy and scipy do on large arrays, the compiled loops of `kernels`, and solvers in other languages. What
is found does not depend on how many threads there are, nor on which of them is first.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

_Asked = TypeVar("_Asked")
_Found = TypeVar("_Found")
_First = TypeVar("_First")
_Second = TypeVar("_Second")


def each_of(work: Callable[[_Asked], _Found], asked: Sequence[_Asked]) -> list[_Found]:
    """Return what work finds of everything that is asked, in that order.

    Args:
        work: keeps nothing between two calls.
        asked: any number.

    Raises:
        GeoprintError: as the work; of several the first in the order of what is asked.
    """
    count = min(len(asked), os.cpu_count() or 1)
    if count < 2:
        return [work(each) for each in asked]
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(work, asked))


def both(first: Callable[[], _First], second: Callable[[], _Second]) -> tuple[_First, _Second]:
    """Return what two works find that have nothing to do with one another.

    Raises:
        GeoprintError: as the works; of both the first one's.
    """
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(second)
        return first(), waiting.result()
