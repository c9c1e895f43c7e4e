"""Work that is shared with processes beside this one, so that what is found does not depend on how many there are.

They are started afresh, alike on every platform, and import what they need while this one reads the part. What each
returns is pickled so that arrays that may not be written stay so.
"""

from __future__ import annotations

import multiprocessing
import pickle
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from importlib import import_module
from typing import TypeVar, cast, final

from geoprint.errors import ResourceError
from geoprint.pipeline.processes.ending import end_with_parent, ended_at_once, stopped_later

# The first protocol that keeps read-only arrays read-only.
PROTOCOL = 5
# What planning imports.
PLANNING = "geoprint.pipeline.comparison"

_Asked = TypeVar("_Asked")
_Found = TypeVar("_Found")


@final
class OtherProcesses:
    """Processes beside this one.

    Args:
        pool: of them.
        count: how many they are, at least one.
    """

    __slots__ = ("_count", "_pool")

    def __init__(self, pool: ProcessPoolExecutor, count: int) -> None:
        self._pool, self._count = pool, count

    def start(self) -> None:
        """Let a process import what planning needs, while this one does something else."""
        with stopped_later():
            self._pool.submit(import_module, PLANNING)

    def shared(
        self, work: Callable[[_Asked], _Found], asked: Sequence[_Asked], *, here: Callable[[_Asked], _Found]
    ) -> list[_Found]:
        """Return what work finds of everything that is asked: of the first in this process, of the next beside it.

        Args:
            work: can be pickled, as what it is asked and what it finds.
            asked: at least one.
            here: does the same in this process.

        Raises:
            ResourceError: a process was ended from outside, as it is where memory runs out.
            GeoprintError: as the work.
        """
        mine = range(0, len(asked), self._count + 1)
        with stopped_later():
            waiting = {
                index: self._pool.submit(_pickled, work, each) for index, each in enumerate(asked) if index not in mine
            }
        found = {index: here(asked[index]) for index in mine}
        return [
            found[index] if index in found else cast("_Found", _result(waiting[index])) for index in range(len(asked))
        ]


def shared(
    helper: OtherProcesses | None,
    work: Callable[[_Asked], _Found],
    asked: Sequence[_Asked],
    *,
    here: Callable[[_Asked], _Found] | None = None,
) -> list[_Found]:
    """Return what work finds of everything that is asked, in other processes too where there are any.

    Args:
        helper: them, or None.
        work: can be pickled, as what it is asked and what it finds.
        asked: any number.
        here: does the same in this process; the work itself by default.

    Raises:
        ResourceError: a process was ended from outside, as it is where memory runs out.
        GeoprintError: as the work.
    """
    here = work if here is None else here
    if helper is None:
        return [here(each) for each in asked]
    return helper.shared(work, asked, here=here)


@contextmanager
def beside(count: int) -> Generator[OtherProcesses | None]:
    """Keep processes beside this one while the body runs; None where there are to be none.

    They are started when they are first asked.
    """
    if count < 1:
        yield None
        return
    with ended_at_once(
        lambda ended: ProcessPoolExecutor(
            count, mp_context=multiprocessing.get_context("spawn"), initializer=end_with_parent, initargs=(ended,)
        )
    ) as pool:
        yield OtherProcesses(pool, count)


def _pickled(work: Callable[[_Asked], object], asked: _Asked) -> bytes:
    return pickle.dumps(work(asked), PROTOCOL)


def _result(waiting: Future[bytes]) -> object:
    try:
        return pickle.loads(waiting.result())  # noqa: S301  (our own process wrote it)
    except BrokenProcessPool as error:
        raise ResourceError(
            "a process that planned a backend was ended from outside, most likely for want of memory: each takes about "
            "a gigabyte. Compare fewer backends at once with `--backends`, or choose a larger spacing. (A script calls "
            'this under `if __name__ == "__main__":`.)'
        ) from error
