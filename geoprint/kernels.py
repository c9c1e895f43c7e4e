"""Compiled loops: with numba, kept where this user may write, compiled by one process at a time."""

from __future__ import annotations

import logging
import os
import stat
import tempfile
import time
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, final

import numba
import numpy as np
from numba.core.caching import FunctionCache
from numba.core.registry import CPUDispatcher
from numpy.typing import NDArray

# What numba keeps of compiled loops, compiled by one process at a time.
#
# The first run after an installation compiles in several processes, which come to the same loops at about the same
# time. Whoever comes second waits and then reads what the first has kept, so that nothing is compiled twice.


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


# How loops are compiled: with numba, and kept for later runs in a place that this user may write.
#
# numba keeps what it compiled in NUMBA_CACHE_DIR, beside the source, or in the user's cache (XDG_CACHE_HOME, or
# .cache in the home), whichever it can write first; where it can write none of them, as in a container, it refuses
# to compile at all. Here a folder of the user among the temporary files stands in then, and without one nothing is
# kept.


P = ParamSpec("P")
R = TypeVar("R")
S = TypeVar("S", bound=np.generic)

_LOG = logging.getLogger(__name__)
# What numba says where it can keep nothing.
_NOWHERE = "no locator available"
_WHY = "because neither geoprint's folder nor the home folder is writable; set NUMBA_CACHE_DIR to another folder"


def njit(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a loop as `numba.njit` does, wherever what it compiles can be kept; every kernel is made here.

    A division by zero gives what it gives in numpy. Where Python calls it, the interpreter's lock is left to other
    threads until it returns.
    """
    return _compiled(function)


def uncounted(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a loop that makes no arrays, and counts no references to those that it is given.

    By default numba counts a reference to an array whenever it is taken out of a tuple, which costs as much as all the
    arithmetic of a small loop, and more than that to compile; whoever calls such a loop holds its arrays anyway.
    """
    return _compiled(function, _nrt=False)


def inner(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a loop as `uncounted`, for other loops alone: Python that calls it runs it as it stands.

    An entry for Python takes as long to compile as a small loop.
    """
    return _without_door(_compiled(function, _nrt=False, no_cpython_wrapper=True))


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a loop as `inner`, for those that call it to hold it: what is so small and so often called.

    LLVM puts the compiled code in place. Where numba does it (`inline="always"`) each place is typed and lowered anew,
    which makes loops take several times as long to compile and no less to run.
    """
    return _without_door(_compiled(function, _nrt=False, no_cpython_wrapper=True, forceinline=True))


class _Inner(CPUDispatcher):
    """A compiled loop that Python cannot call: it would jump to nowhere."""

    py_func: Callable[..., object]

    def __call__(self, *arguments: object) -> object:
        return self.py_func(*arguments)


def _without_door(kernel: Callable[P, R]) -> Callable[P, R]:
    # numba makes the loop, and knows no other place for what a call of it from Python is to do.
    kernel.__class__ = _Inner
    return kernel


def _compiled(function: Callable[P, R], **special: bool) -> Callable[P, R]:
    # Nothing asks for a loop as a function of C, for which numba compiles a second entry by default.
    options: dict[str, Any] = special | {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
    kernel = numba.njit(**options)(function)
    if (kept := _kept_of(function)) is not None:
        dispatcher: Any = kernel
        dispatcher._cache = kept  # noqa: SLF001  (numba has no other place for it)
    return kernel


def _kept_of(function: Callable[..., object]) -> SharedCache | None:
    """Return what is kept of a kernel, which is compiled by one process at a time; None where nothing can be kept."""
    try:
        return SharedCache(function)
    except RuntimeError as error:
        if _NOWHERE not in str(error):
            raise
    return SharedCache(function) if _may_keep() else None


def writable(array: NDArray[S]) -> NDArray[S]:
    """Return a copy of an array that may be written, for a loop that is asked about arrays of either kind.

    numba compiles a loop once for arrays that may be written, and once more for those that may not.
    """
    return np.array(array, order="C")


def is_kept(kernel: object) -> bool:
    """Say whether an earlier run has left in its place what it compiled of a kernel's file."""
    place = _place(kernel)
    return place is not None and any(place.glob("*.nbi"))


def keeps(kernel: object) -> bool:
    """Say whether there is a place in which what is compiled of a kernel's file is left for later runs."""
    return _place(kernel) is not None


def _place(kernel: object) -> Path | None:
    place: str | None = getattr(getattr(kernel, "stats", None), "cache_path", None)
    return None if place is None else Path(place)


@cache
def _may_keep() -> bool:
    """Let numba keep what it compiles among the temporary files, and say so once; False where it cannot there either.

    What others could write there would run here: the folder is this user's alone, or not used.
    """
    try:
        folder = Path(tempfile.gettempdir(), f"geoprint-{os.getuid()}")
        known = folder.exists()
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        usable = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        usable = known = False
        folder = Path()
    if not usable:
        _LOG.warning("note: compiled loops cannot be cached, so each run compiles them, %s.", _WHY)
        return False
    if not known:
        _LOG.warning("note: compiled loops are cached in %s, %s.", folder, _WHY)
    numba.config.CACHE_DIR = str(folder)
    return True
