"""The processes that plan the layers of a stack: two at a time, each started afresh, and as small as they can be.

What a plan leaves in memory would add up from layer to layer, so each layer has a process of its own. Two of them make
the peak of a stack, and so they give back at once what they need no more, where a single plan may keep it.
"""

from __future__ import annotations

import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager, suppress
from multiprocessing.connection import Connection

from geoprint.pipeline.processes.ending import end_with_parent, ended_at_once

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
