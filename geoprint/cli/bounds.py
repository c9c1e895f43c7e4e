"""While a command runs: the running stage, and the memory it may take."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager

from geoprint.errors import UsageError

# Stages faster than this [s] are not worth a line.
QUICK_STAGE = 1.0
# Addresses that the libraries take before any work [GB].
LEAST_MEMORY = 1.5


def limit_memory(gigabytes: float | None) -> None:
    """Let the system refuse memory beyond a limit, so that a large job ends in one sentence.

    The limit is on addresses, of which libraries and their threads take about a gigabyte without using it.
    """
    if gigabytes is None:
        return
    if not gigabytes >= LEAST_MEMORY:
        raise UsageError(f"`--max-memory {gigabytes:g}` is less than the {LEAST_MEMORY:g} GB that every run takes.")
    import resource

    limit = round(min(gigabytes, 2.0**32) * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


@contextmanager
def watch() -> Generator[Callable[[str], None]]:
    """Show the running stage on a terminal, and leave a line for each that took more than a second."""
    # It would say that it finds no home to keep its fonts in.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console

    from geoprint.geometry.halfedges import matched
    from geoprint.kernels import is_kept

    console = Console(stderr=True)
    if not is_kept(matched):
        console.print("compiling the numerical kernels, once: later runs start faster", highlight=False)
    with console.status("starting") as status:
        running = ["starting"]
        since = [time.perf_counter()]
        record = list[str]()

        def observe(name: str) -> None:
            seconds = time.perf_counter() - since[0]
            if seconds > QUICK_STAGE:
                record.append(running[0])
                console.print(f"  {running[0]:<34}{seconds:6.1f} s", highlight=False)
            running[0], since[0] = name, time.perf_counter()
            status.update(name)

        yield observe
        observe("done")
    if record:
        console.print()
