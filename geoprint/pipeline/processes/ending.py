"""Processes that end when the one that started them does, however that ends.

Where it is killed, nobody tells its processes: they would plan on to the end and then wait for ever.
"""

from __future__ import annotations

import multiprocessing
import os
from multiprocessing.connection import wait
from threading import Thread

# What a process that nobody waits for ends with.
FORSAKEN = 1


def end_with_parent() -> None:
    """Let this process end at once when the one that started it has; nothing that it holds is worth keeping then."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        Thread(target=_end_after, args=(parent.sentinel,), daemon=True).start()


def _end_after(sentinel: int) -> None:
    wait([sentinel])
    os._exit(FORSAKEN)
