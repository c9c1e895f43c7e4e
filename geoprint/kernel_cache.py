"""What numba keeps of compiled loops, compiled by one process at a time.

The first run after an installation compiles in several processes, which come to the same loops at about the same time.
Whoever comes second waits and then reads what the first has kept, so that nothing is compiled twice.
"""

from __future__ import annotations

import os
import tempfile
import time
import zlib
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import final

from numba.core.caching import FunctionCache

try:
    import fcntl
except ImportError:  # Windows: every process compiles for itself.
    fcntl = None

# Nobody waits longer [s] for a process that may have been stopped: twice what the largest loop takes on a busy machine.
LONGEST_WAIT = 30.0
# Between two looks [s].
LOOK = 0.01
# Bytes of the file that stand for loops, one each but for chance.
PLACES = 2**30


@final
class SharedCache(FunctionCache):
    """What is kept of one function; numba asks it before it compiles, and gives it what was compiled."""

    _held: int | None = None

    def load_overload(self, sig: object, target_context: object) -> object | None:
        """Return what is kept of a signature; None where this process is to compile it."""
        found = super().load_overload(sig, target_context)
        if found is not None or self._held is not None:
            return found
        self._held = taken(f"{self.cache_path}/{self._impl.filename_base}")
        found = super().load_overload(sig, target_context)
        if found is not None:
            self._give_back()
        return found

    def save_overload(self, sig: object, data: object) -> None:
        """Keep what was compiled, and let others read it."""
        try:
            super().save_overload(sig, data)
        finally:
            self._give_back()

    def _give_back(self) -> None:
        held, self._held = self._held, None
        file = _file()
        if fcntl is not None and file is not None and held is not None:
            fcntl.lockf(file, fcntl.LOCK_UN, 1, held)


def taken(name: str) -> int | None:
    """Wait until no other process compiles a loop, and return its place in the file; None where nothing is locked.

    What a process has locked is free when it ends, however it ends.
    """
    file = _file()
    if fcntl is None or file is None:
        return None
    place = zlib.crc32(name.encode()) % PLACES
    begun = time.monotonic()
    while time.monotonic() - begun < LONGEST_WAIT:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
        except (BlockingIOError, PermissionError):  # Another has it, by either name.
            time.sleep(LOOK)
        except OSError:  # The file system knows no locks.
            return None
        else:
            return place
    return None


@cache
def _file() -> int | None:
    """Open the file whose bytes are locked, once: where a process closes one, all that it has locked is free."""
    if fcntl is None:
        return None
    path = Path(tempfile.gettempdir(), f"geoprint-compiling-{os.getuid()}")
    with suppress(OSError):
        return os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    return None
