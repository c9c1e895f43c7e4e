"""Workers: processes that share work, end with the one that started them, and plan layers in parallel."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, suppress
from importlib import import_module
from multiprocessing.connection import Connection, wait
from multiprocessing.resource_tracker import ensure_running
from threading import Thread
from typing import TypeVar, cast, final

from geoprint.errors import ResourceError

# Processes that end when the one that started them does, however that ends.
#
# Where it is killed, nobody tells its processes: they would plan on to the end and then wait for ever. Where it is
# stopped at the keyboard its processes hear that too: one that still imports must not break off with a traceback.


# What a process that nobody waits for ends with.
FORSAKEN = 1


@contextmanager
def stopped_later() -> Generator[None]:
    """Start processes in the body that hear of a stop at the keyboard once they come to `end_with_parent`."""
    if sys.platform == "win32":
        yield
        return
    # Python's own helper of processes lets signals through again as it is started.
    ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def ended_at_once(pool: Callable[[Connection], ProcessPoolExecutor]) -> Generator[ProcessPoolExecutor]:
    """Keep processes while the body runs; where that fails or is stopped, they end at once, whatever they do.

    Args:
        pool: makes them; each is given what `end_with_parent` waits for.
    """
    others = set(multiprocessing.active_children())
    ended, line = multiprocessing.Pipe(duplex=False)
    with ended, line, pool(ended) as processes:
        try:
            yield processes
        except BaseException:
            line.close()
            # One that still imports hears of neither the line nor the keyboard, for seconds on a busy machine.
            for process in set(multiprocessing.active_children()) - others:
                process.kill()
            processes.shutdown(wait=True, cancel_futures=True)
            raise


def end_with_parent(ended: Connection | None = None) -> None:
    """Let this process end at once when the one that started it has; nothing that it holds is worth keeping then.

    It ends here without a word if it was stopped at the keyboard since `stopped_later` started it.

    Args:
        ended: a pipe, at whose end this process ends too.
    """
    if sys.platform != "win32":
        try:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
        except KeyboardInterrupt:
            os._exit(FORSAKEN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        awaited = [parent.sentinel, *([] if ended is None else [ended])]
        Thread(target=_end_after, args=(awaited,), daemon=True).start()


def _end_after(awaited: list[int | Connection]) -> None:
    wait(awaited)
    os._exit(FORSAKEN)


# Work that is shared with processes beside this one, so that what is found does not depend on how many there are.
#
# They are started afresh, alike on every platform, and import what they need while this one reads the part. What
# each returns is pickled so that arrays that may not be written stay so.


# The first protocol that keeps read-only arrays read-only.
PROTOCOL = 5
# What planning imports.
PLANNING = "geoprint.workflow.comparison"

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
            "a worker that planned a backend was killed, most likely out of memory: each needs about 1 GB. Compare "
            "fewer backends at once with `--backend`, or choose a larger spacing. (A script calls this under `if "
            '__name__ == "__main__":`.)'
        ) from error


# The processes that plan the layers of a stack: two at a time, each started afresh, and as small as they can be.
#
# What a plan leaves in memory would add up from layer to layer, so each layer has a process of its own. Two of them
# make the peak of a stack, and so they give back at once what they need no more, where a single plan may keep it.


# Plans at a time: each takes up to a gigabyte.
WORKERS = 2
# What glibc's mallopt calls the free memory at the end of its heap that goes back to the system, and the size from
# which a block lies outside of the heap and goes back as soon as it is free [malloc.h].
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
# Left alone, glibc raises both up to 64 MB with each large array that is freed, and then keeps a sixth of a plan's
# peak. From this size [bytes] on, what a call of the system costs is nothing beside filling the block.
GIVEN_BACK = 1 << 20


def layer_processes() -> AbstractContextManager[ProcessPoolExecutor]:
    """Return an executor whose every task has a process of its own; all of them end at once where the body fails."""
    return ended_at_once(
        lambda ended: ProcessPoolExecutor(
            WORKERS,
            mp_context=multiprocessing.get_context("spawn"),
            max_tasks_per_child=1,
            initializer=_begin,
            initargs=(ended,),
        )
    )


def _begin(ended: Connection) -> None:
    end_with_parent(ended)
    give_back_memory()


def give_back_memory() -> None:
    """Let this process give large arrays back to the system as soon as they are free.

    On Linux with glibc; other C libraries decide for themselves.
    """
    if sys.platform != "linux":
        return
    import ctypes

    # musl gives back of its own accord and has no such function.
    with suppress(AttributeError):
        adjust = ctypes.CDLL(None).mallopt
        adjust(M_TRIM_THRESHOLD, GIVEN_BACK)
        adjust(M_MMAP_THRESHOLD, GIVEN_BACK)
