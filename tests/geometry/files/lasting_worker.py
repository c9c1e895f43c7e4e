"""A worker that lasts: one process for many files, which loads its native libraries once instead of for each file.

It stands in for `geoprint.geometry.native.run_worker` where files are good, and what is tested is what becomes of
them; limits, crashes and damaged files want a process of their own.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import cast, final

# Answers go where libraries do not print. What fails ends it, and with it the test that asked.
LASTING = """
import os, pickle, runpy, sys
answers = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)
works = {}
while True:
    try:
        script, arguments, data = pickle.load(sys.stdin.buffer)
    except EOFError:
        break
    if script not in works:
        works[script] = runpy.run_path(script)["work"]
    pickle.dump(works[script](data, *arguments), answers)
    answers.flush()
"""


@final
class LastingWorker:
    """A process that does what a worker script does, as often as it is asked."""

    def __init__(self, running: subprocess.Popen[bytes]) -> None:
        self._running = running

    def run(self, script: Path, arguments: Sequence[str], *, data: bytes, work: str, name: str) -> bytes:
        """Return what a worker script answers."""
        assert self._running.stdin is not None, (work, name)
        assert self._running.stdout is not None
        pickle.dump((str(script), [*arguments], data), self._running.stdin)
        self._running.stdin.flush()
        return cast("bytes", pickle.load(self._running.stdout))  # noqa: S301  (written by the process above)


@contextmanager
def lasting_worker() -> Generator[LastingWorker]:
    """Start such a process, and end it."""
    command = [sys.executable, "-I", "-c", LASTING]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as running:
        yield LastingWorker(running)
        running.communicate()
