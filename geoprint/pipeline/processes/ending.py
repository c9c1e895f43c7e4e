"""Processes that end when the one that started them does, however that ends.

Where it is killed, nobody tells its processes: they would plan on to the end and then wait for ever. Where it is
stopped at the keyboard its processes hear that too: one that still imports must not break off with a traceback.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Generator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from multiprocessing.resource_tracker import ensure_running
from threading import Thread

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
